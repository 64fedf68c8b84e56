//! A flight for a smoother: flown once, and once more where the filter was led astray in it.

use std::sync::Arc;

use cslam_core::estimator::Watch;
use cslam_core::receiver::Config;

use super::Smoother;
use crate::flight_log::FlightLog;
use crate::raw_flight::{Source, Swept};
use crate::recording::Keeper;

/// Who flies a receiver that begins anew, whose filter has `N` states.
pub trait Flier<const N: usize> {
    /// Flies through what a source gives. `listener` hears each step of the filter, `swept` sees each sweep that has ended.
    ///
    /// # Errors
    /// What ends a flight early.
    fn fly(
        &mut self,
        source: &impl Source,
        listener: Arc<dyn Watch<f32, N>>,
        swept: impl FnMut(&Swept<'_>),
    ) -> anyhow::Result<FlightLog>;
}

/// Flies a receiver that is configured so, and smooths the flight: its log as it was on board, and the smoothed one. Where the filter was led astray
/// in an outage, the flight is flown again without the paths of that outage.
///
/// # Errors
/// Those of [`Flier::fly`].
pub fn fly_smoothed<const N: usize>(
    source: &impl Source,
    config: &Config<'_>,
    flier: &mut impl Flier<N>,
) -> anyhow::Result<[FlightLog; 2]> {
    let keeper = Keeper::new(source);
    let mut smoother = Smoother::default();
    let listener = smoother.listener();
    let log = flier.fly(&keeper, listener, |ended| {
        keeper.swept(ended);
        smoother.swept(ended.report);
    })?;
    let astray = smoother.led_astray();
    let again = if astray.is_empty() || log.interrupted() {
        None
    } else {
        let again = Smoother::default();
        flier.fly(&keeper.replayed(astray), again.listener(), |_| ())?;
        Some(again)
    };
    let smoothed = smoother.smoothed(again, &log, config);
    Ok([log, smoothed])
}
