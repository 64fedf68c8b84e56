use cslam_host_sim::accuracy::*;
fn main() {
    println!("== equal");
    debug_pairs(0.3, 0.0, 0.0, 100, 1);
    println!("== -10");
    debug_pairs(0.3, 0.0, -10.0, 100, 1);
    println!("== 0 10");
    debug_pairs(0.0, 10.0, 0.0, 100, 1);
    println!("== 0 40");
    debug_pairs(0.0, 40.0, 0.0, 100, 1);
    for d in [20.0, 50.0, 100.0] {
        let b = bounce(Mode::Best, d, 1000, 2);
        println!(
            "bounce {d} apart {:.2?} range mm {:.2?} angle {:.4?} bound mm {:.2} {:.4}",
            b.apart,
            b.range_m.map(|x| x * 1e3),
            b.angle_deg,
            b.bound[0] * 1e3,
            b.bound[1]
        );
    }
}
