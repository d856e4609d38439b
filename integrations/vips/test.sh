#!/usr/bin/env bash
# Builds the module into a prefix, and uses it from there with the program vips and with one of its own.
# shellcheck source=integrations/setup.sh
. "$(dirname "$0")/../setup.sh"
here=$root/integrations/vips

needs make cc pkg-config vips vipsheader
pkg-config --exists vips || {
    printf 'skipped: there are no development files of libvips\n'
    exit 0
}
install_library
install_tool
module() { quietly make --directory "$here" BUILD="$scratch/build" CFLAGS='-O2 -Werror' "$@"; }
module install PREFIX="$prefix" LDFLAGS="-Wl,-rpath,$prefix/lib"
module install DESTDIR="$scratch/package"
[ -s "$scratch/package$(pkg-config --variable=libdir vips)/vips-modules-$(pkg-config --modversion vips |
    cut -d . -f 1,2)/vips-gip.so" ] || fail 'the module is not where libvips looks for it'
# libvips takes the last part of its usual folder for libraries from there.
export VIPSHOME=$prefix/lib G_ENABLE_DIAGNOSTIC=1
[ "$(basename "$(pkg-config --variable=libdir vips)")" = lib ] && export VIPSHOME=$prefix
cd "$scratch"

# What a header says in a line, and what it says of one field.
check() {
    local told
    told=$(vipsheader "$1" 2>&1) || fail "$told"
    [ "${told#"$1: "}" = "$2" ] || fail "$told, in place of $2"
}
field() {
    local told
    told=$(vipsheader -f "$2" "$1" 2>&1) || fail "$told"
    [ "$told" = "$3" ] || fail "$1: $2 is $told in place of $3"
}
same() {
    quietly vips relational "$1" "$2" same.v equal
    [ "$(vips min same.v)" = 255.000000 ] || fail "$1 and $2 differ"
}

# A picture of 300 x 200 pixels.
quietly vips xyz xyz.v 300 200
quietly vips linear xyz.v two.v '0.8 1.2' '0 5' --uchar
quietly vips extract_band two.v one.v 0
quietly vips bandjoin 'two.v one.v' three.v
quietly vips copy three.v picture.png --interpretation srgb
quietly vips copy picture.png picture.gip
check picture.gip '300x200 uchar, 3 bands, srgb, gipload'
field picture.gip orientation 1

# The same samples as those of the tool, in whole and in part, at the stored and at another size.
quietly gip decode picture.gip whole.png
quietly vips copy picture.gip read.png
same read.png whole.png
quietly vips crop picture.gip part.png 31 17 200 100
quietly vips crop whole.png expected.png 31 17 200 100
same part.png expected.png
quietly gip decode picture.gip twice.png --scale 2
quietly vips copy 'picture.gip[scale=2]' read.png
same read.png twice.png
quietly vips thumbnail picture.gip small.png 100
check small.png '100x67 uchar, 3 bands, srgb, pngload'
quietly vips thumbnail 'picture.gip[scale=0.5]' small.png 100
check small.png '100x67 uchar, 3 bands, srgb, pngload'

# From and to a pipe.
quietly vips copy stdin piped.png <picture.gip
same piped.png whole.png
vips copy picture.png '.gip[Q=75]' | cmp - picture.gip || fail 'the default is another file'

# What the saver is asked for.
quietly vips copy picture.png 'small.gip[bytes=400]'
[ "$(stat --format %s small.gip)" -le 400 ] || fail 'the file is too large'
quietly vips copy picture.png 'low.gip[Q=20,effort=1]'
quietly vips copy picture.png 'high.gip[psnr=55]'
[ "$(stat --format %s low.gip)" -lt "$(stat --format %s high.gip)" ] || fail 'the quality does not count'

# 16 bits, gray, alpha; and what there is no other way to store.
for vector in gray8 gray16 gray-alpha8 gray-alpha16 rgb8 rgb16 rgba8 rgba16; do
    file=$root/spec/vectors/entropy-$vector.gip
    expected=$(vipsheader "$file")
    quietly gip decode "$file" whole.png
    quietly vips copy "$file" read.png
    same read.png whole.png
    quietly vips copy "$file" again.gip
    check again.gip "${expected#*: }"
