//! The steps of the entropy coding as the header has them (section 5.3), written from `spec/gip.md` alone.

/// The codes of the least step, 2^-20, and of the largest, 2^10.
pub(crate) const LEAST: u16 = 0;
pub(crate) const MOST: u16 = 0xF000;

/// The step with a code.
pub(crate) fn step(code: u16) -> f32 {
    f32::from_bits(0x3580_0000 + (u32::from(code) << 12))
}

/// The ratio of two steps with a code.
pub(crate) fn ratio(code: u8) -> f32 {
    f32::from_bits(0x3B80_0000 + (u32::from(code) << 19))
}

/// The largest step that a header can have of those that are not over `value`.
pub(crate) fn at_most(value: f32) -> f32 {
    f32::from_bits(value.to_bits() & !0xFFF)
}

/// The code of a step that a header can have.
pub(crate) fn code(value: f32) -> u16 {
    let code = (value.to_bits() - 0x3580_0000) >> 12;
    let code = u16::try_from(code).ok().filter(|&code| code <= MOST && step(code) == value);
    code.unwrap_or_else(|| panic!("no header has the step {value}"))
}

/// The code of the ratio of a step to the one of the first axis.
fn ratio_code(value: f32, first: f32) -> u8 {
    let code = (0..=u8::MAX).find(|&code| first * ratio(code) == value);
    code.unwrap_or_else(|| panic!("no header has the step {value} beside {first}"))
}

/// The steps of position, size, ratio and slant that a header need not have.
pub(crate) fn usual_geometry() -> [f32; 4] {
    [1.2_f64, 0.6, 0.75, 3.0].map(|square| square.sqrt() as f32)
}

/// Whether a header need not have the steps of geometry among these: position, size, ratio, slant, colour axes.
pub(crate) fn has_usual_geometry(steps: &[f32]) -> bool {
    steps[..4] == usual_geometry()
}

/// The steps in the header: those of the colour axes, and those of geometry if they are not the usual ones.
pub(crate) fn bytes(steps: &[f32]) -> Vec<u8> {
    let (geometry, axes) = steps.split_at(4);
    let mut bytes = code(axes[0]).to_le_bytes().to_vec();
    bytes.extend(axes[1..].iter().map(|&axis| ratio_code(axis, axes[0])));
    if !has_usual_geometry(steps) {
        bytes.extend(geometry.iter().flat_map(|&step| code(step).to_le_bytes()));
    }
    bytes
}
