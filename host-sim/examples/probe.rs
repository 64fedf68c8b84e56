use cslam_core::cslam::*;
use cslam_core::ltd::{Estimator, EstimatorConfig};
use cslam_host_sim::{
    evaluation,
    flight_log::Header,
    raw_flight,
    scene::Scene,
    world::{World, WorldConfig},
};
use std::sync::atomic::AtomicBool;
fn main() {
    let seed: u64 = std::env::args().nth(1).map_or(1, |s| s.parse().unwrap());
    let dur: f64 = std::env::args().nth(2).map_or(20.0, |s| s.parse().unwrap());
    let scene = Scene::load("outdoor").unwrap();
    let mut config = WorldConfig::default();
    config.flight.duration_s = dur;
    let world = World::new(&scene, config, seed).unwrap();
    let est: Estimator = Estimator::new(&EstimatorConfig::default());
    let mut rx: Box<Cslam<'_, Estimator, 4096, 44>> =
        Box::new(Cslam::new(Config::best(LinkStates::Rules(Rules::default())), est).unwrap());
    println!("receiver {} bytes", std::mem::size_of_val(&*rx));
    let header = Header {
        mode: "best".into(),
        scene: "outdoor".into(),
        seed,
        planned_sweeps: world.sweeps() as usize,
        sweep_period_s: 0.5,
        delay_cycle_m: Some(625.0),
    };
    let t = std::time::Instant::now();
    let mut log = raw_flight::fly(&world, &mut rx, header, &AtomicBool::new(false), |r| {
        if std::env::var("V").is_ok() {
            println!(
                "{} {:?} {:?} {:?}",
                r.sweep,
                r.verdict,
                r.bearing,
                r.paths
                    .iter()
                    .map(|p| (
                        p.estimated.path.c_tau_m,
                        p.gain_db,
                        p.estimated.snr_db,
                        p.estimated.path.aod.map(|a| a.sigma_rad)
                    ))
                    .collect::<Vec<_>>()
            );
        }
    })
    .unwrap();
    println!("flown in {:?}", t.elapsed());
    for s in &log.sweeps {
        let e = s.estimate.pose.map(|p| {
            (0..3)
                .map(|i| (p.position_m[i] - s.truth.pose.position_m[i]).powi(2))
                .sum::<f64>()
                .sqrt()
        });
        let c = s
            .estimate
            .pose
            .map(|p| (p.clock_offset_s.unwrap() - s.truth.pose.clock_offset_s) * 1e9);
        println!(
            "{:3} t {:6.2} los {} used {} err {:?} clk {:?} paths {} true {} : {}",
            s.sweep,
            s.time_s,
            s.truth.los_visible(),
            s.estimate.los_used,
            e.map(|x| (x * 1000.0).round() / 1000.0),
            c.map(|x| (x * 100.0).round() / 100.0),
            s.estimate.paths.len(),
            s.truth.link.as_ref().unwrap().paths.len(),
            s.estimate
                .paths
                .iter()
                .map(|p| p.verdict.chars().take(12).collect::<String>())
                .collect::<Vec<_>>()
                .join("|")
        );
    }
    for s in log.sweeps.iter().take(20) {
        let l = s.truth.link.as_ref().unwrap();
        println!(
            "true {:?}",
            l.paths
                .iter()
                .map(|p| (
                    p.order,
                    p.delay_s * 299792458.0,
                    p.gain.map(|g| 10.0 * (g[0] * g[0] + g[1] * g[1]).log10())
                ))
                .collect::<Vec<_>>()
        );
    }
    let ev = evaluation::evaluate(&mut log, Some(&scene));
    println!("{}", serde_json::to_string_pretty(&ev).unwrap());
    println!("{:?} {:?}", log.counters, rx.counters());
}
