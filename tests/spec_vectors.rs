//! The test vectors of the specification: `spec/vectors` holds what this builds, byte for byte,
//! and every way to decode it gives the pixels that `index.tsv` lists.
//!
//! `BLESS=1 cargo test --test spec_vectors` writes the folder again.

#[path = "vectors/broken.rs"]
mod broken;
mod common;
#[path = "vectors/entropy.rs"]
mod entropy;
#[path = "vectors/metadata.rs"]
mod metadata;
#[path = "vectors/sound.rs"]
mod sound;
#[path = "vectors/sums.rs"]
mod sums;
#[path = "vectors/texture.rs"]
mod texture;

use core::fmt::Write as _;
use std::fs;
use std::path::Path;

use common::oracle::{self, Request};
use common::{File, Header, crc32, decode, decode_pieces, of_chunks, render};
use image_gip::{ChunkType, ColorModel, DecodeError, Limits, Region, RenderOptions, Threads};

const FOLDER: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/spec/vectors");

/// One file of the folder.
#[derive(Clone)]
struct Vector {
    name: &'static str,
    shows: &'static str,
    bytes: Vec<u8>,
    /// The structure behind the bytes, for the oracle; `None` for a file that breaks a rule.
    file: Option<File>,
    /// Further ways to render it.
    requests: Vec<Rendering>,
}

#[derive(Clone, Copy)]
enum Rendering {
    Whole,
    Size(u32, u32),
    Region(u32, u32, u32, u32),
    SizeAndRegion((u32, u32), (u32, u32, u32, u32)),
    Prefix(u32),
    Color(ColorModel),
    /// Without texture.
    Plain,
}

impl Rendering {
    fn name(self) -> String {
        match self {
            Self::Whole => "whole".into(),
            Self::Size(w, h) => format!("size {w}x{h}"),
            Self::Region(x, y, w, h) => format!("region {w}x{h} at {x},{y}"),
            Self::SizeAndRegion((sw, sh), (x, y, w, h)) => {
                format!("size {sw}x{sh}, region {w}x{h} at {x},{y}")
            }
            Self::Prefix(count) => format!("first {count}"),
            Self::Color(color) => format!("as {color:?}"),
            Self::Plain => "without texture".into(),
        }
    }

    fn options(self) -> RenderOptions {
        let options = RenderOptions::new();
        let region = |(x, y, width, height)| Region { x, y, width, height };
        match self {
            Self::Whole => options,
            Self::Size(w, h) => options.with_size(w, h),
            Self::Region(x, y, w, h) => options.with_region(region((x, y, w, h))),
            Self::SizeAndRegion((w, h), part) => options.with_size(w, h).with_region(region(part)),
            Self::Prefix(count) => options.with_prefix(count),
            Self::Color(color) => options.with_color(color),
            Self::Plain => options.with_texture(false),
        }
    }

    /// The same for the oracle, which does not widen colour models.
    fn request(self, file: &File) -> Option<Request> {
        let mut request = Request::whole(file);
        match self {
            Self::Whole => {}
            Self::Size(w, h) => request = Request::at(w, h),
            Self::Region(x, y, w, h) => request.region = (x, y, w, h),
            Self::SizeAndRegion(size, region) => {
                (request.size, request.region) = (size, region);
            }
            Self::Prefix(count) => request.prefix = count as usize,
            Self::Plain => request.texture = false,
            Self::Color(_) => return None,
        }
        Some(request)
    }
}

impl Vector {
    fn valid(name: &'static str, shows: &'static str, file: File) -> Self {
        let bytes = file.bytes();
        Self { name, shows, bytes, file: Some(file), requests: vec![Rendering::Whole] }
    }

    /// A valid file whose chunks are not just those of `file`.
    fn valid_chunks(
        name: &'static str,
        shows: &'static str,
        file: File,
        chunks: &[Vec<u8>],
    ) -> Self {
        Self { bytes: of_chunks(chunks), ..Self::valid(name, shows, file) }
    }

    /// A file with chunks that break a rule and are skipped, so that it gives the picture of `file`.
    fn skipping(name: &'static str, shows: &'static str, file: File, bytes: Vec<u8>) -> Self {
        Self { bytes, ..Self::valid(name, shows, file) }
    }

    fn invalid(name: &'static str, shows: &'static str, bytes: Vec<u8>) -> Self {
        Self { name, shows, bytes, file: None, requests: Vec::new() }
    }

    fn also(mut self, requests: &[Rendering]) -> Self {
        self.requests.extend(requests);
        self
    }
}

fn header(color: u8, width: u32, height: u32) -> Header {
    let mut base = [0; 4];
    base[..=usize::from(color)].fill(0x8080);
    Header { color, width, height, base, ..Header::default() }
}

/// The letters of a type, without what the crate says that they stand for.
fn letters(chunk: ChunkType) -> String {
    chunk.to_string().split(' ').next().unwrap_or_default().into()
}

