//! The entropy coder (section 7.3), written from `spec/gip.md` alone.

/// How sixteen symbols divide the 2^15 slots, and how many symbols were read with them.
#[derive(Clone, Debug)]
struct Model {
    /// start(0) to start(16).
    starts: [i32; 17],
    read: u32,
}

impl Model {
    fn adapt(&mut self, symbol: u32) {
        let rate = match self.read {
            0..32 => 5,
            32..96 => 6,
            _ => 7,
        };
        self.read += 1;
        for (s, start) in (0..16).zip(&mut self.starts).skip(1) {
            let target = s + if s > symbol as i32 { (1 << 15) - 16 } else { 0 };
            *start += (target - *start) >> rate;
        }
    }

    /// The first slot of a symbol, and how many it has.
    fn slots(&self, symbol: u32) -> (u32, u32) {
        let symbol = symbol as usize;
        let (start, end) = (self.starts[symbol], self.starts[symbol + 1]);
        (start as u32, (end - start) as u32)
    }
}

/// One model for each context.
#[derive(Clone, Debug)]
struct Models(Vec<Model>);

impl Models {
    /// As the table of the specification says.
    fn new() -> Self {
        let table = include_str!("../../spec/entropy-models.tsv");
        let model = |line: &str| {
            let mut starts = [1 << 15; 17];
            let numbers = line.split('\t').skip(1).map(|n| n.parse().expect("a number"));
            starts.iter_mut().zip(numbers).for_each(|(start, number)| *start = number);
            Model { starts, read: 0 }
        };
        Self(table.lines().map(model).collect())
    }
}

/// What is coded, in the order in which it is read.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Op {
    Symbol {
        context: u32,
        symbol: u32,
    },
    /// At most 16 plain bits.
    Bits {
        count: u32,
        value: u32,
    },
}

/// The bytes of a layer from which a decoder reads `ops`.
pub(crate) fn encode(ops: &[Op]) -> Vec<u8> {
    let mut models = Models::new();
    // The models adapt forwards, but the last is coded first.
    let ranges = ops.iter().map(|&op| match op {
        Op::Symbol { context, symbol } => {
            let model = &mut models.0[context as usize];
            let (start, size) = model.slots(symbol);
            model.adapt(symbol);
            (u64::from(start), u64::from(size), 1 << 15)
        }
        Op::Bits { count, value } => (u64::from(value), 1, 1 << count),
    });
    let ranges: Vec<(u64, u64, u64)> = ranges.collect();
    let (mut state, mut words) = (1_u64 << 16, Vec::new());
    // What the decoder does, undone.
    for &(start, size, total) in ranges.iter().rev() {
        // States from here on would not fit into 32 bits.
        let room = (size << 32) / total;
        if state >= room {
            words.push(state as u16);
            state >>= 16;
        }
        state = state / size * total + state % size + start;
    }
    let mut bytes = (state as u32).to_le_bytes().to_vec();
    bytes.extend(words.iter().rev().flat_map(|word| word.to_le_bytes()));
    bytes
}

/// The state and the words of a layer, while it is read.
pub(crate) struct Decoder<'a> {
    models: Models,
    state: u32,
    words: &'a [u8],
    pub(crate) ops: Vec<Op>,
    /// The state before each of them, and after the last.
    pub(crate) states: Vec<u32>,
}

/// What is wrong with a layer.
pub(crate) type Flaw = &'static str;

impl<'a> Decoder<'a> {
    pub(crate) fn new(bytes: &'a [u8]) -> Result<Self, Flaw> {
        let (state, words) = bytes.split_first_chunk().ok_or("no state")?;
        let state = u32::from_le_bytes(*state);
        if state < 1 << 16 {
            return Err("the state begins below 2^16");
        }
        Ok(Self { models: Models::new(), state, words, ops: Vec::new(), states: vec![state] })
    }

    /// After every symbol and every number of bits.
    fn refill(&mut self) -> Result<(), Flaw> {
        if self.state < 1 << 16 {
            let (word, rest) = self.words.split_first_chunk().ok_or("no word left")?;
            self.state = self.state << 16 | u32::from(u16::from_le_bytes(*word));
            self.words = rest;
        }
        self.states.push(self.state);
        Ok(())
    }

    pub(crate) fn symbol(&mut self, context: u32) -> Result<u32, Flaw> {
        let model = &mut self.models.0[context as usize];
        let slot = self.state % (1 << 15);
        let symbol = (0..16).find(|&s| slot < model.starts[s + 1] as u32);
        let symbol = symbol.expect("the slots end with 2^15") as u32;
        let (start, size) = model.slots(symbol);
        self.state = size * (self.state >> 15) + slot - start;
        model.adapt(symbol);
        self.ops.push(Op::Symbol { context, symbol });
        self.refill()?;
        Ok(symbol)
    }

    pub(crate) fn bits(&mut self, count: u32) -> Result<u32, Flaw> {
        if count > 16 {
            let low = self.bits(16)?;
            return Ok(low | self.bits(count - 16)? << 16);
        }
        let value = self.state % (1 << count);
        self.state >>= count;
        self.ops.push(Op::Bits { count, value });
        self.refill()?;
        Ok(value)
    }

    pub(crate) fn excess(&mut self) -> Result<i32, Flaw> {
        let n = self.symbol(156)?;
        let b = self.bits(n)?;
        Ok((1 << n) + b as i32 - 1)
    }

    pub(crate) fn signed(&mut self, context: u32, shift: u32) -> Result<i32, Flaw> {
        let h = match self.symbol(context)? {
            15 => {
                let negative = self.bits(1)? == 1;
                let h = 8 + self.excess()?;
                if negative { -h } else { h }
            }
            symbol => symbol as i32 - 7,
        };
        Ok(h.wrapping_mul(1 << shift).wrapping_add(self.bits(shift)? as i32))
    }

    pub(crate) fn end(&self) -> Result<(), Flaw> {
        match (self.state, self.words) {
            (0x1_0000, []) => Ok(()),
            (0x1_0000, _) => Err("words left"),
            _ => Err("another state at the end"),
        }
    }
}

/// The writer's half of the numbers that are made of symbols and bits.
#[derive(Debug, Default)]
pub(crate) struct Encoder {
    pub(crate) ops: Vec<Op>,
}

impl Encoder {
    pub(crate) fn symbol(&mut self, context: u32, symbol: u32) {
        self.ops.push(Op::Symbol { context, symbol });
    }

    pub(crate) fn bits(&mut self, count: u32, value: u32) {
        let low = count.min(16);
        self.ops.push(Op::Bits { count: low, value: value & ((1 << low) - 1) });
        if count > 16 {
            self.bits(count - 16, value >> 16);
        }
    }

    pub(crate) fn excess(&mut self, number: i32) {
        let n = (number + 1).ilog2();
        self.symbol(156, n);
        self.bits(n, (number + 1 - (1 << n)) as u32);
    }

    pub(crate) fn signed(&mut self, context: u32, shift: u32, number: i32) {
        let h = number >> shift;
        if (-7..=7).contains(&h) {
            self.symbol(context, (h + 7) as u32);
        } else {
            self.symbol(context, 15);
            self.bits(1, u32::from(h < 0));
            self.excess(h.abs() - 8);
        }
        self.bits(shift, number as u32 & ((1 << shift) - 1));
    }
}
