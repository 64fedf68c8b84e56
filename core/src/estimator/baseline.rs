//! Hybrid periodic positioning calibration (HPC), the paper's localization: a position fix every `T_c` steps, inertial
//! sums in between.
//!
//! Equations (bsm) and (imu) of the paper, with the sum corrected: it starts at the time of the last fix, q = n T_c,
//! not one period earlier (the printed lower limit counts a whole period of motion twice). With the inertial position
//! `p_imu`,
//!
//! `p(t) = p_fix(n) + sum_{q = n T_c}^{t-1} (p_imu(q+1) - p_imu(q)) = p_fix(n) + p_imu(t) - p_imu(n T_c)`.
//!
//! The paper does not say where the velocity inside `p_imu` comes from. Two readings are here:
//! - [`Mode::Literal`]: `p_imu` integrates on its own from the start; fixes correct the position only. The difference of two
//!   of its positions still carries its whole velocity error, which an accelerometer bias makes grow without end.
//! - [`Mode::VelocityFromFixes`]: at each fix the velocity is set to what carries the last fix into this one under the
//!   measured forces. The fairest form that needs nothing but the paper's quantities.
//!
//! Attitude comes from the gyroscope alone, or from outside with every step (an AHRS). No clock state, no biases, no
//! covariance: it is the baseline that the filter is measured against. Everything is `f64`: a literal `p_imu` runs away
//! by kilometres, of which single precision resolves no step of a millisecond.

use core::fmt;
use core::num::NonZeroU32;

use nalgebra::Vector3;

use crate::constants::STANDARD_GRAVITY_M_PER_S2;
use crate::geometry::{Body, Position, Rotation, World};
use crate::inertial::ImuIncrement;

/// Nanoseconds in a second.
/// Given: a unit.
const NS: f64 = 1e-9;

/// Where the velocity of the inertial sum comes from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Mode {
    /// Integrated from the start, never corrected.
    #[default]
    Literal,
    /// Derived from the last two fixes, integrated since.
    VelocityFromFixes,
}

/// State at the start: the paper's `n = 0` fix, and what the inertial unit begins with.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Start {
    /// UAV clock, ns.
    pub time_ns: u64,
    /// First fix, m.
    pub position: Position<World, f64>,
    /// Velocity, m/s, world frame.
    pub velocity_m_per_s: Vector3<f64>,
    /// Attitude R_wb.
    pub attitude: Rotation<Body, World, f64>,
}

/// Why an inertial increment was not used; the state is unchanged.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum StepError {
    /// It begins before the end of the last one, or does not end after its own start.
    OutOfOrder,
    /// A number of it is NaN or infinite.
    NotFinite,
}

impl fmt::Display for StepError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::OutOfOrder => "the inertial increment does not follow the last one in time",
            Self::NotFinite => "a number of the inertial increment is not finite",
        })
    }
}

impl core::error::Error for StepError {}

/// The paper's localization.
#[derive(Clone, Debug)]
pub struct Baseline {
    mode: Mode,
    interval_steps: NonZeroU32,
    time_ns: u64,
    attitude: Rotation<Body, World, f64>,
    velocity_m_per_s: Vector3<f64>,
    /// The inertial position p_imu, now and at the last fix, m.
    inertial_m: Vector3<f64>,
    inertial_at_fix_m: Vector3<f64>,
    fix_m: Vector3<f64>,
    fix_ns: u64,
}

impl Baseline {
    /// Begins at a first fix. `interval_steps` is the paper's T_c, in its time steps (sweeps).
    #[must_use]
    pub fn new(mode: Mode, interval_steps: NonZeroU32, start: Start) -> Self {
        Self {
            mode,
            interval_steps,
            time_ns: start.time_ns,
            attitude: start.attitude,
            velocity_m_per_s: start.velocity_m_per_s,
            inertial_m: *start.position.vector(),
            inertial_at_fix_m: *start.position.vector(),
            fix_m: *start.position.vector(),
            fix_ns: start.time_ns,
        }
    }

    /// Whether a fix belongs to time step `step`: t % T_c = 0.
    #[must_use]
    pub fn fix_due(&self, step: u32) -> bool {
        step.is_multiple_of(self.interval_steps.get())
    }

