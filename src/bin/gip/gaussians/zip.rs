//! ZIP archives: written without compression, and read with it.

use std::io::Read;

use anyhow::{Context, Result, bail};
use flate2::read::DeflateDecoder;

const LOCAL: u32 = 0x0403_4B50;
const CENTRAL: u32 = 0x0201_4B50;
const END: u32 = 0x0605_4B50;
/// Bytes of the record at the end, without its comment, which has at most 65535.
const END_LENGTH: usize = 22;
/// The first of January 1980: archives depend on their contents alone.
const DATE: u16 = 0x0021;
/// The version that has what is written.
const VERSION: u16 = 20;

/// An archive that is written.
#[derive(Debug, Default)]
pub(crate) struct Archive {
    bytes: Vec<u8>,
    directory: Vec<u8>,
    count: u16,
}

impl Archive {
    /// Adds a file. No archive of this tool reaches the limits of the format, 4 GiB and 65535 files.
    pub(crate) fn add(&mut self, name: &str, contents: &[u8]) {
        let (length, at) = (contents.len() as u32, self.bytes.len() as u32);
        let mut shared = Vec::new();
        // No flags, no compression, the time.
        for field in [VERSION, 0, 0, 0, DATE] {
            shared.extend(field.to_le_bytes());
        }
        for field in [crc32fast::hash(contents), length, length] {
            shared.extend(field.to_le_bytes());
        }
        shared.extend((name.len() as u16).to_le_bytes());
        shared.extend(0_u16.to_le_bytes());

        self.bytes.extend(LOCAL.to_le_bytes());
        self.bytes.extend(&shared);
        self.bytes.extend(name.as_bytes());
        self.bytes.extend(contents);

        self.directory.extend(CENTRAL.to_le_bytes());
        self.directory.extend(VERSION.to_le_bytes());
        self.directory.extend(&shared);
        // No comment, the first disk, no attributes.
        self.directory.extend([0; 10]);
        self.directory.extend(at.to_le_bytes());
        self.directory.extend(name.as_bytes());
        self.count += 1;
    }

    /// The archive.
    pub(crate) fn finish(self) -> Vec<u8> {
        let Self { mut bytes, directory, count } = self;
        let at = bytes.len() as u32;
        bytes.extend(&directory);
        bytes.extend(END.to_le_bytes());
        bytes.extend([0; 4]);
        bytes.extend([count, count].into_iter().flat_map(u16::to_le_bytes));
        bytes.extend((directory.len() as u32).to_le_bytes());
        bytes.extend(at.to_le_bytes());
        bytes.extend([0; 2]);
        bytes
    }
}

/// The wanted files of an archive with their names, which have at most so many bytes together.
pub(crate) fn read(
    archive: &[u8],
    most: u64,
    mut is_wanted: impl FnMut(&str) -> bool,
) -> Result<Vec<(String, Vec<u8>)>> {
    let end = (0..=archive.len().saturating_sub(END_LENGTH))
        .rev()
        .take(usize::from(u16::MAX) + 1)
        .find(|&at| u32_at(archive, at).is_ok_and(|signature| signature == END))
        .context("not a ZIP archive")?;
    let count = u16_at(archive, end + 10)?;
    let mut at = u32_at(archive, end + 16)? as usize;
    let mut rest = most;
    let mut files = Vec::new();
    for _ in 0..count {
        if u32_at(archive, at)? != CENTRAL {
            bail!("the directory of the ZIP archive is damaged");
        }
        let (flags, method) = (u16_at(archive, at + 8)?, u16_at(archive, at + 10)?);
        let (crc, compressed, length) =
            (u32_at(archive, at + 16)?, u32_at(archive, at + 20)?, u32_at(archive, at + 24)?);
        let [name, extra, comment] =
            [28, 30, 32].map(|field| u16_at(archive, at + field).map(usize::from));
        let (name, extra, comment) = (name?, extra?, comment?);
        let local = u32_at(archive, at + 42)? as usize;
        let name_bytes = slice(archive, at + 46, name)?;
        let name_text = String::from_utf8_lossy(name_bytes).into_owned();
        at += 46 + name + extra + comment;
        if !is_wanted(&name_text) {
            continue;
        }

        let context = || format!("{name_text} in the ZIP archive");
        if flags & 1 != 0 {
            bail!("{}: it is encrypted", context());
        }
        if u32_at(archive, local)? != LOCAL {
            bail!("{}: its header is damaged", context());
        }
        let [name, extra] = [26, 28].map(|field| u16_at(archive, local + field).map(usize::from));
        let data = slice(archive, local + 30 + name? + extra?, compressed as usize)?;
        if u64::from(length) > rest {
            bail!("{}: the archive has more than {most} bytes uncompressed", context());
        }
        rest -= u64::from(length);
        let contents = match method {
            0 => data.to_vec(),
            8 => {
                let mut contents = Vec::new();
                // One byte more than there may be tells that there are more.
                let mut decoder = DeflateDecoder::new(data).take(u64::from(length) + 1);
                decoder.read_to_end(&mut contents).with_context(context)?;
                contents
            }
            method => bail!("{}: compression method {method} is not read", context()),
        };
        if contents.len() != length as usize || crc32fast::hash(&contents) != crc {
            bail!("{}: it is damaged", context());
        }
        files.push((name_text, contents));
    }
    Ok(files)
}

fn slice(archive: &[u8], at: usize, length: usize) -> Result<&[u8]> {
    let end = at.checked_add(length).context("the ZIP archive is damaged")?;
    archive.get(at..end).context("the ZIP archive is truncated or damaged")
}

fn u16_at(archive: &[u8], at: usize) -> Result<u16> {
    Ok(u16::from_le_bytes(slice(archive, at, 2)?.try_into()?))
}

fn u32_at(archive: &[u8], at: usize) -> Result<u32> {
    Ok(u32::from_le_bytes(slice(archive, at, 4)?.try_into()?))
}
