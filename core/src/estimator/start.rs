//! Start-up and hard re-fix: the pose from a window of sweeps, everything else kept.

use super::gate::{APART_SIGMAS, Innovation};
use super::layout::{
    ACCEL_BIAS, ARRAY_AXIS, ARRAY_SLOPE, ARRAYS, ATTITUDE, CLOCK_DRIFT, CLOCK_OFFSET, CLOCK_RAMP, FACE_BIAS,
    FACES, GYRO_BIAS, GYRO_MATRIX, MOUNTING, POSITION, TWO_WAY_BIAS, VELOCITY,
};
use super::measurement::{PathMeasurement, Transmitter};
use super::nominal::Nominal;
use super::watch::Step;
use super::window::{SIGHT_SCATTER_RAD, START_FIXES, Solution};
use super::{Covariance, Filter};
use crate::geometry::Real;
use crate::inertial::Alignment;
use nalgebra::{Matrix3, Vector3};

/// Mean square of the change of a face's cosine with the mast's tilt.
/// Derived: that of the cosine of the angle off the face's normal, over its 120 degrees.
const MAST_SHARE: f64 = 0.7;

/// Chi-square that one heading in twenty is beyond.
/// Derived: the quantile .95 of the chi-square of one.
const USUAL_HEADING: f64 = 3.84;

// What is rare is never inlined here: flash is short.
impl<T: Real, const N: usize> Filter<T, N> {
    /// Takes over the gyroscope bias found at rest. The tilt serves a start without departures only: the window finds it from
    /// motion, as precisely as the accelerometer's bias lets anyone.
    pub fn aligned(&mut self, rest: &Alignment) {
        let (bias, sigma) = (rest.gyro_bias_rad_per_s, rest.gyro_bias_sigma_rad_per_s);
        let force = rest.up * (rest.accel_bias_up_m_per_s2 + rest.accel_bias_up_sigma_m_per_s2);
        if !(bias + sigma + force).iter().all(|c| c.is_finite()) {
            return;
        }
        self.nominal.imu.gyro_bias_rad_per_s = bias;
        self.rest = Some(*rest);
        // What was integrated before has the bias in it.
        self.window.clear();
        for (i, sigma) in sigma.iter().enumerate() {
            self.covariance
                .reset(GYRO_BIAS + i, T::of(f64::from(*sigma) * f64::from(*sigma)));
        }
        if !self.running {
            self.forget_accel_bias(self.config.priors.accel_bias_m_per_s2);
        }
        self.set_tilt(rest);
    }

    /// From now on nothing is known of the accelerometer's bias but what rest has shown: its part along the vertical of then. Across that it
    /// has this standard deviation, m/s^2.
    pub(super) fn forget_accel_bias(&mut self, across_m_per_s2: f64) {
        let across = across_m_per_s2 * across_m_per_s2;
        self.nominal.imu.accel_bias_m_per_s2 = Vector3::zeros();
        let mut covariance = Matrix3::from_diagonal_element(T::of(across));
        if let Some(rest) = &self.rest {
            self.nominal.imu.accel_bias_m_per_s2 = rest.up * rest.accel_bias_up_m_per_s2;
            let along = f64::from(rest.accel_bias_up_sigma_m_per_s2);
            let less = T::of(along * along - across);
            let up = rest.up.map(|c| T::of(f64::from(c)));
            covariance += up * up.transpose() * less;
        }
        self.covariance.reset_block(ACCEL_BIAS, &covariance);
    }

    /// Adds a line-of-sight path to the window of fixes.
    pub(super) fn push_fix(&mut self, gmt: &Transmitter, path: &PathMeasurement) {
        if !self.clock_known {
            return;
        }
        let Some(departure) = path.departure else {
            return;
        };
        let Some(departed) = self.model.departed(&departure, gmt, &self.nominal) else {
            return;
        };
        let Some(place) = self.model.place(&self.nominal, gmt, path, &[]) else {
            return;
        };
        let seen = self.model.corrected(&path.aoa, &self.nominal);
        let left = departure.sigma_along(&departed);
        let sigma = [
            left * (place - gmt.position_m).norm(),
            left.map(|sigma| libm::hypot(sigma, path.aoa_sigma_rad)),
        ];
        self.window.push(&self.nominal, place, &sigma, -departed, seen);
    }

