//! The path estimator: beams in, one at a time, paths out at the end of the sweep.

mod build;
mod pilots;

use heapless::Vec;
use nalgebra::{Matrix3, Vector3};

use super::PathEstimator;
use super::calibration::Calibration;
use super::departure::{Departures, Look};
use super::effort::{Effort, Work};
use super::estimated::{BeamReport, EstimatedPath};
use super::gate::Gate;
use super::grid::AngleGrid;
use super::merge::{Detection, Detections, Merged};
use super::meter::{Meter, Stage};
use super::model::ArrayModel;
use super::pilot::Pilots;
use super::search::{Beam, Found, Left, SOURCES, Search};
use super::template::Template;
use crate::geometry::Direction;
use crate::path::{Departure, Path};
use crate::paths::early_termination::Screen;
use crate::paths::warm_start::{FITTED, KnownPaths, Levels, Seen};
use crate::signal::{BeamBlock, Correlator, Detector, SAMPLES, Scaled, TAP_EXPONENT, Workspace};

/// Paths of a sweep of which the departure is sought everywhere, the strongest that need it.
/// Capacity: 2.5 million instructions each. Others have none.
const DEPARTURE_SEARCHES: u8 = 3;

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
    pilots: Pilots<A, K>,
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
    M: Meter,
> Estimator<A, E, C, BEAMS, FACES, X, Z, MOST, K, M>
{
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
            range_rate: None,
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

    fn push_pilot(&mut self, block: BeamBlock<'_, C>, turn: &Vector3<f32>, paths: &mut [EstimatedPath]) {
        let outer = self.meter.enter(Stage::Rest);
        self.hear_pilot(block, turn, paths);
        self.meter.enter(outer);
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
        self.pilots.clear();
        (self.strongest, self.noise, self.loudest) = (0.0, 0.0, 0.0);
        self.meter.enter(outer);
        paths
    }
}
