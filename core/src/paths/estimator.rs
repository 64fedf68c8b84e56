//! The path estimator: beams in, one at a time, paths out at the end of the sweep.

use core::mem::MaybeUninit;

use heapless::Vec;
use nalgebra::Matrix3;

use super::PathEstimator;
use super::calibration::{Calibration, ElementErrors};
use super::departure::{Departures, Look};
use super::effort::{Effort, Work, WorkLimit};
use super::gate::Gate;
use super::grid::AngleGrid;
use super::merge::{Detection, Detections, Merged};
use super::meter::{Meter, Stage};
use super::model::ArrayModel;
use super::search::{Beam, Found, Left, SOURCES, Search};
use super::template::Template;
use crate::array::{Codebook, UavArrays};
use crate::geometry::{Body, Direction, Frame, Gmt, Rotation, World};
use crate::path::{Departure, Path};
use crate::paths::early_termination::Screen;
use crate::paths::warm_start::{FITTED, KnownPaths, Levels, Seen};
use crate::radio::RadioConfig;
use crate::signal::{
    BeamBlock, Correlator, Detector, SAMPLES, Scaled, TAP_EXPONENT, Waveform, Workspace, fit_threshold,
};

/// Paths of a sweep of which the departure is sought everywhere, the strongest that need it.
/// Capacity: 2.5 million instructions each. Others have none.
const DEPARTURE_SEARCHES: u8 = 3;

/// What the estimator needs to know about both ends of the link, and its few free parameters.
#[derive(Clone, Debug)]
pub struct EstimatorConfig<
    const A: usize = 4,
    const E: usize = 8,
    const FACES: usize = 3,
    const X: usize = 8,
    const Z: usize = 8,
    const ELEVATIONS: usize = 3,
> {
    /// Receive arrays, calibrated: `A` of `E` elements.
    pub arrays: UavArrays<f32, A, E>,
    /// Transmitted waveform.
    pub waveform: Waveform,
    /// Transmit beams.
    pub codebook: Codebook<f32, FACES, X, Z, ELEVATIONS>,
    /// False alarms a sweep on noise alone.
    /// Given: what is asked for (docs/path-estimation.md).
    pub false_alarms_per_sweep: f64,
    /// Paths weaker than the strongest one by more than this are not reported, dB.
    /// Given: what is asked for (docs/path-estimation.md).
    pub dynamic_range_db: f32,
    /// Whether a beam, and a candidate in it, is passed over as soon as it shows that it holds no path within the dynamic range of
    /// the strongest one so far, but those that an earlier beam showed better. Costs a path at the very floor one look in ten,
    /// 1 dB above it one in forty, and nothing more than 3 dB above it; begins when the strongest path's SNR, mean over the
    /// elements, exceeds about 16 dB.
    pub screening: bool,
    /// Whether a beam is passed over as soon as its power shows that it holds none, by the noise that earlier sweeps have shown, and
    /// beams that show nothing but noise take turns: each is looked at in every third sweep. For sweeps that follow each other.
    pub gating: bool,
    /// Errors of the receive elements. Beside a path they leave this square of its energy; what is weaker is not taken for a second path
    /// close to it, and the path's own place is not claimed to be known better.
    /// Derived: the root of the sum of squares of the poorest arrays' errors: gains of 0.5 dB, phases of 2 degrees, patterns that ripple by
    /// 1 dB and 5 degrees, coupling of -32 dB, the airframe's wave of -22 dB.
    pub element_errors: ElementErrors,
    /// Standard deviation of a transmit beam's gain, dB: widens the angle of departure.
    /// Derived: what the budget of the GMT's element errors makes of a beam.
    pub beam_gain_sigma_db: f32,
    /// What the search of a sweep may take.
    pub work_limit: WorkLimit,
}

