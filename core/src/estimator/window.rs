//! Pose from a few sweeps alone: start-up and re-fix.
//!
//! Delay and departure of a line-of-sight path fix the position; the inertial increments between the fixes say how the
//! body moved and turned. Over five sweeps that is enough for everything else in closed form, whatever the attitude
//! was thought to be: the second difference of the fixes, less gravity, is the specific force seen in the world; the
//! increments hold the same force seen in the body. That pair of directions and the line of sight, seen from both ends,
//! give the attitude (triad); what is left of the fixes is a straight line, which gives position and velocity.
//!
//! The fixes judge each other: a wrong path among them bends the line, and nothing is given until it has left. A re-fix has one more than a start
//! takes, and does without the one that is wrong. A wave that a wall has turned makes a window of its own, of the place's image, and only a sight
//! that turns to the side tells the two apart.

mod bend;
mod error;
mod image;

use nalgebra::{Matrix3, Vector3};

use self::bend::{Bend, Times};
pub(super) use self::error::{Cause, Errors};
use self::image::image_apart;
use super::nominal::{Nominal, rotation};
use crate::constants::STANDARD_GRAVITY_M_PER_S2;
use crate::inertial::ImuIncrement;

/// Exchanges, and sweeps, further apart than this do not confirm each other, s.
/// Derived: as long as it takes to hear five sweeps, twice a second, and a tenth of a second for late ones.
pub(super) const SUSPECT_S: f64 = 2.6;
/// Fixes kept.
/// Capacity: memory of the window.
pub(super) const WINDOW: usize = 6;
/// Fixes that a start needs.
/// Derived: three tell a motion that bends, two more which of them is wrong.
pub(super) const START_FIXES: usize = 5;
/// A fix further than this from the common line is wrong, m; and two sweeps agree within it.
/// Tuned: `cslam campaign` with tuning seeds (docs/flights.md).
pub(super) const LINE_TOLERANCE_M: f64 = 0.5;
/// An angle of arrival further than this from the common attitude is wrong, rad: 3 degrees.
/// Derived: what a gyroscope's bias of 0.5 deg/s turns the body by in the two seconds of five fixes, thrice.
const SIGHT_TOLERANCE_RAD: f64 = 0.052;
/// Scatter of the angles between the two ends of a sight beside what its departure claims, rad per axis.
/// Derived: the ground's bounce draws departures aside, and a gyroscope's bias of 0.5 deg/s turns the body as far in a second.
pub(super) const SIGHT_SCATTER_RAD: f64 = 0.008;
/// Normal deviate that one window in a thousand is beyond, on either side one in five hundred.
/// Derived: the quantile .999 of the normal distribution.
const DEVIATE: f64 = 3.09;
/// Scatter of fixes per axis beside what their departures claim, m.
/// Tuned: `cslam campaign` with tuning seeds (docs/flights.md).
const FIX_SCATTER_M: f64 = 0.06;
/// Error of the specific force seen in the body: an accelerometer bias of 20 mg, rad.
/// Given: the error budget.
const FORCE_TILT_RAD: f64 = 0.02;
/// A vector shorter than this has no direction.
/// Numerical: a guard of a division.
const LEAST_NORM: f64 = 1e-6;

/// Motion since the previous fix, in the body axes at that fix.
#[derive(Clone, Copy, Debug)]
struct Segment {
    dt_s: f64,
    turn: Matrix3<f64>,
    velocity: Vector3<f64>,
    position: Vector3<f64>,
}

impl Segment {
    fn empty() -> Self {
        Self {
            dt_s: 0.0,
            turn: Matrix3::identity(),
            velocity: Vector3::zeros(),
            position: Vector3::zeros(),
        }
    }

    fn then(&self, next: &Self) -> Self {
        Self {
            dt_s: self.dt_s + next.dt_s,
            turn: self.turn * next.turn,
            velocity: self.velocity + self.turn * next.velocity,
            position: self.position + self.velocity * next.dt_s + self.turn * next.position,
        }
    }
}

/// One line-of-sight sweep as a fix.
#[derive(Clone, Copy, Debug)]
struct Fix {
    position_m: Vector3<f64>,
    /// From the UAV to the GMT, world axes.
    towards_gmt: Vector3<f64>,
    /// The same as seen by the arrays, body axes.
    seen: Vector3<f64>,
    /// Variance of the position along each axis, m^2: noise, not what all fixes share.
    variance_m2: Vector3<f64>,
    /// Variance of the difference between both ends of the sight along each axis, rad^2.
    sight_variance_rad2: Vector3<f64>,
    /// Clock offset that its range was reckoned with, m.
    clock_offset_m: f64,
    since_previous: Segment,
}

