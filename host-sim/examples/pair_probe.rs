use cslam_host_sim::accuracy::*;
fn main() {
    let n: usize = std::env::args().nth(1).map_or(40, |s| s.parse().unwrap());
    for d in [20.0, 50.0, 100.0] {
        let b = bounce(Mode::Best, d, n, 1);
        println!(
            "bounce {d} apart {:.2?} range mm {:.2?} angle {:.4?} bound mm {:.2} {:.4}",
            b.apart,
            b.range_m.map(|x| x * 1e3),
            b.angle_deg,
            b.bound[0] * 1e3,
            b.bound[1]
        );
    }
    for (m, a) in [
        (0.3, 0.0),
        (0.75, 0.0),
        (1.5, 0.0),
        (0.0, 5.0),
        (0.0, 10.0),
        (0.0, 15.0),
        (0.0, 25.0),
        (0.0, 40.0),
        (0.6, 10.0),
        (0.6, 22.0),
        (1.5, 10.0),
        (3.0, 10.0),
    ] {
        let [x, y] = [0.0, -10.0].map(|db| pairs(Mode::Best, m, a, db, n, 1));
        println!(
            "pair {m} m {a} deg: equal {:.2} (possible {:.2})  -10 dB {:.2} ({:.2})",
            x.both, x.possible, y.both, y.possible
        );
    }
    for snr in [0.0, 20.0] {
        let s = scenes(Mode::Best, snr, n, 1);
        println!("{s:?}");
    }
    for snr in [0.0, 10.0, 20.0] {
        println!("{:?}", departures(Mode::Best, snr, n, 1));
    }
}
