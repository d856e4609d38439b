//! Reading a packet of XMP.

use roxmltree::{Document, Node, ParsingOptions};

pub(super) const RDF: &str = "http://www.w3.org/1999/02/22-rdf-syntax-ns#";
pub(super) const TIFF: &str = "http://ns.adobe.com/tiff/1.0/";
pub(super) const XML: &str = "http://www.w3.org/XML/1998/namespace";

/// Longest packet that is read, in bytes.
const MAX_LENGTH: usize = 1 << 24;
/// Most nodes of a packet. Those of real ones with long histories have some hundred thousand.
const MAX_NODES: u32 = 1 << 20;
/// Most declarations of namespaces, each of which may be looked at for every name.
const MAX_NAMESPACES: usize = 1000;
/// Most pairs of attributes in the same element, which are compared with each other.
const MAX_PAIRS: usize = 1 << 26;

/// Why a packet cannot be used: it is no XML, or is none of a reasonable size.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::metadata) struct Damaged;

/// Parses a packet. XMP in a file is UTF-8; some programs write a NUL after it.
pub(super) fn parse(xmp: &[u8]) -> Result<Document<'_>, Damaged> {
    let text = str::from_utf8(xmp).map_err(|_| Damaged)?.trim_end_matches('\0');
    if !is_reasonable(text) {
        return Err(Damaged);
    }
    let options = ParsingOptions { nodes_limit: MAX_NODES, ..ParsingOptions::default() };
    Document::parse_with_options(text, options).map_err(|_| Damaged)
}

/// The element that holds the properties of a packet.
pub(super) fn rdf<'a>(document: &'a Document<'_>) -> Option<Node<'a, 'a>> {
    document.descendants().find(|node| node.has_tag_name((RDF, "RDF")))
}

/// A text as it is written in XML.
pub(super) fn escaped(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for character in text.chars() {
        match character {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            '\r' => out.push_str("&#xD;"),
            other => out.push(other),
        }
    }
    out
}

/// Whether a text can be parsed in a time that its length leads to expect.
fn is_reasonable(text: &str) -> bool {
    let pairs = text.split('<').map(|tag| attributes(tag).pow(2)).sum::<usize>();
    text.len() <= MAX_LENGTH
        && pairs <= MAX_PAIRS
        && text.matches("xmlns").count() <= MAX_NAMESPACES
}

/// The number of attributes in a tag, with which the text begins.
fn attributes(tag: &str) -> usize {
    let (mut count, mut open) = (0, None);
    for byte in tag.bytes() {
        match (open, byte) {
            (None, b'>') => break,
            (None, b'"' | b'\'') => {
                open = Some(byte);
                count += 1;
            }
            (Some(quote), byte) if byte == quote => open = None,
            _ => {}
        }
    }
    count
}
