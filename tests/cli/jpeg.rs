//! JPEG files with segments that `image` does not write.

/// What a segment with XMP begins with.
const XMP: &[u8] = b"http://ns.adobe.com/xap/1.0/\0";

/// A JPEG with further segments APP1.
pub(crate) fn with_segments(jpeg: &[u8], segments: &[Vec<u8>]) -> Vec<u8> {
    let segments = segments.iter().rev();
    segments.fold(jpeg.to_vec(), |file, segment| with_segment(&file, 0xE1, segment))
}

/// A JPEG with a further segment, which is the first one.
pub(crate) fn with_segment(jpeg: &[u8], marker: u8, segment: &[u8]) -> Vec<u8> {
    let length = u16::try_from(segment.len() + 2).expect("it fits").to_be_bytes();
    [&jpeg[..2], &[0xFF, marker], &length, segment, &jpeg[2..]].concat()
}

pub(crate) fn with_xmp(jpeg: &[u8], xmp: &str) -> Vec<u8> {
    with_segments(jpeg, &[xmp_segment(xmp)])
}

pub(crate) fn xmp_segment(xmp: &str) -> Vec<u8> {
    [XMP, xmp.as_bytes()].concat()
}
