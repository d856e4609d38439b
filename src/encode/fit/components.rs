//! What a Gaussian of the fit consists of, and the bounds that trained values are clamped to.

use glam::Vec2;

use crate::coding::entropy::CenterGrid;
use crate::gaussian::{Gaussian, MAX_COMPONENTS, Parameterization};
use crate::render::splat::Splat;

/// Something for each component of a Gaussian: the trained values, their gradient, their codes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Components<T = f32> {
    pub(crate) center: [T; 2],
    /// In the parameterization of the training.
    pub(crate) shape: [T; 3],
    /// The values and gradients of absent channels are 0.
    pub(crate) color: [T; 4],
}

impl<T: Copy> Components<T> {
    /// The same for all components of an attribute.
    pub(crate) const fn by_attribute(center: T, shape: T, color: T) -> Self {
        Self { center: [center; 2], shape: [shape; 3], color: [color; 4] }
    }

    /// From all components in the order of the file.
    #[inline(always)]
    pub(crate) const fn from_array([x, y, a, b, c, c0, c1, c2, c3]: [T; MAX_COMPONENTS]) -> Self {
        Self { center: [x, y], shape: [a, b, c], color: [c0, c1, c2, c3] }
    }

    /// All components in the order of the file.
    #[inline(always)]
    pub(crate) const fn to_array(self) -> [T; MAX_COMPONENTS] {
        let Self { center: [x, y], shape: [a, b, c], color: [c0, c1, c2, c3] } = self;
        [x, y, a, b, c, c0, c1, c2, c3]
    }
}

impl Components {
    pub(crate) const ZERO: Self = Self::by_attribute(0.0, 0.0, 0.0);

    /// The Gaussian that has these values.
    #[inline]
    pub(crate) fn gaussian(&self, parameterization: Parameterization) -> Gaussian {
        let Self { center, shape, color } = *self;
        Gaussian { center, cholesky: parameterization.to_cholesky(shape), color }
    }

    /// The splat of that Gaussian; nothing if it is not drawn.
    pub(super) fn splat(&self, parameterization: Parameterization) -> Splat {
        Splat::new(&self.gaussian(parameterization)).unwrap_or(Splat::NOWHERE)
    }
}

// Constants: docs/tuning.md, "Growth".
/// Largest magnitude of a trained colour: where larger colours cancel each other, the picture
/// depends on rounding errors.
pub(crate) const MOST_COLOR: f32 = 2.0;

/// Pixels by which rounding may move a centre outwards: where a Gaussian is steep, an error along x
/// moves it along y.
const MOST_ROUNDING: f32 = 1.0;

/// What the step of a Gaussian depends on.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Slope<Gradient = Components> {
    pub(crate) gradient: Gradient,
    /// How much a squared error counts there.
    pub(crate) perceptual_weight: f32,
}

/// The bounds of the components of a picture's Gaussians.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Bounds {
    pub(crate) parameterization: Parameterization,
    pub(crate) channels: usize,
    /// The ranges of x and y of a centre. Farther outside, it would widen the range over which positions
    /// are quantized, for a Gaussian of which little is visible; and it would leave the grid of the entropy
    /// coding, which moves a centre inwards, and a long Gaussian with it.
    pub(super) center_ranges: [(f32, f32); 2],
    /// Largest standard deviation that is trained, in pixels: twice the longer side of the picture.
    pub(super) max_deviation: f32,
}

impl Bounds {
    /// Those for a picture of this width and height in pixels.
    pub(crate) fn new(
        parameterization: Parameterization,
        channels: usize,
        [width, height]: [u32; 2],
    ) -> Self {
        let size = Vec2::new(width as f32, height as f32);
        let grid = CenterGrid::new(width, height);
        let margin = (8.0 + 0.05 * size).min(Vec2::splat(grid.margin() - MOST_ROUNDING));
        Self {
            parameterization,
            channels,
            center_ranges: [(-margin.x, size.x + margin.x), (-margin.y, size.y + margin.y)],
            max_deviation: 2.0 * size.max_element(),
        }
    }

    /// The components with all values clamped, so that the shape is valid.
    #[inline]
    pub(crate) fn clamped(self, mut components: Components) -> Components {
        let (shape, max) = (components.shape, self.max_deviation);
        components.shape = self.parameterization.clamped(shape, max);
        self.clamp_center_and_color(&mut components);
        components
    }

    /// Clamps everything but the shape.
    #[inline]
    pub(crate) fn clamp_center_and_color(self, components: &mut Components) {
        for (value, (low, high)) in components.center.iter_mut().zip(self.center_ranges) {
            *value = value.clamp(low, high);
        }
        components.color = components.color.map(|value| value.clamp(-MOST_COLOR, MOST_COLOR));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn centers_have_codes_even_where_a_gaussian_is_steep() {
        for side in [1, 8, 96, 128, 129, 200, 256, 257, 480, 512, 513, 768, 3000, 65_536_u32] {
            let grid = CenterGrid::new(side, 8);
            let bounds = Bounds::new(Parameterization::Cholesky, 1, [side, 8]);
            for (outermost, outwards) in [(-1e6, -0.9), (1e6, 0.9)] {
                let mut values = Components { center: [outermost; 2], ..Components::ZERO };
                bounds.clamp_center_and_color(&mut values);
                let rounded = values.center.map(|coordinate| coordinate + outwards);
                let coded = grid.center(grid.units(rounded));
                let is_near = |(a, b): (&f32, &f32)| (a - b).abs() < 0.01;
                assert!(rounded.iter().zip(&coded).all(is_near), "{side}: {rounded:?} {coded:?}");
            }
        }
    }
}
