//! Tar files, as WebDataset lays out pictures: a member per picture, named by its key and its format.

use std::io::{self, Read, Write};

use anyhow::{Context, Result, bail};

/// Bytes of a block, in whole numbers of which everything is stored.
const BLOCK: usize = 512;
/// Most bytes of a name in a header; a longer one has a record of its own before it.
const MOST_OF_NAME: usize = 100;
/// Where a header has its checksum, which counts as spaces in itself.
const CHECKSUM: core::ops::Range<usize> = 148..156;

/// Writes a tar file, whose bytes depend on its members alone: their owner and time are 0.
pub(super) struct TarWriter<W>(W);

impl<W: Write> TarWriter<W> {
    pub(super) fn new(file: W) -> Self {
        Self(file)
    }

    pub(super) fn add(&mut self, name: &str, bytes: &[u8]) -> io::Result<()> {
        if name.len() > MOST_OF_NAME || !name.is_ascii() {
            let record = path_record(name);
            self.member("pax", b'x', record.as_bytes())?;
        }
        let mut end = name.len().min(MOST_OF_NAME);
        while !name.is_char_boundary(end) {
            end -= 1;
        }
        self.member(&name[..end], b'0', bytes)
    }

    pub(super) fn finish(mut self) -> io::Result<W> {
        self.0.write_all(&[0; 2 * BLOCK])?;
        self.0.flush()?;
        Ok(self.0)
    }

    fn member(&mut self, name: &str, kind: u8, bytes: &[u8]) -> io::Result<()> {
        self.0.write_all(&header(name, kind, bytes.len()))?;
        self.0.write_all(bytes)?;
        let rest = bytes.len().next_multiple_of(BLOCK) - bytes.len();
        self.0.write_all(&[0; BLOCK][..rest])
    }
}

/// The record of a path in an extended header (POSIX, pax): it begins with its own length.
fn path_record(name: &str) -> String {
    let rest = format!(" path={name}\n");
    let mut length = rest.len();
    while length != rest.len() + length.to_string().len() {
        length = rest.len() + length.to_string().len();
    }
    format!("{length}{rest}")
}

fn header(name: &str, kind: u8, size: usize) -> [u8; BLOCK] {
    let mut header = [0; BLOCK];
    let mut put =
        |at: usize, text: &str| header[at..][..text.len()].copy_from_slice(text.as_bytes());
    put(0, name);
    put(100, "0000644\0");
    put(108, "0000000\0");
    put(116, "0000000\0");
    put(124, &format!("{size:011o}\0"));
    put(136, "00000000000\0");
    put(CHECKSUM.start, "        ");
    put(257, "ustar\x0000");
    header[156] = kind;
    let sum: u32 = header.iter().copied().map(u32::from).sum();
    let text = format!("{sum:06o}\0 ");
    header[CHECKSUM].copy_from_slice(text.as_bytes());
    header
}

/// The names and sizes of the members of a tar file that [`TarWriter`] has written.
///
/// # Errors
/// When the file has another layout, or is not whole.
pub(super) fn members(mut file: impl Read) -> Result<Vec<(String, u64)>> {
    let (mut found, mut path) = (Vec::new(), None);
    loop {
        let mut header = [0; BLOCK];
        file.read_exact(&mut header)?;
        if header == [0; BLOCK] {
            return Ok(found);
        }
        let text = |range: core::ops::Range<usize>| {
            let field = &header[range];
            let end = field.iter().position(|&byte| byte == 0).unwrap_or(field.len());
            str::from_utf8(&field[..end]).context("a field of a tar file is not UTF-8")
        };
        let size = u64::from_str_radix(text(124..136)?, 8).context("a tar file of another kind")?;
        let blocks = size.next_multiple_of(BLOCK as u64);
        if header[156] == b'x' {
            let mut record = Vec::new();
            file.by_ref().take(blocks).read_to_end(&mut record)?;
            let record = String::from_utf8(record)?;
            let name = record.split_once(" path=").and_then(|(_, rest)| rest.split_once('\n'));
            path = Some(name.context("a record of a tar file that is no path")?.0.to_owned());
            continue;
        }
        let name = text(0..MOST_OF_NAME)?.to_owned();
        found.push((path.take().unwrap_or(name), size));
        if io::copy(&mut file.by_ref().take(blocks), &mut io::sink())? < blocks {
            bail!("a tar file that is not whole");
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::process::Command;

    fn tar() -> (Vec<u8>, Vec<(String, u64)>) {
        let long = format!("{}/a.gip", "folder/".repeat(20));
        let accents = format!("{}é.gip", "x".repeat(99));
        let mut writer = TarWriter::new(Vec::new());
        let mut expected = Vec::new();
        for (name, size) in [("a.gip", 0), ("2024/b.gip", 512), (&long, 513), (&accents, 9)] {
            writer.add(name, &vec![7; size]).expect("in memory");
            expected.push((name.to_owned(), size as u64));
        }
        (writer.finish().expect("in memory"), expected)
    }

    #[test]
    fn members_come_back() {
        let (file, expected) = tar();
        assert_eq!(file.len() % BLOCK, 0);
        assert_eq!(members(&file[..]).expect("it is whole"), expected);
        assert!(members(&file[..file.len() - 2 * BLOCK]).is_err(), "the end is missing");
        assert!(members(&file[..1000]).is_err());
        assert!(members(&[7; 2 * BLOCK][..]).is_err());
    }

    #[test]
    #[cfg(unix)]
    fn other_programs_read_them() {
        let (file, expected) = tar();
        let room = tempfile::tempdir().expect("a place for temporary files");
        let path = room.path().join("a.tar");
        std::fs::write(&path, file).expect("writable");
        let mut command = Command::new("tar");
        let listing = command.arg("-C").arg(room.path()).arg("-xf").arg(&path).status();
        assert!(listing.expect("there is tar").success());
        for (name, size) in expected {
            let member = std::fs::metadata(room.path().join(&name)).expect("it was extracted");
            assert_eq!(member.len(), size, "{name}");
        }
    }
}
