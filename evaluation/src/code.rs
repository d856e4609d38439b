//! What of the product's source can change a result: a checksum of it.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use proc_macro2::{Delimiter, TokenStream, TokenTree};

/// Files and folders of the library that are not in what is measured here: the tool, parts with features of
/// their own, and what is for tests.
const LEFT_OUT: [&str; 5] = ["bin", "image.rs", "metadata", "testing.rs", "tests.rs"];

/// A checksum of the tokens of all `.rs` files of a folder and of the packages that they need, which
/// `lock`, a `Cargo.lock`, has under `package`. Comments, documentation, spaces and tests do not count.
pub(crate) fn checksum(folder: &Path, lock: &Path, package: &str) -> Result<u32> {
    let mut hasher = crc32fast::Hasher::new();
    let mut files = Vec::new();
    find(folder, &mut files)?;
    for path in files {
        let text = fs::read_to_string(&path)?;
        let tokens: TokenStream = text
            .parse()
            .map_err(|error| anyhow::anyhow!("{error}"))
            .with_context(|| format!("cannot read {}", path.display()))?;
        // A module is named by its path.
        hasher.update(path.strip_prefix(folder)?.to_string_lossy().as_bytes());
        hash(tokens, &mut hasher);
    }
    let lock = fs::read_to_string(lock).with_context(|| format!("no {}", lock.display()))?;
    hasher.update(packages(&lock, package).join("\n").as_bytes());
    Ok(hasher.finalize())
}

/// All sources of a folder but those of [`LEFT_OUT`], in the order of their names.
fn find(folder: &Path, files: &mut Vec<PathBuf>) -> Result<()> {
    let paths = fs::read_dir(folder).with_context(|| format!("no folder {}", folder.display()))?;
    let mut paths = paths.map(|entry| Ok(entry?.path())).collect::<Result<Vec<_>>>()?;
    paths.sort();
    for path in paths {
        if path.file_name().is_some_and(|name| LEFT_OUT.iter().any(|left_out| name == *left_out)) {
            continue;
        }
        if path.is_dir() {
            find(&path, files)?;
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            files.push(path);
        }
    }
    Ok(())
}

/// Hashes tokens but documentation and what is compiled for tests only.
fn hash(tokens: TokenStream, hasher: &mut crc32fast::Hasher) {
    let mut tokens = tokens.into_iter().peekable();
    while let Some(token) = tokens.next() {
        match token {
            TokenTree::Punct(punct) if punct.as_char() == '#' => {
                // `#![doc = ""]` is of what is around it.
                tokens.next_if(|next| matches!(next, TokenTree::Punct(p) if p.as_char() == '!'));
                let attribute = tokens.next().map(|token| token.to_string().replace(' ', ""));
                let attribute = attribute.unwrap_or_default();
                if attribute == "[cfg(test)]" {
                    let is_end = |token: &TokenTree| match token {
                        TokenTree::Group(group) => group.delimiter() == Delimiter::Brace,
                        TokenTree::Punct(punct) => punct.as_char() == ';',
                        _ => false,
                    };
                    tokens.by_ref().find(is_end);
                } else if !attribute.starts_with("[doc=") {
                    hasher.update(attribute.as_bytes());
                }
            }
            TokenTree::Group(group) => {
                let [open, close] = match group.delimiter() {
                    Delimiter::Brace => ["{", "}"],
                    Delimiter::Bracket => ["[", "]"],
                    Delimiter::Parenthesis => ["(", ")"],
                    Delimiter::None => [" ", " "],
                };
                hasher.update(open.as_bytes());
                hash(group.stream(), hasher);
                hasher.update(close.as_bytes());
            }
            token => {
                hasher.update(token.to_string().as_bytes());
                hasher.update(b" ");
            }
        }
    }
}

