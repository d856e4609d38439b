//! The arguments of `gip batch`.

use std::path::PathBuf;

use super::encode::EncoderArgs;
use super::keep::Keep;
use super::limits::LimitArgs;
use super::values::{bounds, extension, number};

/// Encodes or decodes many files and whole folders, one picture per core.
///
/// Each INPUT is a file or a folder. A file becomes DIR/NAME.gip. Of a folder, every picture in it
/// and in its subfolders is taken, in the order of their names, and keeps its path below DIR:
/// `gip batch photos --out gips` makes gips/2024/a.gip of photos/2024/a.jpg. What is a picture is
/// told by the extension, and its format by the contents. Pictures of formats that are not read, such
/// as HEIC, AVIF and raw files of cameras, are named in a warning and in the manifest, and other files
/// are counted. Hidden files are left out, links to folders are not followed, and a folder that cannot
/// be read is a failure. Options of the encoder are those of `gip encode`.
///
/// In every folder of an INPUT, a file .gipignore may say what to leave out there and below, with
/// patterns as in .gitignore, where upper and lower case are the same. If it cannot be read, or has
/// a line that is no pattern, nothing is done.
///
/// If two results would get the same name, as those of a.png and a.jpg, or if a result would
/// replace an INPUT, nothing is done. Nor is it if a decoded picture would replace a file in a folder
/// of an INPUT, which may be an original, unless the --manifest says that an earlier run wrote it. A
/// picture that cannot be read is reported and skipped.
///
/// Every result gets its name when it is complete, and other existing files are replaced. After an
/// interruption of any kind, even a crash, the same command with --resume does the rest, and removes
/// temporary files that were left. If the disk is full, the run ends at once.
#[derive(Debug, clap::Args)]
#[command(
    allow_negative_numbers = true,
    after_help = "\
Examples:
  gip batch photos --out gips --manifest gips.jsonl      a whole folder
  gip batch photos --out gips --resume                   what is missing or old there
  gip batch photos --out gips --include '*.jpg' --exclude raw/
  gip batch gips --out back --decode --format webp
  gip batch gips --out thumbs --thumbnail 160 --format jpg

