//! A flight with a fault, flown and compared with the truth.

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
const DURATION_S: f64 = 45.0;

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
    /// Worst of the five seconds before the fault.
    pub(crate) before: Figures,
    /// Worst after it.
    pub(crate) worst: Figures,
    /// Worst of the last three seconds.
    pub(crate) end: Figures,
    /// At the first sweep after the flag.
    pub(crate) at_flag: Option<Figures>,
    /// Samples of the inertial sensor that were missing, repeated, late.
    pub(crate) missing: u32,
    pub(crate) repeated: u32,
    pub(crate) late: u32,
}

/// Flies with faults that begin at `fault_s`; `flagged` says which flags are meant.
pub(crate) fn fly(faults: &str, fault_s: f64, flagged: impl Fn(&LocalizerHealth) -> bool) -> Flown {
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
    let recorded = RecordedFlight::new(&scene, &flight, &sensors, &scenario, SEED).expect("a flight");
    let mut localizer = Box::new(Localizer::<f32, 44>::new(&config(), 0));
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
            Event::Sweep(sweep) => {
                now_ns = now_ns.max(sweep.time_ns);
                localizer.sweep(&SweepMeasurement {
                    time_ns: sweep.time_ns,
                    gmt: sweep.gmt,
                    stop: sweep.stop,
                    line_of_sight: sweep.line_of_sight,
                    reflections: &sweep.reflections,
                    planes: &planes,
                });
                let time_s = sweep.time_ns as f64 * 1e-9;
                let nearest = recorded
                    .truth
                    .iter()
                    .zip(1u32..)
                    .min_by(|a, b| {
                        let off = |n: u32| (f64::from(n) * 0.5 - time_s).abs();
                        off(a.1).total_cmp(&off(b.1))
                    })
                    .map(|(truth, _)| truth);
                let figures = figures(&localizer, nearest.expect("sweeps"));
                flown.finite &=
                    figures.is_none_or(|f| (f.position_m + f.attitude_deg + f.clock_ns).is_finite());
                let figures = figures.unwrap_or_default();
                if (fault_s - 5.0..fault_s).contains(&time_s) {
                    flown.before = flown.before.worst(figures);
                }
                if time_s >= fault_s {
                    flown.worst = flown.worst.worst(figures);
                }
                if time_s > DURATION_S - 3.0 {
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
fn figures(localizer: &Localizer<f32, 44>, truth: &TrueSweep) -> Option<Figures> {
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