impl Default for EstimatorConfig {
    /// docs/signal-model.md, "Path estimation": 1e-2 false alarms a sweep, 34 dB, 17 % (gains of 0.5 dB, phases of 2 degrees, patterns that
    /// ripple by 1 dB and 5 degrees, coupling of -32 dB and the airframe's scattered wave of -22 dB: the poorest arrays), and
    /// 0.3 dB, which is what the budget of the GMT's element errors makes of a beam.
    fn default() -> Self {
        Self {
            arrays: UavArrays::default(),
            waveform: Waveform::default(),
            codebook: Codebook::default(),
            false_alarms_per_sweep: 1e-2,
            dynamic_range_db: 34.0,
            screening: true,
            gating: true,
            element_errors: ElementErrors::Learned(0.17),
            beam_gain_sigma_db: 0.3,
            work_limit: WorkLimit::FLIGHT,
        }
    }
}

impl<
    const A: usize,
    const E: usize,
    const FACES: usize,
    const X: usize,
    const Z: usize,
    const ELEVATIONS: usize,
> EstimatorConfig<A, E, FACES, X, Z, ELEVATIONS>
{
    /// For a radio whose arrays are as they are drawn; all else as by default.
    #[must_use]
    pub fn of<const AZIMUTH_SWEEPS: usize, const ELEVATION_SWEEPS: usize>(
        radio: &RadioConfig<ELEVATIONS, AZIMUTH_SWEEPS, ELEVATION_SWEEPS>,
    ) -> Self {
        let default = EstimatorConfig::default();
        Self {
            arrays: radio.uav_arrays(),
            waveform: radio.waveform,
            codebook: radio.codebook(),
            false_alarms_per_sweep: default.false_alarms_per_sweep,
            dynamic_range_db: default.dynamic_range_db,
            screening: default.screening,
            gating: default.gating,
            element_errors: default.element_errors,
            beam_gain_sigma_db: default.beam_gain_sigma_db,
            work_limit: default.work_limit,
        }
    }
}

impl EstimatorConfig {
    /// For sweeps that are of no one flight, on a host that has the time: every beam may be looked at in each, and nothing is learned from
    /// one for the next.
    #[must_use]
    pub fn single_sweeps() -> Self {
        Self {
            gating: false,
            element_errors: ElementErrors::BUDGET,
            work_limit: WorkLimit::NONE,
            ..Self::default()
        }
    }
}

/// A path with what else the receiver saw of it. Its departure is in frame `D`: in the axes of the GMT as it is estimated, for only a beacon tells
/// how these stand in the world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EstimatedPath<D: Frame = Gmt> {
    /// Delay, angles and covariance. The covariance is that of noise (inverse Fisher information) and of the errors of the receive elements
    /// ([`ElementErrors`]), as if each path met another draw of them; what they share, attitude and clock add their own.
    pub path: Path<Body, f32, D>,
    /// Transmit beam in which the path was strongest.
    pub beam: u16,
    /// SNR per element and active subcarrier in that beam, mean over the elements, dB.
    pub snr_db: f32,
    /// Power per active subcarrier in that beam, summed over the elements, amplitude units of the blocks squared.
    pub energy: f32,
}

impl EstimatedPath {
    /// The same path with its departure in world axes, by how the GMT stands.
    #[must_use]
    pub fn with_departure_in_world(&self, gmt_attitude: &Rotation<Gmt, World>) -> EstimatedPath<World> {
        EstimatedPath {
            path: Path {
                c_tau_m: self.path.c_tau_m,
                aoa: self.path.aoa,
                aod: self.path.aod.map(|departure| departure.to_world(gmt_attitude)),
                covariance: self.path.covariance,
            },
            beam: self.beam,
            snr_db: self.snr_db,
            energy: self.energy,
        }
    }
}

/// What one beam gave.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct BeamReport {
    /// Paths found in it.
    pub paths: u8,
    /// Mean power of a sample, all channels added, amplitude units squared.
    pub power: f32,
    /// The beam was not searched: by its power it holds no path worth reporting, or only noise when it was not its turn, or the cheap stage
    /// saw that no such path is in it but those that an earlier beam showed better.
    pub weak: bool,
    /// The beam was not searched because the sweep's work was spent, see [`WorkLimit`].
    pub left_out: bool,
    /// Lanes that clipped in the transform, see [`crate::signal::BeamTaps::clips`].
    pub clips: u32,
    /// See [`crate::signal::BeamTaps::unexamined`].
    pub unexamined: u32,
}

