//! Trials over the 8 x 8 faces.

use cslam_core::array::{Codebook, GmtArrays, UavArrays, phasor};
use cslam_core::beam_squint::Sighting;
use cslam_core::constants::SPEED_OF_LIGHT_M_PER_S;
use cslam_core::geometry::{Body, Direction, Gmt};
use cslam_core::paths::EstimatedPath;
use cslam_core::signal::Waveform;
use nalgebra::Vector3;
use rayon::prelude::*;

use super::bound::{Hearing, position_variance_m2};
use super::case::Case;
use super::receiver::Receiver;
use crate::channel::{ChannelConfig, FrontEndConfig, Impairments, Instant, Ray, Simulator};
use crate::random::Stream;
use crate::statistics::rms;

/// Figures of a row. Position errors are 3-D norms, rms over the trials, m.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Row {
    /// What was tried.
    pub case: Case,
    /// Trials.
    pub trials: usize,
    /// Cramer-Rao bound of the line of sight alone without errors, m.
    pub bound_m: f64,
    /// Maximum likelihood, m.
    pub fit_m: f64,
    /// Rms of the errors of maximum likelihood, each over its bound.
    pub fit_over_bound: f64,
    /// Squared error of the cosines in units of the fit's own covariance, over 2.
    pub fit_nees: f64,
    /// Rms errors of the fit's cosines.
    pub fit_cosines_rms: [f64; 2],
    /// Maximum likelihood on every face that is heard, joined, m.
    pub joined_m: f64,
    /// Squared error of the joined direction in units of its own covariance, over 2.
    pub joined_nees: f64,
    /// Share of the trials in which two faces were joined.
    pub joined_share: f64,
    /// Parabola, m.
    pub parabola_m: f64,
    /// Peak subcarrier, m.
    pub pick_m: f64,
    /// Squared error of the cosines in units of the readings' own covariance, over 2: parabola and pick.
    pub peak_nees: [f64; 2],
    /// Trials in which the fit refused.
    pub refused: usize,
}

/// Errors of one trial.
struct Errors {
    bound_m: f64,
    /// Fit, parabola and pick; none where refused.
    readings: [Option<Reading>; 3],
    /// All faces together.
    joined: Option<JoinedReading>,
}

/// Errors of the faces' joined direction.
#[derive(Clone, Copy)]
struct JoinedReading {
    position_m: f64,
    nees: f64,
    faces: usize,
}

/// Errors of one reading.
#[derive(Clone, Copy)]
struct Reading {
    position_m: f64,
    /// Squared error of the cosines in units of the covariance, over 2.
    nees: f64,
    cosines: [f64; 2],
}

/// Carrier wavelength, m.
fn wavelength_m() -> f64 {
    SPEED_OF_LIGHT_M_PER_S / Waveform::default().carrier_hz
}

/// Height of the GMT over the ground, m.
const GMT_HEIGHT_M: f64 = 1.5;
/// Beams sent for each path.
const BEAMS: usize = 3;
/// Amplitude of the bounce: -6 dB.
const BOUNCE: f64 = 0.501;

/// Where the UAV is: before a face, GMT frame.
struct Scene {
    face: usize,
    rays: Vec<Ray>,
    cosines: [f64; 2],
    position_m: Vector3<f64>,
    /// The vertical as the receiver knows it: 0.5 degrees off about each axis.
    down: Direction<Body>,
}

impl Scene {
    /// Anywhere within 60 degrees of a face's normal, 0.5 to 16.5 m over the GMT but at most 30 degrees.
    fn draw(case: &Case, stream: &mut Stream) -> Self {
        let face = ((3.0 * stream.uniform()) as usize).min(2);
        let azimuth = face as f64 * std::f64::consts::TAU / 3.0
            + (2.0 * stream.uniform() - 1.0) * std::f64::consts::FRAC_PI_3;
        let d = case.distance_m;
        let height = 0.5 + ((0.5 * d).min(16.5) - 0.5) * stream.uniform();
        let yaw = std::f64::consts::TAU * stream.uniform();
        let horizontal = (d * d - height * height).sqrt();
        let to = |height: f64| {
            Vector3::new(
                horizontal * libm::cos(azimuth),
                horizontal * libm::sin(azimuth),
                height,
            )
        };
        let mut ray = |way: Vector3<f64>, amplitude: f64| {
            // Level UAV: the body is turned by yaw only. A bounce arrives from the image below and leaves downwards.
            let arrival = -way;
            let (sine, cosine) = libm::sincos(yaw);
            let body = Vector3::new(
                cosine * arrival.x + sine * arrival.y,
                cosine * arrival.y - sine * arrival.x,
                arrival.z,
            );
            let length = way.norm();
            let phase = phasor(std::f64::consts::TAU * stream.uniform());
            (
                body,
                length,
                phase * (amplitude * wavelength_m() / (4.0 * std::f64::consts::PI * length)),
            )
        };
        let position_m = to(height);
        let mut rays = Vec::new();
        let (body, length, amplitude) = ray(position_m, 1.0);
        rays.push(Ray {
            amplitude,
            across: nalgebra::Complex::ZERO,
            delay_s: length / SPEED_OF_LIGHT_M_PER_S,
            arrival: unit(body),
            departure: unit(position_m),
            doppler_hz: 0.0,
        });
        if case.bounce {
            // From the GMT's image, 3 m lower; the departure is mirrored.
            let way = to(height + 2.0 * GMT_HEIGHT_M);
            let (body, length, amplitude) = ray(way, BOUNCE);
            rays.push(Ray {
                amplitude,
                across: nalgebra::Complex::ZERO,
                delay_s: length / SPEED_OF_LIGHT_M_PER_S,
                arrival: unit(body),
                departure: unit(Vector3::new(way.x, way.y, -way.z)),
                doppler_hz: 0.0,
            });
        }
        let mut tilt = || stream.normal() * 0.5_f64.to_radians();
        let down =
            Direction::from_vector(Vector3::new(tilt() as f32, tilt() as f32, -1.0)).expect("not zero");
        let arrays = GmtArrays::<f64>::default();
        let cosines = GmtArrays::<f64>::cosines(&arrays.faces()[face], &rays[0].departure);
        Self {
            face,
            rays,
            cosines,
            position_m,
            down,
        }
    }
}

