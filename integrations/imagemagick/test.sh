#!/usr/bin/env bash
# Converts pictures with ImageMagick, both ways, with the delegates of this folder.
# shellcheck source=integrations/setup.sh
. "$(dirname "$0")/../setup.sh"

needs convert identify mogrify
install_tool
export MAGICK_CONFIGURE_PATH=$root/integrations/imagemagick
cd "$scratch"

# What identify says of a file: format of the picture, size, depth, whether there is alpha.
check() {
    local told
    told=$(identify -format '%w x %h, %z, %[colorspace], %A' "$1")
    [ "$told" = "$2" ] || fail "$1 is $told in place of $2"
}
# Two pictures, over white, differ by a few thousandths of a full sample on average.
close() {
    local deviation
    deviation=$(convert \( "$1" -background white -flatten \) \( "$2" -background white -flatten \) -compose difference -composite -format '%[fx:round(mean*1000)]' info:)
    [ "$deviation" -lt 20 ] || fail "$1 and $2 differ by $deviation"
}

quietly convert -size 120x80 gradient:red-yellow -fill blue -draw 'circle 60,40 60,20' -depth 8 picture.png
quietly convert picture.png picture.gip
check picture.gip '120 x 80, 8, sRGB, False'
close picture.gip picture.png
[ "$(head -c 4 picture.gip)" = $'\xc7GIP' ] || fail 'it is no .gip'
quietly convert picture.gip -resize 50% small.jpg
check small.jpg '60 x 40, 8, sRGB, False'

# Names that a shell would take apart, and a name without an extension.
# shellcheck disable=SC2016
odd='a b $c;"d".gip'
quietly convert picture.png "$odd"
check "$odd" '120 x 80, 8, sRGB, False'
cp picture.gip plain
check gip:plain '120 x 80, 8, sRGB, False'
quietly convert gip:- piped.png <picture.gip
cmp <(convert piped.png rgb:) <(convert picture.gip rgb:) || fail 'standard input is another picture'

# A quality that is asked for, and that of gip.
quietly convert picture.png -quality 20 low.gip
quietly convert picture.png -quality 75 default.gip
quietly convert picture.png -quality 0 zero.gip
[ "$(stat --format %s low.gip)" -lt "$(stat --format %s picture.gip)" ] || fail 'the quality does not count'
cmp default.gip picture.gip || fail 'the default is another quality'
cmp zero.gip picture.gip || fail 'ImageMagick knows a quality of 0'

quietly convert picture.png -depth 16 -colorspace gray gray.tif
quietly convert gray.tif gray.gip
check gray.gip '120 x 80, 16, Gray, False'
quietly convert picture.png -alpha set -channel A -evaluate set 50% +channel alpha.png
quietly convert alpha.png alpha.gip
check alpha.gip '120 x 80, 8, sRGB, True'
close alpha.gip alpha.png

# A picture that lies on its side stands upright.
quietly convert picture.png -orient RightTop -set comment x side.tif
quietly convert side.tif side.gip
check side.gip '80 x 120, 8, sRGB, False'
quietly convert side.tif -auto-orient upright.png
close side.gip upright.png

# Of a file that is cut off, what has arrived, and no picture of one that is none.
head -c $(($(stat --format %s picture.gip) * 2 / 3)) picture.gip >cut.gip
quietly convert cut.gip cut.png
check cut.png '120 x 80, 8, sRGB, False'
head -c 20 picture.gip >none.gip
if convert none.gip none.png 2>/dev/null; then
    fail 'a picture comes from nowhere'
fi
# What cannot be written leaves the file that was there.
refused() {
    cp picture.gip "$1"
    "${@:2}" 2>/dev/null && fail "$*: there is no failure"
    cmp "$1" picture.gip || fail "$*: the file is lost"
}
refused keep.gip convert picture.png -quality 200 keep.gip
refused keep.gip mogrify -quality 200 -resize 50% keep.gip
cp low.gip "$odd~"
refused "$odd" mogrify -quality 200 -resize 50% "$odd"
cmp "$odd~" low.gip || fail 'an older copy is lost'
cp low.gip new.gip~
if convert picture.png -quality 200 new.gip 2>/dev/null || [ -e new.gip ]; then
    fail 'a picture comes from nowhere'
fi
quietly mogrify -resize 50% keep.gip
check keep.gip '60 x 40, 8, sRGB, False'
[ ! -e keep.gip~ ] || fail 'mogrify leaves a copy'
mkdir bin
printf '#!/bin/sh\nexit 127\n' >bin/gip
chmod +x bin/gip
PATH=$scratch/bin:$PATH refused keep.gip convert picture.png keep.gip
head -c 20 picture.gip >none.gip
cp none.gip broken.gip
mogrify -resize 50% broken.gip 2>/dev/null && fail 'nothing is resized'
cmp broken.gip none.gip || fail 'the broken file is lost'
# Standard output is for what is asked for.
[ "$(convert picture.png -write second.gip -format %w info: 2>/dev/null)" = 120 ] || fail 'there is more on standard output'

# Only gip:- takes standard input.
printf 'missing.gip\npicture.gip\n' | {
    while read -r name; do
        convert "$name" "read-$name.png" 2>said || grep -q 'No such file' said || fail "$name: $(<said)"
    done
}
[ -s read-picture.gip.png ] || fail 'a file that is missing takes standard input'
if convert missing.gip none.png <picture.gip 2>/dev/null || [ -e none.png ]; then
    fail 'standard input is taken for a file that is missing'
fi
mkdir 'a folder'
MAGICK_TMPDIR="$scratch/a folder" quietly convert picture.gip spaces.png </dev/null
check spaces.png '120 x 80, 8, sRGB, False'
MAGICK_TMPDIR="$scratch/a folder" quietly convert picture.png spaces.gip
cmp spaces.gip picture.gip || fail 'the folder counts'

# The command of both READMEs, in a home where nothing is.
command=$(sed -n 's/^    \(mkdir .*\)/\1/p' "$root/integrations/imagemagick/README.md")
grep -qF "\`$command\`" "$root/README.md" || fail 'the READMEs tell of two ways to install'
(
    cd "$root"
    export HOME=$scratch/home
    mkdir "$HOME"
    quietly bash -c "$command"
    unset MAGICK_CONFIGURE_PATH XDG_CONFIG_HOME
    cd "$scratch"
    check picture.gip '120 x 80, 8, sRGB, False'
)

convert -version | sed -n 's/^Version: \(ImageMagick [^ ]*\).*/\1: reads and writes .gip/p'
