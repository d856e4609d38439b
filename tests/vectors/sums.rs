//! The test vectors of sums, where numbers cancel (section 9.4).

use super::common::{EXPONENTIAL, Entry, File, GRAY, Header, RGBA, Random};
use super::sound::{floats, gray};
use super::{Rendering, Vector, header};

pub(super) fn valid() -> Vec<Vector> {
    [sums(), cancelling()].concat()
}

/// Pairs of Gaussians that all but cancel: a deviation in the last bit of a number shows, in each kernel and
/// parameterization (sections 8 and 9). Also on coarse grids, of which an output pixel averages up to about eight
/// columns and rows.
fn cancelling() -> Vec<Vector> {
    // Almost 1.
    let near = |random: &mut Random| random.range(1.0 - 1.9e-6, 1.0 + 1.9e-6);
    let file = |seed: u64, header: Header, scales: [f32; 2]| {
        let mut random = Random(seed);
        let mut rows = Vec::new();
        for _ in 0..5 {
            let [a, c] = [(); 2].map(|()| random.range(scales[0], scales[1]));
            let b = random.range(-scales[1], scales[1]);
            let shape = match header.form {
                0 => [a * a, a * b, b * b + c * c],
                1 => [a, b, c],
                _ => [a, c, 3.0 * b],
            };
            let center = header.sides().map(|side| random.range(0.0, side as f32));
            let row = [&center[..], &shape].concat();
            let colors = (0..=header.color).map(|_| random.range(20_000.0, 65_000.0));
            let colors = colors.collect::<Vec<f32>>();
            rows.push([&row[..], &colors].concat());
            let other = row.iter().map(|value| value * near(&mut random));
            rows.push(other.chain(colors.iter().map(|color| -color)).collect());
        }
        File::of_floats(header, &rows)
    };
    let gray = Header { depth: 16, base: [0x8000; 4], ..header(GRAY, 32, 24) };
    let exponential = |header: Header| Header { kernel: EXPONENTIAL, cutoff: 11.0, ..header };
    let coarse = Header { color: RGBA, form: 1, width: 333, height: 211, ..gray };
    let shows = "pairs of Gaussians that all but cancel, so that the last bit of each number shows";
    let sizes = [(7, 5), (11, 40), (33, 26), (3, 2)].map(|(w, h)| Rendering::Size(w, h));
    vec![
        ("cancelling-covariance-quartic", Header { form: 0, ..gray }),
        ("cancelling-cholesky-quartic", Header { form: 1, ..gray }),
        ("cancelling-rotation-quartic", Header { form: 2, ..gray }),
        ("cancelling-covariance-exponential", exponential(Header { form: 0, ..gray })),
        ("cancelling-cholesky-exponential", exponential(Header { form: 1, ..gray })),
        ("cancelling-rotation-exponential", exponential(Header { form: 2, ..gray })),
    ]
    .into_iter()
    .zip(90..)
    .map(|((name, header), seed)| {
        let file = file(seed, header, [1.0, 10.0]);
        Vector::valid(name, shows, file).also(&[Rendering::Size(80, 50)])
    })
    .chain([
        Vector::valid(
            "coarse-quartic",
            "such pairs on coarse grids, with alpha",
            file(96, coarse, [0.2, 30.0]),
        )
        .also(&sizes),
        Vector::valid(
            "coarse-exponential",
            "the same with the exponential kernel",
            file(97, exponential(coarse), [0.2, 30.0]),
        )
        .also(&sizes),
    ])
    .collect()
}

/// Sums (section 9.4).
fn sums() -> Vec<Vector> {
    let gray = gray();
    vec![
        Vector::valid(
            "order",
            "amplitudes of 100 and more that cancel, so that the order of summation shows",
            floats(
                Header { depth: 16, ..gray },
                &[
                    [9.0, 8.0, 5.0, 1.0, 4.0, 100.0],
                    [9.01, 8.0, 5.0, 1.0, 4.0, -100.0],
                    [14.0, 8.0, 5.0, 1.0, 4.0, 0.3],
                    [9.0, 8.0, 5.0, 1.0, 4.0, 65_536.0],
                    [14.0, 9.0, 5.0, 1.0, 4.0, 0.001],
                    [9.0, 8.0, 5.0, 1.0, 4.0, -65_536.0],
                ],
            ),
        ),
        Vector::valid(
            "thousand-equal",
            "a thousand equal Gaussians from a quantizer with one bit per component",
            {
                let entries = [12.0, 8.0, 4.0, 1.0, 3.0, 0.001].map(|v| Entry::linear(1, 1.0, v));
                File::new(gray, entries.to_vec(), vec![vec![0; 6000]])
            },
        ),
    ]
}