fn unit<F: cslam_core::geometry::Frame>(v: Vector3<f64>) -> Direction<F, f64> {
    Direction::from_vector(v).expect("not zero")
}

/// The line of sight, the first of the strong paths, as a receiver that knows the link state takes it.
fn sight(paths: &[EstimatedPath], null: bool, down: &Direction<Body>) -> Option<Sighting> {
    let strongest = paths.first()?.energy;
    let strong = paths
        .iter()
        .enumerate()
        .filter(|(_, p)| p.energy > 0.05 * strongest);
    let (los, _) = strong.min_by(|a, b| a.1.path.c_tau_m.total_cmp(&b.1.path.c_tau_m))?;
    let beam = usize::from(paths.get(los)?.beam);
    let face = Codebook::<f32>::default().beam(beam)?.face;
    let mut sighting = Sighting::new(true, paths, los, face, &Waveform::default().delay_period())?;
    if null {
        let range_m = sighting.c_tau_m;
        let up = unit::<Gmt>(Vector3::z());
        let up = Direction::from_vector(up.vector().cast()).expect("unit");
        sighting = sighting.with_ground(range_m, GMT_HEIGHT_M as f32, down, &up);
    } else {
        sighting.interferers.clear();
    }
    Some(sighting)
}

fn trial(case: &Case, receiver: &mut Receiver, seed: u64, index: u32) -> Errors {
    let mut stream = Stream::new(seed, u64::from(index));
    let scene = Scene::draw(case, &mut stream);
    let device = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ u64::from(index);
    let simulator = Simulator::new(config(case, &scene), device);
    let waveform = Waveform::default();
    let gmt = GmtArrays::<f64>::default();
    let face = &gmt.faces()[scene.face];
    let los = &scene.rays[0];
    let amplitude = los.amplitude.norm() * simulator.signal_amplitude() * gmt.amplitude(face, &los.departure);
    // Waveforms of power one have 512/416 of it on each active subcarrier; noise has its power on all.
    let snr = amplitude * amplitude * 512.0 / waveform.active as f64 / simulator.noise_power_w();
    let symbols = case.symbols_of_a_face(&waveform);
    let hearing = Hearing {
        symbols: &symbols,
        waveform: &waveform,
        cosines: scene.cosines,
        snr: UavArrays::<f64>::default()
            .amplitude(&los.arrival)
            .map(|gain| 8.0 * gain * gain * snr),
    };
    let distance_m = scene.position_m.norm();
    let bound = hearing.bound().map_or(f64::NAN, |b| {
        position_variance_m2(&b, scene.cosines, distance_m).sqrt()
    });

    let mut beams = simulator.sweep_rays(&scene.rays, &Instant::at_rest(), index);
    for block in beams.strongest_first() {
        receiver.estimator.push_beam(block.view());
    }
    let paths = receiver.estimator.finish();
    let Some(sighting) = sight(&paths, case.null, &scene.down) else {
        return Errors {
            bound_m: bound,
            readings: [None; 3],
            joined: None,
        };
    };
    let single = GmtArrays::<f32>::default();
    let heard = receiver.listen(case, &simulator, &scene.rays, &sighting, scene.face, index);
    let joined = heard[0]
        .ok()
        .and_then(|first| receiver.join(case, &simulator, &scene.rays, &sighting, &first, index))
        .and_then(|joined| {
            let c_tau_m = joined.delay.map_or(sighting.c_tau_m, |d| d.c_tau_m);
            let position = joined.direction.vector().cast::<f64>() * f64::from(c_tau_m);
            let (e1, e2) = joined.direction.tangents();
            let off = scene.position_m / distance_m - joined.direction.vector().cast::<f64>();
            let off = nalgebra::Vector2::new(off.dot(&e1.cast()), off.dot(&e2.cast()));
            let information = joined.covariance.cast::<f64>().try_inverse()?;
            Some(JoinedReading {
                position_m: (position - scene.position_m).norm(),
                nees: off.dot(&(information * off)) / 2.0,
                faces: joined.faces,
            })
        });
    let readings = heard.map(|bearing| {
        let bearing = bearing.ok()?;
        let direction: Direction<Gmt> = bearing.direction(&single.faces()[scene.face])?;
        let c_tau_m = bearing.delay.map_or(sighting.c_tau_m, |d| d.c_tau_m);
        let position = direction.vector().cast::<f64>() * f64::from(c_tau_m);
        let off = nalgebra::Vector2::from_fn(|i, _| f64::from(bearing.cosines[i]) - scene.cosines[i]);
        let mut covariance = bearing.covariance.cast::<f64>();
        // What a filter knows besides: the constant part of the face's error.
        for (i, sigma) in case.face_bias_sigma().into_iter().enumerate() {
            covariance[(i, i)] += f64::from(sigma * sigma);
        }
        let information = covariance.try_inverse()?;
        Some(Reading {
            position_m: (position - scene.position_m).norm(),
            nees: off.dot(&(information * off)) / 2.0,
            cosines: off.into(),
        })
    });
    Errors {
        bound_m: bound,
        readings,
        joined,
    }
}

