//! SVG: a radial gradient for every channel of every Gaussian, added up by `plus-lighter`.

use core::fmt::Write;

use image_gip::{DecodeError, Gaussian, Header, Kernel, LimitKind, Limits, Picture, RenderOptions};

use super::model::Spots;

/// Parts of the radius, between which gradients are linear.
const PARTS: u32 = 64;
/// Colours of channels that have no others in the way.
const COLORS: [&str; 4] = ["#f00", "#0f0", "#00f", "#fff"];
/// The class of all colours at once.
const WHITE: usize = 3;
/// An opacity below half a step of 16 bits shows nowhere.
const LEAST_OPACITY: f64 = 1.0 / 131_072.0;
/// About how many bytes a circle takes.
const CIRCLE: f64 = 128.0;

/// The picture. Colours and alpha are sums of their own; alpha is a mask.
pub(crate) fn write(spots: &Spots, limits: &Limits) -> Result<String, DecodeError> {
    let header = &spots.header;
    let channels = header.color.channels();
    let colors = channels - usize::from(header.color.has_alpha());
    let (width, height) = (header.width, header.height);
    let mut out = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" \
         viewBox=\"0 0 {width} {height}\">\n<style>circle,.p{{mix-blend-mode:plus-lighter}}\
         .i{{fill:#fff;mix-blend-mode:difference}}.g{{isolation:isolate}}"
    );
    for (class, _) in COLORS.iter().enumerate() {
        let _ = write!(out, ".c{class}{{fill:url(#c{class})}}");
    }
    out.push_str("</style>\n<defs>\n");
    for (class, color) in COLORS.iter().enumerate() {
        gradient(&mut out, class, color, header.kernel);
    }
    let of_colors: Vec<_> =
        (0..colors).map(|channel| (channel, if colors == 1 { WHITE } else { channel })).collect();
    let picture = layers(&mut out, spots, &of_colors, "f", limits)?;
    if header.color.has_alpha() {
        let alpha = layers(&mut out, spots, &[(colors, WHITE)], "m", limits)?;
        let _ = write!(
            out,
            "<mask id=\"a\" maskUnits=\"userSpaceOnUse\" x=\"0\" y=\"0\" width=\"{width}\" height=\"{height}\">\n{alpha}</mask>\n"
        );
    }
    out.push_str("</defs>\n");
    let mask = if header.color.has_alpha() { " mask=\"url(#a)\"" } else { "" };
    let _ = write!(out, "<g{mask}>\n{picture}</g>\n</svg>\n");
    Ok(out)
}

/// The gradient of a colour: the weights of the kernel as opacities.
fn gradient(out: &mut String, class: usize, color: &str, kernel: Kernel) {
    let radius = kernel.cutoff().sqrt();
    let _ = writeln!(
        out,
        "<radialGradient id=\"c{class}\" gradientUnits=\"userSpaceOnUse\" cx=\"0\" cy=\"0\" r=\"{radius}\">"
    );
    for part in 0..=PARTS {
        let offset = f64::from(part) / f64::from(PARTS);
        let q = offset * offset * f64::from(kernel.cutoff());
        let weight = match kernel {
            Kernel::Exponential { .. } => (-q / 2.0).exp(),
            _ => (1.0 - q / 4.0).powi(2),
        };
        let _ = write!(
            out,
            "<stop offset=\"{offset}\" stop-color=\"{color}\" stop-opacity=\"{weight:.5}\"/>"
        );
    }
    out.push_str("\n</radialGradient>\n");
}

