//! From marker to marker through a JPEG (ITU-T T.81, B).

use super::bits::{Damage, Table};
use super::frame::{COEFFICIENTS, Frame, unread};
use super::index;
use super::scan::Scan;
use super::survey::Survey;

/// What a segment with a part of an ICC profile begins with.
const PROFILE: &[u8] = b"ICC_PROFILE\0";

/// Most bytes between segments that may be padding, whatever they are.
const MOST_PADDING: usize = 64;

/// Goes through all segments and data.
pub(crate) fn survey(file: &[u8]) -> Survey {
    let mut segments = Segments::default();
    segments.survey.damage = segments.read(file).err();
    segments.survey
}

/// What the segments have set so far.
#[derive(Debug, Default)]
struct Segments {
    survey: Survey,
    /// For the lowest frequency, and for the others.
    tables: [[Option<Table>; 4]; 2],
    frame: Option<Frame>,
    restart_interval: usize,
}

/// What follows a segment.
enum Next {
    /// Another one, at this place.
    At(usize),
    /// Nothing that is to be looked at.
    End,
}

impl Segments {
    fn read(&mut self, file: &[u8]) -> Result<(), Damage> {
        let mut at = 2;
        loop {
            let Some(marker) = next_marker(file, at) else {
                // Some programs leave out the last marker.
                return match &self.frame {
                    Some(frame) if frame.is_complete() => Ok(()),
                    _ => Err(Damage::TooFew),
                };
            };
            // Many bytes, some of them stuffed, are those of a scan whose beginning is lost.
            let skipped = &file[at..marker];
            let is_stuffed = |pair: &[u8]| pair == [0xFF, 0];
            if skipped.len() > MOST_PADDING && skipped.windows(2).any(is_stuffed) {
                return Err(Damage::TooMany);
            }
            at = marker + 2;
            match self.segment(file, file[marker + 1], at)? {
                Next::At(next) => at = next,
                Next::End => return Ok(()),
            }
        }
    }

    fn segment(&mut self, file: &[u8], marker: u8, at: usize) -> Result<Next, Damage> {
        match marker {
            // The end, after which other pictures may follow.
            0xD9 => {
                let has_all = self.frame.as_ref().is_some_and(Frame::has_all_components);
                return if has_all { Ok(Next::End) } else { Err(Damage::Missing) };
            }
            // They stand alone.
            0x01 | 0xD0..=0xD8 => return Ok(Next::At(at)),
            // They are reserved.
            0x02..=0xBF | 0xF0..=0xFD if self.frame.is_some() => return Err(Damage::Marker),
            _ => {}
        }
        let mut payload = || {
            self.survey.cut = Some(at - 2);
            let &[high, low] = file.get(at..at + 2)? else { return None };
            let end = at + usize::from(u16::from_be_bytes([high, low]));
            let payload = file.get((at + 2).min(end)..end)?;
            self.survey.cut = None;
            Some((payload, end))
        };
        let Some((payload, end)) = payload() else { return Err(Damage::TooFew) };
        let survey = &mut self.survey;
        let is_known = match marker {
            0xC0..=0xC2 => {
                survey.unread = unread(payload);
                self.frame = Frame::parse(payload, marker == 0xC2);
                if let Some(frame) = &self.frame {
                    if frame.has_broken_sampling() {
                        survey.unread = Some("JPEG with such sampling is not read");
                    }
                    survey.is_unusual = frame.has_unusual_sampling();
                    survey.ids = frame.components.iter().map(|component| component.id).collect();
                }
                self.frame.is_some()
            }
            0xC4 => self.add_tables(payload).is_some(),
            0xC3 | 0xC5..=0xC7 | 0xC9..=0xCB | 0xCD..=0xCF => {
                survey.unread = Some(match marker {
                    0xC3 | 0xCB => "lossless JPEG is not read",
                    0xC9 | 0xCA => "JPEG with arithmetic coding is not read",
                    _ => "hierarchical JPEG is not read",
                });
                false
            }
            0xE0 => {
                survey.is_jfif |= payload.starts_with(b"JFIF\0");
                if let [b'J', b'F', b'I', b'F', 0, _, _, _, x1, x0, y1, y0, ..] = *payload {
                    let number = |high, low| u16::from_be_bytes([high, low]).into();
                    survey.density = Some((number(x1, x0), number(y1, y0)));
                }
                true
            }
            0xE2 => {
                survey.has_profile |= payload.starts_with(PROFILE);
                if payload.starts_with(index::PREFIX) {
                    survey.pictures = index::pictures(file, at + 2 + index::PREFIX.len());
                }
                true
            }
            0xEE => {
                if let [b'A', b'd', b'o', b'b', b'e', _, _, _, _, _, _, transform, ..] = payload {
                    survey.adobe = Some(*transform);
                }
                true
            }
            0xDD => match payload {
                &[high, low] => {
                    self.restart_interval = u16::from_be_bytes([high, low]).into();
                    true
                }
                _ => false,
            },
            0xDA => {
                let Some(mut frame) = self.frame.take() else { return Ok(Next::End) };
                let scan = self.scan(payload, &frame);
                let Some(scan) = scan.filter(|scan| scan.follows(&frame)) else {
                    // There are no usual tables of progressive pictures.
                    return if frame.is_progressive { Err(Damage::Missing) } else { Ok(Next::End) };
                };
                let is_unusual = scan.is_unusual(&frame);
                let next = scan.read(&mut frame, file, end);
                self.survey.is_unusual |= is_unusual;
                self.frame = Some(frame);
                return next.map(Next::At);
            }
            _ => true,
        };
        Ok(if is_known { Next::At(end) } else { Next::End })
    }

