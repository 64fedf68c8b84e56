//! A flight with a fault, flown and compared with the truth.

use std::sync::OnceLock;

use cslam_core::estimator::Health;
use cslam_core::telemetry::HealthCounters;
use cslam_host_sim::kept_flight::{Changes, KeptFlight, PoseErrors, pose_errors};
use cslam_host_sim::raw_flight::board_config;
use cslam_host_sim::scene::Scene;
use cslam_host_sim::sensors::FaultsConfig;
use cslam_host_sim::world::{Profile, WorldConfig};

/// A flight in whose sweeps 60 to 99 the UAV is below 24 degrees of elevation at the GMT and less than 60 m away, in line of sight: nowhere else
/// can a sweep fix the attitude that a fault has taken.
const SEED: u64 = 23;
const DURATION_S: f64 = 60.0;
const SIGHTED: core::ops::Range<u32> = 60..100;
/// The sweep before which faults begin.
const SWEEP: u32 = 72;
/// When the pose is looked at before the fault, s before it.
const BEFORE_S: f64 = 4.0;
/// When the pose must be as good as before, s after the fault.
const END_S: (f64, f64) = (10.0, 13.5);

/// Errors at one time, or the worst of several.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Figures {
    pub(crate) position_m: f64,
    pub(crate) attitude_deg: f64,
    pub(crate) clock_ns: f64,
}

impl Figures {
    fn worst(self, other: &PoseErrors) -> Self {
        Self {
            position_m: self.position_m.max(other.position_m),
            attitude_deg: self.attitude_deg.max(other.attitude_deg),
            clock_ns: self.clock_ns.max(other.clock_ns),
        }
    }
}

/// What came of a flight.
#[derive(Debug)]
pub(crate) struct Flown {
    /// Every number of every pose is finite.
    pub(crate) finite: bool,
    /// Time from the fault to the first sweep with the flag, s.
    pub(crate) flagged_after_s: Option<f64>,
    /// Worst of the four seconds before the fault.
    pub(crate) before: Figures,
    /// Worst from the fault to the end.
    pub(crate) worst: Figures,
    /// Worst from ten seconds after the fault on.
    pub(crate) end: Figures,
    /// At the first sweep with the flag.
    pub(crate) at_flag: Option<Figures>,
    /// Whether a path was taken for the line of sight, in each of the first three sweeps of the fault.
    pub(crate) taken: [bool; 3],
    /// What the ground hears at the end.
    pub(crate) counters: HealthCounters,
}

/// The flight, with the paths of each sweep: without a fault, or with fixes that are wrong (their errors are in the samples).
fn kept(wrong_fixes: bool) -> &'static KeptFlight<'static> {
    static KEPT: [OnceLock<KeptFlight<'static>>; 2] = [OnceLock::new(), OnceLock::new()];
    KEPT[usize::from(wrong_fixes)].get_or_init(|| {
        static SCENE: OnceLock<Scene> = OnceLock::new();
        let scene = SCENE.get_or_init(|| Scene::load("outdoor").expect("built in"));
        let mut config = WorldConfig::of(Profile::Budget);
        config.flight.duration_s = DURATION_S;
        if wrong_fixes {
            config.sensors.faults = parsed("[[fix]]\nsweep = @S\nsweeps = 3\ndistance_m = 10.0");
        }
        let flight = KeptFlight::fly(scene, config, SEED).expect("a flight");
        for sweep in SIGHTED {
            let truth = flight.world().flight().sweep_truth(sweep);
            let way_m = truth.uav.position_m - truth.gmt_position_m;
            assert!(
                way_m.norm() < 60.0 && way_m.z.abs() < 0.4 * way_m.norm(),
                "{sweep}"
            );
            assert!(flight.sights()[sweep as usize], "{sweep}");
        }
        flight
    })
}

/// When faults begin, s: a tenth of a second before their sweep.
fn fault_s() -> f64 {
    (f64::from(SWEEP) + 1.0) * 0.5 - 0.1
}

/// Faults, in which `@T` stands for the time at which they begin and `@S` for the sweep after it.
fn parsed(faults: &str) -> FaultsConfig {
    let faults = faults
        .replace("@T", &format!("{:?}", fault_s()))
        .replace("@S", &SWEEP.to_string());
    toml::from_str(&faults).expect("valid")
}

/// Flies with faults; `flagged` says which flags are meant.
pub(crate) fn fly(faults: &str, flagged: impl Fn(&Health) -> bool) -> Flown {
    again(kept(false), parsed(faults), flagged)
}

/// Flies with three sweeps whose line of sight is 10 m off.
pub(crate) fn fly_wrong_fixes() -> Flown {
    again(kept(true), FaultsConfig::default(), |_| false)
}

fn again(flight: &KeptFlight<'_>, faults: FaultsConfig, flagged: impl Fn(&Health) -> bool) -> Flown {
    let changes = Changes {
        faults,
        ..Changes::default()
    };
    let mut flown = Flown {
        finite: true,
        flagged_after_s: None,
        before: Figures::default(),
        worst: Figures::default(),
        end: Figures::default(),
        at_flag: None,
        taken: [false; 3],
        counters: HealthCounters::default(),
    };
    let mut counters = HealthCounters::default();
    flight
        .again(
            &changes,
            board_config().expect("sound models"),
            |swept, truth| {
                let report = swept.report;
                // The UAV's clock is off by microseconds only, but where it steps.
                let after_s = (f64::from(report.sweep) + 1.0) * 0.5 - fault_s();
                let errors = report.pose.as_ref().map(|pose| pose_errors(pose, truth));
                if let Some(errors) = &errors {
                    flown.finite &=
                        (errors.position_sigmas + errors.attitude_deg + errors.clock_ns).is_finite();
                    for (figures, from_s, to_s) in [
                        (&mut flown.before, -BEFORE_S, 0.0),
                        (&mut flown.worst, 0.0, END_S.1),
                        (&mut flown.end, END_S.0, END_S.1),
                    ] {
                        if (from_s..to_s).contains(&after_s) {
                            *figures = figures.worst(errors);
                        }
                    }
                }
                if let Some(taken) = report
                    .sweep
                    .checked_sub(SWEEP)
                    .and_then(|k| flown.taken.get_mut(k as usize))
                {
                    *taken = report.verdict.is_taken();
                }
                if after_s >= 0.0 && flown.flagged_after_s.is_none() && flagged(&report.health) {
                    flown.flagged_after_s = Some(after_s);
                    flown.at_flag = errors.map(|errors| Figures::default().worst(&errors));
                }
            },
            |receiver| counters = receiver.health_counters(),
        )
        .expect("flown");
    flown.counters = counters;
    flown
}
