//! Instructions of whole sweeps on the emulated chip, estimation included, stage by stage, against the committed table.

use cslam_tests::cost::{counts, rises};
use cslam_tests::root;

use crate::chip;
use crate::recordings::nine_paths;

#[test]
fn no_stage_costs_more_than_committed() {
    let recording = nine_paths();
    let run = chip::run("best", &recording, Some("10"));
    let mut measured = counts(&run.log);
    assert_eq!(measured.remove("sweeps"), Some(recording.names.len() as f64));
    for (name, count) in &measured {
        println!("{name}: {count}");
    }
    let table =
        std::fs::read_to_string(root().join("tests/golden/ltd_sweep_cost.txt")).expect("the committed table");
    let rises = rises(&counts(&table), &measured);
    assert!(rises.is_empty(), "{}", rises.join("\n"));
}
