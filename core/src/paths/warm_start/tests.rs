//! Known paths in folded taps that are made by the definition of the signal.

use nalgebra::Complex;

use super::*;
use crate::array::{UavArrayConfig, UavArrays, UavLayout};
use crate::kernels::Iq;
use crate::kernels::stages::FoldedChannel;
use crate::paths::early_termination::Screen;
use crate::paths::effort::WorkLimit;
use crate::signal::{SAMPLES, Waveform};

/// Two elements of each array, as the screen looks at.
const CHANNELS: [u8; 8] = [2, 5, 10, 13, 18, 21, 26, 29];
const ARRAYS: usize = 4;

struct Path {
    delay_taps: f64,
    u: Vector3<f32>,
    /// Amplitude of a full tap.
    amplitude: f64,
}

impl Path {
    /// Sum over all channels at a full tap's peak.
    fn energy(&self) -> f32 {
        (32.0 * self.amplitude * self.amplitude) as f32
    }
}

fn model() -> ArrayModel<ARRAYS, 8> {
    ArrayModel::new(&UavArrays::default(), &Waveform::default())
}

/// Folded taps of paths by the definition: half the amplitude, even subcarriers, rounded.
fn folded(paths: &[Path]) -> ([FoldedChannel; FOLDED_CHANNELS], [u64; FOLDED_TAPS]) {
    folded_at(&model(), CHANNELS, paths)
}

/// The same at arrays of eight elements, of channels that are looked at.
fn folded_at<const A: usize>(
    model: &ArrayModel<A, 8>,
    channels: [u8; FOLDED_CHANNELS],
    paths: &[Path],
) -> ([FoldedChannel; FOLDED_CHANNELS], [u64; FOLDED_TAPS]) {
    let waveform = Waveform::default();
    let mut taps = [[Iq::ZERO; FOLDED_TAPS]; FOLDED_CHANNELS];
    for (row, channel) in taps.iter_mut().zip(channels) {
        let (j, i) = (usize::from(channel) / 8, usize::from(channel) % 8);
        let (step, lead) = model.arrays().nth(j).expect("array");
        for (n, tap) in row.iter_mut().enumerate() {
            let mut sum = Complex::new(0.0_f64, 0.0);
            for (p, path) in paths.iter().enumerate() {
                let delay = path.delay_taps - f64::from(lead.dot(&path.u));
                let spatial = f64::from(step.dot(&path.u)) * (i as f64 - 3.5) + 0.13 * (j + p) as f64;
                for k in (0..waveform.active)
                    .map(|a| waveform.offset(a))
                    .filter(|k| k % 2 == 0)
                {
                    let turns = f64::from(k) * (n as f64 - delay) / SAMPLES as f64 + spatial;
                    let angle = core::f64::consts::TAU * turns;
                    let share = 0.5 * path.amplitude / (waveform.active / 2) as f64;
                    sum += Complex::new(libm::cos(angle), libm::sin(angle)) * share;
                }
            }
            *tap = Iq::new(libm::round(sum.re) as i16, libm::round(sum.im) as i16);
        }
    }
    let profile = core::array::from_fn(|n| taps.iter().map(|row| u64::from(row[n].power())).sum());
    (taps, profile)
}

fn three() -> [Path; 3] {
    [
        Path {
            delay_taps: 100.3,
            u: Vector3::new(0.6, 0.0, 0.8),
            amplitude: 4000.0,
        },
        // Close to the first one, and weaker.
        Path {
            delay_taps: 101.1,
            u: Vector3::new(-0.48, 0.64, 0.6),
            amplitude: 900.0,
        },
        // Beyond the folded period, near its end: its kernel runs over it.
        Path {
            delay_taps: 510.8,
            u: Vector3::new(0.0, -1.0, 0.0),
            amplitude: 1500.0,
        },
    ]
}

fn known(paths: &[Path], louder: f32) -> KnownPaths {
    let mut known = KnownPaths::default();
    for (beam, path) in (0..).zip(paths) {
        known.learn(path.delay_taps as f32, path.u, louder * path.energy(), beam);
    }
    known
}

fn recognise(known: &KnownPaths, paths: &[Path], floor: f32) -> (Option<Vec<Seen, FITTED>>, u64) {
    let (mut taps, mut profile) = folded(paths);
    let template = Template::folded(&Waveform::default());
    let mut folded = Folded {
        taps: &mut taps,
        profile: &mut profile,
        strained: false,
    };
    let levels = Levels {
        floor,
        noise: 1.0,
        to_lsb: 1.0,
        threshold: 33.0,
    };
    let effort = Effort::new(WorkLimit::NONE);
    let seen =
        known.recognise::<ARRAYS, 8, 32>(&model(), &template, &CHANNELS, &mut folded, &levels, &effort);
    let sums = core::array::from_fn::<u64, FOLDED_TAPS, _>(|n| {
        folded.taps.iter().map(|row| u64::from(row[n].power())).sum()
    });
    assert_eq!(&sums, folded.profile, "the profile keeps step");
    (seen, profile.iter().copied().max().expect("taps"))
}

