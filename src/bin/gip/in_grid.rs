//! Gaussians whose centre is too far outside of a picture for the entropy coding: what stands for them.

use image_gip::Gaussian;

/// The squared Mahalanobis distance at which the weight of the quartic kernel ends, the one that the coding has.
const CUTOFF: f32 = 4.0;
/// The distance of coordinates that codes can have, in pixels.
const UNIT: f64 = 1.0 / 128.0;
/// The least reach that is left of a Gaussian, in standard deviations. What shows of less is a part in 10^8 of its
/// amplitude.
const LEAST_REACH: f32 = 1e-2;

/// How much longer than the ellipse that ends where the Gaussian ends the new one may be, along the line from the old
/// centre and across. In those of 200 random Gaussians around a small picture, the best of them leaves at most 0.8 % of
/// the squared amplitudes, in the median 0.3 %.
const STRETCHES: ([f32; 4], [f32; 5]) = ([0.8, 0.9, 1.0, 1.1], [0.6, 0.7, 0.8, 0.9, 1.0]);
/// Samples along x and y of what shows of a Gaussian.
const SAMPLES: usize = 16;

/// Where the centres of a picture may be (spec, section 7.5).
#[derive(Clone, Copy, Debug)]
pub(crate) struct Grid {
    /// Width and height of the picture, in pixels.
    size: [f32; 2],
    /// The least and the largest coordinate along x and y, in pixels.
    bounds: [[f32; 2]; 2],
}

impl Grid {
    /// The grid of a picture of this size.
    pub(crate) fn new(width: u32, height: u32) -> Self {
        let root = width.max(height).div_ceil(16).next_power_of_two().max(8);
        let bounds = |side: u32| {
            let roots = side.div_ceil(root) + 1;
            [-f64::from(root), f64::from(roots) * f64::from(root) - UNIT].map(|bound| bound as f32)
        };
        let size = [width, height].map(|side| side as f32);
        Self { size, bounds: [bounds(width), bounds(height)] }
    }

    /// The Gaussian, if its centre is in the grid; else one whose centre is there, and that is nearly the same in the
    /// picture. `None` if nothing of it shows in the grid.
    ///
    /// The new centre is the place of the grid that has most of its weight. Seen where the Gaussian is a disc, the new
    /// one is about the ellipse around that place that ends where the disc ends, along the line from the old centre and
    /// across; which, and its amplitude, is what has the least squared error.
    pub(crate) fn brought_in(&self, gaussian: &Gaussian) -> Option<Gaussian> {
        let is_inside = |axis: usize| {
            let [least, most] = self.bounds[axis];
            (least..=most).contains(&gaussian.center[axis])
        };
        if is_inside(0) && is_inside(1) {
            return Some(*gaussian);
        }
        let (center, [u, v]) = self.nearest(gaussian);
        let distance = u.hypot(v);
        let reach = CUTOFF.sqrt();
        if distance > reach - LEAST_REACH {
            return None;
        }
        let direction = [u / distance, v / distance];
        let places = self.shown(gaussian);
        let mut best = (0.0, None);
        for along in STRETCHES.0.map(|stretch| stretch * (1.0 - distance / reach)) {
            for across in STRETCHES.1 {
                let across = across * (1.0 - (distance / reach).powi(2)).sqrt();
                let cholesky = stretched(gaussian.cholesky, direction, along, across);
                let new = Gaussian { center, cholesky, ..*gaussian };
                let (mut product, mut energy) = (0.0, 0.0);
                for &place in &places {
                    let weight = weight(&new, place);
                    product += weight * self::weight(gaussian, place);
                    energy += weight * weight;
                }
                let explained = product * product / energy;
                if explained > best.0 {
                    let color = gaussian.color.map(|part| part * (product / energy));
                    best = (explained, Some(Gaussian { color, ..new }));
                }
            }
        }
        best.1.filter(Gaussian::is_drawable)
    }

    /// Places of the picture that may be within reach of a Gaussian.
    fn shown(&self, gaussian: &Gaussian) -> Vec<[f32; 2]> {
        let [xx, _, yy] = gaussian.covariance();
        let coordinates = |axis: usize, variance: f32| {
            let (center, extent) = (gaussian.center[axis], (CUTOFF * variance).sqrt());
            let least = (center - extent).clamp(0.0, self.size[axis]);
            let most = (center + extent).clamp(0.0, self.size[axis]);
            let step = (most - least) / SAMPLES as f32;
            (0..SAMPLES).map(move |index| least + (index as f32 + 0.5) * step)
        };
        let rows = coordinates(1, yy);
        rows.flat_map(|y| coordinates(0, xx).map(move |x| [x, y])).collect()
    }

