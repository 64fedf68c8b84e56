//! The UAV's arrays as they truly hear a wave: steering, delay and carrier phase of every element, device errors and the
//! effects of [`super::effects`] included.

use cslam_core::constants::SPEED_OF_LIGHT_M_PER_S;
use cslam_core::geometry::{Body, Direction};
use nalgebra::Vector3;

use super::antenna::phasor;
use super::antenna::uav::UavArrays;
use super::effects::coupling::Coupling;
use super::effects::cross_polarisation::CrossPolarisation;
use super::effects::drift::Drift;
use super::effects::ripple::Ripple;
use super::effects::{Draw, airframe};
use super::impairments::Impairments;
use super::radio::Radio;
use super::{C64, Calibration};

/// The arrays of a device.
#[derive(Clone, Debug)]
pub(super) struct ReceiveArrays<const ARRAYS: usize, const ELEMENTS: usize> {
    arrays: UavArrays<ARRAYS>,
    carrier_hz: f64,
    element: [[C64; ELEMENTS]; ARRAYS],
    delay_s: [f64; ARRAYS],
    drift: Option<Drift<ARRAYS, ELEMENTS>>,
    ripple: Option<Ripple<ARRAYS, ELEMENTS>>,
    cross: Option<CrossPolarisation<ARRAYS, ELEMENTS>>,
    coupling: Option<Coupling<ARRAYS, ELEMENTS>>,
    shadow: bool,
    squint: bool,
}

/// The errors of the elements at a time.
pub(super) struct ElementErrors<const ARRAYS: usize, const ELEMENTS: usize> {
    /// Gain and phase of each element.
    factor: [[C64; ELEMENTS]; ARRAYS],
    /// Delay of each array, s.
    delay_s: [f64; ARRAYS],
}

/// A ray at the receive arrays.
pub(super) struct Reception<const ARRAYS: usize, const ELEMENTS: usize> {
    /// Element pattern, steering and errors of each array's elements.
    pub(super) steering: [[C64; ELEMENTS]; ARRAYS],
    /// Delay of each element after its array's centre, s, where squint is on; zero else.
    pub(super) element_delay_s: [[f64; ELEMENTS]; ARRAYS],
    /// Delay at each array, s; lever arm and delay error included, clock not.
    pub(super) delay_s: [f64; ARRAYS],
    /// Carrier phase of the lever arm.
    pub(super) carrier: [C64; ARRAYS],
}

impl<const ARRAYS: usize, const ELEMENTS: usize> ReceiveArrays<ARRAYS, ELEMENTS> {
    /// The arrays with the errors of a device; `seed` draws what the device does not hold.
    pub(super) fn new(
        radio: &Radio,
        impairments: &Impairments,
        device: &Calibration<ARRAYS, ELEMENTS>,
        seed: u64,
    ) -> Self {
        let mut arrays = UavArrays::nominal(&radio.uav_arrays);
        for (array, [along, across]) in arrays.arrays.iter_mut().zip(device.uav_axis_rad) {
            let tangent = array.normal.cross(&array.axis);
            array.axis = (array.axis + array.normal * along + tangent * across).normalize();
        }
        if let (Some(column), Some(row)) = (&mut arrays.column, arrays.arrays.first()) {
            // The board is stiff: its columns stay across its rows.
            let tilted = *column + row.normal * device.uav_column_rad;
            *column = (tilted - row.axis * row.axis.dot(&tilted)).normalize();
        }
        for (array, error_m) in arrays.arrays.iter_mut().zip(device.uav_centre_m) {
            array.centre_m += error_m;
        }
        let set = &impairments.uav_arrays;
        let ripples = set.ripple_rms_db != 0.0 || set.ripple_rms_deg != 0.0;
        let ripple = || {
            let rms = (set.ripple_rms_db, set.ripple_rms_deg);
            Ripple::draw(rms, radio, Draw::Ripple.stream(seed))
        };
        let coupling = || Coupling::draw(set.coupling_unknown_share, radio, Draw::Coupling.stream(seed));
        Self {
            arrays,
            carrier_hz: radio.waveform.carrier_hz,
            element: device.uav_element,
            delay_s: device.uav_delay_s,
            drift: Drift::draw(impairments, seed),
            ripple: ripples.then(ripple),
            cross: set
                .cross_polarisation_db
                .map(|db| CrossPolarisation::draw(db, seed)),
            coupling: (set.coupling_unknown_share != 0.0).then(coupling),
            shadow: impairments.airframe.shadow,
            squint: set.squint,
        }
    }

