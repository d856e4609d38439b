//! The manual pages and the completions of shells, which packages ship: `packaging/man` and
//! `packaging/completions` are what the definitions of the arguments say. `BLESS=1` rewrites them.

use std::collections::BTreeMap;
use std::env;
use std::fs;
use std::path::Path;

use clap::{Command, CommandFactory};
use clap_complete::Shell;
use clap_mangen::Man;

use super::Args;

/// When this version is released, as packaging/debian/changelog says.
const DATE: &str = "2026-10-01";

/// The manual pages by their names: of the tool, and of each of its commands.
fn pages() -> BTreeMap<String, Vec<u8>> {
    let mut tool = Args::command().disable_help_subcommand(true);
    tool.build();
    let commands = tool.get_subcommands();
    let source = format!("gip {}", env!("CARGO_PKG_VERSION"));
    let mut pages = BTreeMap::new();
    let named = commands.map(|command| (format!("gip-{}", command.get_name()), command.clone()));
    for (name, command) in named.chain([("gip".into(), tool.clone())]) {
        let mut page = Vec::new();
        let man = Man::new(command.display_name(name.clone()));
        man.date(DATE).source(&source).render(&mut page).expect("in memory");
        let page = readable(&String::from_utf8(page).expect("UTF-8"));
        pages.insert(format!("{name}.1"), page.into_bytes());
    }
    pages
}

/// A page without what programs that show it warn of, and with examples that stay in their lines.
fn readable(page: &str) -> String {
    let page = page.replace("\n.br\n\n.br\n", "\n.sp\n");
    let (options, notes) = page.split_once("\n.SH EXTRA\n").unwrap_or((&page, ""));
    let mut readable = options.to_owned();
    if !notes.is_empty() {
        readable += "\n.SH EXTRA\n";
    }
    for line in notes.lines() {
        readable += &match line.strip_prefix("  ").map(|example| example.split_once("  ")) {
            Some(Some((command, text))) => format!(".TP\n{command}\n{}\n", text.trim_start()),
            Some(None) => format!(".PP\n{}\n", line.trim_start()),
            None if line.is_empty() => ".PP\n".into(),
            None => format!("{line}\n"),
        };
    }
    readable
}

/// The completions by their names, which are those that the shells expect.
fn completions() -> BTreeMap<String, Vec<u8>> {
    let shells = [Shell::Bash, Shell::Elvish, Shell::Fish, Shell::PowerShell, Shell::Zsh];
    let written = |shell: Shell| {
        let (mut command, mut script): (Command, Vec<u8>) = (Args::command(), Vec::new());
        clap_complete::generate(shell, &mut command, "gip", &mut script);
        let name = match shell {
            Shell::Bash => "gip.bash",
            Shell::Elvish => "gip.elv",
            Shell::Fish => "gip.fish",
            Shell::PowerShell => "_gip.ps1",
            _ => "_gip",
        };
        (name.to_owned(), script)
    };
    shells.map(written).into()
}

/// The files of a folder, whose lines end as on Unix.
fn files(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let entries = fs::read_dir(folder).unwrap_or_else(|error| panic!("{folder:?}: {error}"));
    let read = |entry: std::io::Result<fs::DirEntry>| {
        let entry = entry.expect("readable");
        let content = fs::read_to_string(entry.path()).expect("text").replace("\r\n", "\n");
        (entry.file_name().into_string().expect("UTF-8"), content.into_bytes())
    };
    entries.map(read).collect()
}

#[test]
fn pages_and_completions_are_current() {
    for (name, made) in [("man", pages()), ("completions", completions())] {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("packaging").join(name);
        if env::var_os("BLESS").is_some() {
            let _ = fs::remove_dir_all(&folder);
            fs::create_dir_all(&folder).expect("writable");
            for (name, content) in &made {
                fs::write(folder.join(name), content).expect("writable");
            }
        }
        let kept = files(&folder);
        assert!(made.keys().eq(kept.keys()), "{:?} in packaging/{name}", kept.keys());
        for (file, content) in made {
            assert!(content == kept[&file], "packaging/{name}/{file} is old; BLESS=1 renews it");
        }
    }
}
