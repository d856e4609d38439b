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
    // Lets `image` read .gip wherever the tool takes a picture.
    image_gip::register();
    let outcome = match Args::parse().command {
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

/// An error and its causes on one line. Many libraries repeat a cause in their own text; it is
/// said once.
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
