use cslam_host_sim::accuracy::*;
fn main() {
    let trials: usize = std::env::args().nth(1).map_or(100, |s| s.parse().unwrap());
    for snr in [-20.0, -18.0] {
        let t = std::time::Instant::now();
        let s = single(Mode::Best, snr, trials, 1);
        println!(
            "{snr:5} det {:.3} out {:.3} ratio {:.3?} nees {:.3} med {:.5} m {:.5} deg  {:?}",
            s.detected,
            s.outliers,
            s.ratio,
            s.nees,
            s.range_median_m,
            s.angle_median_deg,
            t.elapsed()
        );
    }
}