/// Best mode. `A` arrays of `E` elements (`C` = A E channels), `BEAMS` transmit beams of `FACES` arrays of `X` x `Z`
/// elements, `MOST` detections kept in a sweep, `K` paths reported.
#[derive(Clone, Debug)]
pub struct Estimator<
    const A: usize = 4,
    const E: usize = 8,
    const C: usize = 32,
    const BEAMS: usize = 72,
    const FACES: usize = 3,
    const X: usize = 8,
    const Z: usize = 8,
    const MOST: usize = 360,
    const K: usize = 9,
    M = (),
> {
    model: ArrayModel<A, E>,
    calibration: Calibration,
    template: Template,
    folded_template: Template,
    grid: AngleGrid<A>,
    detector: Detector,
    gate: Option<Gate>,
    screen: Option<Screen<C>>,
    /// Noise variances that the fit of a path must explain.
    threshold: f32,
    correlator: Correlator,
    departures: Departures<BEAMS, FACES, X, Z>,
    /// Energy of the weakest path that is reported, relative to the strongest.
    share: f32,
    // State of a sweep.
    work: Workspace,
    profile: [u64; SAMPLES],
    found: Vec<Found<A>, SOURCES>,
    detections: Detections<MOST>,
    known: KnownPaths,
    effort: Effort,
    strongest: f32,
    /// What was left beside the first path of the beam that shows the strongest one.
    left: Option<Left>,
    /// Power of the strongest beam.
    loudest: f64,
    /// Noise variance of a tap in the last beam searched, amplitude units squared.
    noise: f32,
    meter: M,
}

impl<
    const A: usize,
    const E: usize,
    const C: usize,
    const BEAMS: usize,
    const FACES: usize,
    const X: usize,
    const Z: usize,
    const MOST: usize,
    const K: usize,
> Estimator<A, E, C, BEAMS, FACES, X, Z, MOST, K>
{
    /// An estimator with empty state. All tables are computed here. It is returned by value: where the stack is short, see
    /// [`Estimator::init`].
    pub fn new<const ELEVATIONS: usize>(config: &EstimatorConfig<A, E, FACES, X, Z, ELEVATIONS>) -> Self {
        Self::with_meter(config, ())
    }
}

impl<
    const A: usize,
    const E: usize,
    const C: usize,
    const BEAMS: usize,
    const FACES: usize,
    const X: usize,
    const Z: usize,
    const MOST: usize,
    const K: usize,
    M: Meter,
