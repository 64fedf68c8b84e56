//! What the surfaces learn from a sweep: planes, extents and evidence, births, merges, ends; and the points that come of it.

use heapless::Vec;
use nalgebra::{Matrix3, SMatrix, Vector3};

use super::chain::{Chain, Prediction};
use super::config::AssociationConfig;
use super::likelihood::{innovation_covariance, joined};
use super::measurement::Measurement;
use super::part::part;
use super::points::{PathPoints, SurfacePoint, each_once, points_of};
use super::pose::PoseEstimate;
use super::prior::probability_of_order;
use super::verdict::{Association, Decision, Verdict};
use crate::estimator::{MAX_PLANES, Transmitter};
use crate::geometry::Plane;
use crate::link_state::Probabilities;
use crate::paths::ReceivedPath;
use crate::surfaces::birth::BirthPath;
use crate::surfaces::{MOST_REFLECTIONS, Sighting, StatusChanges, SurfaceIds, Surfaces, Waiting};

/// Points that a sweep hands over at most. Those of paths that waited stay for the next sweep when there is no room.
/// Capacity: memory of a sweep.
pub const POINTS: usize = 64;

/// What a sweep was associated with.
#[derive(Clone, Copy, Debug)]
pub struct SweepPaths<'a, const K: usize> {
    /// Its paths.
    pub paths: &'a Vec<ReceivedPath, K>,
    /// The pose that they were associated with.
    pub pose: &'a PoseEstimate,
    /// The transmitter.
    pub transmitter: &'a Transmitter,
    /// Number of the sweep.
    pub sweep: u32,
    /// Surfaces that were corrected together with the pose: of their planes the same paths say nothing new.
    pub held: &'a Vec<u16, MAX_PLANES>,
}

/// What came of a sweep.
#[derive(Clone, Debug, PartialEq)]
pub struct Learned<const N: usize> {
    /// Points for the map: of paths that confirmed surfaces explain, and of those that waited for them.
    pub points: Vec<SurfacePoint, POINTS>,
    /// Surfaces that were confirmed, demoted (their points leave the map) and died.
    pub changes: StatusChanges<N>,
    /// Surfaces that went into an older one: (gone, stays).
    pub merged: Vec<(u16, u16), N>,
}

/// A path with the pose it is seen with.
pub(super) struct Seen<'a, const K: usize> {
    pub(super) sweep: &'a SweepPaths<'a, K>,
    pub(super) pose: PoseEstimate,
    pub(super) config: &'a AssociationConfig,
    pub(super) index: usize,
    pub(super) measured: Measurement,
    pub(super) probabilities: Option<Probabilities>,
}

impl<const N: usize> Surfaces<N> {
    /// Learns from the verdicts of a sweep.
    // As its question, never inlined.
    #[inline(never)]
    pub fn learn<const K: usize>(
        &mut self,
        association: &Association<K>,
        sweep: &SweepPaths<'_, K>,
        config: &AssociationConfig,
    ) -> Learned<N> {
        let mut points = Vec::new();
        let pose = sweep.pose.relative_to(sweep.transmitter.sigma_m);
        for (index, (path, verdict)) in sweep.paths.iter().zip(&association.verdicts).enumerate() {
            let seen = Seen {
                sweep,
                pose,
                config,
                index,
                measured: Measurement::of(path, verdict.neighbourhood, &pose, &config.errors),
                probabilities: path.probabilities,
            };
            match verdict.decision {
                Decision::Explained | Decision::Tentative => {
                    self.take(&seen, verdict);
                    self.wait(&seen, verdict, &mut points);
                }
                Decision::New => self.bear_single(&seen),
                Decision::Unexplained => self.bear_pair(&seen),
                Decision::Ambiguous => {}
            }
        }
        self.count_against(association, sweep, config);
        let merged = self.merge();
        let changes = self.update_status();
        self.release(&mut points);
        Learned {
            points,
            changes,
            merged,
        }
    }

