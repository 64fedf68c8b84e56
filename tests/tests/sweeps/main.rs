#![allow(missing_docs)]
mod probe;
mod recordings;
use cslam_host_sim::channel::Impairments;
use recordings::*;

#[test]
#[ignore]
fn dump() {
    let free = Impairments {
        free_array_phase: true,
        ..Impairments::none()
    };
    let mut r = Recorder::new(free, 1);
    let mut out = Vec::new();
    for (i, snr) in [20.0, 20.0, 20.0, 30.0, 10.0, 0.0].into_iter().enumerate() {
        let rays = r.nine(snr);
        record(&r.sweep(&rays, i as u32), &mut out);
    }
    std::fs::write(std::env::var("DUMP").unwrap(), out).unwrap();
}
