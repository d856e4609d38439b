#!/usr/bin/env bash
# Installs the library into a prefix, and uses it from there as others do.
#
#     tests/installed.sh
#
# Needs make, a C and a C++ compiler, readelf and pkg-config. Without CMake, that part is skipped.
set -euo pipefail
cd "$(dirname "$0")/.."
folder=$PWD
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
prefix=$scratch/prefix

fail() {
    printf 'failed: %s\n' "$*" >&2
    exit 1
}
strict=(-std=c99 -Wall -Wextra -Werror -pedantic)

# A package: the same files in DESTDIR, which say nothing of it.
make --silent install PREFIX="$prefix"
make --silent install PREFIX=/usr LIBDIR=/usr/lib/machine DESTDIR="$scratch/package"
(cd "$scratch/package/usr" && find . -type f -o -type l) | sed 's|lib/machine|lib|' | sort >"$scratch/packaged"
(cd "$prefix" && find . -type f -o -type l) | sort | diff - "$scratch/packaged" ||
    fail 'DESTDIR changes what is installed'
if grep -rF "$scratch" "$scratch/package/usr/lib/machine/pkgconfig" "$scratch/package/usr/lib/machine/cmake"; then
    fail 'DESTDIR is in the files'
fi
grep -qx 'libdir=/usr/lib/machine' "$scratch/package/usr/lib/machine/pkgconfig/gip.pc"

# The shared library: its name, and nothing but what the header declares.
abi=$(sed -n 's/^#define GIP_ABI_VERSION //p' include/gip.h)
readelf -d "$prefix/lib/libgip.so" | grep -qF "[libgip.so.$abi]" || fail 'the soname is wrong'
nm -D --defined-only "$prefix/lib/libgip.so" | awk '{ print $3 }' | sort >"$scratch/exported"
"${CC:-cc}" -fpreprocessed -dD -E -P include/gip.h | grep -o '\bgip_[a-z_]*(' | tr -d '(' |
    sort -u >"$scratch/declared"
diff "$scratch/exported" "$scratch/declared" || fail 'exported is other than what is declared'
# What the crates in it ask of those who pass them on.
notices=$prefix/share/doc/libgip/LICENSE-THIRD-PARTY
for words in '^kamadak-exif ' '^mutate_once ' 'Redistributions in binary form'; do
    grep -q "$words" "$notices" || fail "LICENSE-THIRD-PARTY lacks $words"
done

# The command of the README, in the words of the README, with the example beside it.
awk '/^```/ { inside = ($0 == "```c"); next } inside' README.md | diff - examples/gip2ppm.c ||
    fail 'the README has another example'
command=$(sed -n 's/^    \(cc .*\)$/\1/p' README.md)
[ -n "$command" ] || fail 'the README has no command'
export PKG_CONFIG_PATH=$prefix/lib/pkgconfig
picture=$folder/../../spec/vectors/rgba16.gip
# What a program prints and writes about the picture.
try() {
    local printed
    printed=$("$@" "$picture" "$scratch/picture.ppm")
    [ "$printed" = "$picture: 16 x 16 pixels" ] || fail "$1 prints $printed"
    [ "$(head -c 12 "$scratch/picture.ppm")" = $'P6\n16 16\n255' ] || fail 'the PPM has another header'
    [ "$(stat --format %s "$scratch/picture.ppm")" -eq $((13 + 16 * 16 * 3)) ] ||
        fail 'the PPM has another size'
    if [ -e "$scratch/first.ppm" ]; then
        cmp "$scratch/picture.ppm" "$scratch/first.ppm" || fail "$1 shows another picture"
    else
        cp "$scratch/picture.ppm" "$scratch/first.ppm"
    fi
}
cp examples/gip2ppm.c "$scratch"
(cd "$scratch" && bash -euc "$command")
LD_LIBRARY_PATH=$prefix/lib try "$scratch/gip2ppm"
readelf -d "$scratch/gip2ppm" | grep -qF "NEEDED" || fail 'it is not linked with shared libraries'
readelf -d "$scratch/gip2ppm" | grep -qF "[libgip.so.$abi]" || fail 'it needs another library'

# The static library, with the shared libraries of the system, and with none.
[ "$(pkg-config --modversion gip)" = "$(sed -n 's/^version = "\(.*\)"$/\1/p' Cargo.toml)" ] ||
    fail 'gip.pc has another version'
read -ra flags < <(pkg-config --static --cflags --libs gip)
"${CC:-cc}" "${strict[@]}" examples/gip2ppm.c "${flags[@]/#-lgip/-l:libgip.a}" -o "$scratch/static"
if readelf -d "$scratch/static" | grep -F libgip; then
    fail 'it is not linked with the static library'
fi
try "$scratch/static"
"${CC:-cc}" "${strict[@]}" -static examples/gip2ppm.c "${flags[@]}" -o "$scratch/alone"
try "$scratch/alone"
printf 'pkg-config: linked with the shared and the static library\n'

# CMake, from a prefix that was moved.
mv "$prefix" "$scratch/moved"
if command -v cmake >/dev/null; then
    cmake -S tests/cmake -B "$scratch/cmake" -DCMAKE_PREFIX_PATH="$scratch/moved" \
        -DEXAMPLE="$folder/examples/gip2ppm.c" -DHEADER_TEST="$folder/tests/header.cpp" >"$scratch/log" ||
        fail "$(<"$scratch/log")"
    cmake --build "$scratch/cmake" >"$scratch/log" 2>&1 || fail "$(<"$scratch/log")"
    try "$scratch/cmake/shared"
    try "$scratch/cmake/static"
    "$scratch/cmake/header"
    printf 'CMake: linked with the shared and the static library\n'
else
    printf 'skipped: there is no CMake\n'
fi

make --silent uninstall PREFIX="$scratch/moved"
[ -z "$(find "$scratch/moved" -type f -o -type l)" ] || fail 'uninstall leaves files'