    /// Updates every surface of a chain with a path that it explains.
    fn take<const K: usize>(&mut self, seen: &Seen<'_, K>, verdict: &Verdict) {
        let transmitter_m = seen.sweep.transmitter.position_m;
        let Some((planes, predicted)) = self.predicted(&verdict.chain, seen) else {
            return;
        };
        let derivatives =
            Chain::over(&planes).derivatives(&transmitter_m, &predicted, &seen.measured.tangents);
        let by_surface = joined(&derivatives, &verdict.chain);
        let covariance = innovation_covariance(
            &derivatives,
            &by_surface,
            &planes,
            &seen.pose,
            &seen.measured.noise,
        );
        let covariance: Matrix3<f64> = part(&covariance, (0, 0));
        let innovation =
            seen.measured
                .innovation(predicted.range_m, &predicted.arrival, &predicted.departure);
        let innovation: Vector3<f64> = part(&innovation, (0, 0));
        let sigma = |variance: f64| libm::sqrt(variance.max(0.0));
        let across_m = predicted.range_m * sigma(covariance.m22.max(covariance.m33));
        let sighting = Sighting {
            transmitter_m: transmitter_m.map(|c| c as f32),
            alone: verdict.chain.len() == 1,
            network_log_ratio: network_log_ratio(seen, verdict.chain.len()),
            source_sigma_m: sigma(covariance.m11).max(across_m) as f32,
            chi_square: verdict.chi_square,
            sweep: seen.sweep.sweep,
        };
        let config = *self.config();
        // Errors of the pose last: so many sightings in a row tell no more than one of a plane, as far as it is the pose that errs.
        let by_pose = derivatives
            .pose
            .tr_mul(&(seen.pose.covariance * derivatives.pose));
        let by_pose: Matrix3<f64> = part(&by_pose, (0, 0));
        let covariance = covariance + by_pose * (f64::from(config.alike_sightings) - 1.0);
        for id in &each_once(&verdict.chain) {
            let first = verdict.chain.iter().position(|other| other == id).unwrap_or(0);
            let (Some(of), Some(plane), Some(surface)) =
                (by_surface.get(first), planes.get(first), self.get_mut(*id))
            else {
                continue;
            };
            let met = verdict
                .chain
                .iter()
                .zip(&predicted.points)
                .filter(|(other, _)| *other == id);
            if !seen.sweep.held.contains(id)
                && let Some(plane) = updated(plane, of, &innovation, &covariance)
            {
                surface.plane = plane;
                surface.floor_covariance(&config);
            }
            // One that is met twice is evidenced by where the wave left it for the UAV, whose flight moves that point.
            let last = met.clone().next_back();
            for (_, point) in met {
                surface.extend(point);
            }
            if let Some((_, point_m)) = last
                && !seen.measured.neighbourhood.may_be_artefact
            {
                let point_m = point_m.map(|c| c as f32);
                let odds = surface.evidence.take(&sighting, &point_m, &config);
                surface.add_log_odds(odds, &config);
            }
        }
    }

    /// The planes of a chain and the path over them.
    #[inline(never)]
    fn predicted<const K: usize>(
        &self,
        chain: &SurfaceIds,
        seen: &Seen<'_, K>,
    ) -> Option<(Vec<Plane<f64>, MOST_REFLECTIONS>, Prediction)> {
        let mut planes = Vec::new();
        for id in chain {
            planes.push(self.get(*id)?.plane.to_f64()).ok()?;
        }
        let transmitter_m = &seen.sweep.transmitter.position_m;
        let predicted = Chain::over(&planes).predict(transmitter_m, &seen.pose.position_m)?;
        Some((planes, predicted))
    }

    /// Hands the points of an explained path over, or lets it wait for its surfaces.
    fn wait<const K: usize>(
        &mut self,
        seen: &Seen<'_, K>,
        verdict: &Verdict,
        points: &mut Vec<SurfacePoint, POINTS>,
    ) {
        let Some((_, predicted)) = self.predicted(&verdict.chain, seen) else {
            return;
        };
        let held = verdict.departure_held > 0.5;
        let in_beams = seen.sweep.transmitter.leaves_in_beams(&predicted.departure);
        let outlier = seen.measured.departure.is_some() && in_beams && !held;
        if verdict.chain.is_empty() || outlier {
            return;
        }
        let path = seen.waiting(verdict.chain.clone());
        if !self.are_confirmed(&path.chain) {
            self.enqueue(path);
        } else if let Some(found) = points_of(self, &path) {
            append(points, &found);
        }
    }