    /// Moves on by an inertial increment. Between its start and the end of the last one, where samples are missing, the
    /// UAV counts as coasting. `attitude`: R_wb at the start of the increment from elsewhere; without it the
    /// gyroscope's.
    ///
    /// # Errors
    /// [`StepError`]; nothing has changed then.
    pub fn step(
        &mut self,
        increment: &ImuIncrement,
        attitude: Option<Rotation<Body, World, f64>>,
    ) -> Result<(), StepError> {
        if increment.start_ns < self.time_ns || increment.end_ns <= increment.start_ns {
            return Err(StepError::OutOfOrder);
        }
        let turn = increment.delta_angle_rad.map(f64::from);
        let push = increment.delta_velocity_m_per_s.map(f64::from);
        let shift = increment.delta_position_m.map(f64::from);
        if !push.iter().chain(&shift).all(|c| c.is_finite()) {
            return Err(StepError::NotFinite);
        }
        let step = Rotation::from_rotation_vector(&turn).map_err(|_| StepError::NotFinite)?;
        let attitude = attitude.unwrap_or(self.attitude);
        let gap_s = (increment.start_ns - self.time_ns) as f64 * NS;
        let dt_s = (increment.end_ns - increment.start_ns) as f64 * NS;
        let gravity = Vector3::new(0.0, 0.0, -STANDARD_GRAVITY_M_PER_S2);
        self.inertial_m += self.velocity_m_per_s * (gap_s + dt_s)
            + attitude.apply_vector(&shift)
            + gravity * (0.5 * dt_s * dt_s);
        self.velocity_m_per_s += attitude.apply_vector(&push) + gravity * dt_s;
        self.attitude = attitude.after(&step);
        self.time_ns = increment.end_ns;
        Ok(())
    }

    /// Takes a position fix that holds now.
    pub fn fix(&mut self, position: Position<World, f64>) {
        let elapsed_s = (self.time_ns - self.fix_ns) as f64 * NS;
        if self.mode == Mode::VelocityFromFixes && elapsed_s > 0.0 {
            // The velocity that the last fix should have left with is off by the miss over the time; it has been off by
            // as much ever since.
            self.velocity_m_per_s += (position.vector() - self.position_m()) / elapsed_s;
        }
        self.fix_m = *position.vector();
        self.fix_ns = self.time_ns;
        self.inertial_at_fix_m = self.inertial_m;
    }

    /// UAV clock at the end of the last step, ns.
    #[must_use]
    pub fn time_ns(&self) -> u64 {
        self.time_ns
    }

    /// Estimated position, m: the last fix and the inertial sum since.
    #[must_use]
    pub fn position_m(&self) -> Vector3<f64> {
        self.fix_m + (self.inertial_m - self.inertial_at_fix_m)
    }

    /// Velocity of the inertial sum, m/s.
    #[must_use]
    pub fn velocity_m_per_s(&self) -> &Vector3<f64> {
        &self.velocity_m_per_s
    }