/// How the GMT sees the UAV.
#[derive(Clone, Copy, Debug)]
pub(super) struct Departure {
    /// From the GMT to the UAV at the last fix, world axes, length 1.
    pub(super) way: Vector3<f64>,
    /// How it changes on average over the window, per s.
    pub(super) turn_per_s: Vector3<f64>,
}

/// What the window gives: pose at its last fix.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Solution {
    /// Position, m.
    pub(super) position_m: Vector3<f64>,
    /// Velocity, m/s.
    pub(super) velocity_m_per_s: Vector3<f64>,
    /// Attitude R_wb.
    pub(super) attitude: Matrix3<f64>,
    /// Standard deviation of the attitude about its worst axis, rad; 0 when the attitude was given.
    pub(super) attitude_sigma_rad: f64,
    /// Whether the sights have turned by enough to tell them from those of an image, which would have parted from each other.
    pub(super) is_no_image: bool,
    /// How far the angles of arrival are off the attitude on average, rad.
    pub(super) sight_off_rad: f64,
    /// How it errs with what it is made of.
    pub(super) errors: Errors,
}

impl Solution {
    /// Covariance of the attitude, rad^2, world axes: its standard deviation about the sight, and what sights scatter by across.
    pub(super) fn attitude_covariance(&self) -> Matrix3<f64> {
        let across = SIGHT_SCATTER_RAD * SIGHT_SCATTER_RAD;
        let about = self.attitude_sigma_rad * self.attitude_sigma_rad - across;
        let sight = &self.errors.towards;
        Matrix3::from_diagonal_element(across) + sight * sight.transpose() * about.max(0.0)
    }
}

/// The last fixes and the motion between them.
#[derive(Clone, Debug)]
pub(super) struct Window {
    fixes: heapless::Deque<Fix, WINDOW>,
    current: Segment,
}

impl Window {
    /// Without a fix.
    pub(super) fn new() -> Self {
        Self {
            fixes: heapless::Deque::new(),
            current: Segment::empty(),
        }
    }

    /// The departures of the fixes; `None` when there are fewer than two.
    pub(super) fn departure(&self) -> Option<Departure> {
        let (first, last) = (self.fixes.front()?, self.fixes.back()?);
        let since_s: f64 = self.fixes.iter().skip(1).map(|fix| fix.since_previous.dt_s).sum();
        let way = -last.towards_gmt;
        (since_s > 0.0).then(|| Departure {
            way,
            turn_per_s: (way + first.towards_gmt) / since_s,
        })
    }

    /// Forgets all fixes.
    pub(super) fn clear(&mut self) {
        *self = Self::new();
    }

    /// Takes in motion.
    pub(super) fn advance(&mut self, increment: &ImuIncrement) {
        self.current = self.current.then(&Segment {
            dt_s: f64::from(increment.dt_s()),
            turn: rotation(&increment.delta_angle_rad.map(f64::from)),
            velocity: increment.delta_velocity_m_per_s.map(f64::from),
            position: increment.delta_position_m.map(f64::from),
        });
        if self.current.dt_s > SUSPECT_S {
            self.fixes.clear();
        }
    }

    /// Takes in a fix at the end of the motion so far: where the UAV was, to `sigma` along each axis (m, and rad for both ends of the sight), the
    /// direction to the GMT in world axes, and the same direction as the arrays saw it. The clock is that of `now`, for the fixes before
    /// as well: what was learnt of it since would be a velocity along the sight.
    pub(super) fn push(
        &mut self,
        now: &Nominal,
        position_m: Vector3<f64>,
        sigma: &[Vector3<f64>; 2],
        towards_gmt: Vector3<f64>,
        seen: Vector3<f64>,
    ) {
        let [sigma_m, sigma_rad] = sigma;
        let all = position_m + towards_gmt + seen + sigma_m + sigma_rad;
        if !all.iter().all(|c| c.is_finite()) {
            return;
        }
        if self.fixes.is_full() {
            let _ = self.fixes.pop_front();
        }
        let fix = Fix {
            position_m,
            towards_gmt,
            seen,
            variance_m2: sigma_m.map(|sigma| FIX_SCATTER_M * FIX_SCATTER_M + sigma * sigma),
            sight_variance_rad2: sigma_rad.map(|sigma| SIGHT_SCATTER_RAD * SIGHT_SCATTER_RAD + sigma * sigma),
            clock_offset_m: now.clock_offset_m,
            since_previous: self.current,
        };
        let _ = self.fixes.push_back(fix);
        self.current = Segment::empty();
        let mut age_s = 0.0;
        for fix in self.fixes.iter_mut().rev() {
            let offset_m = now.clock_offset_m - now.clock_drift_m_per_s * age_s;
            let nearer_m = now.delay_period.wrap_m(offset_m - fix.clock_offset_m);
            fix.position_m += fix.towards_gmt * nearer_m;
            fix.clock_offset_m = offset_m;
            age_s += fix.since_previous.dt_s;
        }
    }

