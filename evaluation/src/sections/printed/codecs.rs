//! Codecs of which there are only figures that the paper prints, beside ours at no higher rate.

use anyhow::Result;
use image_gip::{Target, Threads};

use super::paper::{self, PrintedCodec};
use crate::bench::Bench;
use crate::comparison::{Better, NamedFigures, better_than};
use crate::gip;
use crate::pictures::TestPicture;
use crate::table::{Table, mean};

/// The bits per pixel that our encoder is asked for, with rows of at least that.
const RATES: [(f64, [PrintedCodec; 3]); 2] = [(0.15, paper::LOW_RATES), (0.98, paper::HIGH_RATES)];
const QUICK_PICTURES: usize = 1;

/// What tables compare, in the order of the figures after the rate.
const CRITERIA: [(&str, Better); 4] = [
    ("PSNR", Better::Higher),
    ("MS-SSIM", Better::Higher),
    ("encoding time", Better::Lower),
    ("decodings per second", Better::Higher),
];

pub(super) fn measure(bench: &Bench) -> Result<String> {
    let mut store = bench.store(
        "published-codecs.csv",
        ["target_bpp", "image"],
        ["bpp", "psnr", "msssim", "encode_seconds", "decodings_per_second"],
    )?;
    let pictures = bench.sample(if bench.quick { QUICK_PICTURES } else { usize::MAX });
    let mut text = format!(
        "\n### Published codecs\n\nCompared with: COIN, a network that is fitted to the picture, \
         and the paper's codecs of Gaussians. Rows marked as printed are from the paper's table 2: \
         all of Kodak, on an NVIDIA A30. Ours is the encoder at effort {}, tuned for PSNR and asked for a \
         rate that is not above theirs; times are those of whole files on this machine, with all threads. \
         PSNR is that of the float rendering. Means; {}.\n",
        gip::EFFORT,
        bench.pictures_used(pictures.len()),
    );
    for (rate, others) in RATES {
        let mut rows = Vec::new();
        for picture in &pictures {
            let key = [&rate.to_string(), picture.name.as_str()];
            rows.push(store.get(&bench.product, key, || encode(rate, picture))?);
        }
        let ours = std::array::from_fn(|column| {
            mean(rows.iter().map(|row| row[column])).unwrap_or(f64::NAN)
        });
        let mut table =
            Table::new(&["codec", "bpp", "PSNR in dB", "MS-SSIM", "encoding s", "decodings/s"]);
        let mut compared: Vec<NamedFigures> = Vec::new();
        let others = others.map(|other| (format!("*{}*", other.codec), other.figures));
        for (name, figures) in [(gip::PSNR_NAME.to_owned(), ours)].into_iter().chain(others) {
            let [rate, psnr, ms_ssim, seconds, decodings] = figures;
            table.row(&[
                name.clone(),
                format!("{rate:.2}"),
                format!("{psnr:.2}"),
                format!("{ms_ssim:.4}"),
                format!("{seconds:.1}"),
                format!("{decodings:.0}"),
            ]);
            compared.push((name, figures[1..].to_vec()));
        }
        text.push_str(&table.finish());
        text.push_str(&better_than(&CRITERIA, &compared[0], &compared[1..]));
    }
    Ok(text)
}

/// Bits per pixel, PSNR of the float rendering, MS-SSIM, encoding seconds, decodings per second.
fn encode(rate: f64, picture: &TestPicture) -> Result<[f64; 5]> {
    let encoder = gip::psnr_encoder(gip::EFFORT).with_target(Target::BitsPerPixel(rate));
    let measured = gip::encode(encoder, picture, Threads::Pool)?;
    Ok([
        picture.rate(measured.bytes),
        measured.report.psnr_float,
        measured.distortion.ms_ssim,
        measured.report.seconds,
        1.0 / gip::decode_seconds(&measured.file, Threads::Pool)?,
    ])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_printed_rate_is_below_ours() {
        for (rate, others) in RATES {
            assert!(others.iter().all(|other| other.figures[0] >= rate), "{rate}");
        }
    }
}
