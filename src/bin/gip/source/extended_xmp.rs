//! The second part of XMP in JPEG (XMP specification, part 3, section 1.1.3.1).

/// What a segment of it begins with.
const PREFIX: &[u8] = b"http://ns.adobe.com/xmp/extension/\0";
/// Bytes of the name after that; the length of the whole and the place of the segment in it follow.
const NAME: usize = 32;
const APP1: u8 = 0xE1;
const START_OF_SCAN: u8 = 0xDA;

/// The part of this name; `None` if its segments are not all there, each once.
pub(super) fn find(file: &[u8], name: &str) -> Option<Vec<u8>> {
    let mut length = None;
    let mut parts = Vec::new();
    for segment in segments(file) {
        let Some(rest) = segment.strip_prefix(PREFIX) else { continue };
        let Some((found, rest)) = rest.split_at_checked(NAME) else { continue };
        if !found.eq_ignore_ascii_case(name.as_bytes()) {
            continue;
        }
        let (whole, rest) = number(rest)?;
        let (place, data) = number(rest)?;
        if *length.get_or_insert(whole) != whole {
            return None;
        }
        parts.push((place, data));
    }
    parts.sort_by_key(|(place, _)| *place);
    let mut joined = Vec::new();
    for (place, data) in parts {
        if place != joined.len() {
            return None;
        }
        joined.extend_from_slice(data);
    }
    (length == Some(joined.len())).then_some(joined)
}

/// What is in the segments APP1 of a JPEG.
fn segments(file: &[u8]) -> impl Iterator<Item = &[u8]> {
    let mut rest = file.strip_prefix(b"\xFF\xD8").unwrap_or_default();
    let next = move || {
        let marker = *rest.strip_prefix(b"\xFF")?.iter().find(|byte| **byte != 0xFF)?;
        let fill = rest.iter().take_while(|byte| **byte == 0xFF).count();
        let segment = rest.get(fill + 1..)?;
        let length = usize::from(u16::from_be_bytes(*segment.first_chunk()?));
        let (segment, after) = segment.split_at_checked(length)?;
        rest = after;
        (marker != START_OF_SCAN).then_some((marker, segment.get(2..)?))
    };
    std::iter::from_fn(next).filter(|(marker, _)| *marker == APP1).map(|(_, segment)| segment)
}

fn number(bytes: &[u8]) -> Option<(usize, &[u8])> {
    let (number, rest) = bytes.split_first_chunk()?;
    Some((u32::from_be_bytes(*number) as usize, rest))
}