> Estimator<A, E, C, BEAMS, FACES, X, Z, MOST, K, M>
{
    /// [`Estimator::new`] with a meter of where the time goes.
    pub fn with_meter<const ELEVATIONS: usize>(
        config: &EstimatorConfig<A, E, FACES, X, Z, ELEVATIONS>,
        meter: M,
    ) -> Self {
        let mut estimator = Self::blank(config, meter);
        estimator.fill(config);
        estimator
    }

    /// Builds an estimator where it shall lie, static memory for example: its tables are computed there, not on the stack
    /// (docs/bindings.md, "C"). `config` as for [`Estimator::new`].
    pub fn init<'p, const ELEVATIONS: usize>(
        place: &'p mut MaybeUninit<Self>,
        config: &EstimatorConfig<A, E, FACES, X, Z, ELEVATIONS>,
        meter: M,
    ) -> &'p mut Self {
        let estimator = place.write(Self::blank(config, meter));
        estimator.fill(config);
        estimator
    }

    /// Computes the tables, where they lie.
    fn fill<const ELEVATIONS: usize>(&mut self, config: &EstimatorConfig<A, E, FACES, X, Z, ELEVATIONS>) {
        self.template.fill(&config.waveform);
        self.folded_template.fill_folded(&config.waveform);
        self.grid.fill(&self.model);
        self.correlator.fill(&config.waveform);
        self.departures.fill(&config.codebook);
    }

    /// An estimator without its tables: what is large in it is a constant of zeros, which the compiler writes
    /// straight to its place.
    #[inline(always)]
    fn blank<const ELEVATIONS: usize>(
        config: &EstimatorConfig<A, E, FACES, X, Z, ELEVATIONS>,
        meter: M,
    ) -> Self {
        const { assert!(C == A * E && K <= 255) };
        let calibration = Calibration::new(config.element_errors);
        let mut model = ArrayModel::new(&config.arrays, &config.waveform);
        model.set_calibration_share(calibration.share());
        let share = libm::powf(10.0, -0.1 * config.dynamic_range_db);
        let gain_sigma = libm::powf(10.0, 0.05 * config.beam_gain_sigma_db) - 1.0;
        Self {
            template: const { Template::blank() },
            folded_template: const { Template::blank() },
            grid: const { AngleGrid::blank() },
            model,
            calibration,
            detector: Detector::new(C, config.false_alarms_per_sweep, BEAMS * config.waveform.active),
            threshold: fit_threshold(config.false_alarms_per_sweep, BEAMS),
            gate: config
                .gating
                .then(|| Gate::new(C * SAMPLES, C * config.waveform.active)),
            screen: config.screening.then(Screen::new::<E>),
            correlator: const { Correlator::blank() },
            departures: Departures::blank(&config.codebook, gain_sigma),
            share,
            work: const { Workspace::new() },
            profile: [0; SAMPLES],
            found: Vec::new(),
            detections: Detections::new(),
            known: KnownPaths::default(),
            effort: Effort::new(config.work_limit),
            strongest: 0.0,
            left: None,
            loudest: 0.0,
            noise: 0.0,
            meter,
        }
    }

    /// Detections of the current sweep that found no place in the list.
    pub fn dropped(&self) -> u32 {
        self.detections.dropped()
    }

    /// Turns what the search found into detections, in amplitude units and metres.
    fn keep(&mut self, noise: f32, exponent: i32, beam: u16) -> u8 {
        let scale = libm::scalbnf(1.0, 2 * exponent);
        let metres = self.model.metres_per_tap();
        // Noise of the taps is correlated: least squares sees it as if 1 / occupancy stronger.
        let variance = 0.5 * noise / self.template.occupancy();
        let paths = || self.found.iter().filter(|f| !f.remainder);
        let members = |group: u8| paths().filter(|f| f.group == group).count() as u8;
        // Errors of the arrays act as noise on all that is fitted jointly: in a channel, the share of what the group holds there.
        let of_group = |group: u8| {
            paths()
                .filter(|f| f.group == group)
                .map(|f| f.source.power())
                .sum::<f32>()
        };
        let mut count = 0;
        for found in paths() {
            let energy = found.source.power() * C as f32 * scale;
            let Ok(aoa) = Direction::from_vector(found.source.u) else {
                continue;
            };
            if energy < self.share * self.strongest {
                continue;
            }
            self.strongest = self.strongest.max(energy);
            self.known
                .learn(found.source.delay_from(0), found.source.u, energy, beam);
            let units = [metres, 1.0, 1.0];
            let covariance = Matrix3::from_fn(|r, c| {
                let [row, column] = [r, c].map(|i| units.get(i).copied().unwrap_or(1.0));
                let spread = found
                    .spread
                    .get(c)
                    .and_then(|column| column.get(r))
                    .copied()
                    .unwrap_or(0.0);
                variance * row * column * spread
            });
            self.detections.insert(Detection {
                c_tau_m: self.model.metres(found.source.origin, found.source.delay_taps),
                aoa,
                covariance,
                energy,
                noise: noise * scale,
                errors: self.model.calibration_share() * of_group(found.group) / noise.max(f32::MIN_POSITIVE),
                beam,
                members: members(found.group),
                glance: false,
                path: None,
            });
            count += 1;
        }
        count
    }

    /// Notes how strong known paths are in a beam that was not transformed: those that would be worth reporting.
    fn glance(&mut self, seen: &[Seen], to_lsb: f32, noise_gain: f32, beam: u16) -> u8 {
        let mut count = 0;
        for seen in seen {
            let energy = seen.energy / to_lsb;
            let known = self.known.get(seen.index);
            let Some((known, Ok(aoa))) = known.map(|known| (known, Direction::from_vector(known.u))) else {
                continue;
            };
            if energy >= self.share * self.strongest {
                self.detections.insert(Detection {
                    c_tau_m: self.model.metres(0, known.delay_taps),
                    aoa,
                    covariance: Matrix3::zeros(),
                    energy,
                    noise: self.noise * noise_gain,
                    errors: 0.0,
                    beam,
                    members: 1,
                    glance: true,
                    path: None,
                });
                count += 1;
            }
        }
        count
    }

    /// Everything about one beam: its gate, a look, and where that cannot tell, the transform.
    fn search(&mut self, block: BeamBlock<'_, C>) -> BeamReport {
        let measured = self.correlator.measure(block);
        let power = measured.mean_power();
        let weak = BeamReport {
            weak: true,
            power: power as f32,
            ..BeamReport::default()
        };
        // A tap gathers Na times the power of a sample at most: a path worth reporting adds this to its beam.
        let floor_power = f64::from(self.share * self.strongest / self.template.active());
        let is_strongest = power > self.loudest;
        self.loudest = self.loudest.max(power);
        let opens = match &mut self.gate {
            Some(gate) => {
                gate.measured(power);
                gate.opens(measured.beam(), power, floor_power)
            }
            None => power >= floor_power,
        };
        if !opens {
            return weak;
        }
        if self.effort.is_spent() && !is_strongest {
            return BeamReport {
                left_out: true,
                ..weak
            };
        }
        let scaled = measured.scale();
        let exponent = scaled.exponent().saturating_add(TAP_EXPONENT);
        let to_lsb = libm::scalbnf(1.0, exponent.saturating_mul(-2));
        let levels = Levels {
            floor: self.share * self.strongest * to_lsb,
            noise: self.noise * to_lsb,
            to_lsb,
            threshold: self.threshold,
        };
        if let Some(paths) = self.look(&scaled, &levels) {
            return BeamReport { paths, ..weak };
        }
        BeamReport {
            weak: false,
            power: weak.power,
            ..self.transform(scaled, levels)
        }
    }

    /// A cheap look at a beam: how many known paths it shows, when it shows nothing that is worth a transform.
    fn look(&mut self, scaled: &Scaled<'_, C>, levels: &Levels) -> Option<u8> {
        let screen = self.screen.as_ref()?;
        if !screen.can_tell(levels.floor, levels.noise) {
            return None;
        }
        self.meter.enter(Stage::Detection);
        self.effort.spend(Work::Look);
        let mut folded = self.correlator.detect(scaled, screen.channels(), &mut self.work);
        let seen: Option<Vec<Seen, FITTED>> = if screen.is_empty(&folded, levels.floor) {
            Some(Vec::new())
        } else if folded.strained {
            None
        } else {
            self.known
                .recognise::<A, E, C>(
                    &self.model,
                    &self.folded_template,
                    screen.channels(),
                    &mut folded,
                    levels,
                    &self.effort,
                )
                .filter(|_| screen.is_empty(&folded, levels.floor))
        };
        let noise_gain = screen.noise_gain();
        let paths = seen.map(|seen| self.glance(&seen, levels.to_lsb, noise_gain, scaled.beam()));
        if paths.is_none() {
            self.meter.enter(Stage::FrontEnd);
        }
        paths
    }

    /// Transforms a beam and finds its paths.
    fn transform(&mut self, scaled: Scaled<'_, C>, levels: Levels) -> BeamReport {
        self.effort.spend(Work::Transform);
        let taps = self.correlator.correlate(scaled, &mut self.work);
        let (clips, unexamined) = (taps.clips(), taps.unexamined());
        self.profile = *taps.profile();
        self.found.clear();
        let BeamBlock {
            samples,
            beam,
            exponent,
        } = taps.into_block();
        let search = Search {
            model: &self.model,
            template: &self.template,
            grid: &self.grid,
            detector: &self.detector,
            levels,
            known: &self.known,
            effort: &self.effort,
            meter: &self.meter,
        };
        let mut under = Beam {
            taps: samples,
            profile: &mut self.profile,
            found: &mut self.found,
        };
        self.meter.enter(Stage::Detection);
        let noise = search.run(&mut under);
        self.meter.enter(Stage::Rest);
        let scale = libm::scalbnf(1.0, exponent.saturating_mul(2));
        let first = under
            .found
            .first()
            .map(|first| first.source.power() * C as f32 * scale);
        if first > Some(self.strongest) {
            self.left = under.left_beside_first(noise);
        }
        self.noise = noise * scale;
        if let Some(gate) = &mut self.gate {
            // A tap sums the noise of Na of the subcarriers of each channel; that of a sample is spread over all of them.
            let bins = C as f32 * SAMPLES as f32 / self.template.active();
            gate.shown(f64::from(self.noise * bins));
        }
        BeamReport {
            paths: self.keep(noise, exponent, beam),
            clips,
            unexamined,
            ..BeamReport::default()
        }
    }

    fn estimated(&self, index: usize, merged: &Merged, searches: &mut u8) -> EstimatedPath {
        let (c_tau_m, aoa, covariance) = merged.mean();
        let first = &merged.strongest;
        let looks = self.detections.looks(index).map(|look| Look {
            beam: look.beam,
            amplitude: libm::sqrtf(look.energy),
            variance: 0.5 * look.noise / self.template.occupancy(),
        });
        let aod = self
            .departures
            .fit(looks, searches)
            .map(|(direction, sigma_rad)| Departure { direction, sigma_rad });
        // A tap sums Na subcarriers coherently: Na^2 in power for the path, Na for the noise.
        let active = self.template.active();
        let snr = first.energy / (C as f32 * active * first.noise.max(f32::MIN_POSITIVE));
        EstimatedPath {
            path: Path {
                c_tau_m,
                aoa,
                aod,
                covariance,
            },
            beam: first.beam,
            snr_db: 10.0 * libm::log10f(snr),
            energy: first.energy / (active * active),
        }
    }
}