#[test]
fn known_paths_are_measured_and_taken_out() {
    let paths = three();
    let floor = paths[1].energy() / 100.0;
    let before = folded(&paths).1.iter().copied().max().expect("taps");
    let (seen, after) = recognise(&known(&paths, 2.0), &paths, floor);
    let seen = seen.expect("none is stronger than known");
    assert_eq!(seen.len(), 3);
    for seen in &seen {
        let ratio = seen.energy / paths[seen.index].energy();
        // The second one lies 0.8 taps beside one of twenty times its energy.
        let tolerance = if seen.index == 1 { 0.1 } else { 0.02 };
        assert!((ratio - 1.0).abs() < tolerance, "path {}: {ratio}", seen.index);
    }
    // What is left lies under a path at the floor: 8 channels of half its amplitude.
    let at_floor = floor / 16.0;
    assert!(
        (after as f32) < at_floor && before as f32 > 1e3 * at_floor,
        "{before} {after} {at_floor}"
    );
}

#[test]
fn a_path_at_eight_rows_is_measured_by_all_of_them() {
    let config = UavArrayConfig {
        layout: UavLayout::Planar { azimuth_rad: 0.0 },
        tilt_rad: 0.0,
        ..UavArrayConfig::default()
    };
    let model = ArrayModel::<8, 8>::new(&UavArrays::new(&config), &Waveform::default());
    // As many as there is room for: what lies beyond is not looked at.
    let screen = Screen::<64>::new::<8>();
    let channels = *screen.channels().first_chunk().expect("eight channels or more");
    let paths = [Path {
        delay_taps: 100.3,
        u: Vector3::new(0.8, 0.6, 0.0),
        amplitude: 4000.0,
    }];
    let (mut taps, mut profile) = folded_at(&model, channels, &paths);
    let mut folded = Folded {
        taps: &mut taps,
        profile: &mut profile,
        strained: false,
    };
    // All channels: twice those of four arrays.
    let energy = 2.0 * paths[0].energy();
    let mut known = KnownPaths::default();
    known.learn(100.3, paths[0].u, energy, 0);
    let levels = Levels {
        floor: energy / 1e4,
        noise: 1.0,
        to_lsb: 1.0,
        threshold: 33.0,
    };
    let (template, effort) = (
        Template::folded(&Waveform::default()),
        Effort::new(WorkLimit::NONE),
    );
    let seen = known.recognise::<8, 8, 64>(
        &model,
        &template,
        screen.channels(),
        &mut folded,
        &levels,
        &effort,
    );
    let seen = seen.expect("not stronger than known");
    let ratio = seen.first().expect("known").energy / energy;
    assert!((ratio - 1.0).abs() < 0.02, "{ratio}");
}

#[test]
fn unknown_path_stays() {
    let paths = three();
    let floor = paths[1].energy() / 100.0;
    // The first and the third are known, the second hides beside the first.
    let mut known = KnownPaths::default();
    for index in [0, 2] {
        known.learn(
            paths[index].delay_taps as f32,
            paths[index].u,
            2.0 * paths[index].energy(),
            index as u16,
        );
    }
    let (_, after) = recognise(&known, &paths, floor);
    assert!(after as f32 > 10.0 * floor / 16.0, "{after}");
}

#[test]
fn stronger_path_than_ever_asks_for_the_whole_beam() {
    let paths = three();
    let floor = paths[1].energy() / 100.0;
    for (louder, whole) in [(1.0 / 1.1, false), (1.0 / 1.5, true)] {
        let (seen, _) = recognise(&known(&paths, louder), &paths, floor);
        assert_eq!(seen.is_none(), whole, "known with {louder} of the energy");
    }
}

#[test]
fn best_look_tells_where_a_path_lies() {
    let u = Vector3::new(0.6, 0.0, 0.8);
    let beside = Vector3::new(0.57, 0.0, 0.821_645);
    let mut known = KnownPaths::default();
    known.learn(-0.1, u, 5.0, 1);
    // The same path across the period's end, first weaker, then stronger; another one of the same beam stays apart.
    known.learn(0.1, beside, 4.0, 2);
    assert_eq!((known.paths.len(), known.paths[0].u), (1, u));
    known.learn(0.1, beside, 6.0, 3);
    known.learn(0.2, u, 1.0, 3);
    assert_eq!((known.paths.len(), known.paths[0].u), (2, beside));
    let near = known.near(511, 1.0, 2.0).expect("known");
    assert!((near.delay_taps - 1.1).abs() < 1e-4 && near.u == beside);
    assert_eq!(
        (known.near(511, 1.0, 7.0), known.near(509, 1.0, 2.0)),
        (None, None)
    );
}

#[test]
fn weakest_known_path_gives_way() {
    let mut known = KnownPaths::default();
    for i in 0..=MOST {
        known.learn(3.0 * i as f32, Vector3::x(), 10.0 + i as f32, 1);
    }
    assert_eq!(known.paths.len(), MOST);
    assert!(known.near(0, 0.0, 0.0).is_none() && known.near(0, 3.0 * MOST as f32, 0.0).is_some());
    known.learn(200.0, Vector3::x(), 1.0, 2);
    assert!(known.near(0, 200.0, 0.0).is_none());
}
