//! A simulated world that has the antennas of `profile::quad_4x16_gmt_48`, and a channel that has those of `profile::planar_8x8_gmt_72`.

use std::f64::consts::TAU;

use cslam_core::geometry::Direction;
use cslam_core::paths::{EstimatedPath, PathEstimator};
use cslam_core::profile::planar_8x8_gmt_72 as planar;
use cslam_core::profile::quad_4x16_gmt_48::{
    ACTIVE, ARRAYS, BEAMS, CHANNELS, Config, ELEMENTS, FlightEstimator, SYMBOLS, radio,
};
use cslam_core::receiver;
use cslam_core::signal::{SAMPLES, Waveform};
use cslam_host_sim::channel::{
    ChannelConfig, GmtCounts, Impairments, Instant, Oscillators, Radio, Ray, Simulator,
};
use cslam_host_sim::flight::{FlightConfig, Heading};
use cslam_host_sim::paths::LinkPath;
use cslam_host_sim::random::Stream;
use cslam_host_sim::raw_flight::{Given, Source};
use cslam_host_sim::world::{HeardSweep, Profile, World, WorldConfig, instant};

use nalgebra::Vector3;

use crate::paths::{planar_signal, quad_signal};
use crate::signal::{C64, SPEED_OF_LIGHT_M_PER_S, Signal, Wave, beam_field};

type Scene = cslam_host_sim::scene::Scene;
type OwnWorld<'s> = World<'s, ARRAYS, ELEMENTS, CHANNELS>;

/// Paths that are as strong as this under the strongest are looked for, dB: the link of the planar array, at 60 GHz, has less to spare.
const RANGE_DB: f64 = 25.0;
const PLANAR_RANGE_DB: f64 = 20.0;

fn description() -> Radio {
    Radio::new(&radio(), GmtCounts::default()).expect("a sound radio")
}

/// Without noise, with the converter's full width.
fn exact(impairments: Impairments) -> ChannelConfig {
    let mut config = ChannelConfig {
        impairments,
        ..ChannelConfig::default()
    };
    config.front_end.noise = false;
    config.front_end.adc_bits = 16;
    config
}

/// A wave of this length that comes from, and left to, this zenith and azimuth.
fn ray(length_m: f64, [arrival, departure]: [[f64; 2]; 2]) -> Ray {
    Ray {
        amplitude: C64::from_polar(3e-5, 0.7),
        across: C64::new(0.0, 0.0),
        delay_s: length_m / SPEED_OF_LIGHT_M_PER_S,
        arrival: Direction::from_zenith_azimuth(arrival[0], arrival[1]).expect("angles"),
        departure: Direction::from_zenith_azimuth(departure[0], departure[1]).expect("angles"),
        doppler_hz: 0.0,
    }
}

