//! Established codecs, run by a Python program in a virtual environment that is set up here.

use std::fs;
use std::io::{BufRead, BufReader, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};
use std::slice;

use anyhow::{Context, Result, bail, ensure};

use crate::pictures::TestPicture;
use crate::provenance::FOLDER;
use crate::python;

/// A codec with the settings to sweep.
#[derive(Debug)]
pub(crate) struct Baseline {
    /// What the worker calls it.
    pub(crate) id: &'static str,
    pub(crate) name: &'static str,
    /// From small files to large ones: from 0.1 bits per pixel, or the least that the codec can
    /// write, to 2 bits per pixel on all but the smoothest pictures, in steps of less than twice
    /// the size.
    pub(crate) settings: &'static [&'static str],
}

/// The baselines, in the order of tables.
pub(crate) const BASELINES: [Baseline; 7] = [
    Baseline {
        id: "jpeg420prog",
        name: "JPEG",
        settings: &["1", "7", "16", "30", "58", "80", "90", "96", "100"],
    },
    Baseline {
        id: "jpegli",
        name: "jpegli",
        settings: &["1", "14", "30", "50", "70", "84", "92", "97", "100"],
    },
    Baseline {
        id: "jp2",
        name: "JPEG 2000",
        settings: &["0.1", "0.2", "0.42", "0.75", "1.0", "1.5", "2.0"],
    },
    Baseline {
        id: "webp_m6",
        name: "WebP",
        settings: &["0", "6", "15", "32", "56", "78", "90", "97", "100"],
    },
    Baseline { id: "avif420_s6", name: "AVIF", settings: &AVIF_SETTINGS },
    Baseline { id: "avif420_s6_psnr", name: "AVIF tune=psnr", settings: &AVIF_SETTINGS },
    Baseline { id: "jxl_e7", name: "JPEG XL", settings: &JXL_DISTANCES },
];

/// 100 would be without loss, which has no tuning.
const AVIF_SETTINGS: [&str; 9] = ["1", "20", "35", "50", "60", "70", "82", "94", "99"];
/// From distance 20 on libjxl halves the resolution.
const JXL_DISTANCES: [&str; 9] = ["25", "14", "8.5", "5", "3", "1.75", "1", "0.5", "0.2"];
const HEIC_SETTINGS: [&str; 9] = ["1", "12", "20", "28", "36", "45", "55", "68", "85"];
/// Fewer, for it takes its time.
const BEST_AVIF_SETTINGS: [&str; 6] = ["5", "30", "52", "72", "93", "99"];

/// More codecs for the sections about rates alone.
const RIVALS: [Baseline; 4] = [
    Baseline { id: "avif420_s6_ssim2", name: "AVIF tune=ssimulacra2", settings: &AVIF_SETTINGS },
    Baseline { id: "jxl_e9", name: "JPEG XL effort 9", settings: &JXL_DISTANCES },
    Baseline { id: "heic", name: "HEIC", settings: &HEIC_SETTINGS },
    Baseline { id: "avif_svt", name: "AVIF by SVT-AV1", settings: &AVIF_SETTINGS },
];

/// The best that AVIF can do, with two tunings.
pub(crate) const BEST_AVIF: [Baseline; 2] = [
    Baseline { id: "avif444_s2", name: "AVIF at its best", settings: &BEST_AVIF_SETTINGS },
    Baseline { id: "avif444_s2_ssim2", name: "AVIF at its best", settings: &BEST_AVIF_SETTINGS },
];

/// What the sections about rates compare with, each with all of its tunings; the slowest is the last.
pub(crate) fn rivals() -> impl Iterator<Item = &'static [Baseline]> {
    let others = BASELINES.iter().chain(&RIVALS).map(slice::from_ref);
    others.chain([&BEST_AVIF[..]])
}

/// AVIF at its slowest. It takes up to half a minute for a picture of Kodak's, so it is for small
/// ones.
pub(crate) const SLOWEST_AVIF: Baseline =
    Baseline { id: "avif444_s0", name: "AVIF speed 0, 4:4:4", settings: &BEST_AVIF_SETTINGS };

/// JPEG as cameras write it: larger than progressive files, and faster to decode.
pub(crate) const SEQUENTIAL_JPEG: Baseline =
    Baseline { id: "jpeg420", name: "JPEG, sequential", settings: BASELINES[0].settings };

