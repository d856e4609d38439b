#!/usr/bin/env bash
# Builds the plug-in for each Qt that is there, runs its tests, and installs it into a prefix that is moved.
# shellcheck source=integrations/setup.sh
. "$(dirname "$0")/../setup.sh"
cd "$(dirname "$0")"

needs make cmake c++ pkg-config
install_library
tried=
for version in 6 5; do
    if ! pkg-config --exists "Qt${version}Gui"; then
        printf 'skipped: there is no Qt %s\n' "$version"
        continue
    fi
    tried=yes
    build=$scratch/build$version
    # A library folder as a prefix of one's own has it.
    quietly cmake -S . -B "$build" -DQT_VERSION_MAJOR="$version" -DCMAKE_PREFIX_PATH="$prefix" \
        -DCMAKE_CXX_FLAGS='-Wall -Wextra -Wpedantic -Werror' -DCMAKE_INSTALL_LIBDIR=lib
    quietly cmake --build "$build"
    quietly ctest --test-dir "$build" --output-on-failure
    grep -E '100% tests passed' "$scratch/log" || fail "no test was run: $(<"$scratch/log")"

    # A package has the same file, and a prefix can be moved, as the plug-in finds the library beside it.
    quietly env DESTDIR="$scratch/package$version" cmake --install "$build" --prefix /usr
    quietly cmake --install "$build" --prefix "$prefix"
    plugin=$(cd "$prefix" && find . -path '*/imageformats/libqgip.so')
    [ -s "$scratch/package$version/usr/$plugin" ] || fail 'DESTDIR changes what is installed'
    if readelf -d "$prefix/$plugin" | grep -F "$scratch"; then
        fail 'the place of the build is in the plug-in'
    fi
    moved=$scratch/moved$version
    cp -r "$prefix" "$moved"
    mv "$prefix" "$prefix.away"
    rm -r "$build/plugins"
    [[ $(ldd "$moved/$plugin") = *"=> $moved/"* ]] ||
        fail 'the plug-in does not find the library beside it'
    QT_PLUGIN_PATH=${moved}/${plugin%/imageformats/*} VECTORS=../../spec/vectors LD_LIBRARY_PATH=$moved/lib \
        quietly "$build/plugin_test" isListed scaled
    mv "$prefix.away" "$prefix"
    rm "$prefix/$plugin"
    printf 'Qt %s: the plug-in works where it is installed\n' "$version"
done
[ -n "$tried" ] || printf 'skipped: there is no Qt\n'
