//! A line of text with every bit of the state.

use core::fmt;

use cslam_core::geometry::Real;
use cslam_core::localization::Localizer;
use cslam_core::localization::filter::SweepVerdict;
use cslam_core::localization::imu::ImuStep;

/// FNV-1a over 64-bit words.
#[derive(Clone, Copy, Debug)]
pub(super) struct Digest(u64);

impl Digest {
    pub(super) fn new() -> Self {
        Self(0xcbf2_9ce4_8422_2325)
    }

    fn add(&mut self, word: u64) {
        for byte in word.to_le_bytes() {
            self.0 = (self.0 ^ u64::from(byte)).wrapping_mul(0x100_0000_01b3);
        }
    }

    /// Every bit of a step of the inertial unit.
    pub(super) fn step(&mut self, step: &ImuStep) {
        let increment = &step.increment;
        self.add(increment.start_ns);
        self.add(increment.end_ns);
        self.add(step.motion as u64);
        for vector in [
            &increment.delta_angle_rad,
            &increment.delta_velocity_m_per_s,
            &increment.delta_position_m,
        ] {
            for part in vector.iter() {
                self.add(u64::from(part.to_bits()));
            }
        }
        self.add(u64::from(step.angle_variance_rad2.to_bits()));
        self.add(u64::from(step.velocity_variance_m2_per_s2.to_bits()));
    }

    pub(super) fn value(self) -> u64 {
        self.0
    }
}

/// State after a sweep.
pub(super) struct Line<'a, T: Real, const N: usize> {
    pub(super) sweep: u32,
    pub(super) time_ns: u64,
    pub(super) verdict: SweepVerdict,
    /// Digest of all steps so far.
    pub(super) inertial: u64,
    pub(super) localizer: &'a Localizer<T, N>,
}

impl<T: Real, const N: usize> fmt::Display for Line<'_, T, N> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let filter = self.localizer.filter();
        let state = filter.nominal();
        write!(
            f,
            "sweep {} {:?} steps {:016x} state",
            self.sweep, self.verdict, self.inertial
        )?;
        let clock = [
            state.clock_offset_m,
            state.clock_drift_m_per_s,
            state.clock_ramp_m_per_s2,
            state.two_way_bias_m,
        ];
        let numbers = state
            .position_m
            .iter()
            .chain(&state.velocity_m_per_s)
            .chain(state.attitude.iter())
            .chain(&clock)
            .chain(state.face_bias.as_flattened())
            .chain(&state.array_slope)
            .chain(state.array_axis_rad.as_flattened());
        for number in numbers {
            write!(f, " {:016x}", number.to_bits())?;
        }
        write!(f, " sensor")?;
        let errors = &state.imu;
        let sensor = errors
            .gyro_bias_rad_per_s
            .iter()
            .chain(&errors.accel_bias_m_per_s2)
            .chain(errors.gyro_matrix.iter());
        for number in sensor {
            write!(f, " {:08x}", number.to_bits())?;
        }
        let mut covariance = Digest::new();
        for i in 0..N {
            for j in 0..N {
                covariance.add(filter.covariance().at(i, j).to_f64().to_bits());
            }
        }
        let mut planes = Digest::new();
        for plane in filter.planes() {
            planes.add(u64::from(plane.id));
            for part in plane
                .plane
                .normal
                .vector()
                .iter()
                .chain(plane.plane.centre.vector())
            {
                planes.add(u64::from(part.to_bits()));
            }
        }
        write!(
            f,
            " covariance {:016x} planes {:016x} {:?} {:?} {:?} {:?}",
            covariance.value(),
            planes.value(),
            self.localizer.health(self.time_ns),
            filter.counters(),
            filter.test_ratios(),
            self.localizer.imu().counters()
        )
    }
}
