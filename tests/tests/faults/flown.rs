//! A flight with a fault, flown and compared with the truth.

use std::sync::OnceLock;

use cslam_core::constants::SPEED_OF_LIGHT_M_PER_S;
use cslam_core::localization::filter::{SweepMeasurement, wrap_delay_m};
use cslam_core::localization::{Localizer, LocalizerHealth};
use cslam_firmware::flight_check::{Event, config};
use cslam_host_sim::flight::FlightConfig;
use cslam_host_sim::localization::{Outliers, RecordedFlight, Scenario, TrueSweep};
use cslam_host_sim::scene::Scene;
use cslam_host_sim::sensors::SensorsConfig;
use nalgebra::Rotation3;

const SEED: u64 = 3;
const DURATION_S: f64 = 60.0;
/// How long there is line of sight before a fault begins, and after, s. The filter takes a fix after an outage only when
/// the next confirms it, so the pose is settled a little later than sight comes back.
const SIGHTED_S: (f64, f64) = (6.0, 14.0);
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
    fn worst(self, other: Self) -> Self {
        Self {
            position_m: self.position_m.max(other.position_m),
            attitude_deg: self.attitude_deg.max(other.attitude_deg),
            clock_ns: self.clock_ns.max(other.clock_ns),
        }
    }
}

/// What came of a flight.
pub(crate) struct Flown {
    /// Every number of every pose is finite.
    pub(crate) finite: bool,
    /// Time from the fault to the flag, s.
    pub(crate) flagged_after_s: Option<f64>,
    /// Worst of the four seconds before the fault.
    pub(crate) before: Figures,
    /// Worst from the fault to the end.
    pub(crate) worst: Figures,
    /// Worst from ten seconds after the fault on.
    pub(crate) end: Figures,
    /// At the first sweep after the flag.
    pub(crate) at_flag: Option<Figures>,
    /// Samples of the inertial sensor that were missing, repeated, late.
    pub(crate) missing: u32,
    pub(crate) repeated: u32,
    pub(crate) late: u32,
}

fn recorded(faults: &str) -> RecordedFlight {
    let flight = FlightConfig {
        duration_s: DURATION_S,
        ..FlightConfig::default()
    };
    let sensors = SensorsConfig {
        faults: toml::from_str(faults).expect("valid"),
        ..SensorsConfig::default()
    };
    let scenario = Scenario {
        outliers: Outliers { rate: 0.0, run: 1 },
        map: Some((0.1, 0.2)),
        ..Scenario::default()
    };
    let scene = Scene::load("outdoor").expect("built in");
    RecordedFlight::new(&scene, &flight, &sensors, &scenario, SEED).expect("a flight")
}

/// Time of a sweep, s.
fn sweep_s(sweep: usize) -> f64 {
    (sweep as f64 + 1.0) * 0.5
}

/// The first sweep from 15 s on with line of sight around it for long enough.
fn fault_sweep() -> usize {
    static SWEEP: OnceLock<usize> = OnceLock::new();
    *SWEEP.get_or_init(|| {
        let truth = recorded("").truth;
        let (before, after) = ((SIGHTED_S.0 * 2.0) as usize, (SIGHTED_S.1 * 2.0) as usize);
        (30..truth.len().saturating_sub(after))
            .find(|&sweep| {
                truth[sweep - before..sweep + after]
                    .iter()
                    .all(|t| t.sight().is_some())
            })
            .expect("a stretch of line of sight")
    })
}