/// The sum of some channels, each drawn with the gradient of a class. Colours that are added are clamped at
/// full, so all are divided by the largest sum of what is added, and a filter, which goes to `defs`, multiplies
/// them again. What is to be taken away is added to the inverted picture.
fn layers(
    defs: &mut String,
    spots: &Spots,
    channels: &[(usize, usize)],
    filter: &str,
    limits: &Limits,
) -> Result<String, DecodeError> {
    let (width, height) = (spots.header.width, spots.header.height);
    let slope = largest_sum(spots, channels, limits)?;
    check_length(spots, channels, slope, limits)?;
    let size = format!("width=\"{width}\" height=\"{height}\"");
    let mut out = String::from("<g class=\"g\"");
    if slope > 1.0 {
        let _ = write!(out, " filter=\"url(#{filter})\"");
        let _ = writeln!(
            defs,
            "<filter id=\"{filter}\" filterUnits=\"userSpaceOnUse\" x=\"0\" y=\"0\" {size} \
             color-interpolation-filters=\"sRGB\"><feComponentTransfer><feFuncR type=\"linear\" slope=\"{slope}\"/>\
             <feFuncG type=\"linear\" slope=\"{slope}\"/><feFuncB type=\"linear\" slope=\"{slope}\"/>\
             </feComponentTransfer></filter>"
        );
    }
    let _ = writeln!(out, "><rect {size}/>");
    for &(channel, class) in channels {
        let opacity = f64::from(spots.header.base_color[channel]) / 65535.0 / slope;
        let color = COLORS[class];
        let _ = writeln!(
            out,
            "<rect class=\"p\" {size} fill=\"{color}\" fill-opacity=\"{opacity:.6}\"/>"
        );
    }
    let invert = format!("<rect class=\"i\" {size}/>\n");
    for sign in [1.0, -1.0] {
        for gaussian in &spots.gaussians {
            for &(channel, class) in channels {
                let amplitude = f64::from(gaussian.color[channel]) * sign / slope;
                circles(&mut out, gaussian, amplitude, class, spots.header.kernel);
            }
        }
        out.push_str(&invert);
    }
    out.push_str("</g>\n");
    Ok(out)
}

/// Draws a channel of a Gaussian as often as its amplitude takes.
fn circles(out: &mut String, gaussian: &Gaussian, amplitude: f64, class: usize, kernel: Kernel) {
    let mut rest = amplitude;
    let radius = kernel.cutoff().sqrt();
    let ([x, y], [l11, l21, l22]) = (gaussian.center, gaussian.cholesky);
    while rest >= LEAST_OPACITY {
        let opacity = rest.min(1.0);
        rest -= opacity;
        let _ = writeln!(
            out,
            "<circle class=\"c{class}\" r=\"{radius}\" transform=\"matrix({l11:.4} {l21:.4} 0 {l22:.4} {x:.3} {y:.3})\" \
             fill-opacity=\"{opacity:.5}\"/>"
        );
    }
}

/// Refuses what takes more memory than is allowed: an amplitude of thousands takes thousands of circles.
fn check_length(
    spots: &Spots,
    channels: &[(usize, usize)],
    slope: f64,
    limits: &Limits,
) -> Result<(), DecodeError> {
    let amplitudes = spots
        .gaussians
        .iter()
        .flat_map(|gaussian| channels.iter().map(|&(channel, _)| gaussian.color[channel]));
    let opacities = amplitudes.map(|amplitude| f64::from(amplitude.abs()) / slope);
    let circles: f64 = opacities.filter(|sum| *sum >= LEAST_OPACITY).map(f64::ceil).sum();
    let wanted = (circles * CIRCLE) as u64;
    if wanted > limits.max_memory {
        return Err(DecodeError::Limit {
            kind: LimitKind::Memory,
            wanted,
            allowed: limits.max_memory,
        });
    }
    Ok(())
}

/// The largest sum of base colour and positive amplitudes, at least 1.
fn largest_sum(
    spots: &Spots,
    channels: &[(usize, usize)],
    limits: &Limits,
) -> Result<f64, DecodeError> {
    let positive = |gaussian: &Gaussian| Gaussian {
        color: gaussian.color.map(|amplitude| amplitude.max(0.0)),
        ..*gaussian
    };
    let gaussians: Vec<Gaussian> = spots.gaussians.iter().map(positive).collect();
    let header: &Header = &spots.header;
    let picture = Picture::from_gaussians(header, &gaussians, limits);
    let picture = picture.expect("they are those of a file, without those that are not drawn");
    let options = RenderOptions::new();
    let mut planes = vec![0.0; picture.output_len(&options)?];
    picture.render_planes(&options, &mut planes)?;
    let pixels = planes.len() / header.color.channels();
    let of_channel = |&(channel, _): &(usize, usize)| &planes[channel * pixels..][..pixels];
    let sums = channels.iter().flat_map(of_channel).copied();
    Ok(f64::from(sums.fold(1.0, f32::max)))
}