/// What a package of a `Cargo.lock` needs, directly or not: names and versions in the order of the file.
pub(crate) fn packages(lock: &str, package: &str) -> Vec<String> {
    let sections: Vec<&str> = lock.split("[[package]]\n").skip(1).collect();
    let value = |section: &str, field: &str| {
        let line = section.lines().find_map(|line| line.strip_prefix(&format!("{field} = \"")));
        line.map_or_else(String::new, |line| line.trim_end_matches('"').to_owned())
    };
    let names: Vec<[String; 2]> = sections
        .iter()
        .map(|section| ["name", "version"].map(|field| value(section, field)))
        .collect();
    let mut needed = vec![false; sections.len()];
    let mut open: Vec<usize> = (0..sections.len()).filter(|&i| names[i][0] == package).collect();
    let root = open.clone();
    while let Some(index) = open.pop() {
        let lines = sections[index].lines().filter_map(|line| line.strip_prefix(" \""));
        // `name`, or `name version` where several versions are there.
        for line in lines {
            let mut words = line.trim_end_matches(['"', ',']).split(' ');
            let (name, version) = (words.next(), words.next());
            for (other, [known, known_version]) in names.iter().enumerate() {
                let is_it = name == Some(known) && version.is_none_or(|v| v == known_version);
                if is_it && !needed[other] {
                    needed[other] = true;
                    open.push(other);
                }
            }
        }
    }
    let needed = (0..names.len()).filter(|index| needed[*index] && !root.contains(index));
    needed.map(|index| names[index].join(" ")).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::provenance::FOLDER;

    fn hash_of(source: &str) -> u32 {
        let mut hasher = crc32fast::Hasher::new();
        hash(source.parse().expect("it is Rust"), &mut hasher);
        hasher.finalize()
    }

    #[test]
    fn comments_and_tests_do_not_count() {
        let code = "pub fn a(b: u8) -> u8 { b + 1 }";
        let same = "//! About.\n\n/// The next one.\npub fn a(b: u8)\n    -> u8 {\n b /* not */ + 1 // why\n}\n\n\
                    #[cfg(test)]\n#[allow(x)]\nmod tests { fn b() {} }\n#[cfg(test)]\nmod more;";
        assert_eq!(hash_of(code), hash_of(same));
        for other in [
            "pub fn a(b: u8) -> u8 { b + 2 }",
            "#[inline] pub fn a(b: u8) -> u8 { b + 1 }",
            "pub fn a(b: u8) -> u8 { b + 1 } const C: &str = \"// c\";",
            "pub fn a(b: u8) -> u8 { (b + 1) }",
        ] {
            assert_ne!(hash_of(code), hash_of(other), "{other}");
        }
        assert_ne!(hash_of("#[cfg(test)] fn a() {} fn b() {}"), hash_of("#[cfg(test)] fn a() {}"));
    }

    #[test]
    fn what_is_needed_counts_with_its_version() {
        let lock = "version = 4\n\n[[package]]\nname = \"a\"\nversion = \"1.0.0\"\ndependencies = [\n \"b\",\n \"c \
                    2.0.0\",\n]\n\n[[package]]\nname = \"b\"\nversion = \"0.1.0\"\ndependencies = [\n \"d\",\n]\n\n\
                    [[package]]\nname = \"c\"\nversion = \"1.0.0\"\n\n[[package]]\nname = \"c\"\nversion = \
                    \"2.0.0\"\n\n[[package]]\nname = \"d\"\nversion = \"3.0.0\"\n\n[[package]]\nname = \"e\"\n\
                    version = \"4.0.0\"\n";
        assert_eq!(packages(lock, "a"), ["b 0.1.0", "c 2.0.0", "d 3.0.0"]);
        assert_eq!(packages(lock, "b"), ["d 3.0.0"]);
    }

    #[test]
    fn the_product_s_files_count_but_the_tool_does_not() {
        let source = Path::new(FOLDER).join("../src");
        let mut files = Vec::new();
        find(&source, &mut files).expect("it is a folder");
        let has = |name: &str| files.contains(&source.join(name));
        assert!(has("lib.rs") && has("encode/fit/pass.rs") && has("container/metadata.rs"));
        assert!(!has("bin/gip/main.rs") && !has("image.rs") && !has("encode/fit/pass/tests.rs"));
        assert!(!has("metadata/policy.rs") && !has("encode/testing.rs"));
        // What is left out of the root is not compiled here.
        let root = fs::read_to_string(source.join("lib.rs")).expect("text");
        for declaration in [
            "#[cfg(feature = \"image\")]\nmod image;",
            "#[cfg(feature = \"metadata\")]\nmod metadata;",
            "#[cfg(test)]\nmod testing;",
        ] {
            assert!(root.contains(declaration), "{declaration}");
        }
        let encoder = fs::read_to_string(source.join("encode/mod.rs")).expect("text");
        assert!(encoder.contains("#[cfg(test)]\nmod testing;"));
        let lock = fs::read_to_string(Path::new(FOLDER).join("Cargo.lock")).expect("text");
        let packages = packages(&lock, "image-gip").join(", ");
        assert!(packages.contains("fearless_simd ") && !packages.contains("clap"), "{packages}");
    }
}