/// Flies with faults, in which `@T` stands for the time at which they begin (a tenth of a second before a sweep) and `@S`
/// for that sweep; `flagged` says which flags are meant.
pub(crate) fn fly(faults: &str, flagged: impl Fn(&LocalizerHealth) -> bool) -> Flown {
    let sweep = fault_sweep();
    let fault_s = sweep_s(sweep) - 0.1;
    let faults = faults
        .replace("@T", &format!("{fault_s:?}"))
        .replace("@S", &sweep.to_string());
    let recorded = recorded(&faults);
    let mut localizer = Box::new(Localizer::<f32, 58>::new(&config(), 0));
    let mut flown = Flown {
        finite: true,
        flagged_after_s: None,
        before: Figures::default(),
        worst: Figures::default(),
        end: Figures::default(),
        at_flag: None,
        missing: 0,
        repeated: 0,
        late: 0,
    };
    let mut planes = Vec::new();
    let mut now_ns = 0;
    for event in &recorded.events {
        match event {
            Event::Imu(sample) => {
                now_ns = now_ns.max(sample.time_ns);
                localizer.sample(sample);
            }
            Event::TwoWay { time_ns, offset_m } => {
                now_ns = now_ns.max(*time_ns);
                localizer.two_way(*time_ns, *offset_m);
            }
            Event::Magnetic { time_ns, field_ut } => {
                now_ns = now_ns.max(*time_ns);
                let _ = localizer.magnetic(*time_ns, field_ut);
            }
            Event::Plane(plane) => planes.push(*plane),
            Event::Begin { time_ns } => {
                now_ns = now_ns.max(*time_ns);
                localizer.announce_sweep(*time_ns);
            }
            Event::Sweep(sweep) => {
                now_ns = now_ns.max(sweep.time_ns);
                let reflections = sweep.reflected(&planes);
                localizer.sweep(&SweepMeasurement {
                    time_ns: sweep.time_ns,
                    gmt: sweep.gmt,
                    stop: sweep.stop,
                    line_of_sight: sweep.line_of_sight,
                    proven: false,
                    level_yaw: None,
                    contrary: None,
                    reflections: &reflections,
                    heard: &[],
                });
                let time_s = sweep.time_ns as f64 * 1e-9;
                // The clock is off by microseconds only.
                let number = (time_s * 2.0 - 0.5) as usize;
                let figures = figures(&localizer, &recorded.truth[number]);
                flown.finite &=
                    figures.is_none_or(|f| (f.position_m + f.attitude_deg + f.clock_ns).is_finite());
                let figures = figures.unwrap_or_default();
                if (fault_s - BEFORE_S..fault_s).contains(&time_s) {
                    flown.before = flown.before.worst(figures);
                }
                if (fault_s..fault_s + END_S.1).contains(&time_s) {
                    flown.worst = flown.worst.worst(figures);
                }
                if (fault_s + END_S.0..fault_s + END_S.1).contains(&time_s) {
                    flown.end = flown.end.worst(figures);
                }
                if flown.flagged_after_s.is_some() {
                    flown.at_flag = flown.at_flag.or(Some(figures));
                }
            }
        }
        let now_s = now_ns as f64 * 1e-9;
        if now_s >= fault_s && flown.flagged_after_s.is_none() && flagged(&localizer.health(now_ns)) {
            flown.flagged_after_s = Some(now_s - fault_s);
        }
    }
    let counters = localizer.imu().counters();
    (flown.missing, flown.repeated, flown.late) = (counters.missing, counters.repeated, counters.late);
    flown
}

/// Errors at the horizon, which is the sweep just taken; `None` without a pose.
fn figures(localizer: &Localizer<f32, 58>, truth: &TrueSweep) -> Option<Figures> {
    let filter = localizer.filter();
    if !filter.is_running() {
        return None;
    }
    let state = filter.nominal();
    let turn = Rotation3::from_matrix_unchecked(truth.motion.attitude.matrix() * state.attitude.transpose());
    let clock_m = wrap_delay_m(state.clock_offset_m - truth.clock_offset_m);
    Some(Figures {
        position_m: (state.position_m - truth.motion.position_m).norm(),
        attitude_deg: turn.angle().to_degrees(),
        clock_ns: clock_m.abs() / SPEED_OF_LIGHT_M_PER_S * 1e9,
    })
}
