//! The frame of a JPEG: its components, and which of their coefficients have come (ITU-T T.81, B.2.2).

/// Width and height of a block in pixels.
const BLOCK: usize = 8;
/// Coefficients of a block.
pub(super) const COEFFICIENTS: usize = 64;

#[derive(Debug)]
pub(super) struct Frame {
    pub(super) is_progressive: bool,
    /// Columns and rows of minimum coded units of an interleaved scan.
    pub(super) units: (usize, usize),
    pub(super) components: Vec<Component>,
}

#[derive(Debug)]
pub(super) struct Component {
    pub(super) id: u8,
    /// Columns and rows of blocks in a unit of an interleaved scan.
    pub(super) sampling: (usize, usize),
    /// Columns and rows of blocks that show.
    pub(super) blocks: (usize, usize),
    /// Blocks from one row to the next.
    pub(super) stride: usize,
    /// For each block of a progressive frame, the coefficients that are not zero so far, a bit each.
    pub(super) nonzero: Vec<u64>,
    /// For each coefficient, how many of its lowest bits have not come yet; `None` before it comes.
    pub(super) missing_bits: [Option<u8>; COEFFICIENTS],
}

/// Why no decoder reads a picture with this payload of a start of frame.
pub(super) fn unread(payload: &[u8]) -> Option<&'static str> {
    let (&bits, rest) = payload.split_first()?;
    if bits != 8 {
        return Some("JPEG with other samples than those of 8 bits is not read");
    }
    if rest.starts_with(&[0, 0]) {
        return Some("JPEG whose height comes after its data is not read");
    }
    None
}

impl Frame {
    /// Reads the payload of a start of frame; `None` if it is not one of pictures with 8 bits.
    pub(super) fn parse(payload: &[u8], is_progressive: bool) -> Option<Self> {
        let &[8, h1, h0, w1, w0, count, ref rest @ ..] = payload else { return None };
        let side = |high, low| usize::from(u16::from_be_bytes([high, low]));
        let (width, height) = (side(w1, w0), side(h1, h0));
        let (parts, []) = rest.as_chunks::<3>() else { return None };
        if width == 0 || height == 0 || parts.is_empty() || parts.len() != usize::from(count) {
            return None;
        }
        let sampling = |sampling: u8| (usize::from(sampling >> 4), usize::from(sampling & 15));
        let all = || parts.iter().map(|&[_, factors, _]| sampling(factors));
        if all().any(|(across, down)| !(1..=4).contains(&across) || !(1..=4).contains(&down)) {
            return None;
        }
        let across = all().map(|(across, _)| across).max()?;
        let down = all().map(|(_, down)| down).max()?;
        let units = (width.div_ceil(BLOCK * across), height.div_ceil(BLOCK * down));
        let component = |&[id, factors, _]: &[u8; 3]| {
            let (x, y) = sampling(factors);
            let blocks = |side: usize, factor: usize, most: usize| {
                (side * factor).div_ceil(most).div_ceil(BLOCK)
            };
            // A single component is never interleaved, whatever its factors.
            let (sampling, stride) = ((x, y), units.0 * x);
            let nonzero = if is_progressive { vec![0; stride * units.1 * y] } else { Vec::new() };
            Component {
                id,
                sampling,
                blocks: (blocks(width, x, across), blocks(height, y, down)),
                stride,
                nonzero,
                missing_bits: [None; COEFFICIENTS],
            }
        };
        Some(Self { is_progressive, units, components: parts.iter().map(component).collect() })
    }

    /// Whether factors are others than 1, 2 and 4, or a component has more samples than the first one.
    pub(super) fn has_unusual_sampling(&self) -> bool {
        let [first, others @ ..] = &self.components[..] else { return false };
        let (across, down) = first.sampling;
        self.factors().any(|factor| !factor.is_power_of_two())
            || others.iter().any(|other| other.sampling.0 > across || other.sampling.1 > down)
    }

    /// Whether samples of a component lie between those of another one: no decoder reads them.
    pub(super) fn has_broken_sampling(&self) -> bool {
        let most = self.components.iter().fold((1, 1), |most, component| {
            (component.sampling.0.max(most.0), component.sampling.1.max(most.1))
        });
        let components = &self.components;
        components
            .iter()
            .any(|Component { sampling: (x, y), .. }| most.0 % x != 0 || most.1 % y != 0)
    }

    fn factors(&self) -> impl Iterator<Item = usize> {
        self.components.iter().flat_map(|component| [component.sampling.0, component.sampling.1])
    }

    /// Whether every component has come, if only with its lowest frequency or its highest bits.
    pub(super) fn has_all_components(&self) -> bool {
        self.components.iter().all(|component| component.missing_bits[0].is_some())
    }

    /// Whether all bits of all coefficients have come.
    pub(super) fn is_complete(&self) -> bool {
        let mut all = self.components.iter().flat_map(|component| component.missing_bits);
        all.all(|missing| missing == Some(0))
    }
}
