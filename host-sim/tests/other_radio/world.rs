//! A simulated world that has the antennas of `profile::quad_4x16_gmt_48`.

use std::f64::consts::TAU;

use cslam_core::geometry::Direction;
use cslam_core::paths::{EstimatedPath, PathEstimator};
use cslam_core::profile::quad_4x16_gmt_48::{
    ACTIVE, ARRAYS, BEAMS, CHANNELS, Config, ELEMENTS, FlightEstimator, SYMBOLS, radio,
};
use cslam_host_sim::channel::{ChannelConfig, GmtCounts, Impairments, Instant, Radio, Ray, Simulator};
use cslam_host_sim::flight::FlightConfig;
use cslam_host_sim::paths::LinkPath;
use cslam_host_sim::random::Stream;
use cslam_host_sim::raw_flight::{Given, Source};
use cslam_host_sim::world::{HeardSweep, Profile, World, WorldConfig, instant};

use crate::paths::quad_signal;
use crate::signal::{C64, SPEED_OF_LIGHT_M_PER_S, Wave, beam_field};

type Scene = cslam_host_sim::scene::Scene;
type OwnWorld<'s> = World<'s, ARRAYS, ELEMENTS, CHANNELS>;

/// Paths that are as strong as this under the strongest are looked for, dB.
const RANGE_DB: f64 = 25.0;

fn description() -> Radio {
    Radio::new(&radio(), GmtCounts::default()).expect("a sound radio")
}

#[test]
fn its_samples_are_those_of_the_signal_model_to_rounding() {
    let mut config = ChannelConfig {
        impairments: Impairments::none(),
        ..ChannelConfig::default()
    };
    config.front_end.noise = false;
    config.front_end.adc_bits = 16;
    let simulator = Simulator::<ARRAYS, ELEMENTS, CHANNELS>::with_radio(description(), config, 1);
    let signal = quad_signal();
    // 30 dBm less 3 dB.
    let sent = 10_f64.powf(-3.0 / 20.0);
    for (length_m, arrival, departure) in [
        (10.0, [1.5, 0.3], [1.6, 0.2]),
        (77.123_4, [0.7, -2.0], [1.4, 2.2]),
        (311.0, [1.9, 3.0], [1.2, -1.9]),
    ] {
        let ray = Ray {
            amplitude: C64::from_polar(3e-5, 0.7),
            across: C64::new(0.0, 0.0),
            delay_s: length_m / SPEED_OF_LIGHT_M_PER_S,
            arrival: Direction::from_zenith_azimuth(arrival[0], arrival[1]).expect("angles"),
            departure: Direction::from_zenith_azimuth(departure[0], departure[1]).expect("angles"),
            doppler_hz: 0.0,
        };
        let sweep = simulator.sweep_rays(&[ray], &Instant::at_rest(), 0);
        assert_eq!(sweep.blocks.len(), BEAMS);
        // The amplitude is that of a wave of mean power one at the body's origin, the model's that of a subcarrier.
        let amplitude = ray.amplitude.norm() * sent / (ACTIVE as f64).sqrt();
        let wave = Wave {
            from: *ray.arrival.vector(),
            c_tau_m: length_m,
        };
        let phase_turns = ray.amplitude.arg() / TAU + signal.carrier_hz * ray.delay_s;
        let waves = signal.waves(&wave, &[phase_turns; ARRAYS], |_| amplitude);
        let unit = signal.channels(&[(&wave, &waves, 1.0)], 0.0, &mut Stream::new(28, 1));
        for block in &sweep.blocks {
            let field = beam_field(block.beam.into(), &[0.0, 14.0], ray.departure.vector());
            let step = 2_f64.powi(block.exponent);
            for (channel, (ours, model)) in block.samples.iter().zip(&unit).enumerate() {
                for (iq, model) in ours.iter().zip(model) {
                    let error = C64::new(iq.re().into(), iq.im().into()) - model * field / step;
                    assert!(
                        error.re.abs() < 0.52 && error.im.abs() < 0.52,
                        "{length_m} m, beam {}, channel {channel}: off by {error} steps",
                        block.beam
                    );
                }
            }
        }
    }
}

fn scene(config: &WorldConfig, name: &str) -> Scene {
    config
        .scene(name)
        .expect("built in")
        .at_frequency(radio().waveform.carrier_hz)
}

fn short(profile: Profile) -> WorldConfig {
    let world = WorldConfig::of(profile);
    WorldConfig {
        flight: FlightConfig {
            duration_s: 10.0,
            ..world.flight.clone()
        },
        ..world
    }
}