    /// Starts when the window allows it.
    pub(super) fn try_start(&mut self, gmt: &Transmitter) -> bool {
        let Some(solution) = self.window.solve(START_FIXES, None) else {
            return false;
        };
        if !self.is_acceptable(&solution) {
            return false;
        }
        let carried = self.nominal.attitude;
        self.set_pose(gmt, &solution);
        self.running = self.take_rest_tilt(&carried);
        if !self.running {
            self.nominal.attitude = carried;
            self.counters.starts_refused = self.counters.starts_refused.saturating_add(1);
        }
        self.running
    }

    /// Fixes the whole pose anew when the last fixes agree.
    pub(super) fn try_refix(&mut self, gmt: &Transmitter) -> bool {
        let solution = self.window.solve(START_FIXES, None);
        solution.is_some_and(|solution| self.refix(gmt, &solution))
    }

    /// Fixes position and velocity anew when the last `fixes` sweeps agree, and the attitude when it is not one that they allow, by theirs or by
    /// their sights: theirs is the poorer one, known to degrees. It is not given up for what may be an image's.
    pub(super) fn try_refix_contested(
        &mut self,
        gmt: &Transmitter,
        path: &PathMeasurement,
        fixes: usize,
    ) -> bool {
        let whole = self.window.solve_most(fixes, None);
        let stands = whole.is_none_or(|whole| self.attitude_stands(&whole));
        if stands && self.try_refix_position(gmt, fixes) {
            return true;
        }
        let whole = whole.filter(|whole| !self.may_be_image(gmt, path, whole));
        whole.is_some_and(|whole| self.refix(gmt, &whole))
    }

    fn attitude_stands(&self, solution: &Solution) -> bool {
        let angle_rad = ((self.turn(solution).trace() - 1.0) * 0.5).acos_libm();
        angle_rad < APART_SIGMAS * libm::hypot(solution.attitude_sigma_rad, SIGHT_SCATTER_RAD)
    }

    /// By what a window turns the attitude, world axes.
    pub(super) fn turn(&self, solution: &Solution) -> Matrix3<f64> {
        solution.attitude * self.nominal.attitude.transpose()
    }

    fn refix(&mut self, gmt: &Transmitter, solution: &Solution) -> bool {
        let acceptable = self.is_acceptable(solution);
        if acceptable {
            self.unlearn_accel_bias();
            self.set_pose(gmt, solution);
            self.settle_refix();
        }
        acceptable
    }

    /// Fixes position and velocity anew when the last `fixes` sweeps agree with each other and with the attitude.
    #[inline(never)]
    fn try_refix_position(&mut self, gmt: &Transmitter, fixes: usize) -> bool {
        let Some(solution) = self.window.solve_most(fixes, Some(&self.nominal.attitude)) else {
            return false;
        };
        let off = solution.sight_off_rad * solution.sight_off_rad;
        for i in 0..3 {
            self.covariance.add(ATTITUDE + i, T::of(off));
        }
        self.unlearn_accel_bias();
        self.set_position(gmt, &solution, true);
        self.settle_refix();
        true
    }

    /// A pose was wrong, and with it what it has taught of the accelerometer: a body that is believed to lean feels gravity where there is
    /// none, and once it turns, that bias leans it the other way. Forgotten before the pose is set, which errs by a bias that nobody knows, and
    /// after: the increments of the window had another taken out of them, with which the one from now on shares nothing.
    #[inline(never)]
    pub(super) fn unlearn_accel_bias(&mut self) {
        self.forget_accel_bias(self.config.priors.accel_bias_m_per_s2);
    }

    fn settle_refix(&mut self) {
        self.unlearn_accel_bias();
        self.resets = self.resets.saturating_add(1);
        self.counters.refixes = self.counters.refixes.saturating_add(1);
    }

    /// Sets place and velocity, and all that they share with the attitude unless it was `given`.
    #[inline(never)]
    fn set_position(&mut self, gmt: &Transmitter, solution: &Solution, given: bool) {
        self.nominal.position_m = solution.position_m;
        self.nominal.velocity_m_per_s = solution.velocity_m_per_s;
        self.set_window_covariance(gmt, solution, given);
        (self.contested, self.held) = (0, 0);
        self.last_innovation = Some(Innovation::none(self.nominal.time_ns));
    }