    /// Pose at the last fix from the last `count` fixes (3 to [`WINDOW`]); `None` when there are fewer or they disagree, and after
    /// the last fix: it would be the pose of a time that is over.
    /// With `known`, the attitude R_wb at the last fix, only position and velocity are found, which three fixes do well.
    pub(super) fn solve(&self, count: usize, known: Option<&Matrix3<f64>>) -> Option<Solution> {
        self.solve_without(None, count, known)
    }

    /// The same where all but one of them agree, if these are as many as a start takes: where many paths come at once every fifth line of sight is
    /// drawn aside, and that many in a row are rarely all sound.
    pub(super) fn solve_most(&self, count: usize, known: Option<&Matrix3<f64>>) -> Option<Solution> {
        let older = if count > START_FIXES { count - 1 } else { 0 };
        self.solve(count, known)
            .or_else(|| (0..older).find_map(|index| self.solve_without(Some(index), count, known)))
    }

    /// Without that one of the last `count` fixes.
    #[inline(never)]
    fn solve_without(
        &self,
        left_out: Option<usize>,
        count: usize,
        known: Option<&Matrix3<f64>>,
    ) -> Option<Solution> {
        let skipped = self.fixes.len().checked_sub(count)?;
        if count < 3 || self.current.dt_s > 0.0 {
            return None;
        }
        let gravity = Vector3::z() * -STANDARD_GRAVITY_M_PER_S2;
        // Motion from the first of the fixes to each.
        let mut motion = heapless::Vec::<(Segment, Fix), WINDOW>::new();
        let mut since_left_out = Segment::empty();
        for (index, fix) in self.fixes.iter().skip(skipped).enumerate() {
            let since_previous = since_left_out.then(&fix.since_previous);
            if left_out == Some(index) {
                since_left_out = since_previous;
                continue;
            }
            since_left_out = Segment::empty();
            let since = motion
                .last()
                .map_or(Segment::empty(), |(before, _)| before.then(&since_previous));
            let _ = motion.push((
                since,
                Fix {
                    since_previous,
                    ..*fix
                },
            ));
        }
        let (last, _) = motion.last()?;
        let times = Times::over(&motion);
        let bend = Bend::over(&motion, &times)?;
        let (first, attitude_sigma_rad) = match known {
            Some(attitude) => (attitude * last.turn.transpose(), 0.0),
            None => attitude_at_first(&motion, &bend)?,
        };
        let off = |(since, fix): &(Segment, Fix)| first * since.turn * fix.seen - fix.towards_gmt;
        if motion.iter().any(|entry| off(entry).norm() > SIGHT_TOLERANCE_RAD) {
            return None;
        }
        let flat = |(since, fix): &(Segment, Fix)| {
            fix.position_m - gravity * (0.5 * since.dt_s * since.dt_s) - first * since.position
        };
        let (mut mean, mut mean_off) = (Vector3::zeros(), Vector3::zeros());
        let mut slope = Vector3::zeros();
        for entry in &motion {
            let place = flat(entry);
            mean += place / times.n;
            mean_off += off(entry) / times.n;
            slope += place * times.of(entry);
        }
        let slope = slope / times.spread;
        let on_line = |t: f64| mean + slope * (t - times.mean_s);
        // A wave that a wall has turned makes a window of its own, every fix in order: the image of the flight. But what turns to the
        // left turns to the right in it, against the gyroscope, and the sights part from each other.
        let (mut chi2, mut sight, mut apart) = (0.0, 0.0, 0.0);
        for entry in &motion {
            let beside_m = flat(entry) - on_line(entry.0.dt_s);
            if beside_m.norm() > LINE_TOLERANCE_M {
                return None;
            }
            chi2 += weighed(&beside_m, &entry.1.variance_m2);
            sight += off(entry).norm_squared() / (2.0 * times.n);
            apart += weighed(&(off(entry) - mean_off), &entry.1.sight_variance_rad2);
        }
        let limit = chi_square_limit(2.0 * times.n - 2.0);
        if apart > limit {
            return None;
        }
        // Of the fixes' three coordinates a line takes two each, and an attitude that comes from their bend one.
        let fitted = if known.is_none() { 9.0 } else { 6.0 };
        let freedom = (3.0 * times.n - fitted).max(1.0);
        // What the fixes leave over widens what they claim.
        let excess = (chi2 / freedom).max(1.0);
        let mut errors = Errors::of(&motion, &times, &bend, &first)?;
        errors.excess = excess;
        errors.sight_variance_rad2 = sight;
        let attitude_sigma_rad = match known {
            Some(_) => 0.0,
            None => libm::sqrt(attitude_sigma_rad * attitude_sigma_rad * excess + sight),
        };
        // An image of which no more than one in a thousand would have stayed within the limit.
        let found = libm::sqrt(limit) + DEVIATE;
        Some(Solution {
            position_m: on_line(last.dt_s) + gravity * (0.5 * last.dt_s * last.dt_s) + first * last.position,
            velocity_m_per_s: slope + gravity * last.dt_s + first * last.velocity,
            attitude: first * last.turn,
            attitude_sigma_rad,
            is_no_image: image_apart(&motion, &errors.towards) > found * found,
            sight_off_rad: mean_off.norm(),
            errors,
        })
    }
}

