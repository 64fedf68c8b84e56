use cslam_host_sim::flight::FlightConfig;
use cslam_host_sim::localization::*;
use cslam_host_sim::scene::Scene;
use cslam_host_sim::sensors::SensorsConfig;
use rayon::prelude::*;
fn main() {
    let n: u64 = std::env::args().nth(1).and_then(|a| a.parse().ok()).unwrap_or(2);
    let scene = Scene::load("outdoor").unwrap();
    let planes = Planes::of(&scene);
    eprintln!("planes {}", planes.planes.len());
    let t = std::time::Instant::now();
    let flights: Vec<_> = (1..=n)
        .into_par_iter()
        .map(|s| {
            Prepared::new(
                &scene,
                &planes,
                &FlightConfig::default(),
                &SensorsConfig::default(),
                s,
            )
            .unwrap()
        })
        .collect();
    eprintln!("prepared in {:?}", t.elapsed());
    for f in &flights {
        let no: Vec<_> = f.sweeps.iter().filter(|s| s.sight().is_none()).collect();
        let r1 = no.iter().filter(|s| s.paths.iter().any(|p| p.order == 1)).count();
        eprintln!(
            "seed {} visible {:.2} blind sweeps {} with 1st order {}",
            f.seed,
            f.visible_share,
            no.len(),
            r1
        );
    }
    let verbose = std::env::args().nth(2).is_some();
    for map in [None, Some((0.1, 0.2))] {
        let sc = Scenario {
            map,
            ..Default::default()
        };
        let t = std::time::Instant::now();
        let all: Vec<_> = flights
            .par_iter()
            .map(|f| {
                if map.is_some() {
                    fly::<f32, 44>(f, &planes, &sc)
                } else {
                    fly::<f32, 38>(f, &planes, &sc)
                }
            })
            .collect();
        eprintln!("map {:?} flown in {:?}", map, t.elapsed());
        for (f, recs) in flights.iter().zip(&all) {
            let use_: Vec<_> = recs.iter().filter(|r| r.time_s > 20.0).collect();
            let rms = |v: &mut dyn Iterator<Item = f64>| {
                let (mut s, mut k) = (0.0, 0.0);
                for x in v {
                    s += x * x;
                    k += 1.0;
                }
                (s / f64::max(k, 1.0)).sqrt()
            };
            let settled = |r: &Record| {
                recs.iter()
                    .filter(|q| q.time_s <= r.time_s && q.time_s > r.time_s - 1.9)
                    .all(|q| q.sight)
            };
            let ps = rms(&mut use_.iter().filter(|r| settled(r)).map(|r| r.position_m.norm()));
            let pa = rms(&mut use_.iter().map(|r| r.position_m.norm()));
            let at = rms(&mut use_.iter().map(|r| r.attitude_rad.norm().to_degrees()));
            let ck = rms(&mut use_.iter().map(|r| r.clock_m / 0.299792458));
            let ne = |i: usize, d: f64| use_.iter().map(|r| r.nees[i]).sum::<f64>() / use_.len() as f64 / d;
            let first = recs.iter().find(|r| r.running).map(|r| r.time_s);
            let rej = use_
                .iter()
                .filter(|r| r.sight && r.verdict == cslam_core::localization::filter::SweepVerdict::Rejected)
                .count();
            println!(
                "seed {} start {:?} settled {:.3} all {:.3} att {:.3} clock {:.3} nees {:.2} {:.2} {:.2} rejected {}",
                f.seed,
                first,
                ps,
                pa,
                at,
                ck,
                ne(0, 3.0),
                ne(1, 3.0),
                ne(2, 1.0),
                rej
            );
            if verbose {
                for r in recs {
                    println!(
                        "{:6.1} {} {:?} refl {} rho {:.0} p {:.2} [{:.2} {:.2} {:.2}] att {:.2} ck {:.2} ratio {:.2} nees {:.1} {:.1}",
                        r.time_s,
                        r.sight as u8,
                        r.verdict,
                        r.reflections,
                        r.range_m,
                        r.position_m.norm(),
                        r.position_m.x,
                        r.position_m.y,
                        r.position_m.z,
                        r.attitude_rad.norm().to_degrees(),
                        r.clock_m,
                        r.ratio,
                        r.nees[0],
                        r.nees[1]
                    );
                }
            }
        }
    }
}
