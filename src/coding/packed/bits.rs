//! Bit streams, least significant bit first (spec, section 7.1).

#[cfg(feature = "encode")]
use alloc::vec::Vec;

/// Reads bits from bytes that arrive in pieces.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct BitReader {
    /// The bits that were taken from the input and are not read yet, the next one lowest.
    window: u64,
    /// The number of these bits.
    available: u32,
}

impl BitReader {
    /// Reads the next `count` <= 32 bits, and takes as many bytes from `input` as they need. `None`
    /// if the input ends before; the bytes that were taken are kept.
    pub(crate) fn read(&mut self, count: u32, input: &mut &[u8]) -> Option<u32> {
        while self.available < count {
            let (&byte, rest) = input.split_first()?;
            *input = rest;
            self.window |= u64::from(byte) << self.available;
            self.available += 8;
        }
        let value = self.window & ((1 << count) - 1);
        self.window >>= count;
        self.available -= count;
        Some(value as u32)
    }

    /// Whether only the padding of a last byte is left: fewer than eight bits, all zero.
    pub(crate) fn is_padding(&self) -> bool {
        self.available < 8 && self.window == 0
    }
}

/// Writes bits into bytes.
#[cfg(feature = "encode")]
#[derive(Debug, Default)]
pub(crate) struct BitWriter {
    bytes: Vec<u8>,
    /// The bits that do not fill a byte yet.
    window: u64,
    /// The number of these bits.
    pending: u32,
}

#[cfg(feature = "encode")]
impl BitWriter {
    /// Appends `count` <= 32 bits: a value below 2^count.
    pub(crate) fn write(&mut self, value: u32, count: u32) {
        assert!(count == 32 || value >> count == 0, "a code wider than its bit depth");
        self.window |= u64::from(value) << self.pending;
        self.pending += count;
        while self.pending >= 8 {
            self.bytes.push(self.window as u8);
            self.window >>= 8;
            self.pending -= 8;
        }
    }

    /// The bytes, the last one padded with zero bits.
    pub(crate) fn finish(mut self) -> Vec<u8> {
        if self.pending > 0 {
            self.bytes.push(self.window as u8);
        }
        self.bytes
    }
}

#[cfg(all(test, feature = "encode"))]
mod tests {
    use super::*;
    use crate::testing::config;
    use proptest::prelude::*;

    proptest! {
        #![proptest_config(config(200))]

        #[test]
        fn any_fields_round_trip_through_any_slicing(
            fields in prop::collection::vec((any::<u32>(), 1_u32..=32), 0..200),
            slice in 1_usize..9,
        ) {
            let mut writer = BitWriter::default();
            let fields: Vec<(u32, u32)> = fields
                .into_iter()
                .map(|(value, count)| (value & (u32::MAX >> (32 - count)), count))
                .collect();
            for &(value, count) in &fields {
                writer.write(value, count);
            }
            let bytes = writer.finish();
            let mut reader = BitReader::default();
            let mut pieces = bytes.chunks(slice);
            let mut input: &[u8] = &[];
            for &(value, count) in &fields {
                let found = loop {
                    match reader.read(count, &mut input) {
                        Some(found) => break found,
                        None => input = pieces.next().expect("the writer wrote every bit"),
                    }
                };
                prop_assert_eq!(found, value);
            }
            prop_assert!(reader.is_padding() && input.is_empty() && pieces.next().is_none());
        }
    }
}
