//! The bits and the Huffman codes of entropy-coded data (ITU-T T.81, F.2.2).

/// Most bytes of padding after the data of a scan. More are what an interrupted copy leaves.
const MAX_PADDING: usize = 32;
/// Longest code in bits.
const MAX_CODE: usize = 16;

/// Why entropy-coded data is not what an encoder writes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Damage {
    /// There are fewer data than the picture needs.
    TooFew,
    /// There are more data than the picture needs.
    TooMany,
    /// No such code, or a coefficient that a block does not have.
    Code,
    /// Zeros in place of data.
    Zeros,
    /// A restart marker is missing or out of order.
    Restart,
    /// Parts of the picture do not come at all.
    Missing,
    /// A marker that no picture has.
    Marker,
}

impl Damage {
    pub(super) fn text(self) -> &'static str {
        match self {
            Self::TooFew => "the data end too early",
            Self::TooMany => "there are data left over",
            Self::Zeros => "there are zeros in place of data",
            Self::Code => "invalid code in the data",
            Self::Restart => "a restart marker is missing",
            Self::Missing => "a part is missing",
            Self::Marker => "there is an invalid marker",
        }
    }
}

/// A Huffman table: for all sixteen bits that may come next, the code's symbol and length.
#[derive(Clone, Debug)]
pub(super) struct Table(Vec<Symbol>);

#[derive(Clone, Copy, Debug, Default)]
struct Symbol {
    value: u8,
    /// 0 where there is no such code.
    length: u8,
}

impl Table {
    /// `counts` are the numbers of codes of 1 to 16 bits, and `values` their symbols; `None` if there
    /// are too many codes for a length.
    pub(super) fn new(counts: &[u8; MAX_CODE], values: &[u8]) -> Option<Self> {
        let mut symbols = Vec::with_capacity(1 << MAX_CODE);
        let mut values = values.iter();
        for (length, &count) in (1..).zip(counts) {
            for _ in 0..count {
                let symbol = Symbol { value: *values.next()?, length };
                symbols.resize(symbols.len() + (1 << (MAX_CODE - usize::from(length))), symbol);
            }
        }
        (symbols.len() <= 1 << MAX_CODE).then(|| {
            symbols.resize(1 << MAX_CODE, Symbol::default());
            Self(symbols)
        })
    }
}

/// Reads bits up to the next marker.
#[derive(Debug)]
pub(super) struct Bits<'a> {
    data: &'a [u8],
    /// Where the next byte is.
    at: usize,
    /// The next bits, the first one highest.
    buffer: u64,
    /// How many they are.
    count: u32,
    /// How often there was another bit than 0 among those taken together.
    ones: u64,
}

impl<'a> Bits<'a> {
    pub(super) fn new(data: &'a [u8], at: usize) -> Self {
        Self { data, at, buffer: 0, count: 0, ones: 0 }
    }

    /// The next data byte, without the zero that is stuffed after 255; `None` at a marker.
    fn byte(&mut self) -> Option<u8> {
        let (byte, length) = match self.data.get(self.at..)? {
            [0xFF, 0, ..] => (0xFF, 2),
            [0xFF, ..] | [] => return None,
            &[byte, ..] => (byte, 1),
        };
        self.at += length;
        Some(byte)
    }

    fn fill(&mut self) {
        while self.count <= 56 {
            let Some(byte) = self.byte() else { break };
            self.buffer |= u64::from(byte) << (56 - self.count);
            self.count += 8;
        }
    }

    /// The value of the next `length` bits, at most 16.
    pub(super) fn take(&mut self, length: u32) -> Result<u32, Damage> {
        if self.count < length {
            self.fill();
            if self.count < length {
                return Err(Damage::TooFew);
            }
        }
        // In two steps, as a shift by all 64 bits is none.
        let value = (self.buffer >> 1 >> (63 - length)) as u32;
        self.buffer <<= length;
        self.count -= length;
        self.ones += u64::from(value != 0);
        Ok(value)
    }

