//! One filter over one prepared flight.

use core::f64::consts::PI;

use cslam_core::geometry::{Direction, Plane, Position, Real, Rotation};
use cslam_core::localization::filter::{
    Bounces, CLOCK_OFFSET, Filter, FilterConfig, MappedPlane, PathMeasurement, ReflectedPath,
    SweepMeasurement, SweepVerdict, Transmitter, wrap_delay_m,
};
use cslam_core::localization::imu::{Alignment, Imu, ImuConfig, RestAlignment, RestConfig, RestStatus};
use nalgebra::{Matrix3, Rotation3, Vector3};

use super::flights::{Heard, Prepared, TruePath, TrueSweep};
use super::radio::{Ends, Hardware, RadioErrors};
use crate::seeded::{Seeded, Source};
use crate::sensors::Beacon;

const DEG: f64 = PI / 180.0;

/// Wrong paths taken for the line of sight.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Outliers {
    /// Share of sweeps that begin a run of them.
    pub rate: f64,
    /// Sweeps in a run; all err in the same way.
    pub run: u32,
}

/// How the filter starts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Start {
    /// On the ground, gyroscope bias found at rest.
    Rest,
    /// In flight at this time, s, nothing known.
    Flight(f64),
    /// In flight at this time, s, gyroscope bias known from rest.
    FlightAligned(f64),
}

/// Everything that is varied between the lines of a table.
#[derive(Clone, Copy, Debug)]
pub struct Scenario {
    /// The filter.
    pub filter: FilterConfig,
    /// Errors of the radio measurements.
    pub radio: RadioErrors,
    /// Wrong paths.
    pub outliers: Outliers,
    /// Standard deviations of mapped planes: offset m, tilt deg; `None` to fly without a map.
    pub map: Option<(f64, f64)>,
    /// Whether reflections have an angle of departure.
    pub reflected_departure: bool,
    /// Share of reflected paths that the estimator finds.
    pub detected: f64,
    /// Share of reflections that are associated with another plane than theirs.
    pub misjudged: f64,
    /// Most reflections of a path that corrects the pose, two at most.
    pub most_reflections: usize,
    /// No line of sight between these times, s.
    pub outage_s: Option<(f64, f64)>,
    /// Two-way timing is lost in the outage too.
    pub timing_in_outage: bool,
    /// Start.
    pub start: Start,
}

impl Default for Scenario {
    fn default() -> Self {
        Self {
            filter: FilterConfig::default(),
            radio: RadioErrors::default(),
            outliers: Outliers { rate: 0.02, run: 1 },
            map: None,
            reflected_departure: true,
            detected: 0.95,
            misjudged: 0.02,
            most_reflections: 2,
            outage_s: None,
            timing_in_outage: true,
            start: Start::Rest,
        }
    }
}

/// State of the filter against truth after a sweep.
#[derive(Clone, Copy, Debug)]
pub struct Record {
    /// Time of the sweep, s.
    pub time_s: f64,
    /// Whether there is a pose.
    pub running: bool,
    /// Whether the sweep had line of sight.
    pub sight: bool,
    /// Whether a wrong path was taken for it.
    pub outlier: bool,
    /// Reflections handed to the filter.
    pub reflections: usize,
    /// Distance to the GMT, m.
    pub range_m: f64,
    /// Position error, m.
    pub position_m: Vector3<f64>,
    /// Attitude error as a rotation vector in world axes, rad.
    pub attitude_rad: Vector3<f64>,
    /// Clock error, m.
    pub clock_m: f64,
    /// Normalised squared errors: position, attitude (3 each), clock (1).
    pub nees: [f64; 3],
    /// Normalised innovation squared of the sweep's line of sight, of 5 degrees of freedom.
    pub nis: f64,
    /// What became of the line of sight.
    pub verdict: SweepVerdict,
}

/// A sweep is processed this long after it began, ns: the estimator takes that long.
pub(super) const PROCESSING_NS: u64 = 200_000_000;

