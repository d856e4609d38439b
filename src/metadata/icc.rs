//! ICC profiles, as far as needed to recognize the one that is implied without a profile.

/// The length of a profile's header; the number of tags follows it.
const HEADER: usize = 128;
/// An entry of the table of tags: signature, offset, length.
const ENTRY: usize = 12;

/// Whether a profile is one for sRGB, which its description says.
pub(super) fn is_srgb(profile: &[u8]) -> bool {
    // Older profiles have the description in ASCII, newer ones in UTF-16.
    let (ascii, utf16): (&[u8], &[u8]) = (b"sRGB", b"\0s\0R\0G\0B");
    description(profile).is_some_and(|text| {
        let has = |name: &[u8]| text.windows(name.len()).any(|window| window == name);
        has(ascii) || has(utf16)
    })
}

/// The data of the tag `desc`.
fn description(profile: &[u8]) -> Option<&[u8]> {
    let number = |bytes: &[u8]| Some(u32::from_be_bytes(*bytes.first_chunk()?) as usize);
    let table = profile.get(HEADER..)?;
    let entries = table.get(4..)?.chunks_exact(ENTRY).take(number(table)?);
    let entry = entries.into_iter().find(|entry| entry.starts_with(b"desc"))?;
    profile.get(number(&entry[4..])?..)?.get(..number(&entry[8..])?)
}