    /// The place of the grid that is nearest to a Gaussian outside, in standard deviations: in pixels, and as it is seen
    /// where the Gaussian is a disc around zero.
    fn nearest(&self, gaussian: &Gaussian) -> ([f32; 2], [f32; 2]) {
        let [xx, xy, yy] = gaussian.covariance();
        let [columns, rows] = self.bounds;
        let [x, y] = gaussian.center;
        // The nearest place of a line is where the other coordinate is expected.
        let of_column =
            |column: f32| [column, (y + xy / xx * (column - x)).clamp(rows[0], rows[1])];
        let of_row = |row: f32| [(x + xy / yy * (row - y)).clamp(columns[0], columns[1]), row];
        let places = columns.map(of_column).into_iter().chain(rows.map(of_row));
        let with_distance = places.map(|place| (place, seen(gaussian, place)));
        let nearer = |a: &(_, [f32; 2]), b: &(_, [f32; 2])| {
            let distance = |[u, v]: [f32; 2]| u.hypot(v);
            distance(a.1).total_cmp(&distance(b.1))
        };
        with_distance.min_by(nearer).expect("a grid has four sides")
    }
}

/// A place as it is seen where the Gaussian is a disc around zero.
fn seen(gaussian: &Gaussian, place: [f32; 2]) -> [f32; 2] {
    let [l11, l21, l22] = gaussian.cholesky;
    let [x, y] = [0, 1].map(|axis| place[axis] - gaussian.center[axis]);
    let u = x / l11;
    [u, (y - l21 * u) / l22]
}

/// The weight of a Gaussian at a place.
fn weight(gaussian: &Gaussian, place: [f32; 2]) -> f32 {
    let [u, v] = seen(gaussian, place);
    (1.0 - (u * u + v * v) / CUTOFF).max(0.0).powi(2)
}

/// The Cholesky factor of a Gaussian that is so many times as long along a direction, and across, seen where it is a
/// disc.
fn stretched([l11, l21, l22]: [f32; 3], [u, v]: [f32; 2], along: f32, across: f32) -> [f32; 3] {
    let (along, across) = (along * along, across * across);
    let uu = along * u * u + across * v * v;
    let uv = (along - across) * u * v;
    let xx = l11 * l11 * uu;
    let xy = l11 * (l21 * uu + l22 * uv);
    // That of the variance of y that does not come with x, where the determinant is the product of all.
    let rest = l11 * l22 * (along * across).sqrt() / xx.sqrt();
    [xx.sqrt(), xy / xx.sqrt(), rest]
}

#[cfg(test)]
mod tests {
    use super::*;
    use image_gip::{ColorModel, Header, Limits, Picture, RenderOptions};

    #[test]
    fn what_is_brought_in_shows_nearly_the_same() {
        let header = Header::new(64, 48, ColorModel::Gray);
        let (grid, limits) = (Grid::new(64, 48), Limits::none());
        let shown = |gaussians: &[Gaussian]| {
            let picture = Picture::from_gaussians(&header, gaussians, &limits).expect("drawable");
            let mut samples = vec![0.0; 64 * 48];
            picture.render_planes(&RenderOptions::new(), &mut samples).expect("the size is right");
            samples
        };
        let mut rng = fastrand::Rng::with_seed(5);
        let mut outside = 0;
        for _ in 0..300 {
            let mut number = |least: f32, most: f32| least + (most - least) * rng.f32();
            let center = [number(-120.0, 180.0), number(-100.0, 150.0)];
            let cholesky = [number(5.0, 60.0), number(-20.0, 20.0), number(5.0, 60.0)];
            let gaussian = Gaussian { center, cholesky, color: [1.0, 0.0, 0.0, 0.0] };
            let before = shown(&[gaussian]);
            let brought = grid.brought_in(&gaussian);
            let after = brought.map_or(vec![0.0; before.len()], |brought| shown(&[brought]));
            let energy = |samples: &mut dyn Iterator<Item = f32>| -> f64 {
                samples.map(|sample| f64::from(sample * sample)).sum()
            };
            let all = energy(&mut before.iter().copied());
            let error = energy(&mut before.iter().zip(&after).map(|(a, b)| a - b));
            if brought == Some(gaussian) {
                assert_eq!(error, 0.0);
                continue;
            }
            outside += usize::from(all > 0.0);
            assert!(error <= 0.02 * all, "{gaussian:?}: {error} of {all}");
        }
        assert!(outside > 50, "{outside}");
    }
}