/// Flies a filter of `N` states whose covariance is in `T` over a flight, with `planes` as its map; a record a sweep.
///
/// Everything that flies is in use: monitor and integration of the inertial samples, alignment at rest, the filter with its
/// history. Sweeps are handed over 0.2 s late.
pub fn fly<T: Real, const N: usize>(
    flight: &Prepared,
    planes: &[(Vector3<f64>, Vector3<f64>)],
    scenario: &Scenario,
) -> Vec<Record> {
    let mut receiver = Receiver::new(flight, planes, scenario);
    let begin_ns = match scenario.start {
        Start::Rest => 0,
        Start::Flight(at_s) | Start::FlightAligned(at_s) => (at_s * 1e9) as u64,
    };
    let rest = match scenario.start {
        Start::Flight(_) => None,
        Start::Rest | Start::FlightAligned(_) => align(flight),
    };
    let mut filter = Filter::<T, N>::new(scenario.filter, begin_ns);
    let mut imu = Imu::new(ImuConfig::default());
    let mut aligned = false;
    let (mut records, mut begun, mut waiting) = (Vec::new(), None, None);
    for &(at, heard) in flight.heard.iter().filter(|(at, _)| *at > begin_ns) {
        if !aligned && let Some(rest) = rest.filter(|rest| rest.time_ns <= at) {
            filter.aligned(&rest);
            imu.set_errors(filter.imu_errors());
            aligned = true;
        }
        if waiting
            .as_ref()
            .is_some_and(|(time_ns, _)| at >= time_ns + PROCESSING_NS)
            && let Some((time_ns, beacon)) = waiting.take()
        {
            records.push(sweep(&mut filter, &mut receiver, time_ns, &beacon));
            imu.set_errors(filter.imu_errors());
        }
        match heard {
            Heard::Inertial(sample) => {
                if let Some(step) = imu.push(&sample) {
                    filter.step(&step);
                }
            }
            Heard::Timing(offset_m) => {
                if !receiver.timing_lost(at) {
                    let _ = filter.two_way(at, offset_m);
                }
            }
            Heard::Sweep(sweep) => begun = Some((at, sweep)),
            Heard::Beacon(beacon) => {
                if let Some((time_ns, _)) = begun.take().filter(|(_, sweep)| *sweep == beacon.sweep) {
                    waiting = Some((time_ns, beacon));
                }
            }
        }
    }
    records
}

fn sweep<T: Real, const N: usize>(
    filter: &mut Filter<T, N>,
    receiver: &mut Receiver<'_>,
    time_ns: u64,
    beacon: &Beacon,
) -> Record {
    let truth = &receiver.flight.sweeps[beacon.sweep as usize];
    let seen = receiver.sweep(beacon.sweep, truth);
    let measurement = SweepMeasurement {
        time_ns,
        gmt: transmitter(beacon),
        stop: beacon.sweep / beacon.sweeps_per_stop.max(1),
        line_of_sight: seen.sight,
        proven: false,
        level_yaw: None,
        contrary: None,
        reflections: &seen.reflections,
        heard: &[],
    };
    let verdict = filter.sweep(&measurement);
    filter.update_map(&mut receiver.map);
    record(filter, truth, beacon.sweep, &seen, verdict)
}

/// What the rest before the flight shows.
fn align(flight: &Prepared) -> Option<Alignment> {
    let mut rest = RestAlignment::new(RestConfig::default());
    flight.heard.iter().find_map(|(_, heard)| match heard {
        Heard::Inertial(sample) => match rest.push(sample) {
            RestStatus::Aligned(alignment) => Some(alignment),
            RestStatus::Gathering { .. } | RestStatus::Moving => None,
        },
        _ => None,
    })
}

pub(super) fn transmitter(beacon: &Beacon) -> Transmitter {
    let [heading, pitch, roll] = beacon.heading_pitch_roll_rad;
    Transmitter {
        position_m: beacon.position_m.into(),
        sigma_m: beacon.position_sigma_m,
        attitude: Rotation::from_yaw_pitch_roll(heading, pitch, roll)
            .unwrap_or_else(|_| Rotation::identity()),
    }
}

fn record<T: Real, const N: usize>(
    filter: &Filter<T, N>,
    truth: &TrueSweep,
    sweep: u32,
    seen: &Seen,
    verdict: SweepVerdict,
) -> Record {
    let state = filter.nominal();
    let position_m = state.position_m - truth.motion.position_m;
    let turn = Rotation3::from_matrix_unchecked(truth.motion.attitude.matrix() * state.attitude.transpose());
    let attitude_rad = turn.scaled_axis();
    let clock_m = wrap_delay_m(state.clock_offset_m - truth.clock_offset_m);
    let pose = filter.pose();
    let nees = |e: &Vector3<f64>, covariance: Option<Matrix3<f32>>| {
        covariance
            .and_then(|covariance| covariance.map(f64::from).try_inverse())
            .map_or(f64::NAN, |inverse| (inverse * e).dot(e))
    };
    let clock_variance = filter.covariance().at(CLOCK_OFFSET, CLOCK_OFFSET).to_f64();
    Record {
        time_s: (f64::from(sweep) + 1.0) * 0.5,
        running: filter.is_running(),
        sight: seen.visible,
        outlier: seen.wrong,
        reflections: seen.reflections.len(),
        range_m: (truth.gmt_m - truth.motion.position_m).norm(),
        position_m,
        attitude_rad,
        clock_m,
        nees: [
            nees(&position_m, pose.map(|pose| pose.position_covariance_m2)),
            nees(&attitude_rad, pose.map(|pose| pose.attitude_covariance_rad2)),
            clock_m * clock_m / clock_variance,
        ],
        nis: f64::from(filter.test_ratios().line_of_sight) * FilterConfig::default().gates.five,
        verdict,
    }
}