    /// Whether elements of an array have delays of their own.
    pub(super) fn squints(&self) -> bool {
        self.squint
    }

    #[cfg(test)]
    pub(super) fn lead_m(&self, u: &Direction<Body, f64>) -> [f64; ARRAYS] {
        self.arrays.lead_m(u)
    }

    /// Frequency shift of a wave from `arrival` at each array by the body's turn about its centre, Hz.
    pub(super) fn turning_hz(
        &self,
        arrival: &Direction<Body, f64>,
        turn_rad_per_s: &Vector3<f64>,
    ) -> [f64; ARRAYS] {
        let per_m = self.carrier_hz / SPEED_OF_LIGHT_M_PER_S;
        self.centres_m()
            .map(|centre_m| per_m * arrival.vector().dot(&turn_rad_per_s.cross(&centre_m)))
    }

    /// Centre of each array, m, body frame.
    pub(super) fn centres_m(&self) -> [Vector3<f64>; ARRAYS] {
        self.arrays.arrays.map(|array| array.centre_m)
    }

    /// The errors of the elements at a time since switch-on.
    pub(super) fn errors_at(&self, time_s: f64) -> ElementErrors<ARRAYS, ELEMENTS> {
        let mut errors = ElementErrors {
            factor: self.element,
            delay_s: self.delay_s,
        };
        if let Some(drift) = &self.drift {
            let (phases_rad, delays_s) = drift.at(time_s);
            for (factor, phase_rad) in errors
                .factor
                .iter_mut()
                .flatten()
                .zip(phases_rad.iter().flatten())
            {
                *factor *= phasor(*phase_rad);
            }
            for (delay_s, more_s) in errors.delay_s.iter_mut().zip(delays_s) {
                *delay_s += more_s;
            }
        }
        errors
    }

    /// How a wave from `arrival` whose delay at the body origin is `delay_s`, and whose horizontal component is `across` times its
    /// vertical one, meets the elements.
    pub(super) fn reception(
        &self,
        arrival: &Direction<Body, f64>,
        delay_s: f64,
        across: C64,
        errors: &ElementErrors<ARRAYS, ELEMENTS>,
    ) -> Reception<ARRAYS, ELEMENTS> {
        let phases_rad = self.arrays.phase_rad::<ELEMENTS>(arrival);
        let mut amplitudes = self.arrays.amplitude(arrival);
        if self.shadow {
            let left = airframe::shadow(arrival.vector());
            amplitudes = amplitudes.map(|amplitude| amplitude * left);
        }
        let ripple = self
            .ripple
            .as_ref()
            .map(|ripple| ripple.factors(arrival.vector()));
        let steering = std::array::from_fn(|j| {
            let mut steering =
                std::array::from_fn(|i| phasor(phases_rad[j][i]) * errors.factor[j][i] * amplitudes[j]);
            if let Some(factors) = &ripple {
                for (s, factor) in steering.iter_mut().zip(&factors[j]) {
                    *s *= factor;
                }
            }
            if let Some(cross) = &self.cross {
                cross.apply(j, across, &mut steering);
            }
            steering
        });
        let steering = match &self.coupling {
            None => steering,
            Some(coupling) => coupling.of(&steering),
        };
        // The phase n step (1 + f/fc) is that of the carrier and a delay.
        let per_rad_s = if self.squint {
            -1.0 / (std::f64::consts::TAU * self.carrier_hz)
        } else {
            0.0
        };
        let lead_s = self.arrays.lead_m(arrival).map(|m| m / SPEED_OF_LIGHT_M_PER_S);
        Reception {
            steering,
            element_delay_s: phases_rad.map(|row| row.map(|phase_rad| phase_rad * per_rad_s)),
            delay_s: std::array::from_fn(|j| delay_s - lead_s[j] + errors.delay_s[j]),
            carrier: lead_s.map(|s| phasor(std::f64::consts::TAU * self.carrier_hz * s)),
        }
    }
}