    /// Whether an attitude is not one that would be lost at once, nor contradicted by the magnetic heading: little by little already where the
    /// sights would be those of an image as well.
    pub(super) fn is_acceptable(&mut self, solution: &Solution) -> bool {
        let gate = if solution.is_no_image {
            self.gates().one
        } else {
            USUAL_HEADING
        };
        libm::sqrt(3.0) * solution.attitude_sigma_rad < self.gates().attitude_lost_rad
            && self.heading_allows(&solution.attitude, &solution.attitude_covariance(), gate)
    }

    /// Sets the pose.
    #[inline(never)]
    pub(super) fn set_pose(&mut self, gmt: &Transmitter, solution: &Solution) {
        self.nominal.attitude = solution.attitude;
        self.set_position(gmt, solution, false);
        self.doubt_anew();
    }

    /// Forgets everything but the time, the gyroscope bias at rest and the history.
    pub(super) fn restart(&mut self) {
        let (time_ns, bias) = (self.nominal.time_ns, self.nominal.imu.gyro_bias_rad_per_s);
        self.nominal = Nominal::origin(time_ns, self.nominal.delay_period);
        if self.rest.is_some() && bias.iter().all(|c| c.is_finite()) {
            self.nominal.imu.gyro_bias_rad_per_s = bias;
        }
        self.window.clear();
        self.slots.clear();
        self.running = false;
        self.rest_tilt = None;
        self.clock_known = false;
        self.suspect_clock = None;
        self.acquired = 0;
        self.last_innovation = None;
        (self.contested, self.held) = (0, 0);
        self.resets = self.resets.saturating_add(1);
        self.health.starting = true;
        self.set_priors();
        self.tell(Step::Restarted);
    }

    /// The covariance before any measurement.
    pub(super) fn set_priors(&mut self) {
        let priors = self.config.priors;
        self.covariance = Covariance::zero();
        let mut set = |state: usize, sigma: f64| self.covariance.reset(state, T::of(sigma * sigma));
        for i in 0..3 {
            // Position, velocity and attitude are set by the first window.
            set(POSITION + i, 1.0);
            set(VELOCITY + i, 1.0);
            set(ATTITUDE + i, 0.1);
            set(GYRO_BIAS + i, priors.gyro_bias_rad_per_s);
        }
        for i in 0..9 {
            set(GYRO_MATRIX + i, priors.gyro_matrix);
        }
        for i in 0..3 {
            set(MOUNTING + i, priors.mounting_rad);
        }
        set(CLOCK_OFFSET, self.nominal.delay_period.length_m());
        set(CLOCK_DRIFT, priors.clock_drift_m_per_s);
        set(CLOCK_RAMP, priors.clock_ramp_m_per_s2);
        set(TWO_WAY_BIAS, priors.two_way_bias_m);
        for j in 0..ARRAYS {
            set(ARRAY_SLOPE + j, priors.array_slope);
            set(ARRAY_AXIS + 2 * j, priors.array_axis_rad);
            set(ARRAY_AXIS + 2 * j + 1, priors.array_axis_rad);
        }
        // A mast that tilts shifts the cosines along the columns, of each face by what it looks at. (A wrong heading turns the
        // whole solution, and is counted where the pose is handed out.)
        let mast = priors.mast_rad * priors.mast_rad * MAST_SHARE;
        let [row, column] = priors.face_bias;
        for a in 0..FACES {
            set(FACE_BIAS + 2 * a, row);
            set(FACE_BIAS + 2 * a + 1, libm::sqrt(column * column + mast));
        }
        // The mean cosine of the angle between a face and the others: faces stand all around.
        let others = self.model.radio.faces.len().saturating_sub(1).max(1) as f64;
        for a in 0..FACES {
            for b in 0..a {
                let (a, b) = (FACE_BIAS + 2 * a + 1, FACE_BIAS + 2 * b + 1);
                self.covariance.correlate(a, b, T::of(-mast / others));
            }
        }
        self.forget_accel_bias(priors.accel_bias_m_per_s2);
    }
}
