//! The bounds of layers, with which a decoder skips those that do not show in a region (spec,
//! section 5.6).

use alloc::vec::Vec;

use crate::container::Header;
#[cfg(feature = "encode")]
use crate::gaussian::Gaussian;
#[cfg(feature = "std")]
use crate::{math, render::view::View};

/// Cells that a picture is divided into along each side.
#[cfg(any(feature = "encode", feature = "std"))]
const CELLS: f32 = 256.0;
/// How far rounding may move the edge of an ellipse when it is rendered, in parts of where it is and of its reach.
#[cfg(feature = "encode")]
const ROUNDING: f32 = 1.0 / 262_144.0;
/// Margin of the bounds in output pixels, which is more than the rounding of ellipses and bounds.
#[cfg(feature = "std")]
const MARGIN: f32 = 8.0;

/// The cells of a picture in which a layer shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct LayerBounds {
    /// First column and first row.
    first: [u8; 2],
    /// Last column and last row, which are included.
    last: [u8; 2],
}

impl LayerBounds {
    /// Bytes of the entry of a layer.
    const LENGTH: usize = 4;

    /// Reads the payload of `bNDS`: the bounds of all layers that the header declares.
    ///
    /// # Errors
    /// When it breaks a rule: which one.
    pub(crate) fn parse_all(payload: &[u8], header: &Header) -> Result<Vec<Self>, &'static str> {
        if payload.len() != usize::from(header.layers) * Self::LENGTH {
            return Err("has not as many entries as there are layers");
        }
        let (entries, _) = payload.as_chunks::<{ Self::LENGTH }>();
        if entries.iter().any(|[left, top, right, bottom]| left > right || top > bottom) {
            return Err("a layer ends before it begins");
        }
        let read = |&[left, top, right, bottom]: &[u8; Self::LENGTH]| Self {
            first: [left, top],
            last: [right, bottom],
        };
        Ok(entries.iter().map(read).collect())
    }

    /// The bounds of a layer with these Gaussians.
    #[cfg(feature = "encode")]
    pub(crate) fn of(gaussians: impl Iterator<Item = Gaussian>, header: &Header) -> Self {
        let sides = [header.width, header.height].map(|side| side as f32);
        let radius = header.kernel.cutoff().sqrt();
        let mut bounds = Self { first: [u8::MAX; 2], last: [0; 2] };
        for Gaussian { center, cholesky: [l11, l21, l22], .. } in gaussians {
            for (axis, reach) in [l11, l21.hypot(l22)].into_iter().enumerate() {
                // The cast clamps: outside of the picture, the nearest cell counts.
                let cell = |at: f32| (at * CELLS / sides[axis]) as u8;
                let reach = reach * radius;
                let reach = reach + ROUNDING * (center[axis].abs() + reach);
                bounds.first[axis] = bounds.first[axis].min(cell(center[axis] - reach));
                bounds.last[axis] = bounds.last[axis].max(cell(center[axis] + reach));
            }
        }
        bounds
    }

    /// The entry of the layer in `bNDS`.
    #[cfg(feature = "encode")]
    pub(crate) fn to_entry(self) -> [u8; Self::LENGTH] {
        let ([left, top], [right, bottom]) = (self.first, self.last);
        [left, top, right, bottom]
    }

    /// Whether the layer may show in the region of a view.
    #[cfg(feature = "std")]
    pub(crate) fn may_show_in(&self, view: &View, header: &Header) -> bool {
        let region = [(view.region.x, view.region.width), (view.region.y, view.region.height)];
        let sides = [header.width, header.height].map(|side| side as f32);
        (0..2).all(|axis| {
            let (start, length) = region[axis];
            let (start, end) = (start as f32, (start + length) as f32);
            let cell = sides[axis] * view.scale[axis] / CELLS;
            // Minification widens Gaussians.
            let margin = MARGIN + math::sqrt(header.kernel.cutoff() * view.filter[axis]);
            let first = f32::from(self.first[axis]) * cell - margin;
            let last = (f32::from(self.last[axis]) + 1.0) * cell + margin;
            // A cell at the edge of the picture also stands for all that lies beyond it.
            (self.first[axis] == 0 || first < end) && (self.last[axis] == u8::MAX || last > start)
        })
    }
}

