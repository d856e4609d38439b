//! Names the shared library for the dynamic linker: programs ask for the version of its binary interface
//! that they were linked with.

#[path = "src/abi.rs"]
mod abi;

use std::env;

fn main() {
    println!("cargo::rerun-if-changed=src/abi.rs");
    let is = |name, value| env::var(name).is_ok_and(|found| found == value);
    // Where libraries are ELF files.
    if is("CARGO_CFG_TARGET_FAMILY", "unix") && !is("CARGO_CFG_TARGET_VENDOR", "apple") {
        let version = abi::GIP_ABI_VERSION;
        println!("cargo::rustc-cdylib-link-arg=-Wl,-soname,libgip.so.{version}");
    }
}