/// What the receiver made of a sweep.
pub(super) struct Seen {
    /// Whether the GMT can be seen.
    visible: bool,
    /// Whether `sight` is a wrong path.
    wrong: bool,
    pub(super) sight: Option<PathMeasurement>,
    /// Reflected paths with the planes of the map that they are associated with, strongest first.
    pub(super) reflections: Vec<ReflectedPath>,
}

/// The radio of one flight: hardware, map and the luck of the day.
pub(super) struct Receiver<'a> {
    flight: &'a Prepared,
    scenario: &'a Scenario,
    hardware: Hardware,
    gmt_attitude: Rotation3<f64>,
    pub(super) map: Vec<MappedPlane>,
    outliers: Seeded,
    run: Option<(u32, Wrong)>,
}

/// How a run of outliers errs.
#[derive(Clone, Copy)]
enum Wrong {
    /// A path of the scene, by its place in the list.
    Path(usize),
    /// As if the UAV were elsewhere: everything agrees but the place.
    Place(Vector3<f64>),
    /// Later by this, m, and turned about an axis by an angle, at either end.
    Free(f64, Vector3<f64>, Vector3<f64>),
}

impl<'a> Receiver<'a> {
    pub(super) fn new(
        flight: &'a Prepared,
        planes: &[(Vector3<f64>, Vector3<f64>)],
        scenario: &'a Scenario,
    ) -> Self {
        let mut random = Seeded::new(flight.seed, Source::MappedPlanes);
        let map = scenario.map.map_or(Vec::new(), |(offset_m, tilt_deg)| {
            planes
                .iter()
                .enumerate()
                .filter_map(|(id, (normal, centre))| {
                    let tilt = tilt_deg * DEG;
                    let covariance = Matrix3::from_diagonal(&Vector3::new(
                        (offset_m * offset_m) as f32,
                        (tilt * tilt) as f32,
                        (tilt * tilt) as f32,
                    ));
                    let plane = Plane {
                        normal: Direction::from_vector(normal.map(|c| c as f32)).ok()?,
                        centre: Position::from_vector(centre.map(|c| c as f32)).ok()?,
                        covariance,
                    };
                    let error = [
                        random.normal() * offset_m,
                        random.normal() * tilt,
                        random.normal() * tilt,
                    ];
                    let plane = plane.corrected(error.map(|c| c as f32), covariance)?;
                    Some(MappedPlane { id: id as u32, plane })
                })
                .collect()
        });
        Self {
            flight,
            scenario,
            hardware: Hardware::new(scenario.radio, flight.seed),
            gmt_attitude: flight.sensed.sweep_truth(0).gmt_attitude,
            map,
            outliers: Seeded::new(flight.seed, Source::RadioOutliers),
            run: None,
        }
    }

    fn in_outage(&self, sweep: u32) -> bool {
        let time_s = (f64::from(sweep) + 1.0) * 0.5;
        self.scenario
            .outage_s
            .is_some_and(|(from, to)| time_s > from && time_s <= to)
    }

    pub(super) fn timing_lost(&self, time_ns: u64) -> bool {
        let time_s = time_ns as f64 * 1e-9;
        !self.scenario.timing_in_outage
            && self
                .scenario
                .outage_s
                .is_some_and(|(from, to)| time_s > from && time_s <= to)
    }

