//! The product's own tests of what its interface does not show: gradients and SIMD levels.

use std::path::Path;
use std::process::Command;

use anyhow::{Context, Result, ensure};

use crate::comparison::list_or_none;
use crate::provenance::FOLDER;
use crate::table::Table;

/// Tests whose names start alike and that assert one property.
struct Property {
    name: &'static str,
    description: &'static str,
    prefix: &'static str,
    /// How many tests there are at least.
    tests: u32,
}

const PROPERTIES: [Property; 2] = [
    Property {
        name: "gradients",
        description: "Every gradient of the encoder in f32 equals the central difference of the \
                      loss in f64, within 2e-3 of its magnitude plus 0.1, for every \
                      parameterization, kernel and colour model.",
        prefix: "every_gradient_",
        tests: 1,
    },
    Property {
        name: "SIMD levels",
        description: "Every SIMD level of this machine gives the same bits: samples those of the \
                      scalar code, gradients those of the level that every processor of this \
                      architecture has.",
        prefix: "every_simd_level_",
        tests: 2,
    },
];

/// Runs the tests, which are built first if need be.
pub(super) fn measure() -> Result<String> {
    let mut table = Table::new(&["property", "tests passed", "tests failed"]);
    let mut violated = Vec::new();
    for property in &PROPERTIES {
        let [passed, failed] = run(property)?;
        table.row(&[property.name.to_owned(), passed.to_string(), failed.to_string()]);
        if failed > 0 {
            violated.push(property.name);
        }
    }
    let descriptions = PROPERTIES.each_ref().map(|property| property.description);
    Ok(format!(
        "\n### Tests of the product\n\nTwo properties that the product's interface does not show \
         are asserted by its own tests, which this run has executed. {}\n{}\nViolated: {}.\n",
        descriptions.join(" "),
        table.finish(),
        list_or_none(violated.into_iter()),
    ))
}

/// How many tests of a property passed and failed.
fn run(property: &Property) -> Result<[u32; 2]> {
    let manifest = Path::new(FOLDER).join("../Cargo.toml");
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    eprintln!("the product's tests {}*", property.prefix);
    let output = Command::new(cargo)
        .args(["test", "--release", "--lib", "--manifest-path"])
        .arg(manifest)
        .args(["--", property.prefix])
        .output()
        .context("cannot run cargo, which the product's own tests need")?;
    let text = String::from_utf8_lossy(&output.stdout);
    let counts = counts(&text).with_context(|| {
        let errors = String::from_utf8_lossy(&output.stderr);
        format!("the product's tests did not run ({}):\n{text}{errors}", output.status)
    })?;
    let [passed, failed] = counts;
    ensure!(
        passed + failed >= property.tests,
        "{} of the product's tests are called {}*, and {} were expected",
        passed + failed,
        property.prefix,
        property.tests
    );
    ensure!(
        output.status.success() == (failed == 0),
        "cargo ended with {}, but {failed} tests failed",
        output.status
    );
    if failed > 0 {
        eprintln!("{text}");
    }
    Ok(counts)
}

/// What the test harness printed at its end: how many tests passed and failed.
fn counts(text: &str) -> Option<[u32; 2]> {
    let summary = text.lines().find_map(|line| line.strip_prefix("test result: "))?;
    let words: Vec<&str> = summary.split([' ', ';']).filter(|word| !word.is_empty()).collect();
    let before = |label: &str| {
        let index = words.iter().position(|word| *word == label)?;
        words.get(index.checked_sub(1)?)?.parse().ok()
    };
    Some([before("passed")?, before("failed")?])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn passed_and_failed_tests_are_counted() {
        let text = |summary: &str| format!("\nrunning 3 tests\ntest a ... ok\n\n{summary}\n\n");
        let rest = "0 ignored; 0 measured; 9 filtered out; finished in 0.01s";
        let ok = text(&format!("test result: ok. 3 passed; 0 failed; {rest}"));
        assert_eq!(counts(&ok), Some([3, 0]));
        let failed = text(&format!("test result: FAILED. 12 passed; 1 failed; {rest}"));
        assert_eq!(counts(&failed), Some([12, 1]));
        let none = text(&format!("test result: ok. 0 passed; 0 failed; {rest}"));
        assert_eq!(counts(&none), Some([0, 0]));
        assert_eq!(counts("error: could not compile"), None);
        assert_eq!(counts("test result: ok."), None);
    }
}
