//! `gip batch`.

mod age;
mod budget;
mod failure;
mod inputs;
mod left_out;
mod manifest;
mod outputs;
mod run;
mod selection;
mod shards;
mod stop;
mod tar;
mod task;
mod work;
mod workers;

pub(crate) use run::run;
