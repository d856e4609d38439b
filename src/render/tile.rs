//! One tile of the output: the sums of its splats, which stay in registers (spec, sections 9.3 and
//! 9.4).

#[cfg(feature = "std")]
use fearless_simd::{Simd, dispatch, f32x8, f32x16, prelude::*};

#[cfg(feature = "std")]
use super::simd_kernel::{Exponential, Quartic, Weight};
use super::splat::Block;
#[cfg(feature = "std")]
use super::splat::Splat;
use super::tile_grid::{PAIR_WIDTH, TILE_HEIGHT, TILE_WIDTH};
use super::tile_lists::TileSplats;
use crate::kernel::Kernel;
use crate::simd::Backend;

/// Rows of a tile in a SIMD vector.
#[cfg(feature = "std")]
const VECTOR_ROWS: usize = 2;

/// One channel of two tiles side by side: height x width sums.
pub(crate) type PairPlane = [[f32; PAIR_WIDTH]; TILE_HEIGHT];

/// Rows of values, of which the first of each row are those of a tile.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TileTexture<'a> {
    pub(crate) values: &'a [f32],
    /// Values from one row to the next.
    pub(crate) stride: usize,
}

impl<'a> TileTexture<'a> {
    /// That of a tile which begins so many columns later.
    pub(crate) fn from(self, column: usize) -> Self {
        Self { values: &self.values[column..], ..self }
    }

    #[inline(always)]
    fn rows(self) -> impl Iterator<Item = &'a [f32; TILE_WIDTH]> {
        self.values.chunks(self.stride).map(|row| row.first_chunk().expect("a row of a tile"))
    }
}

/// A tile to render.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Tile<'a, const CHANNELS: usize> {
    /// Column and row of the first pixel in the whole output.
    pub(crate) origin: (u32, u32),
    /// The base colour.
    pub(crate) base: [f32; CHANNELS],
    /// What is added to the colours.
    pub(crate) texture: Option<TileTexture<'a>>,
    /// All splats of the band.
    pub(crate) blocks: &'a [Block],
    /// The splats that are added to this tile, in file order.
    pub(crate) splats: TileSplats<'a>,
    pub(crate) kernel: Kernel,
}

