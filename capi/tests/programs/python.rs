//! The Python package, in the environment that the stage `python-package` makes.

use std::path::Path;
use std::process::Command;

use crate::recording::{Recorded, cslam};
use crate::{ROOT, page, printed};

/// What a user writes.
const ESTIMATE: &str = "
import sys, cslam
sweep = cslam.read_sigmf(sys.argv[1])
print(cslam.Estimator().estimate(sweep.iq, sweep.beams, sweep.exponents))
";

/// The environment, from the root.
const PYTHON: &str = "target/verify-bindings/bin/python";

/// An old NumPy of that environment's, which its path does not have.
const OLDEST_NUMPY: &str = "target/verify-bindings/oldest-numpy";

#[test]
#[ignore = "needs the Python package: the stage python-package runs it"]
fn python_takes_the_oldest_numpy() {
    let python = Path::new(ROOT).join(PYTHON);
    let version = "import numpy; print(numpy.__version__)";
    let newest = printed(Command::new(&python).args(["-c", version]));
    let with_oldest = || {
        let mut command = Command::new(&python);
        command
            .current_dir(Path::new(ROOT).join("python"))
            .env("PYTHONPATH", Path::new(ROOT).join(OLDEST_NUMPY));
        command
    };
    let oldest = printed(with_oldest().args(["-c", version]));
    assert_ne!(oldest, newest);
    println!("NumPy {}", oldest.trim());
    // Dask and matplotlib, which the other files need, are compiled against newer ones.
    let files = ["package", "receiver", "bridge"].map(|name| format!("tests/test_{name}.py"));
    print!("{}", printed(with_oldest().args(["-m", "pytest"]).args(files)));
}

#[test]
#[ignore = "needs the Python package: the stage python-package runs it"]
fn python_prints_what_the_command_prints() {
    let recorded = Recorded::new();
    let python = Path::new(ROOT).join(PYTHON);
    assert_eq!(
        printed(Command::new(&python).args(["-c", ESTIMATE]).arg(recorded.meta())),
        recorded.by_the_command()
    );
    let demo = printed(Command::new(&python).args(["-c", "import cslam; print(cslam.demo())"]));
    assert!(page().contains(&demo), "docs/bindings.md does not show\n{demo}");
    let tests = printed(
        Command::new(&python)
            .current_dir(Path::new(ROOT).join("python"))
            .args(["-m", "pytest"])
            .env("CSLAM_COMMAND", cslam().get_program()),
    );
    print!("{tests}");
    assert!(!tests.contains("skipped"), "{tests}");
}
