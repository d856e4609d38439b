//! The curvature of the squared error of one Gaussian: integrals of the squares of the quartic kernel's
//! derivatives.
//!
//! Changes are measured in the Gaussian's own frame: with its Cholesky factor L and its centre m, a
//! point p has the coordinates (u, v) = L^-1 (p - m), and q = u^2 + v^2. When the size of a Gaussian
//! changes, its colour changes too, such that its strength, colour times the square root of the area
//! l11 l22, and with it the sum of its squares, remains the same. Then the Hessian is diagonal: it
//! mixes neither the components of the geometry nor geometry and colour.
//!
//! The constants are half of the second derivatives of the squared error, for a Gaussian of strength 1
//! and for one of area 1.

/// By either coordinate of the centre, in standard deviations: 2 pi / 3.
pub(crate) const POSITION: f32 = 2.094_395;
/// By the logarithm of the size, ln(l11 l22) / 2: 4 pi / 3.
pub(crate) const SIZE: f32 = 4.188_79;
/// By the logarithm of the ratio, ln(l11 / l22) / 2: 16 pi / 15.
pub(crate) const RATIO: f32 = 3.351_032;
/// By the slant, l21 / l22: 4 pi / 15.
pub(crate) const SLANT: f32 = 0.837_758;
/// By the colour, for an area of 1: 4 pi / 5.
pub(crate) const COLOR: f32 = 2.513_274;
