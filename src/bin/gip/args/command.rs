//! The commands of the tool.

use clap::{Parser, Subcommand};

use super::batch::Batch;
use super::decode::Decode;
use super::encode::Encode;
use super::gaussians::{Export, Import};
use super::inspect::{Compare, Info};
use super::prefix::Prefix;
use super::transform::Transform;

/// Encodes, decodes, inspects and compares .gip files: pictures made of 2D Gaussians.
#[derive(Debug, Parser)]
#[command(
    name = "gip",
    version,
    arg_required_else_help = false,
    after_help = "\
Examples:
  gip encode photo.jpg photo.gip                     a good quality
  gip encode photo.png small.gip --bytes 20000       a file of 20,000 bytes
  gip decode photo.gip photo.png                     back to pixels
  gip decode photo.gip thumb.png --fit 160           a thumbnail, rendered at that size
  gip batch photos --out gips                        a folder, one picture per core
  gip info photo.gip                                 what the file contains
  gip prefix photo.gip 500 placeholder.gip           its first layers, in 500 bytes at most
  gip transform photo.gip turned.gip --rotate 90     turned, without encoding it again
  gip compare photo.png photo.gip                    how much they differ
  gip export photo.gip photo.npz                     its Gaussians, as arrays of NumPy

In place of any file, `-` is standard input or standard output, but not as an input of `gip batch`.
Exit status: 0 for success, 1 for failure, 2 for wrong usage, 3 if some files of `gip batch` or some of \
several files of `gip info` failed."
)]
pub(crate) struct Args {
    #[command(subcommand)]
    pub(crate) command: Command,
}

#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    Encode(Encode),
    Decode(Decode),
    Batch(Batch),
    Info(Info),
    Compare(Compare),
    Prefix(Prefix),
    Transform(Transform),
    Export(Export),
    Import(Import),
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn the_definition_is_consistent() {
        Args::command().debug_assert();
    }

    #[test]
    fn help_explains_every_argument() {
        let mut tool = Args::command();
        tool.build();
        let mut commands: Vec<clap::Command> = tool.get_subcommands().cloned().collect();
        assert_eq!(commands.len(), 9 + 1, "nine and `help`");
        commands.push(tool);
        for mut command in commands {
            let help = command.render_long_help().to_string();
            let words = help.split_whitespace().collect::<Vec<_>>().join(" ");
            let names = |text: &str| {
                assert!(words.contains(text), "{}: {text} is missing:\n{help}", command.get_name());
            };
            names(&command.get_about().expect("a text").to_string());
            for argument in command.get_arguments() {
                let text = argument.get_long_help().or(argument.get_help()).expect("a text");
                names(&text.to_string().split_whitespace().collect::<Vec<_>>().join(" "));
                if let Some(long) = argument.get_long() {
                    names(&format!("--{long}"));
                }
                if !argument.get_action().takes_values() {
                    continue;
                }
                for name in argument.get_value_names().expect("it takes values") {
                    names(name);
                }
                for default in argument.get_default_values() {
                    names(&format!("[default: {}]", default.display()));
                }
                for value in argument.get_possible_values() {
                    let text = value.get_help().expect("a text");
                    names(&format!("- {}: {text}", value.get_name()));
                }
            }
        }
    }
}
