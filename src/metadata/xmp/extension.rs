//! A packet in two parts: JPEG has no room for a long one, so that the rest of it is elsewhere in the file.

use roxmltree::Node;

use super::packet::{Damaged, escaped, parse, rdf};

/// The property of the first part that names the second.
const NOTE: (&str, &str) = ("http://ns.adobe.com/xmp/note/", "HasExtendedXMP");

/// The name of the second part, if there is one.
pub(in crate::metadata) fn name(xmp: &[u8]) -> Option<String> {
    let document = parse(xmp).ok()?;
    document.descendants().find_map(|node| {
        let text = if node.has_tag_name(NOTE) { node.text() } else { node.attribute(NOTE) };
        text.map(|text| text.trim().to_owned())
    })
}

/// The first part without the name of the second, and with its properties if it is given.
pub(in crate::metadata) fn join(xmp: &[u8], extension: Option<&[u8]>) -> Result<Vec<u8>, Damaged> {
    let document = parse(xmp)?;
    let text = document.input_text();
    // What is replaced, and by what; the places do not overlap.
    let mut edits = Vec::new();
    for node in document.descendants() {
        if node.has_tag_name(NOTE) {
            edits.push((node.range(), String::new()));
        }
        edits.extend(node.attribute_node(NOTE).map(|note| (note.range(), String::new())));
    }
    if let Some(extension) = extension {
        let last = rdf(&document).and_then(|rdf| rdf.last_child()).ok_or(Damaged)?;
        let end = last.range().end;
        edits.push((end..end, descriptions(extension)?));
    }
    edits.sort_by_key(|(place, _)| place.start);
    let mut joined = text.to_owned();
    for (place, new) in edits.into_iter().rev() {
        joined.replace_range(place, &new);
    }
    // Whatever was unusual about the two, they are one now.
    parse(joined.as_bytes())?;
    Ok(joined.into_bytes())
}

/// The properties of a packet, as XML that is complete by itself.
fn descriptions(xmp: &[u8]) -> Result<String, Damaged> {
    let document = parse(xmp)?;
    let rdf = rdf(&document).ok_or(Damaged)?;
    let mut out = String::new();
    for node in rdf.children().filter(Node::is_element) {
        let text = &document.input_text()[node.range()];
        let name = text.find(|c: char| c.is_whitespace() || c == '>' || c == '/').ok_or(Damaged)?;
        let tag = &text[..text.find('>').ok_or(Damaged)?];
        out.push_str(&text[..name]);
        // What the elements around it declare.
        for namespace in rdf.namespaces() {
            let name = match namespace.name() {
                Some("xml") => continue,
                Some(prefix) => format!("xmlns:{prefix}"),
                None => "xmlns".into(),
            };
            if !declares(tag, &name) {
                out.push_str(&format!(" {name}=\"{}\"", escaped(namespace.uri())));
            }
        }
        out.push_str(&text[name..]);
    }
    Ok(out)
}

/// Whether a tag has an attribute of this name.
fn declares(tag: &str, name: &str) -> bool {
    let is_equals = |rest: &str| rest.trim_start().starts_with('=');
    tag.match_indices(name).any(|(at, _)| is_equals(&tag[at + name.len()..]))
}