Exit status: 0 for success, 1 for failure, 2 for wrong usage, 3 if some files failed. After Ctrl-C or a \
SIGTERM, the run stops within milliseconds to seconds and ends by that signal (130 or 143 in a shell)."
)]
pub(crate) struct Batch {
    /// Files and folders.
    #[arg(required = true, value_name = "INPUT")]
    pub(crate) inputs: Vec<PathBuf>,
    /// The folder of the results; it is made if there is none.
    #[arg(long, value_name = "DIR")]
    pub(crate) out: PathBuf,
    /// Take only files that match GLOB, or any of several when given again: a pattern as in
    /// .gitignore, of the path below INPUT. Upper and lower case are the same.
    ///
    /// *.jpg takes all JPEG files, 2024/ what is in folders of that name, and /2024/*.jpg the JPEG
    /// files right in the folder 2024 of an INPUT.
    #[arg(long, value_name = "GLOB")]
    pub(crate) include: Vec<String>,
    /// Leave out files and folders that match GLOB, even if --include takes them; may be given again.
    #[arg(long, value_name = "GLOB")]
    pub(crate) exclude: Vec<String>,
    /// Number of pictures that are worked on at the same time, from 1 to 1024; each takes one thread
    /// [default: one per core].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub(crate) jobs: Option<u16>,
    /// Most megapixels that are worked on at the same time, from 0.001 to 1000000 [default: 16 for
    /// each job].
    ///
    /// A picture that would exceed them waits, and one that is larger by itself is worked on alone.
    /// Encoding takes about 16 bytes per pixel of gray with 8 bits, 22 of RGB, and 32 of RGB with
    /// alpha and 16 bits.
    #[arg(long, value_name = "MP", value_parser = |text: &str| number(text, 0.001, 1e6))]
    pub(crate) budget: Option<f64>,
    /// Skip files whose result is whole and newer than they are.
    ///
    /// A result is whole if it can be decoded. Options are not compared: to make results anew with
    /// other ones, leave --resume out. If both times are equal, the result is made again, but not with
    /// --preserve-times, which makes them equal.
    #[arg(long)]
    pub(crate) resume: bool,
    /// Write tar files of N pictures each, as WebDataset reads them, in place of a file per picture: DIR/000000.tar and so
    /// on, from 1 to 1000000.
    ///
    /// Pictures are in the order of the inputs. A member is named by the path below INPUT, in whose last part dots become
    /// underscores: 2024/a.gip. Pictures that cannot be read are left out of their shard. Each shard is made by one job,
    /// and with --resume only those are made that lack a picture or are older than one; if inputs were added or removed
    /// before others, these change their shard. A folder that has shards beyond the last one of this run is refused.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    pub(crate) shards: Option<u32>,
    /// Write a line of JSON for every file to FILE, or to standard output if it is `-`.
    ///
    /// Fields: input, output (null if there is none), status ("written", "skipped", "failed", or
    /// "ignored" of a picture in a format that is not read), input_bytes, width, height, bytes,
    /// gaussians (their number), psnr (in dB; 999 if infinite), quality (an estimate of SSIMULACRA2),
    /// both without texture, seconds (from reading to the encoded result), shortfall (null, or why the target was not met),
    /// warnings (an array of what of the input is lost, such as all frames but the first), error (null,
    /// or why there is no result). What is unknown or does not apply is null. In input and output, a
    /// byte that is not UTF-8 is U+FFFD and two hexadecimal digits, and so are the bytes of a U+FFFD in
    /// a name.
    ///
    /// Lines are written as files are finished, which is not the order of the inputs. An existing FILE
    /// is replaced, if it is a manifest. With --resume, lines of files that are skipped are kept, and so are those of files
    /// that this run does not know; an incomplete last line is dropped. So there is one line per file.
    /// If a file is skipped that has no line, it gets one with what its result tells.
    #[arg(long, value_name = "FILE")]
    pub(crate) manifest: Option<PathBuf>,
    /// Take what can be read of a file that is truncated or damaged, with a warning, instead of failing
    /// with it. `gip encode --help` says for which formats damage in the middle goes unnoticed.
    #[arg(long)]
    pub(crate) allow_partial: bool,
    #[command(flatten)]
    pub(crate) limits: LimitArgs,
    /// Decode .gip files; of a folder, only these are taken.
    #[arg(long, help_heading = "Decoding", group = "decoding",
          conflicts_with_all = EncoderArgs::IDS)]
    pub(crate) decode: bool,
    /// Decode .gip files to thumbnails that fit into SIZE: one number for both sides, or WxH.
    ///
    /// Pictures are not enlarged.
    #[arg(long, help_heading = "Decoding", value_name = "SIZE", value_parser = bounds,
          group = "decoding", conflicts_with_all = EncoderArgs::IDS)]
    pub(crate) thumbnail: Option<(u32, u32)>,
    /// The format of decoded pictures, as an extension: png, tif, webp, jpg, bmp, tga, qoi, gif, ico,
    /// ff, pgm, ppm, pnm or pam.
    #[arg(long, help_heading = "Decoding", value_name = "EXT", default_value = "png",
          requires = "decoding", value_parser = extension)]
    pub(crate) format: String,
    /// Leave out the texture of decoded pictures: the noise in place of sand, water or leaves.
    #[arg(long, help_heading = "Decoding", requires = "decoding")]
    pub(crate) no_texture: bool,
    #[command(flatten)]
    pub(crate) keep: Keep,
    #[command(flatten)]
    pub(crate) encoder: EncoderArgs,
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::{Args, Parser};

    #[derive(Debug, Parser)]
    struct Line {
        #[command(flatten)]
        batch: Batch,
    }

    fn parse(flags: &[&str]) -> Option<Batch> {
        let line = Line::try_parse_from([&["gip", "in", "--out", "out"], flags].concat());
        line.ok().map(|line| line.batch)
    }

    #[test]
    fn decoding_takes_no_options_of_the_encoder() {
        let options = EncoderArgs::augment_args(clap::Command::new("gip"));
        let values = ["50", "1", "300", "packed", "psnr"];
        for flags in [&["--decode"][..], &["--thumbnail", "64"]] {
            assert!(parse(flags).is_some());
            for option in options.get_arguments() {
                let name = format!("--{}", option.get_long().expect("all are options"));
                let value = values.into_iter().find(|value| parse(&[&name, value]).is_some());
                let value = value.unwrap_or_else(|| panic!("{name} takes none of these values"));
                assert!(parse(&[flags, &[&name, value]].concat()).is_none(), "{flags:?} {name}");
            }
            assert!(parse(&[flags, &["--format", "jpg"]].concat()).is_some());
        }
        assert!(parse(&["--format", "jpg"]).is_none());
        assert!(parse(&["--no-texture"]).is_none());
        assert!(parse(&["--decode", "--thumbnail", "64"]).is_none());
        assert!(parse(&["--decode", "--format", "gip"]).is_none());
    }

    #[test]
    fn inputs_and_a_folder_are_required() {
        assert!(Line::try_parse_from(["gip", "in"]).is_err());
        assert!(Line::try_parse_from(["gip", "--out", "out"]).is_err());
        assert_eq!(parse(&["more", "--thumbnail", "64"]).and_then(|b| b.thumbnail), Some((64, 64)));
    }
}