    #[inline(never)]
    pub(super) fn enqueue(&mut self, path: Waiting) {
        if self.waiting.push(path) {
            crate::surfaces::count(&mut self.counters.forgotten);
        }
    }

    /// Hands the points over that waited for surfaces which are confirmed now, as far as there is room.
    fn release(&mut self, points: &mut Vec<SurfacePoint, POINTS>) {
        while points.capacity() - points.len() >= MOST_REFLECTIONS {
            let ready = |path: &Waiting| self.are_confirmed(&path.chain);
            let ready = self.waiting.paths().iter().position(ready);
            let Some(path) = ready.and_then(|index| self.waiting.remove(index)) else {
                break;
            };
            match points_of(self, &path) {
                Some(found) => append(points, &found),
                None => crate::surfaces::count(&mut self.counters.forgotten),
            }
        }
    }
}

impl<const K: usize> Seen<'_, K> {
    pub(super) fn waiting(&self, chain: SurfaceIds) -> Waiting {
        Waiting {
            sweep: self.sweep.sweep,
            path: u8::try_from(self.index).unwrap_or(u8::MAX),
            chain,
            transmitter_m: self.sweep.transmitter.position_m.map(|c| c as f32),
            uav_m: self.pose.position_m.map(|c| c as f32),
            uav_covariance_m2: self.position_covariance_m2().map(|c| c as f32),
        }
    }

    fn position_covariance_m2(&self) -> Matrix3<f64> {
        part(&self.pose.covariance, (0, 0))
    }

    pub(super) fn birth_path(&self) -> BirthPath {
        BirthPath {
            transmitter_m: self.sweep.transmitter.position_m,
            uav_m: self.pose.position_m,
            length_m: self.measured.path.c_tau_m,
            arrival: self.measured.path.aoa,
            path_covariance: self.measured.path.covariance,
            uav_covariance_m2: self.position_covariance_m2(),
        }
    }
}

/// What the network says for the order of a chain, against one reflection where it has several, and the reverse. The surfaces of a chain
/// share it.
fn network_log_ratio<const K: usize>(seen: &Seen<'_, K>, order: usize) -> f32 {
    let probability = |order| probability_of_order(seen.probabilities.as_ref(), order, seen.config);
    let ratio = libm::log(probability(1) / probability(2)) as f32;
    match order {
        1 => ratio,
        2 => -ratio / 2.0,
        _ => -ratio / 3.0,
    }
}

/// A plane after delay and arrival of a path, all else that they depend on being noise: Joseph's form.
fn updated(
    plane: &Plane<f64>,
    derivatives: &SMatrix<f64, 3, 5>,
    innovation: &Vector3<f64>,
    covariance: &Matrix3<f64>,
) -> Option<Plane> {
    // The innovation changes by this times the plane's error, so the correction is the error that explains it, with the other sign.
    let by: Matrix3<f64> = part(derivatives, (0, 0));
    let h = -by.transpose();
    let before = plane.covariance;
    let gain = before * h.transpose() * covariance.try_inverse()?;
    let noise = covariance - h * before * h.transpose();
    let rest = Matrix3::identity() - gain * h;
    let after = rest * before * rest.transpose() + gain * noise * gain.transpose();
    let after = (after + after.transpose()) * 0.5;
    let change = gain * innovation;
    let corrected = plane.corrected([change.x, change.y, change.z], after)?;
    Some(Plane {
        normal: crate::geometry::Direction::from_vector(corrected.normal.vector().map(|c| c as f32)).ok()?,
        centre: crate::geometry::Position::from_vector(corrected.centre.vector().map(|c| c as f32)).ok()?,
        covariance: after.map(|c| c as f32),
    })
}

/// Adds the points of a path, all or none.
fn append(points: &mut Vec<SurfacePoint, POINTS>, found: &PathPoints) {
    let _fits = points.extend_from_slice(found);
}