/// The channel of a trial: only the beams that show a path best are sent, path estimation needs no more.
fn config(case: &Case, scene: &Scene) -> ChannelConfig {
    let codebook = Codebook::<f64>::default();
    let mut sent = Vec::new();
    for ray in &scene.rays {
        let mut beams: Vec<(u16, f64)> = (0..codebook.len())
            .map(|m| (m as u16, codebook.field(m, &ray.departure).norm_sqr()))
            .collect();
        beams.sort_by(|a, b| b.1.total_cmp(&a.1));
        sent.extend(beams.iter().take(BEAMS).map(|(m, _)| *m));
    }
    let budget = Impairments::budget();
    let of = |on: bool, value: f64| if on { value } else { 0.0 };
    ChannelConfig {
        front_end: FrontEndConfig {
            snr_offset_db: case.snr_offset_db,
            ..FrontEndConfig::default()
        },
        impairments: Impairments {
            free_array_phase: true,
            gmt_element_phase_rms_deg: of(case.gmt_errors, budget.gmt_element_phase_rms_deg),
            gmt_element_delay_rms_ps: of(case.gmt_errors, budget.gmt_element_delay_rms_ps),
            uav_element_phase_rms_deg: of(case.uav_errors, budget.uav_element_phase_rms_deg),
            uav_axis_rms_deg: of(case.uav_errors, budget.uav_axis_rms_deg),
            uav_array_delay_rms_ps: of(case.uav_errors, budget.uav_array_delay_rms_ps),
            dropped_beams: (0..codebook.len() as u16).filter(|m| !sent.contains(m)).collect(),
            ..Impairments::none()
        },
        ..ChannelConfig::default()
    }
}

/// Runs the trials of a row.
pub fn run(case: &Case, trials: usize, seed: u64) -> Row {
    let all: Vec<Errors> = (0..trials as u32)
        .into_par_iter()
        .map_init(
            || Receiver::new(case),
            |receiver, index| trial(case, receiver, seed, index),
        )
        .collect();
    let column = |reading: usize, pick: fn(&Reading) -> f64| -> Vec<f64> {
        all.iter()
            .filter_map(|e| e.readings[reading].as_ref().map(pick))
            .collect()
    };
    let root = |values: &[f64]| rms(values).unwrap_or(f64::NAN);
    let error_m = |reading: usize| root(&column(reading, |r| r.position_m));
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
    let nees = |reading: usize| mean(&column(reading, |r| r.nees));
    let bounds: Vec<f64> = all.iter().map(|e| e.bound_m).collect();
    let over_bound = |e: &Errors| e.readings[0].map(|r| r.position_m / e.bound_m);
    let joined: Vec<JoinedReading> = all.iter().filter_map(|e| e.joined).collect();
    let of_joined = |pick: fn(&JoinedReading) -> f64| -> Vec<f64> { joined.iter().map(pick).collect() };
    let ratios: Vec<f64> = all.iter().filter_map(over_bound).collect();
    Row {
        case: *case,
        trials,
        bound_m: root(&bounds),
        fit_m: error_m(0),
        fit_over_bound: root(&ratios),
        fit_nees: nees(0),
        fit_cosines_rms: [
            root(&column(0, |r| r.cosines[0])),
            root(&column(0, |r| r.cosines[1])),
        ],
        joined_m: root(&of_joined(|j| j.position_m)),
        joined_nees: mean(&of_joined(|j| j.nees)),
        joined_share: mean(&of_joined(|j| if j.faces > 1 { 1.0 } else { 0.0 })),
        parabola_m: error_m(1),
        pick_m: error_m(2),
        peak_nees: [nees(1), nees(2)],
        refused: all.iter().filter(|e| e.readings[0].is_none()).count(),
    }
}
