//! The whole receiver of another radio: line of sight and one wall, from samples to pose and map.

use std::f64::consts::{PI, TAU};

use cslam_core::geometry::Rotation;
use cslam_core::inertial::ImuSample;
use cslam_core::link_state::models;
use cslam_core::map::PointCloud;
use cslam_core::profile::{planar_8x8_gmt_72 as planar, quad_4x16_gmt_48 as quad};
use cslam_core::radio::RadioConfig;
use cslam_core::receiver::{Beacon, Config, LinkStates, Memory, Radio, Receiver};
use cslam_core::signal::BeamBlock;
use cslam_host_sim::random::Stream;
use nalgebra::Vector3;

use crate::paths;
use crate::signal::{Captured, SPEED_OF_LIGHT_M_PER_S, Signal, Wave, beam_field, squint_field};

/// The wall is the plane y = 12 m, and reflects so much of the amplitude.
const WALL_Y_M: f64 = 12.0;
const REFLECTED: f64 = 0.6;
const SWEEPS: u32 = 64;
const SWEEP_S: f64 = 0.5;
/// The GMT moves on after so many sweeps: a surface is believed when it shows the GMT at several places.
const SWEEPS_PER_STOP: u32 = 16;
/// The UAV stands until then.
const REST_S: f64 = 8.0;
/// 30 dBm less 3 dB of losses.
const TRANSMITTED_W: f64 = 0.5;
const SYMBOLS: usize = 11;

/// Thermal noise of a sample: 7 dB of noise figure over the sample rate.
fn noise_w() -> f64 {
    10_f64.powf((-174.0 + 7.0 - 30.0) / 10.0) * 245.76e6
}

/// Where the GMT is during a sweep, m.
fn gmt_m(sweep: u32) -> Vector3<f64> {
    Vector3::new(0.0, 1.5 * f64::from(sweep / SWEEPS_PER_STOP), 1.5)
}

/// Where the UAV is, m, and its acceleration, m/s^2.
fn motion(time_s: f64) -> [Vector3<f64>; 2] {
    let t = (time_s - REST_S).max(0.0);
    let start_m = Vector3::new(26.0, -3.0, 6.0);
    let swing = |amplitude_m: f64, period_s: f64| {
        let w = TAU / period_s;
        let acceleration = if time_s < REST_S {
            0.0
        } else {
            amplitude_m * w * w * (w * t).cos()
        };
        [amplitude_m * (1.0 - (w * t).cos()), acceleration]
    };
    let (x, y, z) = (swing(7.0, 20.0), swing(3.0, 13.0), swing(1.0, 8.0));
    [0, 1].map(|i| Vector3::new(x[i], y[i], z[i]) + if i == 0 { start_m } else { Vector3::zeros() })
}

/// A way from the GMT to the UAV.
struct Way {
    wave: Wave,
    /// Direction in which it left.
    left: Vector3<f64>,
    /// Amplitude of a subcarrier between isotropic antennas, square root of a watt.
    amplitude: f64,
}

fn ways(signal: &Signal, gmt_m: &Vector3<f64>, uav_m: &Vector3<f64>, yaw_rad: f64) -> [Way; 2] {
    let image = |v: &Vector3<f64>| Vector3::new(v.x, 2.0 * WALL_Y_M - v.y, v.z);
    let to_body = nalgebra::Rotation3::from_axis_angle(&Vector3::z_axis(), -yaw_rad);
    let way = |source_m: Vector3<f64>, left_for_m: Vector3<f64>, share: f64| {
        let towards = source_m - uav_m;
        let length_m = towards.norm();
        let wavelength_m = SPEED_OF_LIGHT_M_PER_S / signal.carrier_hz;
        Way {
            wave: Wave {
                from: to_body * (towards / length_m),
                c_tau_m: length_m,
            },
            left: (left_for_m - gmt_m).normalize(),
            amplitude: share * (TRANSMITTED_W / 416.0).sqrt() * wavelength_m / (4.0 * PI * length_m),
        }
    };
    [
        way(*gmt_m, *uav_m, 1.0),
        way(image(gmt_m), image(uav_m), REFLECTED),
    ]
}

/// What became of a flight.
#[derive(Debug, Default)]
struct Flown {
    /// Most paths of a sweep.
    paths: usize,
    /// Sweeps with a pose.
    poses: usize,
    /// Error of the pose at the end, m.
    position_error_m: f64,
    attitude_error_rad: f64,
    /// Distances of the map's points from the wall, m.
    off_wall_m: Vec<f64>,
}