    pub(super) fn sweep(&mut self, sweep: u32, truth: &TrueSweep) -> Seen {
        // Each sweep has noise of its own, so that one more path does not shift all later draws.
        let mut random = Seeded::numbered(self.flight.seed, Source::RadioNoise, sweep);
        let ends = Ends {
            attitude: truth.motion.attitude,
            gmt_attitude: self.gmt_attitude,
            clock_offset_m: truth.clock_offset_m,
        };
        let hidden = self.in_outage(sweep);
        let wrong = self.wrong(truth, hidden);
        let measure = |path: &TruePath, random: &mut Seeded| {
            self.hardware
                .measure(&ends, path.length_m, &path.arrival, &path.departure, random)
        };
        let mut sight = truth
            .sight()
            .filter(|_| !hidden)
            .and_then(|path| measure(path, &mut random));
        let visible = sight.is_some();
        let mut reflections = Vec::new();
        for path in truth.paths.iter().filter(|path| path.order > 0) {
            let (found, judged) = (random.uniform(), random.uniform());
            let Some(mut measured) = measure(path, &mut random).filter(|_| found < self.scenario.detected)
            else {
                continue;
            };
            if !self.scenario.reflected_departure {
                measured.departure = None;
            }
            // A draw below the share is even within it.
            let wrong = judged / self.scenario.misjudged;
            if let Some(planes) = self.associated(path, Some(wrong).filter(|wrong| *wrong < 1.0)) {
                reflections.push(ReflectedPath {
                    path: measured,
                    planes,
                });
            }
        }
        if let Some(wrong) = &wrong {
            sight = wrong_path(truth, wrong).and_then(|path| measure(&path, &mut random));
        }
        Seen {
            visible,
            wrong: wrong.is_some(),
            sight,
            reflections,
        }
    }

    /// The planes of the map that a path is associated with: its own, or one by `wrong`, from 0 to 1, in place of the first. `None` when the
    /// map does not have them, or when there are too many.
    fn associated(&self, path: &TruePath, wrong: Option<f64>) -> Option<Bounces> {
        let mut planes = Bounces::new();
        for place in path.planes.iter().flatten() {
            let plane = self.map.iter().find(|plane| plane.id as usize == *place)?;
            planes.push(*plane).ok()?;
        }
        if let (Some(wrong), Some(first)) = (wrong, planes.first_mut()) {
            let other = self.map.get((wrong * self.map.len() as f64) as usize)?;
            *first = *other;
        }
        (1..=self.scenario.most_reflections)
            .contains(&planes.len())
            .then_some(planes)
    }

    /// The run of outliers that this sweep belongs to.
    fn wrong(&mut self, truth: &TrueSweep, hidden: bool) -> Option<Wrong> {
        let draw = self.outliers.uniform();
        let kind = self.outliers.uniform();
        let (a, b, c) = (
            self.outliers.normal_vector(),
            self.outliers.normal_vector(),
            self.outliers.uniform(),
        );
        if let Some((left, wrong)) = self.run {
            self.run = (left > 1).then_some((left - 1, wrong));
            return Some(wrong);
        }
        if draw >= self.scenario.outliers.rate || (hidden && kind < 0.5) {
            return None;
        }
        let others = truth.paths.iter().filter(|path| path.order > 0).count();
        let wrong = if kind < 0.5 && others > 0 {
            Wrong::Path((c * others as f64) as usize)
        } else if kind < 0.75 {
            // A fix 10 m off.
            Wrong::Place(a.normalize() * 10.0)
        } else {
            Wrong::Free(2.0 + 18.0 * c, a.normalize() * (0.05 + 0.6 * kind), b * 0.2)
        };
        self.run = (self.scenario.outliers.run > 1).then_some((self.scenario.outliers.run - 1, wrong));
        Some(wrong)
    }
}

/// The path that is taken for the line of sight.
fn wrong_path(truth: &TrueSweep, wrong: &Wrong) -> Option<TruePath> {
    let straight = |way: Vector3<f64>| TruePath {
        order: 0,
        length_m: way.norm(),
        arrival: way.normalize(),
        departure: -way.normalize(),
        planes: [None; 2],
    };
    let way = truth.gmt_m - truth.motion.position_m;
    match wrong {
        Wrong::Path(place) => truth
            .paths
            .iter()
            .filter(|path| path.order > 0)
            .nth(*place)
            .copied(),
        Wrong::Place(shift) => Some(straight(way - shift)),
        Wrong::Free(late_m, arrival, departure) => {
            let plain = straight(way);
            Some(TruePath {
                length_m: plain.length_m + late_m,
                arrival: Rotation3::new(*arrival) * plain.arrival,
                departure: Rotation3::new(*departure) * plain.departure,
                ..plain
            })
        }
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// A record with a position error along x, everything else as expected.
    pub(in super::super) fn record(time_s: f64, sight: bool, error_m: f64) -> Record {
        Record {
            time_s,
            running: true,
            sight,
            outlier: false,
            reflections: 0,
            range_m: 50.0,
            position_m: Vector3::x() * error_m,
            attitude_rad: Vector3::zeros(),
            clock_m: 0.0,
            nees: [3.0, 3.0, 1.0],
            nis: 5.0,
            verdict: SweepVerdict::Accepted,
        }
    }
}
