//! Differences of states, as the filter counts errors.

use cslam_core::estimator::{
    ACCEL_BIAS, ARRAY_AXIS, ARRAY_SLOPE, ATTITUDE, CLOCK_DRIFT, CLOCK_OFFSET, CLOCK_RAMP, FACE_BIAS,
    GYRO_BIAS, GYRO_MATRIX, MOUNTING, Nominal, PLANES, POSITION, TWO_WAY_BIAS, VELOCITY,
};
use nalgebra::{Rotation3, Vector3};

/// What [`Nominal::correct`] has to add to `from` to make it `to`; surfaces are not part of it.
pub(super) fn errors(from: &Nominal, to: &Nominal) -> [f64; PLANES] {
    let mut errors = [0.0; PLANES];
    let mut set = |first: usize, values: &[f64]| errors[first..first + values.len()].copy_from_slice(values);
    let turn = Rotation3::from_matrix_unchecked(to.attitude * from.attitude.transpose());
    let narrow = |to: Vector3<f32>, from: Vector3<f32>| to.map(f64::from) - from.map(f64::from);
    set(POSITION, (to.position_m - from.position_m).as_slice());
    set(VELOCITY, (to.velocity_m_per_s - from.velocity_m_per_s).as_slice());
    set(ATTITUDE, turn.scaled_axis().as_slice());
    set(
        GYRO_BIAS,
        narrow(to.imu.gyro_bias_rad_per_s, from.imu.gyro_bias_rad_per_s).as_slice(),
    );
    set(
        ACCEL_BIAS,
        narrow(to.imu.accel_bias_m_per_s2, from.imu.accel_bias_m_per_s2).as_slice(),
    );
    for axis in 0..3 {
        let column = |of: &Nominal| of.imu.gyro_matrix.column(axis).into_owned();
        set(
            GYRO_MATRIX + 3 * axis,
            narrow(column(to), column(from)).as_slice(),
        );
    }
    set(
        MOUNTING,
        narrow(to.imu.mounting_rad, from.imu.mounting_rad).as_slice(),
    );
    set(
        CLOCK_OFFSET,
        &[to.delay_period.wrap_m(to.clock_offset_m - from.clock_offset_m)],
    );
    set(CLOCK_DRIFT, &[to.clock_drift_m_per_s - from.clock_drift_m_per_s]);
    set(CLOCK_RAMP, &[to.clock_ramp_m_per_s2 - from.clock_ramp_m_per_s2]);
    set(TWO_WAY_BIAS, &[to.two_way_bias_m - from.two_way_bias_m]);
    let list = |first: usize, to: &[f64], from: &[f64], errors: &mut [f64; PLANES]| {
        for (k, (to, from)) in to.iter().zip(from).enumerate() {
            errors[first + k] = to - from;
        }
    };
    list(
        FACE_BIAS,
        to.face_bias.as_flattened(),
        from.face_bias.as_flattened(),
        &mut errors,
    );
    list(ARRAY_SLOPE, &to.array_slope, &from.array_slope, &mut errors);
    list(
        ARRAY_AXIS,
        to.array_axis_rad.as_flattened(),
        from.array_axis_rad.as_flattened(),
        &mut errors,
    );
    errors
}

#[cfg(test)]
mod tests {
    use cslam_core::signal::Waveform;

    use super::*;

    #[test]
    fn a_difference_is_what_a_correction_adds() {
        let from = Nominal::origin(0, Waveform::default().delay_period());
        let added: [f64; PLANES] = std::array::from_fn(|i| 1e-3 * (i as f64 + 1.0));
        let mut to = from;
        to.correct(&added);
        for (i, (found, added)) in errors(&from, &to).iter().zip(&added).enumerate() {
            assert!(
                (found - added).abs() < 1e-6,
                "state {i}: {found}, expected {added}"
            );
        }
        // From another attitude, and over the end of a delay period.
        let mut again = to;
        again.correct(&added);
        again.clock_offset_m += 3.0 * again.delay_period.length_m();
        for (found, added) in errors(&to, &again).iter().zip(&added) {
            assert!((found - added).abs() < 1e-6);
        }
    }
}
