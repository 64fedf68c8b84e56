//! What path estimation is told of the radio, and the few figures that are its own.

use super::calibration::ElementErrors;
use super::effort::WorkLimit;
use crate::array::{Codebook, UavArrays};
use crate::radio::RadioConfig;
use crate::signal::Waveform;

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