/// How far a path is from a true one: along the way, m, and in angle, deg.
fn off(found: &EstimatedPath, path: &LinkPath, heard: &HeardSweep<CHANNELS>) -> [f64; 2] {
    let period = radio().waveform.delay_period();
    let true_m = (path.delay_s + heard.truth.clock_offset_s) * SPEED_OF_LIGHT_M_PER_S;
    let towards = Direction::from_zenith_azimuth(path.aoa_zenith_rad, path.aoa_azimuth_rad).expect("angles");
    let attitude = instant(&heard.truth).expect("a rotation").attitude;
    let u = attitude.inverse().apply(towards);
    let found_u = found.path.aoa.vector().cast::<f64>();
    [
        period.wrap_m(f64::from(found.path.c_tau_m) - true_m).abs(),
        found_u.dot(u.vector()).clamp(-1.0, 1.0).acos().to_degrees(),
    ]
}

#[test]
fn path_estimation_finds_the_traced_paths_of_a_flight() {
    let config = short(Profile::Budget);
    let mut estimator = Box::new(FlightEstimator::checked(&Config::of(&radio())).expect("a sound radio"));
    println!("| scene | true paths found | of | found paths that are true | of |");
    for name in ["outdoor", "street", "indoor"] {
        let scene = scene(&config, name);
        let world = OwnWorld::with_radio(&scene, description(), config.clone(), 3).expect("a flight");
        let [mut strong, mut seen, mut found, mut true_ones] = [0; 4];
        for sweep in 0..world.sweeps() {
            let mut heard = world.sweep(sweep).expect("sound");
            for block in heard.beams.strongest_first() {
                estimator.push_beam(block.view());
            }
            let paths: Vec<EstimatedPath> = estimator.finish().to_vec();
            let near = |found: &EstimatedPath, path: &LinkPath| {
                let [off_m, off_deg] = off(found, path, &heard);
                off_m < 0.3 && off_deg < 2.0
            };
            let power = |path: &LinkPath| path.gain.map_or(0.0, |[re, im]| re * re + im * im);
            let most = heard.link.paths.iter().map(power).fold(0.0, f64::max);
            let least = most * 10_f64.powf(-RANGE_DB / 10.0);
            for path in heard.link.paths.iter().filter(|path| power(path) > least).take(4) {
                strong += 1;
                seen += usize::from(paths.iter().any(|found| near(found, path)));
            }
            found += paths.len();
            let is_true = |found: &&EstimatedPath| heard.link.paths.iter().any(|path| near(found, path));
            true_ones += paths.iter().filter(is_true).count();
        }
        println!("| {name} | {seen} | {strong} | {true_ones} | {found} |");
        assert!(strong >= 20, "{name}: {strong} strong paths");
        assert!(10 * seen >= 8 * strong, "{name}: {seen} of {strong}");
        assert!(10 * true_ones >= 9 * found, "{name}: {true_ones} of {found}");
    }
}

#[test]
fn a_flight_gives_its_samples_with_every_effect() {
    let config = short(Profile::Real);
    let scene = scene(&config, "indoor");
    let world = OwnWorld::with_radio(&scene, description(), config.clone(), 3).expect("a flight");
    let given: Given<CHANNELS> = Source::sweep(&world, 2).expect("sound");
    assert_eq!(given.beams.blocks.len(), BEAMS);
    assert_eq!(given.squint.blocks.len(), 3 * SYMBOLS);
    let powers: [f32; BEAMS] = given.beams.powers();
    assert!(powers.iter().all(|power| *power > 0.0));
    let device = Simulator::<ARRAYS, ELEMENTS, CHANNELS>::with_radio(description(), config.channel, 3);
    let mut errors: Vec<f64> = device
        .device()
        .uav_element
        .as_flattened()
        .iter()
        .map(|e| e.arg())
        .collect();
    errors.sort_by(f64::total_cmp);
    errors.dedup();
    assert_eq!(errors.len(), CHANNELS, "an error of its own for each element");
}

#[test]
fn a_scene_at_another_frequency_is_refused() {
    let config = short(Profile::Budget);
    let refused = |scene: &Scene, config: &WorldConfig| {
        let world = OwnWorld::with_radio(scene, description(), config.clone(), 3);
        world.err().map(|error| error.to_string())
    };
    let scene = config.scene("outdoor").expect("built in");
    let expected = "scene outdoor is at 30 GHz, the radio at 28";
    assert_eq!(refused(&scene, &config).as_deref(), Some(expected));
    let scene = scene.at_frequency(radio().waveform.carrier_hz);
    let mut deaf = config.clone();
    deaf.channel.impairments.dead_channels = vec![64];
    let expected = "channel.impairments.dead_channels holds 64, expected 0 to 63";
    assert_eq!(refused(&scene, &deaf).as_deref(), Some(expected));
    deaf.channel.impairments.dead_channels = vec![63];
    assert_eq!(refused(&scene, &deaf), None);
}
