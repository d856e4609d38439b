//! Placeholders as they look.

use anyhow::Result;
use image::RgbImage;

use super::codecs::{self, BUDGETS, Codec, Placeholder, Placeholders};
use crate::bench::Bench;
use crate::canvas::{Canvas, LINE};
use crate::parallel;
use crate::pictures::TestPicture;

/// How many pictures are shown, of those that are at least as wide as high.
const PICTURES: usize = 6;
const QUICK_PICTURES: usize = 1;
/// They are side by side.
const COLUMNS: u32 = 2;
const GAP: u32 = 4;
const BYTES: usize = 300_000;
const NAME: &str = "sheet-placeholders.jpg";

/// All placeholders of a picture, side by side: a row for each budget.
struct Block {
    name: String,
    original: RgbImage,
    /// Those of each codec.
    placeholders: Vec<Placeholders>,
}

pub(super) fn make(bench: &mut Bench) -> Result<String> {
    let wide = |picture: &&TestPicture| picture.width >= picture.height;
    let wide: Vec<TestPicture> = bench.pictures.iter().filter(wide).cloned().collect();
    let count = if bench.quick { QUICK_PICTURES } else { PICTURES }.min(wide.len());
    let shown: Vec<_> = (0..count).map(|index| &wide[index * wide.len() / count]).collect();
    let scratch = bench.path("");
    let (workers, _) = bench.workers()?;
    let blocks = parallel::map(workers, &shown, |worker, picture| {
        let of_codec = |codec: Codec| codec.placeholders(worker, &scratch, picture);
        let placeholders = Codec::ALL.into_iter().map(of_codec).collect::<Result<_>>()?;
        let (name, original) = (picture.name.clone(), codecs::original(picture));
        Ok(Block { name, original, placeholders })
    })?;
    draw(&blocks).save_jpeg(&bench.path(NAME), BYTES)?;
    Ok(format!(
        "\n![Placeholders of {count} pictures, with the bytes and the SSIMULACRA2 of each]({NAME})\n"
    ))
}

fn draw(blocks: &[Block]) -> Canvas {
    let side = |of: fn(&RgbImage) -> u32| {
        blocks.iter().map(|block| of(&block.original)).max().unwrap_or(0)
    };
    let tile = (side(RgbImage::width) + GAP, LINE + side(RgbImage::height) + GAP);
    // The original, and the codecs.
    let width = (1 + Codec::ALL.len() as u32) * tile.0 + 3 * GAP;
    let height = LINE + BUDGETS.len() as u32 * tile.1 + 3 * GAP;
    let rows = (blocks.len() as u32).div_ceil(COLUMNS);
    let mut canvas = Canvas::new(COLUMNS * width, rows * height);
    for (index, block) in (0..).zip(blocks) {
        let corner = (index % COLUMNS * width + GAP, index / COLUMNS * height + GAP);
        draw_block(&mut canvas, block, corner, tile);
    }
    canvas
}

/// Draws a block, of which each tile takes so many columns and rows, with its caption and a gap.
fn draw_block(canvas: &mut Canvas, block: &Block, (left, top): (u32, u32), tile: (u32, u32)) {
    canvas.write(&block.name, (left, top));
    canvas.paste(&block.original, (left, top + 2 * LINE));
    for (column, (codec, of_codec)) in (1..).zip(Codec::ALL.iter().zip(&block.placeholders)) {
        let x = left + column * tile.0;
        canvas.write(codec.name(), (x, top));
        for (row, placeholder) in (0..).zip(of_codec) {
            let y = top + LINE + row * tile.1;
            if let Some(Placeholder { bytes, ssimulacra2, shown, .. }) = placeholder {
                canvas.write(&format!("{bytes} B: {ssimulacra2:.1}"), (x, y));
                canvas.paste(shown, (x, y + LINE));
            } else {
                canvas.write("none", (x, y));
            }
        }
    }
}