/// All ways to decode the file; they must agree. The lines of the index that belong to it.
fn lines(vector: &Vector) -> String {
    let Vector { name, shows, bytes, file, requests } = vector;
    let (decoder, result) = decode(bytes);
    let (by_bytes, by_bytes_result) = decode_pieces(bytes.chunks(1), Limits::default());
    let mut lines = String::new();
    let Some(file) = file else {
        let error = result.expect_err(name);
        let other = by_bytes_result.expect_err(name);
        assert_eq!(error.to_string(), other.to_string(), "{name}");
        let kept = decoder.gaussians().len();
        assert_eq!(by_bytes.gaussians().len(), kept, "{name}");
        let what = match error {
            DecodeError::Signature => "signature".into(),
            DecodeError::Malformed { chunk, .. } => format!("malformed {}", letters(chunk)),
            DecodeError::Unsupported { chunk, .. } => format!("unsupported {}", letters(chunk)),
            DecodeError::UnexpectedEnd { chunk: Some(chunk) } => {
                format!("unexpected end {}", letters(chunk))
            }
            DecodeError::UnexpectedEnd { chunk: None } => "unexpected end".into(),
            error => panic!("{name}: {error}"),
        };
        writeln!(lines, "{name}.gip\terror\t{what}; {kept} kept\t{shows}").expect("a string");
        return lines;
    };
    result.expect(name);
    by_bytes_result.expect(name);
    assert_eq!(decoder.skipped(), by_bytes.skipped(), "{name}");
    let skipped = decoder.skipped().iter().map(|skipped| letters(skipped.chunk));
    let skipped = skipped.collect::<Vec<_>>().join(" ");
    assert_eq!(name.starts_with("skip-"), !skipped.is_empty(), "{name}: {skipped}");
    for request in requests {
        let crc = render(&decoder, &request.options());
        for reference in [false, true] {
            for threads in [Threads::One, Threads::Pool] {
                let options = request.options().with_reference(reference).with_threads(threads);
                let found = render(&by_bytes, &options);
                assert_eq!(found, crc, "{name}, {}: reference {reference}", request.name());
            }
        }
        if let Some(request) = request.request(file) {
            let depth = file.header.depth;
            let samples = oracle::samples(&oracle::render(file, &request), depth);
            let bytes = samples.into_iter().flat_map(|sample| match depth {
                8 => vec![sample as u8],
                _ => sample.to_be_bytes().to_vec(),
            });
            assert_eq!(crc32(&bytes.collect::<Vec<_>>()), crc, "{name}: the oracle disagrees");
        }
        // What the file is there for stands in its first line alone.
        let shows = if lines.is_empty() { shows } else { "" };
        writeln!(lines, "{name}.gip\t{}\t{crc:08x}\t{shows}", request.name()).expect("a string");
    }
    if !skipped.is_empty() {
        writeln!(lines, "{name}.gip\tskips\t{skipped}\t").expect("a string");
    }
    lines
}

#[test]
fn the_folder_holds_what_the_specification_describes() {
    let folder = Path::new(FOLDER);
    let vectors = [
        sound::valid(),
        metadata::valid(),
        sums::valid(),
        entropy::valid(),
        texture::valid(),
        broken::invalid(),
        metadata::skipping(),
        entropy::invalid(),
        texture::invalid(),
    ];
    let vectors = vectors.into_iter().flatten().collect::<Vec<Vector>>();
    let mut index = String::from("file\trendering\tresult\tshows\n");
    for vector in &vectors {
        assert_eq!(vector.name.starts_with('x'), vector.file.is_none(), "{}", vector.name);
        index.push_str(&lines(vector));
    }
    let path = |vector: &Vector| folder.join(format!("{}.gip", vector.name));
    if std::env::var_os("BLESS").is_some() {
        for vector in &vectors {
            fs::write(path(vector), &vector.bytes).expect("writable");
        }
        fs::write(folder.join("index.tsv"), &index).expect("writable");
    }
    for vector in &vectors {
        let stored = fs::read(path(vector)).expect(vector.name);
        assert!(stored == vector.bytes, "{}.gip differs from what the test builds", vector.name);
    }
    let stored = fs::read_to_string(folder.join("index.tsv")).expect("the index");
    for (stored, built) in stored.lines().zip(index.lines()) {
        assert_eq!(stored, built, "index.tsv is out of date");
    }
    assert_eq!(stored.lines().count(), index.lines().count());
    let names = |entry: fs::DirEntry| entry.file_name().into_string().expect("ASCII");
    let mut found: Vec<String> = fs::read_dir(folder)
        .expect("the folder")
        .map(|entry| names(entry.expect("an entry")))
        .collect();
    let mut expected: Vec<String> =
        vectors.iter().map(|vector| format!("{}.gip", vector.name)).collect();
    expected.extend(["README.md".into(), "index.tsv".into()]);
    found.sort_unstable();
    expected.sort_unstable();
    assert_eq!(found, expected);
}
