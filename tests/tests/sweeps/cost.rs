//! Instructions of whole sweeps on the emulated chip, estimation included, stage by stage, against the committed table.

use cslam_tests::cost::{costs_no_more_than_committed, counts};

use crate::chip;
use crate::recordings::nine_paths;

#[test]
fn no_stage_costs_more_than_committed() {
    let recording = nine_paths();
    let run = chip::run("best", &recording, Some("10"));
    let mut measured = counts(&run.log);
    assert_eq!(measured.remove("sweeps"), Some(recording.names.len() as f64));
    costs_no_more_than_committed("path_cost.txt", &measured);
}
