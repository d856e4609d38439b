//! JPEG files with segments that `image` does not write.

/// What a segment with XMP begins with.
const XMP: &[u8] = b"http://ns.adobe.com/xap/1.0/\0";

/// A JPEG with further segments APP1.
pub(crate) fn with_segments(jpeg: &[u8], segments: &[Vec<u8>]) -> Vec<u8> {
    let mut file = jpeg[..2].to_vec();
    for segment in segments {
        file.extend([0xFF, 0xE1]);
        file.extend(u16::try_from(segment.len() + 2).expect("it fits").to_be_bytes());
        file.extend(segment);
    }
    file.extend(&jpeg[2..]);
    file
}

pub(crate) fn with_xmp(jpeg: &[u8], xmp: &str) -> Vec<u8> {
    with_segments(jpeg, &[xmp_segment(xmp)])
}

pub(crate) fn xmp_segment(xmp: &str) -> Vec<u8> {
    [XMP, xmp.as_bytes()].concat()
}
