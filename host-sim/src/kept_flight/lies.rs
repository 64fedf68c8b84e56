//! Flights in which the GMT lies: a beacon that tells another place, two-way timing that tells another offset. Both are signed, so
//! nothing but the measurements themselves can tell.

use cslam_core::estimator::Setup;
use cslam_core::receiver::{Config, Localization};

use super::{Changes, KeptFlight, pose_errors};
use crate::sensors::FaultsConfig;

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

/// Flies with `faults` that begin at `onset_s`. With `setup_within_m` the receiver knows where the GMT was set up, to within that.
///
/// # Errors
/// [`crate::input::InputError`] naming a figure of the faults that is out of range.
pub fn fly_lie(
    flight: &KeptFlight<'_>,
    mut receiver: Config<'static>,
    faults: &FaultsConfig,
    onset_s: f64,
    setup_within_m: Option<f64>,
) -> anyhow::Result<LieFigures> {
    if let Localization::Filter(filter) = &mut receiver.localization {
        filter.beacon.setup = setup_within_m.map(|within_m| Setup {
            position_m: flight.world().flight().sweep_truth(0).gmt_position_m,
            within_m,
        });
    }
    let changes = Changes {
        faults: faults.clone(),
        ..Changes::default()
    };
    let mut figures = LieFigures::default();
    flight.again(
        &changes,
        receiver,
        |swept, truth| {
            let report = swept.report;
            let time_s = report.time_ns as f64 * 1e-9;
            if time_s < onset_s {
                return;
            }
            let flagged = report.health.beacon_implausible || report.health.clock_contested;
            if flagged {
                figures.flagged_after_s.get_or_insert(time_s - onset_s);
            }
            let Some(pose) = &report.pose else {
                return;
            };
            let errors = pose_errors(pose, truth);
            figures.sweeps += 1;
            figures.worst_m = figures.worst_m.max(errors.position_m);
            figures.last_m = errors.position_m;
            figures.worst_sigmas = figures.worst_sigmas.max(errors.position_sigmas);
            figures.silent += usize::from(!flagged && errors.position_sigmas > SHOWN_SIGMAS);
        },
        |_| (),
    )?;
    Ok(figures)
}
