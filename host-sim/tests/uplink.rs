//! Hostile packets against the receiver in flight: as many as a test has time for. `cslam bench uplink` sends ten million.

use cslam_host_sim::uplink_attack;

#[test]
fn hostile_packets_move_nothing() {
    let figures = uplink_attack::run(40_000).expect("a flight");
    println!("{figures}");
    assert!(figures.is_safe(), "{figures}");
    assert!(
        figures.compared[1] >= 5,
        "a pose in {} sweeps",
        figures.compared[1]
    );
}
