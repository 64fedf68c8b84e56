use cslam_host_sim::accuracy::*;
use rayon::prelude::*;
fn main() {
    let range = Range::new(&(0..72).collect::<Vec<u16>>(), 5);
    let n: u32 = std::env::args().nth(1).map_or(100, |s| s.parse().unwrap());
    // each beam its own sweep: only one beam sent
    let range1 = Range::new(&[3], 5);
    let _ = range;
    let mut x: Vec<f64> = (0..n)
        .into_par_iter()
        .map_init(
            || estimator(Mode::Best),
            |e, i| {
                let p = range1.sweep(&[], i, e.as_mut());
                p.first()
                    .map_or(0.0, |p| 32.0 * 416.0 * 10f64.powf(f64::from(p.snr_db) / 10.0))
            },
        )
        .collect();
    x.sort_by(f64::total_cmp);
    for q in [0.5, 0.8, 0.9, 0.97, 0.99, 0.997, 0.999, 0.9995, 0.9999] {
        println!("{q} {:.2}", x[(q * (n as f64)) as usize]);
    }
    println!("fired {} of {n}", x.iter().filter(|x| **x > 0.0).count());
    println!("{:.2?}", x.iter().rev().take(60).collect::<Vec<_>>());
    println!("max {:.2}", x[n as usize - 1]);
}