/// What the names of the baselines stand for.
pub(crate) const DESCRIPTION: &str = "JPEG is 4:2:0, progressive, with optimised Huffman tables; \
jpegli is Google's modern encoder of JPEG, 4:2:0, with progressive scans by MozJPEG; JPEG 2000 is \
OpenJPEG's 9/7 wavelet with its colour transform, in a .jp2; WebP is libwebp's method 6; AVIF is \
aom at speed 6, 4:2:0, with libavif's default tuning (tune=iq, for perceived quality) and with \
tune=psnr; JPEG XL is libjxl's effort 7, tuned for perceived quality; from \
distance 20 on it halves the resolution.";

/// The same of those that are no baselines.
pub(crate) const RIVALS_DESCRIPTION: &str = "AVIF tune=ssimulacra2 is the same with that tuning; \
AVIF by SVT-AV1 is that encoder's preset 4 for still pictures with its tuning for images (tune=iq), \
4:2:0 of 10 bits; AVIF at its best is aom at speed 2 in 4:4:4, on each picture with the tuning that is \
best by the metric in question, iq or ssimulacra2 (speed 0 takes more than three times as long for \
files that are hardly smaller); JPEG XL effort 9 is the same at that effort; HEIC is x265's preset \
veryslow, 4:2:0.";

/// A picture encoded and decoded by a baseline.
#[derive(Clone, Debug)]
pub(crate) struct RoundTrip {
    pub(crate) bytes: f64,
    /// The samples that were decoded.
    pub(crate) decoded: Vec<u8>,
    pub(crate) encode_seconds: f64,
    pub(crate) decode_seconds: f64,
}

/// The running Python program.
#[derive(Debug)]
pub(crate) struct Worker {
    child: Child,
    requests: ChildStdin,
    answers: BufReader<ChildStdout>,
    /// Where it leaves decoded samples.
    decoded: PathBuf,
    pub(crate) versions: Vec<String>,
}

impl Worker {
    /// Installs what is missing, and starts. `scratch` is a folder for passing files; `index` tells
    /// this worker from others with the same folder.
    pub(crate) fn start(scratch: &Path, index: usize) -> Result<Self> {
        let packages = Path::new(FOLDER).join("baselines/requirements.txt");
        let python = python::environment("baselines", &packages, None)?;
        let mut child = Command::new(python)
            .arg(Path::new(FOLDER).join("baselines/worker.py"))
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .context("cannot start the baselines")?;
        let requests = child.stdin.take().context("the worker has no input")?;
        let answers = BufReader::new(child.stdout.take().context("the worker has no output")?);
        let decoded = std::path::absolute(scratch.join(format!("decoded-{index}.rgb")))?;
        let mut worker = Self { child, requests, answers, decoded, versions: Vec::new() };
        loop {
            let line = worker.line()?;
            if line.is_empty() {
                return Ok(worker);
            }
            worker.versions.push(line);
        }
    }

    /// Encodes and decodes a picture with so many threads; `None` for all. Times are medians over
    /// so many encodings and decodings.
    pub(crate) fn round_trip(
        &mut self,
        codec: &str,
        setting: &str,
        picture: &TestPicture,
        threads: Option<usize>,
        [encodings, decodings]: [u32; 2],
    ) -> Result<RoundTrip> {
        let (source, decoded) = (picture.path.display(), self.decoded.display());
        let threads = threads.unwrap_or(0);
        let repeats = format!("{encodings}\t{decodings}");
        writeln!(self.requests, "{codec}\t{setting}\t{threads}\t{repeats}\t{source}\t{decoded}")?;
        let answer = self.line()?;
        let numbers: Vec<f64> =
            answer.split('\t').map(str::parse).collect::<Result<_, _>>().context(answer.clone())?;
        let [bytes, encode_seconds, decode_seconds] = numbers[..] else {
            bail!("the worker answered `{answer}`");
        };
        let decoded = fs::read(&self.decoded)?;
        Ok(RoundTrip { bytes, decoded, encode_seconds, decode_seconds })
    }

    /// The median time in seconds of decoding the last file so many times more.
    pub(crate) fn decode_again(&mut self, decodings: usize) -> Result<f64> {
        writeln!(self.requests, "again\t{decodings}")?;
        let answer = self.line()?;
        answer.parse().context(answer)
    }

    fn line(&mut self) -> Result<String> {
        let mut line = String::new();
        let length = self.answers.read_line(&mut line)?;
        ensure!(length > 0, "the worker stopped; its last words are above");
        Ok(line.trim_end().to_owned())
    }
}

impl Drop for Worker {
    fn drop(&mut self) {
        // Without waiting for a picture that it may be working on.
        let _ = self.child.kill();
        let _ = self.child.wait();
        let _ = fs::remove_file(&self.decoded);
    }
}
