//! Flights in which the GMT lies: a beacon that tells another place, two-way timing that tells another offset. Both are signed, so
//! nothing but the measurements themselves can tell.

use cslam_core::localization::filter::{Setup, SweepMeasurement};
use cslam_core::localization::{Localizer, LocalizerConfig};
use cslam_firmware::flight_check::{Event, config};

use super::{RecordedFlight, Scenario};
use crate::flight::FlightConfig;
use crate::input::InputError;
use crate::scene::Scene;
use crate::sensors::{FaultsConfig, SensorsConfig};

/// An error of the pose beyond so many of its standard deviations is not shown in them.
pub const SHOWN_SIGMAS: f64 = 3.0;

/// What came of a flight with a lie in it.
#[derive(Clone, Copy, Debug, Default)]
pub struct LieFigures {
    /// From the first sweep with a lie to the first with a flag, s.
    pub flagged_after_s: Option<f64>,
    /// Greatest position error from then on, m.
    pub worst_m: f64,
    /// Greatest position error in standard deviations: the length of the error over the root of the covariance's trace.
    pub worst_sigmas: f64,
    /// Position error after the last sweep, m.
    pub last_m: f64,
    /// Sweeps with a pose from then on.
    pub sweeps: usize,
    /// Those beyond [`SHOWN_SIGMAS`] without a flag.
    pub silent: usize,
}

/// Flies `seed` with `faults` that begin at `onset_s`. With `setup_within_m` the receiver knows where the GMT was set up, to within that.
///
/// Errors of the budget, wrong paths and no map: what a beacon moves is moved with nothing to hold it.
///
/// # Errors
/// [`InputError`] when a figure is out of range or the scene has no room.
pub fn fly_lie(
    scene: &Scene,
    flight: &FlightConfig,
    faults: &FaultsConfig,
    onset_s: f64,
    setup_within_m: Option<f64>,
    seed: u64,
) -> Result<LieFigures, InputError> {
    let sensors = SensorsConfig {
        faults: faults.clone(),
        ..SensorsConfig::default()
    };
    let recorded = RecordedFlight::new(scene, flight, &sensors, &Scenario::default(), seed)?;
    let mut localizer_config: LocalizerConfig = config();
    localizer_config.filter.beacon.setup = setup_within_m.map(|within_m| Setup {
        position_m: recorded
            .truth
            .first()
            .map_or_else(Default::default, |sweep| sweep.gmt_m),
        within_m,
    });
    let mut localizer = Box::new(Localizer::<f32, 58>::new(&localizer_config, 0));
    let mut figures = LieFigures::default();
    let mut truth = recorded.truth.iter();
    for event in &recorded.events {
        let sweep = match event {
            Event::Imu(sample) => {
                localizer.sample(sample);
                continue;
            }
            Event::TwoWay { time_ns, offset_m } => {
                localizer.two_way(*time_ns, *offset_m);
                continue;
            }
            Event::Magnetic { time_ns, field_ut } => {
                let _refused = localizer.magnetic(*time_ns, field_ut);
                continue;
            }
            Event::Begin { time_ns } => {
                localizer.announce_sweep(*time_ns);
                continue;
            }
            Event::Plane(_) => continue,
            Event::Sweep(sweep) => sweep,
        };
        localizer.sweep(&SweepMeasurement {
            time_ns: sweep.time_ns,
            gmt: sweep.gmt,
            stop: sweep.stop,
            line_of_sight: sweep.line_of_sight,
            proven: false,
            contrary: None,
            level_yaw: None,
            reflections: &[],
            heard: &[],
        });
        let Some(truth) = truth.next() else { break };
        let time_s = sweep.time_ns as f64 * 1e-9;
        if time_s < onset_s {
            continue;
        }
        let health = localizer.filter().health();
        let flagged = health.beacon_implausible || health.clock_contested;
        if flagged {
            figures.flagged_after_s.get_or_insert(time_s - onset_s);
        }
        let Some(pose) = localizer.filter().pose() else {
            continue;
        };
        let error_m = (pose.position.vector().map(f64::from) - truth.motion.position_m).norm();
        let sigma_m = f64::from(pose.position_covariance_m2.trace()).sqrt();
        figures.sweeps += 1;
        figures.worst_m = figures.worst_m.max(error_m);
        figures.last_m = error_m;
        figures.worst_sigmas = figures.worst_sigmas.max(error_m / sigma_m);
        figures.silent += usize::from(!flagged && error_m > SHOWN_SIGMAS * sigma_m);
    }
    Ok(figures)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sensors::TimingFault;

    #[test]
    fn timing_that_is_wrong_from_the_start_is_found_by_motion() {
        let scene = Scene::load("outdoor").expect("a scene");
        let flight = FlightConfig {
            duration_s: 60.0,
            ..FlightConfig::default()
        };
        let faults = FaultsConfig {
            timing: vec![TimingFault {
                start_s: 0.0,
                duration_s: 1e9,
                offset_ns: 20.0 / 0.299_792_458,
                drift_ns_per_s: 0.0,
            }],
            ..FaultsConfig::default()
        };
        let figures = fly_lie(&scene, &flight, &faults, 0.0, None, 1).expect("flown");
        println!("{figures:?}");
        let after_s = figures.flagged_after_s.expect("flagged");
        assert!(after_s < 20.0, "flagged after {after_s} s");
        // Of 20 m.
        assert!(figures.last_m < 1.5, "{} m off at the end", figures.last_m);
    }
}
