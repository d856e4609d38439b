//! What of XMP is safe to pass on.

use core::fmt::Write as _;

use roxmltree::{Document, Node};

use super::packet::{Damaged, RDF, TIFF, XML, escaped, parse, rdf};

/// The properties that are safe: namespace, its usual prefix, names.
const SAFE: [(&str, &str, &[&str]); 6] = [
    ("http://purl.org/dc/elements/1.1/", "dc", &["title", "description", "creator", "rights"]),
    ("http://ns.adobe.com/xap/1.0/", "xmp", &["CreateDate", "ModifyDate", "MetadataDate"]),
    (
        "http://ns.adobe.com/xap/1.0/rights/",
        "xmpRights",
        &["Marked", "Owner", "UsageTerms", "WebStatement"],
    ),
    ("http://ns.adobe.com/photoshop/1.0/", "photoshop", &["Credit", "DateCreated"]),
    (
        TIFF,
        "tiff",
        &[
            "Orientation",
            "XResolution",
            "YResolution",
            "ResolutionUnit",
            "DateTime",
            "ImageDescription",
            "Artist",
            "Copyright",
        ],
    ),
    (
        "http://ns.adobe.com/exif/1.0/",
        "exif",
        &["DateTimeOriginal", "DateTimeDigitized", "ColorSpace"],
    ),
];

/// The safe properties of a packet, written anew, so that nothing else is between them; `None` if there
/// are none.
pub(in crate::metadata) fn safe(xmp: &[u8]) -> Result<Option<Vec<u8>>, Damaged> {
    let document = parse(xmp)?;
    let mut properties = String::new();
    for (uri, prefix, names) in SAFE {
        for name in names {
            if let Some(value) = value(&document, uri, name) {
                _ = write!(properties, "<{prefix}:{name}>{value}</{prefix}:{name}>");
            }
        }
    }
    if properties.is_empty() {
        return Ok(None);
    }
    let mut packet = format!(
        "<?xpacket begin=\"\u{feff}\" id=\"W5M0MpCehiHzreSzNTczkc9d\"?><x:xmpmeta \
         xmlns:x=\"adobe:ns:meta/\"><rdf:RDF xmlns:rdf=\"{RDF}\"><rdf:Description rdf:about=\"\""
    );
    for (uri, prefix, _) in SAFE {
        if properties.contains(&format!("<{prefix}:")) {
            _ = write!(packet, " xmlns:{prefix}=\"{uri}\"");
        }
    }
    packet.push('>');
    packet.push_str(&properties);
    packet.push_str("</rdf:Description></rdf:RDF></x:xmpmeta><?xpacket end=\"w\"?>");
    Ok(Some(packet.into_bytes()))
}

/// A property of the picture, as the XML of a plain text or a list of plain texts. One of any other form
/// is left out.
fn value(document: &Document<'_>, uri: &str, name: &str) -> Option<String> {
    descriptions(document).find_map(|description| {
        if let Some(text) = description.attribute((uri, name)).filter(|text| !text.is_empty()) {
            return Some(escaped(text));
        }
        let property = description.children().find(|child| child.has_tag_name((uri, name)))?;
        text(property).or_else(|| list(property))
    })
}

/// The elements that hold the properties of the picture.
fn descriptions<'a>(document: &'a Document<'_>) -> impl Iterator<Item = Node<'a, 'a>> {
    let children = rdf(document).into_iter().flat_map(|rdf| rdf.children());
    children.filter(|node| node.has_tag_name((RDF, "Description")))
}

/// The XML of a list and its items.
fn list(property: Node<'_, '_>) -> Option<String> {
    let mut lists = property.children().filter(Node::is_element);
    let (list, None) = (lists.next()?, lists.next()) else { return None };
    let name = ["Alt", "Bag", "Seq"].into_iter().find(|name| list.has_tag_name((RDF, *name)))?;
    let mut out = format!("<rdf:{name}>");
    for item in list.children().filter(|node| node.has_tag_name((RDF, "li"))) {
        let text = text(item)?;
        match item.attribute((XML, "lang")) {
            Some(lang) => _ = write!(out, "<rdf:li xml:lang=\"{}\">{text}</rdf:li>", escaped(lang)),
            None => _ = write!(out, "<rdf:li>{text}</rdf:li>"),
        }
    }
    _ = write!(out, "</rdf:{name}>");
    Some(out)
}

/// The text in an element without further ones, or the address that it refers to.
fn text(node: Node<'_, '_>) -> Option<String> {
    if node.children().any(|child| child.is_element()) {
        return None;
    }
    let text: String = node.children().filter_map(|child| child.text()).collect();
    let text = if text.is_empty() { node.attribute((RDF, "resource"))? } else { &text };
    Some(escaped(text))
}
