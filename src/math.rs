//! The functions that the specification defines to the last bit (spec, section 3).
//!
//! The mathematics libraries of platforms differ in the last bits of `exp`, `sin` and `cos`, so the
//! format defines its own: IEEE 754 additions and multiplications in a stated order, never fused.
//! `sqrt` is correctly rounded everywhere, so hardware gives the same bits as the integer version
//! for builds without `std`.

/// Adding and then subtracting this rounds an `f32` of magnitude below 2^22 to the nearest integer,
/// ties to even.
pub(crate) const ROUND_MAGIC: f32 = 12_582_912.0;
/// log2(e).
pub(crate) const LOG2_E: f32 = core::f32::consts::LOG2_E;
/// The coefficients of a polynomial for 2^f on [-1/2, 1/2], highest power first. Its relative error
/// is 2e-8, rounding not counted.
pub(crate) const EXP2_POLYNOMIAL: [f32; 7] =
    [1.540_353e-4, 1.333_355_8e-3, 9.618_129e-3, 5.550_411e-2, 2.402_265e-1, 6.931_472e-1, 1.0];

/// e^x for finite x, from the specification's polynomial (spec, section 3.1).
///
/// The exponent of two is clamped to [-126, 126], so the result is always finite and normal.
pub(crate) fn exp(x: f32) -> f32 {
    let y = (x * LOG2_E).clamp(-126.0, 126.0);
    let n = (y + ROUND_MAGIC) - ROUND_MAGIC;
    let f = y - n;
    let mut p = EXP2_POLYNOMIAL[0];
    for &coefficient in &EXP2_POLYNOMIAL[1..] {
        p = p * f + coefficient;
    }
    // |n| <= 126, so the biased exponent is within 1 to 254.
    p * f32::from_bits(((n as i32 + 127) as u32) << 23)
}

/// (sin x, cos x) for |x| <= 1024, from the specification's polynomials (spec, section 3.2).
pub(crate) fn sin_cos(x: f32) -> (f32, f32) {
    let n = (x * core::f32::consts::FRAC_2_PI + ROUND_MAGIC) - ROUND_MAGIC;
    // pi/2 in two parts. The first has so few bits that its product with n is exact.
    let r = (x - n * 1.570_312_5) - n * 4.838_268e-4;
    let r2 = r * r;
    let sin = ((-1.951_529_6e-4 * r2 + 8.332_161e-3) * r2 - 1.666_665_5e-1) * r2 * r + r;
    let cos =
        ((2.443_315_7e-5 * r2 - 1.388_731_6e-3) * r2 + 4.166_664_6e-2) * r2 * r2 - 0.5 * r2 + 1.0;
    match (n as i32) & 3 {
        0 => (sin, cos),
        1 => (cos, -sin),
        2 => (-sin, -cos),
        _ => (-cos, sin),
    }
}

/// The correctly rounded square root (IEEE 754 squareRoot); NaN for x < 0.
#[cfg(feature = "std")]
pub(crate) fn sqrt(x: f32) -> f32 {
    x.sqrt()
}

/// The correctly rounded square root (IEEE 754 squareRoot); NaN for x < 0.
#[cfg(not(feature = "std"))]
pub(crate) fn sqrt(x: f32) -> f32 {
    soft_sqrt(x)
}

/// IEEE 754 squareRoot in integers: `core` has none.
#[cfg(any(not(feature = "std"), test))]
fn soft_sqrt(x: f32) -> f32 {
    if x < 0.0 {
        return f32::NAN;
    }
    if x == 0.0 || !x.is_finite() {
        return x;
    }
    let bits = x.to_bits();
    let (mut exponent, mut mantissa) = ((bits >> 23) as i32, u64::from(bits & 0x7f_ffff));
    if exponent == 0 {
        let shift = mantissa.leading_zeros() as i32 - 40;
        mantissa <<= shift;
        exponent = 1 - shift;
    } else {
        mantissa |= 0x80_0000;
    }
    // x = mantissa * 2^(exponent - 150). Make that power even, then take an integer root with more
    // bits than the result; `exact` tells whether it has a remainder.
    let mut power = exponent - 150;
    if power & 1 != 0 {
        mantissa <<= 1;
        power -= 1;
    }
    let root = (mantissa << 26).isqrt();
    let power = (power - 26) / 2;
    let extra = 64 - root.leading_zeros() as i32 - 24;
    let half = 1_u64 << (extra - 1);
    let exact = root * root == mantissa << 26;
    let (mut kept, rest) = (root >> extra, root & ((1 << extra) - 1));
    // If the root has a remainder, a rest of one half is more than that. The root of a 24-bit
    // number is never exactly halfway; ties go to even for completeness only.
    if rest > half || (rest == half && (!exact || kept & 1 == 1)) {
        kept += 1;
    }
    // kept <= 2^24 is exact in f32, and the power is far from the subnormal range.
    kept as f32 * f32::from_bits(((power + extra + 127) as u32) << 23)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exp_is_accurate_over_its_range() {
        for i in -80_000..80_000 {
            let x = i as f32 * 1e-3;
            let truth = f64::from(x).exp();
            // The rounding error of the argument reduction grows with |x|.
            let allowed = 2.4e-7 + f64::from(x.abs()) * 1.3e-7;
            let error = (f64::from(exp(x)) - truth).abs() / truth;
            assert!(error < allowed, "exp({x}): relative error {error:e}");
        }
        assert!(exp(-1e30) > 0.0 && exp(1e30).is_finite());
    }

    #[test]
    fn sin_cos_is_accurate_over_its_range() {
        for i in -102_400..=102_400 {
            let x = i as f32 * 1e-2;
            let (sin, cos) = sin_cos(x);
            let (true_sin, true_cos) = f64::from(x).sin_cos();
            let allowed = 2e-7 + f64::from(x.abs()) * 1e-9;
            assert!((f64::from(sin) - true_sin).abs() < allowed, "sin({x})");
            assert!((f64::from(cos) - true_cos).abs() < allowed, "cos({x})");
        }
    }

    #[test]
    fn the_integer_square_root_equals_the_hardware_one() {
        let mut bits = 1_u32;
        for _ in 0..400_000 {
            bits = bits.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            let x = f32::from_bits(bits & 0x7fff_ffff);
            if x.is_finite() {
                assert_eq!(soft_sqrt(x).to_bits(), x.sqrt().to_bits(), "sqrt({x:e})");
            }
        }
        for x in [0.0, 1.0, 4.0, 2.0, f32::MIN_POSITIVE, f32::MAX, 1e-45] {
            assert_eq!(soft_sqrt(x).to_bits(), x.sqrt().to_bits(), "sqrt({x:e})");
        }
        for x in [-1.0, -1e-45, f32::NEG_INFINITY, f32::NAN] {
            assert!(soft_sqrt(x).is_nan() && x.sqrt().is_nan(), "sqrt({x:e})");
        }
        assert_eq!(soft_sqrt(f32::INFINITY), f32::INFINITY);
    }
}