    /// Attitude R_wb at the end of the last step.
    #[must_use]
    pub fn attitude(&self) -> &Rotation<Body, World, f64> {
        &self.attitude
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::inertial::ImuErrors;

    const STEP_NS: u64 = 10_000_000;

    fn start(velocity_m_per_s: [f64; 3]) -> Start {
        Start {
            time_ns: 0,
            position: Position::new(1.0, 2.0, 3.0).expect("finite"),
            velocity_m_per_s: velocity_m_per_s.into(),
            attitude: Rotation::identity(),
        }
    }

    fn baseline(mode: Mode, velocity_m_per_s: [f64; 3]) -> Baseline {
        Baseline::new(mode, NonZeroU32::MIN, start(velocity_m_per_s))
    }

    /// Step `k` of a UAV that turns about z and feels `force` in body axes, constant over each step.
    fn increment(k: u64, yaw_rate: f32, force: [f32; 3]) -> ImuIncrement {
        let dt = STEP_NS as f32 * 1e-9;
        let force = Vector3::from(force);
        ImuIncrement {
            start_ns: k * STEP_NS,
            end_ns: (k + 1) * STEP_NS,
            delta_angle_rad: Vector3::new(0.0, 0.0, yaw_rate * dt),
            delta_velocity_m_per_s: force * dt,
            delta_position_m: force * (0.5 * dt * dt),
            removed: ImuErrors::default(),
        }
    }

    const G: f32 = STANDARD_GRAVITY_M_PER_S2 as f32;

    #[test]
    fn the_sum_starts_at_the_last_fix() {
        // Constant velocity: after a fix the position is the fix, and T later the fix and T of motion. The printed
        // limit would add the period before the fix as well.
        for mode in [Mode::Literal, Mode::VelocityFromFixes] {
            let mut baseline = baseline(mode, [2.0, 0.0, 0.0]);
            for period in 1..=5 {
                for k in 0..50 {
                    baseline
                        .step(&increment(50 * (period - 1) + k, 0.0, [0.0, 0.0, G]), None)
                        .expect("in order");
                }
                let truth = Vector3::new(1.0 + period as f64, 2.0, 3.0);
                assert!((baseline.position_m() - truth).norm() < 1e-6, "{mode:?}");
                baseline.fix(Position::from_vector(truth).expect("finite"));
                assert!((baseline.position_m() - truth).norm() < 1e-9);
            }
        }
    }

    #[test]
    fn literal_keeps_a_velocity_error_for_ever_and_the_other_form_removes_it() {
        let run = |mode| {
            // The UAV stands still; it believes that it flies north at 1 m/s.
            let mut baseline = baseline(mode, [0.0, 1.0, 0.0]);
            let truth = *start([0.0; 3]).position.vector();
            for k in 0..300 {
                baseline
                    .step(&increment(k, 0.7, [0.0, 0.0, G]), None)
                    .expect("in order");
                if k % 100 == 99 && k < 200 {
                    baseline.fix(Position::from_vector(truth).expect("finite"));
                }
            }
            baseline.position_m() - truth
        };
        assert!((run(Mode::Literal) - Vector3::new(0.0, 1.0, 0.0)).norm() < 1e-5);
        assert!(run(Mode::VelocityFromFixes).norm() < 1e-5);
    }

    #[test]
    fn an_accelerometer_bias_acts_from_the_start_or_from_the_fix_before_last() {
        // Bias b, fixes every T: the error at the end of period n is b T^2 (n - 1/2) with free velocity; from fixes,
        // where the velocity is right in the mean of the period before, b T^2.
        let (b, period_s) = (0.2_f32, 1.0);
        for (mode, expected) in [(Mode::Literal, 4.5), (Mode::VelocityFromFixes, 1.0)] {
            let mut baseline = baseline(mode, [0.0; 3]);
            let truth = *start([0.0; 3]).position.vector();
            for k in 0..500 {
                baseline
                    .step(&increment(k, 0.0, [b, 0.0, G]), None)
                    .expect("in order");
                if k % 100 == 99 && k < 499 {
                    baseline.fix(Position::from_vector(truth).expect("finite"));
                }
            }
            let error = baseline.position_m() - truth;
            let expected = f64::from(b) * period_s * period_s * expected;
            assert!((error.x - expected).abs() < 1e-4, "{mode:?}: {error}");
        }
    }

    #[test]
    fn force_is_turned_by_the_gyroscope_or_by_the_attitude_that_is_given() {
        // A quarter turn in a second, then a second of force ahead: north by the gyroscope, east by what is given.
        let run = |given: Option<Rotation<Body, World, f64>>| {
            let mut baseline = baseline(Mode::Literal, [0.0; 3]);
            for k in 0..200 {
                let (rate, ahead) = if k < 100 {
                    (core::f32::consts::FRAC_PI_2, 0.0)
                } else {
                    (0.0, 1.0)
                };
                baseline
                    .step(&increment(k, rate, [ahead, 0.0, G]), given)
                    .expect("in order");
            }
            baseline.position_m() - start([0.0; 3]).position.vector()
        };
        assert!((run(None) - Vector3::new(0.0, 0.5, 0.0)).norm() < 1e-5);
        assert!((run(Some(Rotation::identity())) - Vector3::new(0.5, 0.0, 0.0)).norm() < 1e-5);
    }

    #[test]
    fn a_gap_is_coasted_and_bad_increments_are_refused() {
        let mut baseline = baseline(Mode::Literal, [2.0, 0.0, 0.0]);
        baseline
            .step(&increment(0, 0.0, [0.0, 0.0, G]), None)
            .expect("first");
        baseline
            .step(&increment(99, 0.0, [0.0, 0.0, G]), None)
            .expect("late");
        assert!((baseline.position_m().x - 3.0).abs() < 1e-6 && baseline.time_ns() == 1_000_000_000);
        let before = baseline.position_m();
        assert_eq!(
            baseline.step(&increment(99, 0.0, [0.0; 3]), None),
            Err(StepError::OutOfOrder)
        );
        let backwards = ImuIncrement {
            start_ns: 3_000_000_000,
            end_ns: 2_000_000_000,
            ..increment(0, 0.0, [0.0; 3])
        };
        assert_eq!(baseline.step(&backwards, None), Err(StepError::OutOfOrder));
        for bad in [
            increment(100, f32::NAN, [0.0; 3]),
            increment(100, 0.0, [f32::INFINITY, 0.0, 0.0]),
        ] {
            assert_eq!(baseline.step(&bad, None), Err(StepError::NotFinite));
        }
        assert_eq!(baseline.position_m(), before);
    }

    #[test]
    fn fixes_fall_on_multiples_of_the_interval() {
        let baseline = Baseline::new(Mode::Literal, NonZeroU32::new(2).expect("two"), start([0.0; 3]));
        assert_eq!(
            [0, 1, 2, 3, 4].map(|step| baseline.fix_due(step)),
            [true, false, true, false, true]
        );
    }
}
