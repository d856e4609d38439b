//! Draws a small landscape for who has no photograph at hand: soft sky, sun, hazy hills, a lake
//! with a reflection, grass, and a house and trees with hard edges.
//!
//!     cargo run --release --example draw_photo -- photo.png
//!
//! A file that exists already is left as it is. The picture is the same on every machine: it uses
//! no random numbers and no functions whose last bits differ between platforms.

use std::error::Error;
use std::path::Path;

use image::{Rgb, RgbImage};

const WIDTH: u32 = 384;
const HEIGHT: u32 = 256;
/// The row where lake and far shore meet.
const HORIZON: f32 = 168.0;

type Color = [f32; 3];

fn main() -> Result<(), Box<dyn Error>> {
    let output = std::env::args().nth(1).ok_or("usage: draw_photo OUTPUT.png")?;
    if Path::new(&output).exists() {
        println!("{output} exists and is left as it is");
        return Ok(());
    }
    let picture = RgbImage::from_fn(WIDTH, HEIGHT, |x, y| {
        // Four samples per pixel soften the edges as a lens would.
        let mut sum = [0.0; 3];
        for (dx, dy) in [(0.25, 0.25), (0.75, 0.25), (0.25, 0.75), (0.75, 0.75)] {
            let color = landscape(x as f32 + dx, y as f32 + dy);
            sum = std::array::from_fn(|c| sum[c] + color[c] / 4.0);
        }
        Rgb(sum.map(|value| (value.clamp(0.0, 1.0) * 255.0 + 0.5) as u8))
    });
    picture.save(&output)?;
    println!("{output}: {WIDTH}x{HEIGHT} pixels");
    Ok(())
}

/// The colour at a point, front to back.
fn landscape(x: f32, y: f32) -> Color {
    let meadow = 214.0 + 10.0 * fractal(x * 0.012, 7.0) - 0.04 * x;
    if let Some(color) = house(x, y) {
        color
    } else if let Some(color) = trees(x, y) {
        color
    } else if y > meadow {
        let blades = noise(x * 0.9 + y * 0.2, y * 0.35);
        let light = fractal(x * 0.03, y * 0.06);
        let near = (y - meadow) / 50.0;
        let color = mix([0.35, 0.47, 0.16], [0.16, 0.27, 0.08], near);
        mix(color, [0.62, 0.63, 0.25], 0.45 * blades * light)
    } else if y > HORIZON {
        // The lake mirrors what is above it, broken by ripples that grow towards the viewer.
        let depth = y - HORIZON;
        let ripple = noise(x * 0.05, depth * 0.9) - 0.5;
        let mirrored = distance(x + ripple * depth * 0.3, HORIZON - depth * (1.2 + 0.5 * ripple));
        mix(mirrored, [0.10, 0.20, 0.29], 0.25 + depth / 160.0)
    } else {
        distance(x, y)
    }
}

/// Hills and sky.
fn distance(x: f32, y: f32) -> Color {
    let near = 140.0 - 34.0 * fractal(x * 0.011 + 9.0, 3.0);
    let middle = 128.0 - 52.0 * fractal(x * 0.009 + 4.0, 1.0);
    let far = 112.0 - 60.0 * fractal(x * 0.007, 0.0);
    let woods = fractal(x * 0.14, y * 0.14);
    if y > near + 16.0 {
        mix([0.15, 0.24, 0.17], [0.28, 0.36, 0.20], woods)
    } else if y > middle + 14.0 {
        mix([0.30, 0.38, 0.38], [0.38, 0.45, 0.42], woods)
    } else if y > far + 8.0 {
        mix([0.50, 0.55, 0.62], [0.55, 0.60, 0.65], woods)
    } else {
        sky(x, y)
    }
}

fn sky(x: f32, y: f32) -> Color {
    let (dx, dy) = (x - 285.0, y - 62.0);
    let from_sun = (dx * dx + dy * dy).sqrt();
    let height = (y / 130.0).clamp(0.0, 1.0);
    let mut color = mix([0.27, 0.46, 0.75], [0.93, 0.80, 0.66], height * height);
    color = mix(color, [1.0, 0.90, 0.66], 0.8 / (1.0 + from_sun * from_sun / 900.0));
    let cloud = fractal(x * 0.013, y * 0.04 + 20.0);
    color = mix(color, [0.98, 0.95, 0.93], ((cloud - 0.5) * 3.0).clamp(0.0, 0.8));
    mix(color, [1.0, 0.98, 0.88], (14.0 - from_sun).clamp(0.0, 1.0))
}