impl<const CHANNELS: usize> Tile<'_, CHANNELS> {
    /// The channels that texture is added to: gray, or red, green and blue. What is more is alpha.
    const COLORS: usize = if CHANNELS < 3 { 1 } else { 3 };

    /// Renders the tile into the first half (0) or the second half (1) of the planes of a pair.
    pub(crate) fn render(&self, backend: Backend, half: usize, planes: &mut [PairPlane; CHANNELS]) {
        let left = half * TILE_WIDTH;
        match (backend, self.kernel) {
            (Backend::Reference(_), _) => self.render_scalar(left, planes),
            #[cfg(feature = "std")]
            (Backend::Simd(level), Kernel::Exponential { cutoff }) => {
                let kernel = Exponential { cutoff };
                dispatch!(level, simd => self.render_simd(simd, kernel, left, planes));
            }
            #[cfg(feature = "std")]
            (Backend::Simd(level), Kernel::Quartic) => {
                dispatch!(level, simd => self.render_simd(simd, Quartic, left, planes));
            }
        }
    }

    fn render_scalar(&self, left: usize, planes: &mut [PairPlane; CHANNELS]) {
        for (plane, base) in planes.iter_mut().zip(self.base) {
            plane.iter_mut().for_each(|row| row[left..][..TILE_WIDTH].fill(base));
        }
        if let Some(texture) = self.texture {
            for plane in planes.iter_mut().take(Self::COLORS) {
                for (row, texture) in plane.iter_mut().zip(texture.rows()) {
                    for (sum, texture) in row[left..].iter_mut().zip(texture) {
                        *sum += texture;
                    }
                }
            }
        }
        for (block, lane) in self.splats {
            let splat = &self.blocks[block][lane];
            for row in 0..TILE_HEIGHT {
                for column in 0..TILE_WIDTH {
                    let px = (self.origin.0 as usize + column) as f32 + 0.5;
                    let py = (self.origin.1 as usize + row) as f32 + 0.5;
                    let weight = self.kernel.weight(splat.uv(px, py));
                    for (plane, color) in planes.iter_mut().zip(splat.color) {
                        plane[row][left + column] += color * weight;
                    }
                }
            }
        }
    }

    #[cfg(feature = "std")]
    #[inline(always)]
    fn render_simd<S: Simd, K: Weight>(
        &self,
        simd: S,
        kernel: K,
        left: usize,
        planes: &mut [PairPlane; CHANNELS],
    ) {
        // These and their sums with the origin are exact.
        const CENTERS: [f32; 8] = [0.5, 1.5, 2.5, 3.5, 4.5, 5.5, 6.5, 7.5];
        let centers = f32x8::load_array(simd, CENTERS);
        let px = centers + self.origin.0 as f32;
        let (px, py) = (px.combine(px), centers + self.origin.1 as f32);
        // They stay in registers if there are enough: loading and storing them would be half of the
        // work.
        let mut sums = [[f32x16::splat(simd, 0.0); TILE_HEIGHT / VECTOR_ROWS]; CHANNELS];
        for (sums, base) in sums.iter_mut().zip(self.base) {
            *sums = [f32x16::splat(simd, base); TILE_HEIGHT / VECTOR_ROWS];
        }
        if let Some(texture) = self.texture {
            let mut rows = texture.rows().map(
                #[inline(always)]
                |row| f32x8::load_array_ref(simd, row),
            );
            for row in 0..TILE_HEIGHT / VECTOR_ROWS {
                if let (Some(upper), Some(lower)) = (rows.next(), rows.next()) {
                    let texture = upper.combine(lower);
                    for sums in sums.iter_mut().take(Self::COLORS) {
                        sums[row] += texture;
                    }
                }
            }
        }
        let mut splats = self.splats;
        while let Some((block, lane)) = splats.next() {
            let first = &self.blocks[block][lane];
            if let Some((block, lane)) = splats.next() {
                let second = &self.blocks[block][lane];
                add_splats(simd, kernel, (px, py), [first, second], &mut sums);
            } else {
                add_splats(simd, kernel, (px, py), [first], &mut sums);
            }
        }
        for (sums, plane) in sums.iter().zip(planes) {
            for (sum, rows) in sums.iter().zip(plane.as_chunks_mut::<VECTOR_ROWS>().0) {
                let (upper, lower) = sum.split();
                upper.store_slice(&mut rows[0][left..][..TILE_WIDTH]);
                lower.store_slice(&mut rows[1][left..][..TILE_WIDTH]);
            }
        }
    }
}

/// Adds splats, one after the other in each pixel. With several in one call, sums that are not in
/// registers are loaded and stored less often.
#[cfg(feature = "std")]
#[inline(always)]
fn add_splats<S: Simd, K: Weight, const CHANNELS: usize, const SPLATS: usize>(
    simd: S,
    kernel: K,
    (px, py): (f32x16<S>, f32x8<S>),
    splats: [&Splat; SPLATS],
    sums: &mut [[f32x16<S>; TILE_HEIGHT / VECTOR_ROWS]; CHANNELS],
) {
    let (mut columns, mut slants) = ([px; SPLATS], [px; SPLATS]);
    let mut shifts = [[0.0; TILE_HEIGHT]; SPLATS];
    for (index, splat) in splats.iter().enumerate() {
        let dx = px - splat.x;
        columns[index] = kernel.column(simd, dx * splat.i11);
        slants[index] = dx * splat.w;
        shifts[index] = ((py - splat.y) * splat.i22).to_array();
    }
    for rows in 0..TILE_HEIGHT / VECTOR_ROWS {
        let mut weights = [px; SPLATS];
        for index in 0..SPLATS {
            let upper = f32x8::splat(simd, shifts[index][VECTOR_ROWS * rows]);
            let lower = f32x8::splat(simd, shifts[index][VECTOR_ROWS * rows + 1]);
            let v = slants[index] + upper.combine(lower);
            weights[index] = kernel.weight(simd, columns[index], v);
        }
        for (channel, sums) in sums.iter_mut().enumerate() {
            let mut sum = sums[rows];
            for (weight, splat) in weights.iter().zip(splats) {
                sum += *weight * splat.color[channel];
            }
            sums[rows] = sum;
        }
    }
}

#[cfg(all(test, feature = "std"))]
mod tests {
    use fearless_simd::Level;
    use proptest::prelude::*;

    use super::*;
    use crate::gaussian::Gaussian;
    use crate::render::splat::Splat;
    use crate::render::tile_grid::TILE_PIXELS;
    use crate::render::tile_lists::TileEntry;
    use crate::simd::LANES;
    use crate::testing::{config, simd_levels};

