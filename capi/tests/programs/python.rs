//! The Python package, in the environment that the stage `python-package` makes.

use std::path::Path;
use std::process::Command;

use crate::recording::{Recorded, cslam};
use crate::{ROOT, printed};

/// What a user writes.
const ESTIMATE: &str = "
import sys, cslam
sweep = cslam.read_sigmf(sys.argv[1])
print(cslam.Estimator().estimate(sweep.iq, sweep.beams, sweep.exponents))
";

/// The environment, from the root.
const PYTHON: &str = "target/verify-bindings/bin/python";

#[test]
#[ignore = "needs the Python package: the stage python-package runs it"]
fn python_prints_what_the_command_prints() {
    let recorded = Recorded::new();
    let python = Path::new(ROOT).join(PYTHON);
    assert_eq!(
        printed(Command::new(&python).args(["-c", ESTIMATE]).arg(recorded.meta())),
        recorded.by_the_command()
    );
    let tests = printed(
        Command::new(&python)
            .current_dir(Path::new(ROOT).join("python"))
            .args(["-m", "pytest"])
            .env("CSLAM_COMMAND", cslam().get_program()),
    );
    print!("{tests}");
    assert!(!tests.contains("skipped"), "{tests}");
}
