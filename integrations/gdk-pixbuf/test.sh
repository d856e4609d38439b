#!/usr/bin/env bash
# Builds the module into a prefix, and loads pictures with it in a program of its own and as file managers do.
# shellcheck source=integrations/setup.sh
. "$(dirname "$0")/../setup.sh"
here=$root/integrations/gdk-pixbuf

needs make cc pkg-config update-mime-database gdk-pixbuf-thumbnailer gdk-pixbuf-pixdata
pkg-config --exists gdk-pixbuf-2.0 || {
    printf 'skipped: there are no development files of gdk-pixbuf\n'
    exit 0
}
query=$(pkg-config --variable=gdk_pixbuf_query_loaders gdk-pixbuf-2.0)
install_library
module() { quietly make --directory "$here" BUILD="$scratch/build" CFLAGS='-O2 -Werror' "$@"; }
module install LOADERS="$prefix/lib/loaders" LDFLAGS="-Wl,-rpath,$prefix/lib"
module install DESTDIR="$scratch/package"
[ -s "$scratch/package$(pkg-config --variable=gdk_pixbuf_moduledir gdk-pixbuf-2.0)/libpixbufloader-gip.so" ] ||
    fail 'the module is not where gdk-pixbuf looks for it'

# It recognizes files by the MIME type, for which it asks the database of a home of our own.
export XDG_DATA_HOME=$scratch/data GDK_PIXBUF_MODULE_FILE=$scratch/loaders.cache
mkdir -p "$XDG_DATA_HOME/mime/packages"
cp "$root/desktop/gip.xml" "$XDG_DATA_HOME/mime/packages"
quietly update-mime-database "$XDG_DATA_HOME/mime"
# The loader of PNG, which thumbnails are stored as, is in the library.
"$query" "$prefix/lib/loaders/libpixbufloader-gip.so" >"$GDK_PIXBUF_MODULE_FILE"
grep -qxF '"image/vnd.gip" ""' "$GDK_PIXBUF_MODULE_FILE" || fail "$(<"$GDK_PIXBUF_MODULE_FILE")"

read -ra flags < <(pkg-config --cflags --libs gdk-pixbuf-2.0)
quietly "${CC:-cc}" -Wall -Wextra -Werror "$here/test.c" "${flags[@]}" -o "$scratch/test"
quietly "$scratch/test" "$root/spec/vectors"

# A name without an extension, as file managers have it for what they make.
quietly gdk-pixbuf-thumbnailer --size 12 "$root/spec/vectors/rgba8.gip" "$scratch/thumbnail"
[ "$(head -c 8 "$scratch/thumbnail")" = $'\x89PNG\r\n\x1a' ] || fail 'there is no thumbnail'
printf 'gdk-pixbuf %s: loads and saves .gip\n' "$(pkg-config --modversion gdk-pixbuf-2.0)"