done
quietly vips cast picture.png float.v float
quietly vips copy float.v float.gip
quietly vips colourspace picture.png lab.v lab
quietly vips copy lab.v lab.gip
check lab.gip '300x200 uchar, 3 bands, srgb, gipload'

# Samples of 8 bits may be held in more.
quietly vips add picture.png picture.png sum.v
check sum.v '300x200 ushort, 3 bands, srgb, pngload'
for interpretation in srgb multiband; do
    quietly vips copy sum.v held.v --interpretation "$interpretation"
    quietly vips copy held.v held.png
    quietly vips copy held.v 'held.gip[psnr=60,effort=1]'
    expected=$(vipsheader held.png)
    expected=${expected#*: }
    check held.gip "${expected%pngload}gipload"
    awk -v png="$(vips avg held.png)" -v gip="$(vips avg held.gip)" 'BEGIN { exit (png - gip) ^ 2 > 1 }' ||
        fail "of $interpretation, the mean is $(vips avg held.gip) in place of $(vips avg held.png)"
done
quietly vips copy sum.v held.v --interpretation rgb16
quietly vips copy held.v 'held.gip[effort=1]'
check held.gip '300x200 ushort, 3 bands, rgb16, gipload'
quietly vips extract_band sum.v band.v 0
quietly vips copy band.v gray.v --interpretation b-w
quietly vips copy gray.v 'gray.gip[effort=1]'
check gray.gip '300x200 uchar, 1 band, b-w, gipload'

# What cannot be saved leaves the file that was there.
cp picture.gip keep.gip
if vips gipsave picture.png keep.gip --psnr 0.5 2>said; then
    fail 'there is no such PSNR'
fi
cmp keep.gip picture.gip || fail 'the file is lost'
if vips gipsave picture.png no/folder.gip 2>said; then
    fail 'there is no such folder'
fi

# Metadata, and a picture that lies on its side and is stored upright.
metadata=$root/spec/vectors/metadata.gip
field "$metadata" orientation 6
field "$metadata" gip-text-0-Title 'Dämmerung über dem Meer'
quietly vips copy "$metadata" upright.gip
field upright.gip orientation 1
field upright.gip exif-ifd0-Orientation '1 (Top-left, Short, 1 components, 2 bytes)'
[ "$(vipsheader -f xmp-data upright.gip)" = "$(vipsheader -f xmp-data "$metadata")" ] || fail 'the XMP is another one'
quietly vips copy "$metadata" 'bare.gip[strip]'
if vipsheader -a bare.gip | grep -E 'exif|xmp|icc'; then
    fail 'metadata is not stripped'
fi
quietly vips autorot "$metadata" turned.png
quietly vips copy upright.gip read.png
quietly vips subtract turned.png read.png difference.v
quietly vips abs difference.v difference2.v
awk -v most="$(vips avg difference2.v)" 'BEGIN { exit most > 4 }' || fail 'it is turned another way'

# A file that is cut off shows what has arrived, unless that is not wanted.
head -c $(($(stat --format %s high.gip) / 2)) high.gip >cut.gip
check cut.gip '300x200 uchar, 3 bands, srgb, gipload'
vips copy cut.gip cut.png 2>said
grep -q 'unexpected end' said || fail 'nothing tells that the file is cut off'
check cut.png '300x200 uchar, 3 bands, srgb, pngload'
if vips copy 'cut.gip[fail_on=truncated]' cut.png 2>said; then
    fail 'a cut file is taken for a whole one'
fi
# Of one that is cut within its first layer there is nothing to show.
head -c 60 picture.gip >cut.gip
if vips copy cut.gip none.png 2>said; then
    fail 'a picture comes from nowhere'
fi
grep -q 'unexpected end' said || fail "what is said of a cut file: $(<said)"
if vips copy "$root/spec/vectors/xformat.gip" none.png 2>said; then
    fail 'a picture comes from nowhere'
fi
for file in "$root"/spec/vectors/*.gip; do
    vips avg "$file" >/dev/null 2>said || [ "$?" -eq 1 ] || fail "$file: $(<said)"
    if grep -E 'CRITICAL|GLib' said; then
        fail "$file is too much for the module"
    fi
done

read -ra flags < <(pkg-config --cflags --libs vips)
quietly cc -Wall -Wextra -Wno-unused-parameter -Werror "$here/test.c" "${flags[@]}" -o test
quietly ./test picture.gip
vips --version | sed 's/$/: reads and writes .gip/'
