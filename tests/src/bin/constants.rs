//! Prints `docs/constants.md`: `cargo constants > docs/constants.md`.

use std::process::ExitCode;

use cslam_tests::constants::{Effects, found, page};

fn main() -> ExitCode {
    let found = found();
    print!("{}", page(&found.constants, &Effects::committed()));
    let wrong = found.wrong();
    for line in &wrong {
        eprintln!("{line}");
    }
    if wrong.is_empty() {
        ExitCode::SUCCESS
    } else {
        ExitCode::FAILURE
    }
}