/// Sum of squares, each over the variance along its axis.
fn weighed(errors: &Vector3<f64>, variances: &Vector3<f64>) -> f64 {
    errors.component_mul(errors).component_div(variances).sum()
}

/// Chi-square that one in a thousand of `freedom` degrees of freedom is beyond (Wilson and Hilferty).
fn chi_square_limit(freedom: f64) -> f64 {
    let ninth = 2.0 / (9.0 * freedom);
    let root = 1.0 - ninth + DEVIATE * libm::sqrt(ninth);
    freedom * root * root * root
}

/// Attitude at the first of some fixes, and its standard deviation per axis, rad.
fn attitude_at_first(motion: &[(Segment, Fix)], bend: &Bend) -> Option<(Matrix3<f64>, f64)> {
    let gravity = Vector3::z() * -STANDARD_GRAVITY_M_PER_S2;
    let (mut outside, mut inside) = (Vector3::zeros(), Vector3::zeros());
    let (mut sight, mut seen) = (Vector3::zeros(), Vector3::zeros());
    for ((since, fix), weight) in motion.iter().zip(&bend.weights) {
        // Twice the coefficient of the square is an acceleration.
        outside += (fix.position_m - gravity * (0.5 * since.dt_s * since.dt_s)) * (2.0 * weight);
        inside += since.position * (2.0 * weight);
        sight += fix.towards_gmt;
        seen += since.turn * fix.seen;
    }
    let scatter = motion.iter().zip(&bend.weights);
    let square: f64 = scatter
        .map(|((_, fix), w)| 4.0 * w * w * fix.variance_m2.max())
        .sum();
    let force = libm::sqrt(square) / STANDARD_GRAVITY_M_PER_S2;
    // Seen from outside and from inside it is as long, but for how both err.
    let longer = (outside.norm() - inside.norm()).abs() / STANDARD_GRAVITY_M_PER_S2;
    if longer > DEVIATE * libm::hypot(force, FORCE_TILT_RAD) {
        return None;
    }
    let (there, sine) = triad(&sight, &outside)?;
    let (here, _) = triad(&seen, &inside)?;
    // The force only tells the turn about the line of sight, and that the worse the nearer it lies to it.
    Some((
        there * here.transpose(),
        libm::hypot(force, FORCE_TILT_RAD) / sine,
    ))
}

/// Orthonormal axes from a sure direction and a less sure one, and the sine between these; `None` when they are parallel.
fn triad(first: &Vector3<f64>, second: &Vector3<f64>) -> Option<(Matrix3<f64>, f64)> {
    let x = first.try_normalize(LEAST_NORM)?;
    let side = x.cross(&second.try_normalize(LEAST_NORM)?);
    let sine = side.norm();
    if sine.is_nan() || sine < LEAST_NORM {
        return None;
    }
    let z = side / sine;
    let y = z.cross(&x);
    // Not from columns: that indexes, and could panic for all the compiler knows.
    let axes = Matrix3::new(x.x, y.x, z.x, x.y, y.y, z.y, x.z, y.z, z.z);
    Some((axes, sine))
}