/// Holds all beams of three waves against the signal model, whose beams have these elevations.
fn samples_are_those_of<const A: usize, const E: usize, const C: usize>(
    signal: &Signal,
    radio: Radio,
    elevations_deg: &[f64],
) {
    let beams = radio.beams();
    let simulator = Simulator::<A, E, C>::with_radio(radio, exact(Impairments::none()), 1);
    // 30 dBm less 3 dB.
    let sent = 10_f64.powf(-3.0 / 20.0);
    for (length_m, ends) in [
        (10.0, [[1.5, 0.3], [1.6, 0.2]]),
        (77.123_4, [[0.7, -2.0], [1.4, 2.2]]),
        (311.0, [[1.9, 3.0], [1.2, -1.9]]),
        (42.0, [[1.2, -0.8], [1.5, 1.0]]),
    ] {
        let ray = ray(length_m, ends);
        let sweep = simulator.sweep_rays(&[ray], &Instant::at_rest(), 0);
        assert_eq!(sweep.blocks.len(), beams);
        // The amplitude is that of a wave of mean power one at the body's origin, the model's that of a subcarrier.
        let amplitude = ray.amplitude.norm() * sent / (ACTIVE as f64).sqrt();
        let wave = Wave {
            from: *ray.arrival.vector(),
            c_tau_m: length_m,
        };
        let phase_turns = ray.amplitude.arg() / TAU + signal.carrier_hz * ray.delay_s;
        let waves = signal.waves(&wave, &[phase_turns; A], |_| amplitude);
        let unit = signal.channels(&[(&wave, &waves, 1.0)], 0.0, &mut Stream::new(28, 1));
        for block in &sweep.blocks {
            let field = beam_field(block.beam.into(), elevations_deg, ray.departure.vector());
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

#[test]
fn its_samples_are_those_of_the_signal_model_to_rounding() {
    samples_are_those_of::<ARRAYS, ELEMENTS, CHANNELS>(&quad_signal(), description(), &[0.0, 14.0]);
}

fn planar_description() -> Radio {
    Radio::new(&planar::radio(), GmtCounts::default()).expect("a sound radio")
}

#[test]
fn samples_of_a_planar_array_are_those_of_the_signal_model_to_rounding() {
    samples_are_those_of::<{ planar::ARRAYS }, { planar::ELEMENTS }, { planar::CHANNELS }>(
        &planar_signal(),
        planar_description(),
        &planar::radio().codebook.elevations_rad.map(f64::to_degrees),
    );
}

#[test]
fn rows_of_a_planar_array_have_one_oscillator() {
    let impairments = Impairments {
        free_array_phase: true,
        oscillators: Oscillators {
            phase_noise: true,
            ..Oscillators::default()
        },
        ..Impairments::none()
    };
    let ray = ray(25.0, [[1.5, 0.3], [1.6, 0.2]]);
    let [with, without] = [impairments, Impairments::none()].map(|impairments| {
        let radio = planar_description();
        let simulator =
            Simulator::<{ planar::ARRAYS }, { planar::ELEMENTS }, { planar::CHANNELS }>::with_radio(
                radio,
                exact(impairments),
                1,
            );
        simulator.sweep_rays(&[ray], &Instant::at_rest(), 0)
    });
    let mut of_beams = Vec::new();
    for (with, without) in with.blocks.iter().zip(&without.blocks) {
        // Phase of a sample against the one without, where it is no rounding.
        let turned = |channel: usize, sample: usize| {
            let [a, b] = [with, without].map(|block| block.samples[channel][sample]);
            let [a, b] = [a, b].map(|iq| C64::new(iq.re().into(), iq.im().into()));
            (b.norm() > 500.0).then(|| a * b.conj() / b.norm_sqr())
        };
        for sample in 0..SAMPLES {
            let turns: Vec<C64> = (0..planar::CHANNELS)
                .filter_map(|channel| turned(channel, sample))
                .collect();
            let first = turns.first().copied().unwrap_or(C64::new(1.0, 0.0));
            // Gain control may scale both differently.
            let apart = |turn: &C64| (turn * first.conj()).arg().abs();
            assert!(
                turns.iter().all(|turn| apart(turn) < 0.01),
                "beam {}, sample {sample}",
                with.beam
            );
            if sample == 100 && !turns.is_empty() {
                of_beams.push(first.arg());
            }
        }
    }
    let spread = of_beams.iter().map(|phase| phase.abs()).fold(0.0, f64::max);
    assert!(
        of_beams.len() > 5 && spread > 1.0,
        "another phase in each beam: {of_beams:?}"
    );
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

/// A true path as the body has it: the way, m, and the direction of arrival.
fn true_path<const C: usize>(path: &LinkPath, heard: &HeardSweep<C>) -> (f64, Vector3<f64>) {
    let towards = Direction::from_zenith_azimuth(path.aoa_zenith_rad, path.aoa_azimuth_rad).expect("angles");
    let attitude = instant(&heard.truth).expect("a rotation").attitude;
    let length_m = (path.delay_s + heard.truth.clock_offset_s) * SPEED_OF_LIGHT_M_PER_S;
    (length_m, *attitude.inverse().apply(towards).vector())
}

/// Lets a radio hear ten seconds of flights, whose UAV looks at the GMT when its array hears what is ahead.
fn finds_the_traced_paths<E, const A: usize, const ELEMENTS: usize, const C: usize>(
    (name, waveform, ahead): (&str, &Waveform, bool),
    radio: &Radio,
    estimator: &mut E,
) where
    E: PathEstimator<C, { receiver::PATHS }>,
{
    let mut config = short(Profile::Budget);
    if ahead {
        config.flight.heading = Heading::AtGmt;
    }
    println!("| radio | scene | true paths found | of | found paths that are true | of |");
    for scene_name in ["outdoor", "street", "indoor"] {
        let scene = config
            .scene(scene_name)
            .expect("built in")
            .at_frequency(waveform.carrier_hz);
        let world =
            World::<A, ELEMENTS, C>::with_radio(&scene, radio.clone(), config.clone(), 3).expect("a flight");
        let [mut strong, mut seen, mut found, mut true_ones] = [0; 4];
        for sweep in 0..world.sweeps() {
            let mut heard = world.sweep(sweep).expect("sound");
            for block in heard.beams.strongest_first() {
                estimator.push_beam(block.view());
            }
            let paths: Vec<EstimatedPath> = estimator.finish().to_vec();
            let near = |found: &EstimatedPath, path: &LinkPath| {
                let (length_m, u) = true_path(path, &heard);
                let off_m = f64::from(found.path.c_tau_m) - length_m;
                let found_u = found.path.aoa.vector().cast::<f64>();
                waveform.delay_period().wrap_m(off_m).abs() < 0.3
                    && found_u.dot(&u) > 2_f64.to_radians().cos()
            };
            // A planar array hears what is well before it.
            let is_heard = |path: &&LinkPath| !ahead || true_path(path, &heard).1.x > 0.5;
            let power = |path: &LinkPath| path.gain.map_or(0.0, |[re, im]| re * re + im * im);
            let most = heard
                .link
                .paths
                .iter()
                .filter(is_heard)
                .map(power)
                .fold(0.0, f64::max);
            let range_db = if ahead { PLANAR_RANGE_DB } else { RANGE_DB };
            let least = most * 10_f64.powf(-range_db / 10.0);
            let strong_ones = heard
                .link
                .paths
                .iter()
                .filter(is_heard)
                .filter(|path| power(path) > least);
            for path in strong_ones.take(4) {
                strong += 1;
                seen += usize::from(paths.iter().any(|found| near(found, path)));
            }
            // Along its rows, at half a wavelength, right and left look alike.
            let of_note = || {
                paths
                    .iter()
                    .filter(|path| !ahead || path.path.aoa.vector().x > 0.5)
            };
            found += of_note().count();
            let is_true = |found: &&EstimatedPath| heard.link.paths.iter().any(|path| near(found, path));
            true_ones += of_note().filter(is_true).count();
        }
        println!("| `{name}` | {scene_name} | {seen} | {strong} | {true_ones} | {found} |");
        assert!(strong >= 20, "{scene_name}: {strong} strong paths");
        assert!(10 * seen >= 8 * strong, "{scene_name}: {seen} of {strong}");
        assert!(
            10 * true_ones >= 9 * found,
            "{scene_name}: {true_ones} of {found}"
        );
    }
}

#[test]
fn path_estimation_finds_the_traced_paths_of_a_flight() {
    let mut estimator = Box::new(FlightEstimator::checked(&Config::of(&radio())).expect("a sound radio"));
    finds_the_traced_paths::<_, ARRAYS, ELEMENTS, CHANNELS>(
        ("quad_4x16_gmt_48", &radio().waveform, false),
        &description(),
        &mut *estimator,
    );
}

#[test]
fn path_estimation_of_a_planar_array_finds_the_traced_paths_of_a_flight() {
    let radio = planar::radio();
    let config = planar::Config::of(&radio);
    let mut estimator = Box::new(planar::FlightEstimator::checked(&config).expect("a sound radio"));
    finds_the_traced_paths::<_, { planar::ARRAYS }, { planar::ELEMENTS }, { planar::CHANNELS }>(
        ("planar_8x8_gmt_72", &radio.waveform, true),
        &planar_description(),
        &mut *estimator,
    );
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
