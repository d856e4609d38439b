//! Section 3.1 of `spec/gip.md`.

pub(crate) fn exp(x: f32) -> f32 {
    const COEFFICIENTS: [u32; 7] =
        [0x3921_8489, 0x3AAE_C3FF, 0x3C1D_955B, 0x3D63_5847, 0x3E75_FDF0, 0x3F31_7218, 0x3F80_0000];
    let y = (x * f32::from_bits(0x3FB8_AA3B)).clamp(-126.0, 126.0);
    let n = y.round_ties_even();
    let f = y - n;
    let p = COEFFICIENTS.into_iter().map(f32::from_bits).reduce(|p, c| p * f + c);
    p.unwrap_or_default() * f32::from_bits(((n as i32 + 127) as u32) << 23)
}