    /// The bits of all sums of a pair of tiles.
    fn rendered<const CHANNELS: usize>(
        backend: Backend,
        splats: &[Splat],
        origin: (u32, u32),
        kernel: Kernel,
    ) -> Vec<u32> {
        let blocks: Vec<Block> = (splats.chunks(LANES))
            .map(|splats| {
                let mut block = [Splat::NOWHERE; LANES];
                block[..splats.len()].copy_from_slice(splats);
                block
            })
            .collect();
        let entries: Vec<TileEntry> =
            (0..=blocks.len() as u32).map(|block| TileEntry { block, members: 0xffff }).collect();
        let splats = TileSplats::new(&entries);
        let base = [0.5; CHANNELS];
        let mut planes = [[[0.0; PAIR_WIDTH]; TILE_HEIGHT]; CHANNELS];
        let values = (0..PAIR_WIDTH * TILE_HEIGHT).map(|at| 0.7 - 0.021 * at as f32);
        let values: Vec<f32> = values.collect();
        let texture = TileTexture { values: &values[3..], stride: PAIR_WIDTH };
        for half in 0..2 {
            let tile = Tile {
                origin: (origin.0 + (half * TILE_WIDTH) as u32, origin.1),
                base,
                texture: (half == 1).then_some(texture),
                blocks: &blocks,
                splats,
                kernel,
            };
            tile.render(backend, half, &mut planes);
        }
        planes.into_iter().flatten().flatten().map(f32::to_bits).collect()
    }

    /// That a SIMD level gives the bits of the scalar code.
    fn check_level<const CHANNELS: usize>(
        (name, level): (&str, Level),
        splats: &[Splat],
        origin: (u32, u32),
        kernel: Kernel,
    ) -> Result<(), TestCaseError> {
        let [expected, found] = [Backend::reference(), Backend::Simd(level)]
            .map(|backend| rendered::<CHANNELS>(backend, splats, origin, kernel));
        prop_assert_eq!(expected.len(), 2 * CHANNELS * TILE_PIXELS);
        prop_assert_eq!(found, expected, "{}, {:?}", name, kernel);
        Ok(())
    }

    /// Numbers from 2^low to 2^high. All powers of two are equally likely.
    fn magnitude(low: i32, high: i32) -> impl Strategy<Value = f32> {
        (low..high, 1.0_f32..2.0).prop_map(|(exponent, part)| part * 2_f32.powi(exponent))
    }

    /// Splats of all shapes, the first pixel of a pair of tiles, and a cut-off. The pair may be far
    /// from the picture's corner.
    fn tiles() -> impl Strategy<Value = (Vec<Splat>, (u32, u32), f32)> {
        let shapes = prop::collection::vec(
            (
                [-40.0_f32..80.0, -40.0_f32..80.0],
                magnitude(-12, 24),
                prop_oneof![Just(0.0), magnitude(-12, 24), magnitude(-12, 24).prop_map(|v| -v)],
                magnitude(-12, 24),
                prop::array::uniform4(-100.0_f32..100.0),
            ),
            1..12,
        );
        let cutoff = prop_oneof![Just(64.0_f32), Just(11.082_527), 0.001_f32..64.0];
        let far = prop_oneof![Just(0_u32), Just(1 << 22)];
        (shapes, (0_u32..4, 0_u32..8), far, cutoff).prop_map(|(shapes, tile, far, cutoff)| {
            let splats = shapes.into_iter().filter_map(|([x, y], l11, l21, l22, color)| {
                let center = [x + far as f32, y];
                let gaussian = Gaussian { center, cholesky: [l11, l21, l22], color };
                Splat::new(&gaussian)
            });
            let origin = (far + tile.0 * TILE_WIDTH as u32, tile.1 * TILE_HEIGHT as u32);
            (splats.collect(), origin, cutoff)
        })
    }

    proptest! {
        #![proptest_config(config(200))]

        #[test]
        fn every_simd_level_gives_the_bits_of_the_scalar_code((splats, origin, cutoff) in tiles()) {
            for level in simd_levels() {
                for kernel in [Kernel::Quartic, Kernel::Exponential { cutoff }] {
                    check_level::<1>(level, &splats, origin, kernel)?;
                    check_level::<2>(level, &splats, origin, kernel)?;
                    check_level::<3>(level, &splats, origin, kernel)?;
                    check_level::<4>(level, &splats, origin, kernel)?;
                }
            }
        }
    }
}
