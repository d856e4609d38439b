//! What the encoder asks of every release of glam, so that files do not depend on it: each product is rounded, and
//! they are added in the order of the axes. Nothing of this crate is used here, so that the test can be compiled with any
//! release alone.

use glam::{Mat2, Mat3, Vec2, Vec3};

#[test]
fn products_are_rounded_as_written_out() {
    let mut random = fastrand::Rng::with_seed(1);
    for _ in 0..1000 {
        let mut number = || 2000.0 * random.f32() - 1000.0;
        let m: [f32; 9] = core::array::from_fn(|_| number());
        let n: [f32; 4] = core::array::from_fn(|_| number());
        let v: [f32; 3] = core::array::from_fn(|_| number());

        let [a, b, c, d, ..] = m;
        let (first, second) = (Mat2::from_cols_array(&[a, b, c, d]), Mat2::from_cols_array(&n));
        let by_first = |[x, y]: [f32; 2]| [a * x + c * y, b * x + d * y];
        let [column1, column2] = [by_first([n[0], n[1]]), by_first([n[2], n[3]])];
        assert_eq!((first * second).to_cols_array_2d(), [column1, column2]);
        assert_eq!((first * Vec2::new(v[0], v[1])).to_array(), by_first([v[0], v[1]]));
        assert_eq!(Vec2::new(a, b).dot(Vec2::new(c, d)), a * c + b * d);
        assert_eq!(first.determinant(), a * d - b * c);

        let row = |index: usize| m[index] * v[0] + m[index + 3] * v[1] + m[index + 6] * v[2];
        let product = Mat3::from_cols_array(&m) * Vec3::from(v);
        assert_eq!(product.to_array(), [row(0), row(1), row(2)]);
    }
}