impl<
    const A: usize,
    const E: usize,
    const C: usize,
    const BEAMS: usize,
    const FACES: usize,
    const X: usize,
    const Z: usize,
    const MOST: usize,
    const K: usize,
    M: Meter,
> PathEstimator<C, K> for Estimator<A, E, C, BEAMS, FACES, X, Z, MOST, K, M>
{
    fn push_beam(&mut self, block: BeamBlock<'_, C>) -> BeamReport {
        let outer = self.meter.enter(Stage::FrontEnd);
        let report = self.search(block);
        self.meter.enter(outer);
        report
    }

    fn front_end(&mut self) -> (&Correlator, &mut Workspace) {
        (&self.correlator, &mut self.work)
    }

    fn finish(&mut self) -> Vec<EstimatedPath, K> {
        let outer = self.meter.enter(Stage::Merge);
        let merged: Vec<Merged, K> = self.detections.merge(self.share);
        self.meter.enter(Stage::Departure);
        let mut paths: Vec<EstimatedPath, K> = Vec::new();
        let mut searches = DEPARTURE_SEARCHES;
        for (index, path) in merged.iter().enumerate() {
            // As many as were merged: there is room.
            let _ = paths.push(self.estimated(index, path, &mut searches));
        }
        if let Some(gate) = &mut self.gate {
            gate.end_sweep(BEAMS);
        }
        if let Some(left) = self.left.take() {
            self.calibration.observe(left.left, left.noise, left.energy);
            self.model.set_calibration_share(self.calibration.share());
        }
        self.detections.clear();
        self.known.clear();
        self.effort.clear();
        (self.strongest, self.noise, self.loudest) = (0.0, 0.0, 0.0);
        self.meter.enter(outer);
        paths
    }
}
