//! The command line tool `gip`.

#![forbid(unsafe_code)]

mod args;
mod codec;
mod compare;
mod decode;
mod encode;
mod files;
mod info;
mod picture;

use std::process::ExitCode;

use clap::Parser;
use image_gip::EncodeError;

use args::{Args, Command};

fn main() -> ExitCode {
    // With this, `image` reads .gip too.
    image_gip::register();
    let args = match Args::try_parse() {
        Ok(args) => args,
        // Help and version are not errors.
        Err(error) if !error.use_stderr() => error.exit(),
        Err(error) => {
            eprintln!("{}", first_paragraph(&error.render().to_string()));
            return ExitCode::from(2);
        }
    };
    let outcome = match args.command {
        Command::Encode(args) => encode::run(&args),
        Command::Decode(args) => decode::run(&args),
        Command::Info(args) => info::run(&args),
        Command::Compare(args) => compare::run(&args),
    };
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {}", one_line(&error));
            let wrong_usage = matches!(error.downcast_ref(), Some(EncodeError::Option(_)));
            ExitCode::from(if wrong_usage { 2 } else { 1 })
        }
    }
}

/// The first paragraph of an error of `clap`, on one line: tips and usage follow it.
fn first_paragraph(text: &str) -> String {
    let paragraph = text.split("\n\n").next().unwrap_or_default();
    paragraph.split_whitespace().collect::<Vec<_>>().join(" ")
}

/// An error and its causes on one line. A cause that the text of an error repeats is printed once.
fn one_line(error: &anyhow::Error) -> String {
    let mut line = String::new();
    for cause in error.chain() {
        let cause = cause.to_string();
        let cause = cause.split_whitespace().collect::<Vec<_>>().join(" ");
        if !line.contains(&cause) {
            if !line.is_empty() {
                line.push_str(": ");
            }
            line.push_str(&cause);
        }
    }
    line
}
