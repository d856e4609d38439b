#!/usr/bin/env bash
# Opens a picture in Gwenview on a display that nobody sees, and takes a screenshot: gwenview.sh PICTURE.gip SHOT.png
#
# On Debian 12: gwenview, xvfb, dbus, imagemagick, shared-mime-info, qtbase5-dev, cmake.
# shellcheck source=integrations/setup.sh
. "$(dirname "$0")/../setup.sh"

[ $# -eq 2 ] || fail 'usage: gwenview.sh PICTURE.gip SHOT.png'
needs gwenview xvfb-run dbus-run-session import update-mime-database cmake make
install_library
here=$root/integrations/qt
quietly cmake -S "$here" -B "$scratch/build" -DQT_VERSION_MAJOR=5 -DCMAKE_PREFIX_PATH="$prefix" -DBUILD_TESTING=OFF
quietly cmake --build "$scratch/build"

# A home of its own, which knows the MIME type.
export HOME=$scratch/home QT_PLUGIN_PATH=$scratch/build/plugins
export XDG_DATA_HOME=$HOME/data XDG_CONFIG_HOME=$HOME/config XDG_CACHE_HOME=$HOME/cache XDG_RUNTIME_DIR=$HOME/run
mkdir -p "$XDG_DATA_HOME/mime/packages" "$XDG_RUNTIME_DIR"
chmod 700 "$XDG_RUNTIME_DIR"
cp "$root/desktop/gip.xml" "$XDG_DATA_HOME/mime/packages"
quietly update-mime-database "$XDG_DATA_HOME/mime"

# Without the picture, its window has some hundred colours.
# shellcheck disable=SC2016
quietly timeout 120 xvfb-run --auto-servernum --server-args '-screen 0 640x480x24' dbus-run-session -- bash -c '
    gwenview "$1" &
    for _ in {1..60}; do
        sleep 1
        import -window root "$2"
        [ "$(identify -format %k "$2")" -gt 5000 ] && break
    done
    kill $!' gwenview "$1" "$2"
colors=$(identify -format %k "$2")
[ "$colors" -gt 5000 ] || fail "the screenshot has $colors colours"
printf '%s: %d colours\n' "$2" "$colors"
