use crate::recordings::Recorder;
use cslam_core::geometry::Direction;
use cslam_core::ltd::*;
use cslam_host_sim::channel::*;
fn adc(bits: u8) -> [f64; 3] {
    let beam = 12;
    let mut r = Recorder::new(
        Impairments {
            free_array_phase: true,
            dropped_beams: (0..72).filter(|b| *b != beam).collect(),
            ..Impairments::none()
        },
        5,
    );
    r.bits(bits);
    let mut est = Estimator::<4, 8, 32, 72, 3, 8, 8, 360, 9>::new(&EstimatorConfig {
        element_phase_sigma_rad: 0.0,
        ..EstimatorConfig::default()
    });
    let mut sum = [0.0; 3];
    let mut n = 0;
    for i in 0..300 {
        let mut ray = r.ray(40.0);
        let aod = Direction::from_vector(
            cslam_core::array::Codebook::<f64>::default()
                .beam(12)
                .unwrap()
                .direction(),
        )
        .unwrap();
        ray.departure = aod;
        let mut s = r.sweep(&[ray], i);
        for b in &mut s.blocks {
            est.push_beam(b.view());
        }
        let f = est.finish();
        let Some(p) = f.first() else { continue };
        let (e1, e2) = ray.arrival.tangents();
        let u = p.path.aoa.vector().cast::<f64>();
        let e = [
            f64::from(p.path.c_tau_m) - ray.delay_s * 299792458.0,
            e1.dot(&u),
            e2.dot(&u),
        ];
        if e[0].abs() > 0.01 {
            continue;
        }
        n += 1;
        if p.path.covariance[(0, 0)] < 1e-12 {
            println!("adc {bits} {i} {p:?} {:?}", ray);
        }
        for k in 0..3 {
            sum[k] += e[k] * e[k] / f64::from(p.path.covariance[(k, k)]);
        }
    }
    println!("n {n}");
    sum.map(|s| (s / f64::from(n)).sqrt())
}
#[test]
#[ignore]
fn bits() {
    for b in [16] {
        println!("adc {b}: {:?}", adc(b));
    }
}
#[test]
#[ignore]
fn screening() {
    let mut r = Recorder::new(
        Impairments {
            free_array_phase: true,
            ..Impairments::none()
        },
        77,
    );
    let make = |screening| {
        Estimator::<4, 8, 32, 72, 3, 8, 8, 360, 9>::new(&EstimatorConfig {
            screening,
            ..EstimatorConfig::default()
        })
    };
    let (mut a, mut b) = (make(true), make(false));
    for snr in [40.0, 30.0, 25.0, 20.0, 15.0, 10.0] {
        let (mut same, mut skipped, mut lost, mut gained) = (0, 0, 0, 0);
        let mut off = vec![];
        for i in 0..40 {
            let rays = r.nine(snr);
            let mut s = r.sweep(&rays, i);
            let mut t = s.clone();
            for x in &mut s.blocks {
                skipped += u32::from(a.push_beam(x.view()).weak);
            }
            for x in &mut t.blocks {
                b.push_beam(x.view());
            }
            let (p, q) = (a.finish(), b.finish());
            for x in &q {
                match p.iter().find(|y| {
                    (x.path.c_tau_m - y.path.c_tau_m).abs() < 0.3
                        && x.path.aoa.angle_to_rad(&y.path.aoa) < 0.035
                }) {
                    Some(y) if y == x => same += 1,
                    Some(_) => {}
                    None => {
                        lost += 1;
                        off.push(x.snr_db - q[0].snr_db);
                    }
                }
            }
            gained += p
                .iter()
                .filter(|x| {
                    !q.iter().any(|y| {
                        (x.path.c_tau_m - y.path.c_tau_m).abs() < 0.3
                            && x.path.aoa.angle_to_rad(&y.path.aoa) < 0.035
                    })
                })
                .count();
        }
        println!(
            "{snr} dB: skipped {skipped} of {}, same {same}, lost {lost} {off:?}, gained {gained}",
            40 * 72
        );
    }
}
