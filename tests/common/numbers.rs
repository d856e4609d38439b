//! Numbers of one to five bytes (section 2).

/// The bytes of a number.
pub(crate) fn number(value: u32) -> Vec<u8> {
    let bytes = (0..5).map(|place| (u64::from(value) >> (7 * place) & 0x7F) as u8);
    let mut bytes: Vec<u8> = bytes.collect();
    while bytes.len() > 1 && bytes.last() == Some(&0) {
        bytes.pop();
    }
    let last = bytes.len() - 1;
    bytes[..last].iter_mut().for_each(|byte| *byte |= 0x80);
    bytes
}

/// The `number` at the front of these bytes, and what follows it.
pub(crate) fn read_number(bytes: &[u8]) -> Option<(u32, &[u8])> {
    let length = bytes.iter().position(|&byte| byte < 0x80)? + 1;
    let (found, rest) = bytes.split_at(length);
    let value = found.iter().rev().fold(0, |value, byte| value << 7 | u64::from(byte & 0x7F));
    let value = u32::try_from(value).ok()?;
    (found == number(value)).then_some((value, rest))
}
