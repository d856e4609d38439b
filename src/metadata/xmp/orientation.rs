//! The orientation in XMP.

use super::packet::{TIFF, parse};

/// Makes a packet say that the picture is upright, if it says anything of that. One that cannot be read
/// stays as it is.
pub(in crate::metadata) fn reset_orientation(xmp: &mut Vec<u8>) {
    const NAME: (&str, &str) = (TIFF, "Orientation");
    let mut places = Vec::new();
    let Ok(document) = parse(xmp) else { return };
    for node in document.descendants() {
        places.extend(node.attribute_node(NAME).map(|attribute| attribute.range_value()));
        if node.has_tag_name(NAME)
            && let Some(first) = node.first_child()
        {
            // What is between the tags. The range of a text may lack its end.
            let element = &document.input_text()[..node.range().end];
            let end = element.rfind("</").unwrap_or(element.len());
            places.push(first.range().start..end);
        }
    }
    // From the end, so that those before it stay where they are; what is within another is gone with it.
    let mut end = 0;
    places.retain(|place| {
        place.start >= end && {
            end = place.end;
            true
        }
    });
    for place in places.into_iter().rev() {
        xmp.splice(place, *b"1");
    }
}
