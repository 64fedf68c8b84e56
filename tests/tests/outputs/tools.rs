//! evo, Open3D, plyfile, NumPy and readers of MCAP and of ROS 2 load the files, and their figures are the report's.

use std::path::{Path, PathBuf};
use std::process::Command;

use cslam_host_sim::flight_files::ply::Encoding;
use cslam_host_sim::scene::Scene;

use crate::{cut, synthetic, write};

/// The interpreter that `cargo verify` sets up.
fn python() -> PathBuf {
    cslam_tests::root().join("target/verify-python/bin/python")
}

fn check(script: &str, directory: &Path) {
    let script = cslam_tests::root().join("tests/tools").join(script);
    let output = Command::new(python())
        .arg(script)
        .arg(directory)
        .output()
        .expect("`cargo verify` sets Python up");
    let said = String::from_utf8_lossy(&output.stdout);
    println!("{said}");
    assert!(
        output.status.success(),
        "{said}\n{}",
        String::from_utf8_lossy(&output.stderr)
    );
}

#[test]
fn the_tools_of_the_field_read_a_flight_and_agree() {
    let scene = Scene::load("outdoor").expect("built in");
    let log = synthetic::fly(&scene, 60.0, 2);
    for (mut log, encoding) in [(log.clone(), Encoding::Binary), (cut(&log, 31), Encoding::Ascii)] {
        let directory = tempfile::tempdir().expect("a directory");
        write(&mut log, &scene, directory.path(), encoding);
        check("check_outputs.py", directory.path());
        check("check_exports.py", directory.path());
    }
}