/// Flies the scene with a body that is turned by `yaw_rad`, its GMT sending beams at these elevations.
fn fly<R, const C: usize, const ELEVATIONS: usize>(
    signal: &Signal,
    radio: RadioConfig<ELEVATIONS>,
    estimator: &mut R::Estimator,
    yaw_rad: f64,
) -> Flown
where
    R: for<'b> Radio<Block<'b> = BeamBlock<'b, C>, Description = RadioConfig<ELEVATIONS>>,
{
    let elevations_deg = radio.codebook.elevations_rad.map(f64::to_degrees);
    let beams = radio.codebook::<f32, 3, 8, 8>().len();
    let mut config = Config::of(
        radio,
        LinkStates::Trees(models::trees().expect("the program's own")),
    );
    // There is no ground in this scene.
    config.accept.point.ground_z_m = None;
    let mut squint = Box::new(
        config
            .beam_squint::<R>()
            .expect("as many symbols as the type says"),
    );
    let mut map = Box::new(PointCloud::<4096>::new());
    let memory = Memory {
        estimator,
        squint: &mut *squint,
        map: &mut *map,
    };
    let mut receiver = Receiver::<R, 4096>::new(config, memory);
    let (mut flown, mut imu, mut stream) = (Flown::default(), 0_u64, Stream::new(28, 1));
    let level = nalgebra::Rotation3::from_axis_angle(&Vector3::z_axis(), yaw_rad);
    for sweep in 0..SWEEPS {
        let time_s = SWEEP_S * f64::from(sweep + 1);
        let time_ns = (time_s * 1e9) as u64;
        while imu < time_ns {
            imu += 1_000_000;
            // The middle of the interval.
            let [_, acceleration] = motion(imu as f64 * 1e-9 - 0.5e-3);
            let force = level.inverse() * (acceleration + Vector3::z() * 9.806_65);
            let mut noise = |sigma: f64| Vector3::from_fn(|_, _| sigma * stream.normal());
            receiver.imu(&ImuSample {
                time_ns: imu,
                rate_rad_per_s: noise(1e-3).cast(),
                specific_force_m_per_s2: (force + noise(0.015)).cast(),
            });
        }
        receiver.timing(time_ns, 0.3e-9 * stream.normal());
        receiver.sweep(time_ns, sweep);
        let [uav_m, _] = motion(time_s);
        let ways = ways(signal, &gmt_m(sweep), &uav_m, yaw_rad);
        let phases = signal.phases(&mut stream);
        let at_rows = ways
            .each_ref()
            .map(|way| signal.waves(&way.wave, &phases, |_| way.amplitude));
        for beam in 0..beams {
            let heard = [0, 1].map(|w| {
                let factor = beam_field(beam, &elevations_deg, &ways[w].left);
                (&ways[w].wave, &at_rows[w], factor)
            });
            let channels = signal.channels(&heard, noise_w(), &mut stream);
            receiver.beam(Captured::<C>::of(&channels).block(beam as u16));
        }
        for symbol in 0..3 * SYMBOLS {
            let (face, within) = (symbol / SYMBOLS, symbol % SYMBOLS);
            // The UAV is before face 0: nobody listens to the others.
            if face > 0 {
                break;
            }
            let at_rows = ways.each_ref().map(|way| {
                signal.waves(&way.wave, &phases, |index| {
                    way.amplitude * squint_field(face, within, signal.carrier_hz, index, &way.left)
                })
            });
            let heard = [0, 1].map(|w| (&ways[w].wave, &at_rows[w], 1.0));
            let channels = signal.channels(&heard, noise_w(), &mut stream);
            receiver.squint(Captured::<C>::of(&channels).block(symbol as u16));
        }
        receiver.beacon(
            time_ns + 1_000_000,
            &Beacon {
                sweep,
                position_m: gmt_m(sweep),
                sigma_m: 0.02,
                attitude: Rotation::identity(),
                sweeps_per_stop: SWEEPS_PER_STOP,
            },
        );
        let report = receiver.end_sweep().expect("it was in hand");
        flown.paths = flown.paths.max(report.paths.len());
        flown.off_wall_m.extend(
            report
                .points
                .iter()
                .map(|point| (f64::from(point.point.position.to_array()[1]) - WALL_Y_M).abs()),
        );
        if let Some(pose) = &report.pose {
            flown.poses += 1;
            flown.position_error_m = (pose.position.vector() - uav_m).norm();
            let turned = pose.attitude.matrix().cast::<f64>() * level.inverse();
            flown.attitude_error_rad = ((turned.trace() - 1.0) / 2.0).clamp(-1.0, 1.0).acos();
        }
    }
    flown
}

/// Prints what became of a flight, and checks it.
fn check(name: &str, flown: &Flown) {
    let mut off_m = flown.off_wall_m.clone();
    off_m.sort_by(f64::total_cmp);
    let median_m = off_m.get(off_m.len() / 2).copied().unwrap_or(f64::NAN);
    println!(
        "{name}: {} sweeps with a pose of {SWEEPS}, {:.3} m and {:.2} deg off at the end, {} points, {median_m:.3} m off the wall in the median",
        flown.poses,
        flown.position_error_m,
        flown.attitude_error_rad.to_degrees(),
        off_m.len(),
    );
    assert!(flown.paths >= 2, "{name}: {flown:?}");
    assert!(flown.poses > 30, "{name}: {flown:?}");
    assert!(
        flown.position_error_m < 0.2 && flown.attitude_error_rad < 0.01,
        "{name}: {flown:?}"
    );
    assert!(off_m.len() > 10 && median_m < 0.1, "{name}: {flown:?}");
}

#[test]
fn the_whole_receiver_of_another_radio_finds_its_pose_and_maps_the_wall() {
    let radio = quad::radio();
    let mut estimator =
        Box::new(quad::FlightEstimator::checked(&quad::Config::of(&radio)).expect("a sound radio"));
    let flown = fly::<quad::Radio, { quad::CHANNELS }, { quad::ELEVATIONS }>(
        &paths::quad_signal(),
        radio,
        &mut estimator,
        PI - 0.3,
    );
    check("quad_4x16_gmt_48", &flown);
}

#[test]
fn the_whole_receiver_of_a_planar_array_finds_its_pose_and_maps_the_wall() {
    let radio = planar::radio();
    let mut estimator =
        Box::new(planar::FlightEstimator::checked(&planar::Config::of(&radio)).expect("a sound radio"));
    let flown = fly::<planar::Radio, { planar::CHANNELS }, { planar::ELEVATIONS }>(
        &paths::planar_signal(),
        radio,
        &mut estimator,
        PI - 0.3,
    );
    check("planar_8x8_gmt_72", &flown);
}
