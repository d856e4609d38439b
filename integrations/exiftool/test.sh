#!/usr/bin/env bash
# Reads with exiftool what was in pictures before they became .gip, and what is in the test vectors.
# shellcheck source=integrations/setup.sh
. "$(dirname "$0")/../setup.sh"

needs exiftool python3
install_tool
read_tags() { exiftool -config "$root/integrations/exiftool/gip.config" "$@"; }
# That these tags of a file have these values.
check() {
    local told
    told=$(read_tags -s3 "${@:3}" "$1" 2>&1) || fail "$1: $told"
    [ "$told" = "$2" ] || fail "$1: $told in place of $2"
}
cd "$scratch"

# A picture of 48 x 32 pixels, with a profile of some hundred bytes, as exiftool writes metadata.
python3 - <<'PYTHON'
import struct
header = struct.pack(">4x4s4s4s4s12x4s28x", b"\0\0\0\0", b"\2\x40\0\0", b"mntr", b"RGB ", b"acsp")[:80]
text = b"desc\0\0\0\0" + struct.pack(">I", 9) + b"Test RGB\0" + bytes(78) + bytes(5)
profile = header.ljust(128, b"\0") + struct.pack(">I4sII", 1, b"desc", 144, len(text)) + text
profile = struct.pack(">I", len(profile)) + profile[4:]
profile = profile[:36] + b"acsp" + profile[40:]
profile = profile[:12] + b"mntrRGB XYZ " + profile[24:]
open("test.icc", "wb").write(profile)
with open("picture.ppm", "wb") as file:
    file.write(b"P6 48 32 255\n" + bytes(v for y in range(32) for x in range(48) for v in (5 * x, 7 * y, 99)))
PYTHON
quietly gip encode picture.ppm plain.gip
check plain.gip $'GIP\nimage/vnd.gip\n48x32\nRGB\n8' -FileType -MIMEType -ImageSize -ColorType -BitDepth
cp plain.gip plain
check plain GIP -FileType

quietly gip decode plain.gip picture.png
quietly exiftool '-ICC_Profile<=test.icc' -EXIF:Artist=Somebody -EXIF:ISO=400 -GPSLatitude=48.5 -GPSLatitudeRef=N \
    -XMP-dc:Title='A title' -XMP-xmp:Rating=4 picture.png
quietly gip encode picture.png picture.gip
check picture.gip $'Somebody\n400\n48.5\nA title\n4\nTest RGB' -EXIF:Artist -ISO '-GPSLatitude#' -XMP:Title -Rating \
    -ICC_Profile:ProfileDescription
check picture.gip '' -Warning -Error
# A copy of the tags for another picture.
quietly gip decode plain.gip copy.png
quietly exiftool -config "$root/integrations/exiftool/gip.config" -TagsFromFile picture.gip -all:all copy.png
check copy.png $'Somebody\nA title' -EXIF:Artist -XMP:Title

# A file that is cut off has what precedes the cut.
head -c "$(($(stat --format %s picture.gip) - 9))" picture.gip >cut.gip
check cut.gip $'Somebody\nThe file is cut off' -EXIF:Artist -Warning

# No vector makes it fail, or warn of the program.
vectors=$root/spec/vectors
check "$vectors/cicp.gip" $'9 16\n10000000 2500000' -ColorSpaceCodes -ContentLight
check "$vectors/metadata-late.gip" $'after the first layer\nafter the last layer' -Title -Comment
check "$vectors/metadata.gip" 'Dämmerung über dem Meer' -Title
read_tags -r "$vectors" >tags 2>said || true
if grep -v '^ *[0-9]* \(image files\|directories\)' said | grep -vi '^Warning: \[minor\]\|^Error: ' | grep .; then
    fail 'the configuration has an error'
fi
printf 'exiftool %s: reads the metadata of .gip\n' "$(exiftool -ver)"
