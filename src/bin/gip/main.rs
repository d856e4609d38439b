//! The command line tool `gip`.

#![forbid(unsafe_code)]

mod args;
mod batch;
mod cicp;
mod codec;
mod compare;
mod decode;
mod encode;
mod errors;
mod files;
mod gaussians;
mod in_grid;
mod info;
mod limits;
mod picture;
mod prefix;
mod source;
mod transform;

use std::process::ExitCode;

use clap::Parser;

use args::{Args, Command};

fn main() -> ExitCode {
    let args = Args::parse();
    let success = |()| ExitCode::SUCCESS;
    let outcome = match args.command {
        Command::Encode(args) => encode::run(&args).map(success),
        Command::Decode(args) => decode::run(&args).map(success),
        Command::Batch(args) => batch::run(&args),
        Command::Info(args) => info::run(&args),
        Command::Compare(args) => compare::run(&args).map(success),
        Command::Prefix(args) => prefix::run(&args).map(success),
        Command::Transform(args) => transform::run(&args).map(success),
        Command::Export(args) => gaussians::export(&args).map(success),
        Command::Import(args) => gaussians::import(&args).map(success),
    };
    outcome.unwrap_or_else(|error| {
        files::tell(&format!("error: {}", errors::one_line(&error)));
        ExitCode::from(errors::exit_status(&error))
    })
}
