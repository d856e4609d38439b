//! `gip batch`.

mod budget;
mod inputs;
mod manifest;
mod outputs;
mod run;
mod stop;
mod task;
mod workers;

pub(crate) use run::run;