#[cfg(all(test, feature = "encode"))]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::color::{ColorModel, SampleDepth};
    use crate::container::Coding;
    use crate::gaussian::Parameterization;
    use crate::kernel::Kernel;
    use crate::limits::Limits;
    use crate::region::Region;
    use crate::render::{Picture, RenderOptions};
    use crate::testing::config;

    fn header(width: u32, height: u32) -> Header {
        Header {
            version: 1,
            coding: Coding::Entropy,
            width,
            height,
            color: ColorModel::Gray,
            depth: SampleDepth::Eight,
            gaussians: 1,
            layers: 1,
            kernel: Kernel::Quartic,
            parameterization: Parameterization::Cholesky,
            base_color: [0; 4],
        }
    }

    proptest! {
        #![proptest_config(config(2000))]

        #[test]
        fn a_gaussian_adds_nothing_outside_of_its_bounds(
            center in [-20.0_f32..120.0, -20.0_f32..100.0],
            cholesky in [0.05_f32..20.0, -20.0_f32..20.0, 0.05_f32..20.0],
            size in (1_u32..400, 1_u32..400),
            corner in (0_u32..400, 0_u32..400),
            side in 1_u32..9,
        ) {
            let header = header(100, 80);
            let gaussian = Gaussian { center, cholesky, color: [1.0; 4] };
            let bounds = LayerBounds::of([gaussian].into_iter(), &header);
            let (x, y) = (corner.0 % size.0, corner.1 % size.1);
            let (width, height) = (side.min(size.0 - x), side.min(size.1 - y));
            let region = Region { x, y, width, height };
            let options = RenderOptions::new().with_size(size.0, size.1).with_region(region);
            let limits = Limits::none();
            let view = options.view(&header, &limits).expect("the region is inside");
            if !bounds.may_show_in(&view, &header) {
                let mut planes = vec![7.0; (width * height) as usize];
                let picture = Picture::new(&header, core::slice::from_ref(&gaussian), &limits, 0);
                picture.render_planes(&options, &mut planes).expect("there are no limits");
                prop_assert!(planes.iter().all(|&value| value == 0.0), "{:?}", planes);
            }
        }
    }

    /// The left edge of a huge Gaussian, far enlarged: rounding moves it by more than a hundred pixels.
    #[test]
    fn what_rounding_adds_to_an_edge_is_within_the_bounds() {
        const SIDE: u32 = 1 << 17;
        let header = header(1000, 1000);
        let center = [16_597_549.0, 500.0];
        let gaussian = Gaussian { center, cholesky: [8_298_372.0, 0.0, 9.0], color: [6e4; 4] };
        let bounds = LayerBounds::of([gaussian].into_iter(), &header);
        let edge = ((f64::from(center[0]) - 2.0 * 8_298_372.0) * f64::from(SIDE) / 1000.0) as u32;
        let limits = Limits::none();
        let picture = Picture::new(&header, core::slice::from_ref(&gaussian), &limits, 0);
        let mut beyond = 0;
        for x in edge - 400..edge {
            let region = Region { x, y: SIDE / 2, width: 1, height: 1 };
            let options = RenderOptions::new().with_size(SIDE, SIDE).with_region(region);
            let mut sample = [0.0];
            picture.render_planes(&options, &mut sample).expect("there are no limits");
            if sample != [0.0] {
                let view = options.view(&header, &limits).expect("the region is inside");
                assert!(bounds.may_show_in(&view, &header), "{x}");
                beyond = beyond.max(edge - x);
            }
        }
        assert!(beyond > 100, "{beyond}");
    }

    #[test]
    fn bounds_end_at_the_nearest_cells() {
        let header = header(256, 512);
        let gaussian =
            Gaussian { center: [20.5, 101.0], cholesky: [1.0, 0.0, 2.0], color: [1.0; 4] };
        let bounds = LayerBounds::of([gaussian].into_iter(), &header);
        assert_eq!(bounds.to_entry(), [18, 48, 22, 52]);
        let entries = LayerBounds::parse_all(&bounds.to_entry(), &header);
        assert_eq!(entries.expect("one layer"), [bounds]);
        // Columns 18 to 22 and rows 96 to 105 of pixels, and a margin of 8.
        for (x, y, shows) in [(9, 100, false), (10, 100, true), (30, 100, true), (31, 100, false)]
            .into_iter()
            .chain([(20, 87, false), (20, 88, true), (20, 113, true), (20, 114, false)])
        {
            let options = RenderOptions::new().with_region(Region { x, y, width: 1, height: 1 });
            let view = options.view(&header, &Limits::none()).expect("it is inside");
            assert_eq!(bounds.may_show_in(&view, &header), shows, "{x}, {y}");
        }
    }
}