    /// A number that stays the same for as long as nothing but zeros is taken.
    pub(super) fn ones(&self) -> u64 {
        self.ones
    }

    /// The symbol of the next code.
    pub(super) fn symbol(&mut self, table: &Table) -> Result<u8, Damage> {
        if self.count < MAX_CODE as u32 {
            self.fill();
        }
        let Symbol { value, length } = table.0[(self.buffer >> (64 - MAX_CODE)) as usize];
        match length {
            // Beyond the end there is nothing but zeros.
            0 if self.count < MAX_CODE as u32 => Err(Damage::TooFew),
            0 => Err(Damage::Code),
            _ => self.take(length.into()).map(|_| value),
        }
    }

    /// Where the marker is that the data end with. What is left may be padding: some encoders write
    /// bytes of it.
    pub(super) fn end(&mut self) -> Result<usize, Damage> {
        self.take(self.count % 8)?;
        let mut padding = None;
        for _ in 0..=MAX_PADDING {
            let byte = match self.count {
                0 => self.byte(),
                _ => Some(self.take(8)? as u8),
            };
            match byte {
                None => return Ok(self.at),
                Some(byte @ (0 | 0xFF)) if *padding.get_or_insert(byte) == byte => {}
                Some(_) => break,
            }
        }
        Err(Damage::TooMany)
    }

    /// Goes on after the restart marker of this number, from 0 to 7.
    pub(super) fn restart(&mut self, number: u8) -> Result<(), Damage> {
        let mut at = self.end()?;
        while self.data.get(at..at + 2) == Some(&[0xFF, 0xFF]) {
            at += 1;
        }
        match self.data.get(at..at + 2) {
            Some(marker) if *marker == [0xFF, 0xD0 + number] => {
                *self = Self { ones: self.ones, ..Self::new(self.data, at + 2) };
                Ok(())
            }
            Some(_) => Err(Damage::Restart),
            None => Err(Damage::TooFew),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bits_end_at_a_marker_and_padding_is_no_damage() {
        let mut bits = Bits::new(&[0b1010_0101, 0xFF, 0, 0x7F, 0xFF, 0xD9], 0);
        assert_eq!((bits.take(3), bits.take(9)), (Ok(0b101), Ok(0b0_0101_1111)));
        assert_eq!((bits.take(16), bits.take(4)), (Err(Damage::TooFew), Ok(0b1111)));
        assert_eq!(bits.end(), Err(Damage::TooMany));
        let mut bits = Bits::new(&[0xAA, 0xFF, 0, 0xFF, 0, 0xFF, 0xD9], 0);
        assert_eq!((bits.take(3), bits.end()), (Ok(0b101), Ok(5)));
    }

    #[test]
    fn more_zeros_than_padding_are_damage() {
        let zeros = |count| Bits::new(&vec![0; count], 0).end();
        assert_eq!(zeros(MAX_PADDING), Ok(MAX_PADDING));
        assert_eq!(zeros(MAX_PADDING + 1), Err(Damage::TooMany));
    }

    #[test]
    fn codes_of_a_table() {
        let mut counts = [0; MAX_CODE];
        (counts[0], counts[1], counts[15]) = (1, 1, 1);
        let table = Table::new(&counts, &[7, 8, 9]).expect("they fit");
        // 0, 10, 1100000000000000, and no code.
        let mut bits = Bits::new(&[0b0101_1000, 0, 0, 0b1111_1110, 0, 0], 0);
        let symbols = [0; 3].map(|_| bits.symbol(&table));
        assert_eq!(symbols, [Ok(7), Ok(8), Ok(9)]);
        bits.take(5).expect("there are more");
        assert_eq!(bits.symbol(&table), Err(Damage::Code));
        counts[0] = 3;
        assert!(Table::new(&counts, &[0; 5]).is_none());
    }
}