/// A house with a roof, a door and four windows.
fn house(x: f32, y: f32) -> Option<Color> {
    let (x, y) = (x - 92.0, y - 212.0);
    let is_window =
        |left: f32, top: f32| (left..left + 8.0).contains(&x) && (top..top + 9.0).contains(&y);
    if (0.0..52.0).contains(&x) && (-34.0..0.0).contains(&y) {
        let bars = (x - 2.0).rem_euclid(12.0);
        Some(if (22.0..31.0).contains(&x) && y > -17.0 {
            [0.30, 0.17, 0.10]
        } else if [5.0, 38.0].iter().any(|&at| is_window(at, -28.0) || is_window(at, -14.0)) {
            if bars < 6.5 { [0.16, 0.20, 0.27] } else { [0.24, 0.30, 0.38] }
        } else {
            // Plaster, in the shade of the roof at the top.
            mix([0.88, 0.83, 0.74], [0.55, 0.50, 0.45], ((-30.0 - y) / 4.0).clamp(0.0, 1.0))
        })
    } else if (36.0..43.0).contains(&x) && (-64.0..-40.0).contains(&y) {
        Some([0.45, 0.28, 0.22])
    } else if (-58.0..-34.0).contains(&y) && (x - 26.0).abs() < 32.0 + (y + 34.0) * 0.9 {
        let tile = (y.rem_euclid(3.0) < 0.8) || (x + y).rem_euclid(5.0) < 0.7;
        Some(if tile { [0.42, 0.15, 0.11] } else { [0.60, 0.24, 0.16] })
    } else {
        None
    }
}

/// A row of firs: stacked triangles with frayed edges.
fn trees(x: f32, y: f32) -> Option<Color> {
    const FIRS: [(f32, f32, f32); 6] = [
        (24.0, 216.0, 74.0),
        (52.0, 213.0, 52.0),
        (176.0, 212.0, 46.0),
        (300.0, 206.0, 58.0),
        (330.0, 210.0, 88.0),
        (362.0, 208.0, 64.0),
    ];
    FIRS.iter().find_map(|&(foot_x, foot_y, height)| {
        let (dx, up) = (x - foot_x, (foot_y - y) / height);
        if (0.0..0.1).contains(&up) && dx.abs() < height * 0.025 {
            return Some([0.25, 0.17, 0.11]);
        }
        let layer = (up * 6.0).fract();
        let reach = height * (0.26 * (1.0 - up) + 0.05 * (1.0 - layer) * (1.0 - up));
        let frayed = reach * (0.75 + 0.5 * noise(x * 0.7, y * 0.9));
        ((0.08..1.0).contains(&up) && dx.abs() < frayed).then(|| {
            let light = (0.5 + dx / (2.0 * reach + 1.0)).clamp(0.0, 1.0);
            mix([0.05, 0.12, 0.09], [0.18, 0.30, 0.14], light * noise(x * 0.5, y * 0.5))
        })
    })
}

fn mix(from: Color, to: Color, share: f32) -> Color {
    let share = share.clamp(0.0, 1.0);
    std::array::from_fn(|c| from[c] + (to[c] - from[c]) * share)
}

/// Four octaves of [`noise`], in [0, 1].
fn fractal(x: f32, y: f32) -> f32 {
    (0..4)
        .map(|octave| {
            let frequency = (1 << octave) as f32;
            noise(x * frequency, y * frequency + 31.0 * octave as f32) / (2.0 * frequency)
        })
        .sum::<f32>()
        / 0.9375
}

/// Smooth noise in [0, 1] with one feature per unit.
fn noise(x: f32, y: f32) -> f32 {
    let (left, top) = (x.floor(), y.floor());
    let smooth = |t: f32| t * t * (3.0 - 2.0 * t);
    let (fx, fy) = (smooth(x - left), smooth(y - top));
    let at = |dx: i32, dy: i32| hash(left as i32 + dx, top as i32 + dy);
    let (upper, lower) =
        (at(0, 0) + (at(1, 0) - at(0, 0)) * fx, at(0, 1) + (at(1, 1) - at(0, 1)) * fx);
    upper + (lower - upper) * fy
}

/// A fixed value in [0, 1) for every point of the grid.
fn hash(x: i32, y: i32) -> f32 {
    let mut bits = (x as u32).wrapping_mul(0x9E37_79B1) ^ (y as u32).wrapping_mul(0x85EB_CA77);
    bits = (bits ^ (bits >> 15)).wrapping_mul(0x2C1B_3C6D);
    bits = (bits ^ (bits >> 12)).wrapping_mul(0x297A_2D39);
    ((bits ^ (bits >> 15)) >> 8) as f32 / 16_777_216.0
}
