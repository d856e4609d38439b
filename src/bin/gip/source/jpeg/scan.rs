//! The symbols of a scan, read for nothing but to see whether they are those of a picture (ITU-T T.81,
//! F.2 and G.2).

use super::bits::{Bits, Damage, Table};
use super::frame::{COEFFICIENTS, Frame};

/// Most coefficients of blocks in a row whose bits are all 0 and that have their last coefficient all the
/// same. Zeros in place of data can be read as such blocks; pictures do not have more than some.
const MAX_FULL_OF_ZEROS: usize = 4 * COEFFICIENTS;

/// A scan: which coefficients of which components, and the tables of their codes.
#[derive(Debug)]
pub(super) struct Scan<'a> {
    /// Indices of the components.
    pub(super) components: Vec<usize>,
    /// For each of them the tables of the lowest frequency and of the others. What has none is not
    /// read.
    pub(super) tables: Vec<[Option<&'a Table>; 2]>,
    /// First and last coefficient.
    pub(super) band: (usize, usize),
    /// How many lowest bits were missing before the scan, 0 if all, and how many after it.
    pub(super) bits: (u8, u8),
    /// Units from one restart marker to the next; 0 for none.
    pub(super) restart_interval: usize,
}

impl Scan<'_> {
    /// Whether it is one of several for all components of a frame that is not progressive, and these differ
    /// in sampling: the usual decoder reads it wrong.
    pub(super) fn is_unusual(&self, frame: &Frame) -> bool {
        let is_part = self.components.len() < frame.components.len();
        let is_subsampled = frame.components.iter().any(|component| component.sampling != (1, 1));
        !frame.is_progressive && is_part && is_subsampled
    }

    /// Whether the bits of its coefficients are those that come next, which a progressive frame has an order
    /// for (ITU-T T.81, G.1.1.1): the lowest frequency first, then one bit at a time of what has come.
    pub(super) fn follows(&self, frame: &Frame) -> bool {
        if !frame.is_progressive {
            return true;
        }
        let (before, after) = self.bits;
        let is_first = before == 0;
        self.components.iter().all(|&index| {
            let missing = &frame.components[index].missing_bits;
            let mut band = missing[self.band.0..=self.band.1].iter();
            if is_first {
                band.all(Option::is_none) && (self.band.0 == 0 || missing[0].is_some())
            } else {
                before == after + 1 && band.all(|&missing| missing == Some(before))
            }
        })
    }

    /// Reads the data of the scan. Returns where the next marker is.
    pub(super) fn read(&self, frame: &mut Frame, data: &[u8], at: usize) -> Result<usize, Damage> {
        let mut bits = Bits::new(data, at);
        let is_single = self.components.len() == 1;
        let (columns, rows) =
            if is_single { frame.components[self.components[0]].blocks } else { frame.units };
        let (mut until_restart, mut restarts) = (self.restart_interval, 0_u8);
        let (mut run, mut full_of_zeros) = (0, 0);
        for y in 0..rows {
            for x in 0..columns {
                if self.restart_interval > 0 {
                    if until_restart == 0 {
                        bits.restart(restarts % 8)?;
                        (until_restart, restarts, run) =
                            (self.restart_interval, restarts.wrapping_add(1), 0);
                    }
                    until_restart -= 1;
                }
                for (&index, tables) in self.components.iter().zip(&self.tables) {
                    let component = &mut frame.components[index];
                    let (across, down) = if is_single { (1, 1) } else { component.sampling };
                    for row in y * down..(y + 1) * down {
                        for column in x * across..(x + 1) * across {
                            let ones = bits.ones();
                            let is_full = if frame.is_progressive {
                                let block = row * component.stride + column;
                                let nonzero = &mut component.nonzero[block];
                                self.progressive_block(&mut bits, *tables, nonzero, &mut run)?
                            } else {
                                sequential_block(&mut bits, *tables)?
                            };
                            let is_of_zeros = is_full && bits.ones() == ones;
                            full_of_zeros = match is_of_zeros {
                                true => full_of_zeros + self.band.1 + 1 - self.band.0,
                                false => 0,
                            };
                            if full_of_zeros > MAX_FULL_OF_ZEROS {
                                return Err(Damage::Zeros);
                            }
                        }
                    }
                }
            }
        }
        for &index in &self.components {
            let missing = &mut frame.components[index].missing_bits;
            missing[self.band.0..=self.band.1].fill(Some(self.bits.1));
        }
        bits.end()
    }

    /// Returns whether the block has its last coefficient. `run` is how many blocks, from this one on,
    /// have nothing new in the band.
    fn progressive_block(
        &self,
        bits: &mut Bits<'_>,
        [lowest, others]: [Option<&Table>; 2],
        nonzero: &mut u64,
        run: &mut u32,
    ) -> Result<bool, Damage> {
        let is_refined = self.bits.0 > 0;
        match (self.band.0, is_refined) {
            (0, false) => lowest.map_or(Ok(()), |table| difference(bits, table)).map(|()| false),
            (0, true) => bits.take(1).map(|_| false),
            (_, false) => self.first_of_band(bits, others, nonzero, run),
            (_, true) => self.refinement_of_band(bits, others, nonzero, run).map(|()| false),
        }
    }

    fn first_of_band(
        &self,
        bits: &mut Bits<'_>,
        table: Option<&Table>,
        nonzero: &mut u64,
        run: &mut u32,
    ) -> Result<bool, Damage> {
        let Some(table) = table else { return Ok(false) };
        if *run > 0 {
            *run -= 1;
            return Ok(false);
        }
        let mut at = self.band.0;
        while at <= self.band.1 {
            let symbol = bits.symbol(table)?;
            let (zeros, size) = (symbol >> 4, symbol & 15);
            match (zeros, size) {
                (15, 0) => at += 16,
                (_, 0) => {
                    *run = (1 << zeros) + bits.take(zeros.into())? - 1;
                    return Ok(false);
                }
                _ => {
                    at += usize::from(zeros);
                    if at > self.band.1 {
                        return Err(Damage::Code);
                    }
                    bits.take(size.into())?;
                    *nonzero |= 1 << at;
                    at += 1;
                }
            }
        }
        Ok(true)
    }

    fn refinement_of_band(
        &self,
        bits: &mut Bits<'_>,
        table: Option<&Table>,
        nonzero: &mut u64,
        run: &mut u32,
    ) -> Result<(), Damage> {
        let Some(table) = table else { return Ok(()) };
        let mut at = self.band.0;
        while *run == 0 && at <= self.band.1 {
            let symbol = bits.symbol(table)?;
            let (mut zeros, size) = (symbol >> 4, symbol & 15);
            match (zeros, size) {
                (15, 0) => {}
                (_, 0) => {
                    *run = (1 << zeros) + bits.take(zeros.into())?;
                    break;
                }
                (_, 1) => _ = bits.take(1)?,
                _ => return Err(Damage::Code),
            }
            // Those that are not zero get a bit each, and do not count.
            while at <= self.band.1 {
                if *nonzero >> at & 1 == 1 {
                    bits.take(1)?;
                } else if zeros == 0 {
                    break;
                } else {
                    zeros -= 1;
                }
                at += 1;
            }
            if size == 1 {
                if at > self.band.1 {
                    return Err(Damage::Code);
                }
                *nonzero |= 1 << at;
            }
            at += 1;
        }
        if *run > 0 {
            for at in at..=self.band.1 {
                bits.take((*nonzero >> at & 1) as u32)?;
            }
            *run -= 1;
        }
        Ok(())
    }
}

/// Returns whether the block has its last coefficient.
fn sequential_block(
    bits: &mut Bits<'_>,
    [lowest, others]: [Option<&Table>; 2],
) -> Result<bool, Damage> {
    let (Some(lowest), Some(others)) = (lowest, others) else { return Ok(false) };
    difference(bits, lowest)?;
    let mut at = 1;
    while at < COEFFICIENTS {
        let symbol = bits.symbol(others)?;
        let (zeros, size) = (symbol >> 4, symbol & 15);
        match (zeros, size) {
            (15, 0) => at += 16,
            (_, 0) => return Ok(false),
            _ => {
                at += usize::from(zeros) + 1;
                if at > COEFFICIENTS {
                    return Err(Damage::Code);
                }
                bits.take(size.into())?;
            }
        }
    }
    Ok(true)
}

/// The difference of the lowest frequency from that of the block before.
fn difference(bits: &mut Bits<'_>, table: &Table) -> Result<(), Damage> {
    let size = bits.symbol(table)?;
    if size > 11 {
        return Err(Damage::Code);
    }
    bits.take(size.into()).map(|_| ())
}
