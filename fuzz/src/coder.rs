//! Symbols and bits, or bytes in their place, for two rans coders.

use arbitrary::Arbitrary;
use image_gip::fuzzing::{Item, contexts, decode, encode};

use crate::rans::{self, Decoder, Op};

/// What is coded, and bytes to be read in place of what the encoder makes of it.
#[derive(Arbitrary, Debug)]
pub struct Case {
    items: Vec<Coded>,
    bytes: Vec<u8>,
}

#[derive(Arbitrary, Debug)]
enum Coded {
    Symbol { context: u8, symbol: u8 },
    Bits { count: u8, value: u16 },
}

impl Case {
    /// Both encoders write the same bytes, and both decoders read the same from any bytes.
    pub fn check(&self) {
        let items: Vec<Item> = self.items.iter().map(Coded::item).collect();
        let ops: Vec<Op> = items.iter().map(op).collect();
        let bytes = encode(&items);
        assert_eq!(bytes, rans::encode(&ops), "the encoders differ");
        let values: Vec<u32> = items.iter().map(value).collect();
        assert_eq!(decode(&bytes, &items), (values, true), "what was encoded is not decoded");

        let (found, sound) = decode(&self.bytes, &items);
        match read(&self.bytes, &ops) {
            Ok(expected) => assert_eq!((found, sound), (expected, true), "the decoders differ"),
            Err(flaw) => assert!(!sound, "{flaw}, which was not noticed"),
        }
    }
}

impl Coded {
    fn item(&self) -> Item {
        match *self {
            Self::Symbol { context, symbol } => Item::Symbol {
                context: usize::from(context) % contexts(),
                symbol: u32::from(symbol % 16),
            },
            Self::Bits { count, value } => {
                let count = u32::from(count % 17);
                Item::Bits { count, value: u32::from(value) & ((1 << count) - 1) }
            }
        }
    }
}

fn op(item: &Item) -> Op {
    match *item {
        Item::Symbol { context, symbol } => Op::Symbol { context: context as u32, symbol },
        Item::Bits { count, value } => Op::Bits { count, value },
    }
}

fn value(item: &Item) -> u32 {
    match *item {
        Item::Symbol { symbol: value, .. } | Item::Bits { value, .. } => value,
    }
}

/// What the other decoder reads.
fn read(bytes: &[u8], ops: &[Op]) -> Result<Vec<u32>, &'static str> {
    let mut decoder = Decoder::new(bytes)?;
    let read = |op: &Op| match *op {
        Op::Symbol { context, .. } => decoder.symbol(context),
        Op::Bits { count, .. } => decoder.bits(count),
    };
    let values = ops.iter().map(read).collect::<Result<_, _>>()?;
    decoder.end()?;
    Ok(values)
}