    /// Adds Huffman tables; `None` if they are invalid.
    fn add_tables(&mut self, mut payload: &[u8]) -> Option<()> {
        while let Some((&kind, rest)) = payload.split_first() {
            let (counts, rest) = rest.split_first_chunk::<16>()?;
            let count = counts.iter().map(|&count| usize::from(count)).sum();
            let (values, rest) = rest.split_at_checked(count)?;
            let tables = self.tables.get_mut(usize::from(kind >> 4))?;
            *tables.get_mut(usize::from(kind & 15))? = Some(Table::new(counts, values)?);
            payload = rest;
        }
        Some(())
    }

    /// Reads the header of a scan; `None` if it is invalid, or if a table that it needs is not there: a
    /// decoder may know it.
    fn scan(&self, payload: &[u8], frame: &Frame) -> Option<Scan<'_>> {
        let (&count, rest) = payload.split_first()?;
        let (parts, last) = rest.split_at_checked(2 * usize::from(count))?;
        let &[first, end, bits] = last else { return None };
        let band = if frame.is_progressive { (first, end) } else { (0, COEFFICIENTS as u8 - 1) };
        let band = (usize::from(band.0), usize::from(band.1));
        let bits = if frame.is_progressive { (bits >> 4, bits & 15) } else { (0, 0) };
        let is_mixed = frame.is_progressive && (band.0 == 0) != (band.1 == 0);
        let is_interleaved_band = band.0 > 0 && count > 1;
        if count == 0
            || band.1 >= COEFFICIENTS
            || band.0 > band.1
            || is_mixed
            || is_interleaved_band
        {
            return None;
        }
        let needs = |kind: usize| match kind {
            0 => band.0 == 0 && bits.0 == 0,
            _ => band.1 > 0,
        };
        let (mut components, mut tables) = (Vec::new(), Vec::new());
        for &[id, selectors] in parts.as_chunks::<2>().0 {
            components.push(frame.components.iter().position(|component| component.id == id)?);
            let selectors = [selectors >> 4, selectors & 15];
            let found = [0, 1].map(|kind| {
                let tables: &[Option<Table>; 4] = &self.tables[kind];
                tables.get(usize::from(selectors[kind]))?.as_ref()
            });
            if (0..2).any(|kind| needs(kind) && found[kind].is_none()) {
                return None;
            }
            tables.push(found);
        }
        let restart_interval = self.restart_interval;
        Some(Scan { components, tables, band, bits, restart_interval })
    }
}

/// Where the next marker is, from `at` on: bytes that are none do not matter between segments.
fn next_marker(file: &[u8], at: usize) -> Option<usize> {
    let pairs = file.get(at..)?.windows(2);
    pairs
        .zip(at..)
        .find(|(pair, _)| pair[0] == 0xFF && !matches!(pair[1], 0 | 0xFF))
        .map(|(_, at)| at)
}
