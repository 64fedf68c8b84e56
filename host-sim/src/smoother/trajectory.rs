//! The smoothed state at any time of a flight.

use cslam_core::estimator::{ATTITUDE, CLOCK_DRIFT, CLOCK_OFFSET, Nominal, POSITION, VELOCITY};
use cslam_core::estimator::{ClockEstimate, Pose};
use cslam_core::geometry::Rotation;
use nalgebra::{DMatrix, DVector, Matrix3};

use super::rts::{Smoothed, smooth};
use super::tape::{Chain, Standing};

/// Covariances are in single precision; a chain of updates leaves ten roundings.
const ROUNDING: f64 = 1e-6;

/// A smoothed state.
#[derive(Clone, Debug)]
pub(super) struct State {
    /// The state.
    pub(super) nominal: Nominal,
    /// Covariance of its errors.
    covariance: DMatrix<f64>,
    /// The filter at the end of that motion.
    pub(super) standing: Standing,
    /// Variances of the filter's own state there.
    filtered: DMatrix<f64>,
}

/// The smoothed states of a flight.
#[derive(Clone, Debug)]
pub(super) struct Trajectory {
    chains: Vec<(Chain, Vec<Smoothed>)>,
}

impl Trajectory {
    /// Smooths what a filter did.
    pub(super) fn of(chains: Vec<Chain>) -> Self {
        let with_smoothed = |chain: Chain| {
            let smoothed = smooth(&chain.stages, ROUNDING);
            (chain, smoothed)
        };
        Self {
            chains: chains.into_iter().map(with_smoothed).collect(),
        }
    }

    /// The state at a time of the UAV's clock, ns: with all that was measured at that time. `None` where the filter had no pose.
    pub(super) fn at(&self, time_ns: u64) -> Option<State> {
        self.chains
            .iter()
            .find_map(|(chain, smoothed)| within(chain, smoothed, time_ns))
    }
}

fn within(chain: &Chain, smoothed: &[Smoothed], time_ns: u64) -> Option<State> {
    let time_of = |stage: usize| chain.standing[stage].nominal.time_ns;
    // The last stage not after that time.
    let last = chain
        .standing
        .partition_point(|standing| standing.nominal.time_ns <= time_ns)
        .checked_sub(1)?;
    if time_of(last) == time_ns || last + 1 == chain.stages.len() {
        return (time_of(last) == time_ns).then(|| State {
            nominal: corrected(&chain.standing[last].nominal, &smoothed[last].correction),
            covariance: smoothed[last].covariance.clone(),
            standing: chain.standing[last].clone(),
            filtered: chain.stages[last].filtered.clone(),
        });
    }
    // Between two stages the correction goes over from the one to the other.
    let next = last + 1;
    let share = (time_ns - time_of(last)) as f64 / (time_of(next) - time_of(last)) as f64;
    let mix = |a: &DMatrix<f64>, b: &DMatrix<f64>| a * (1.0 - share) + b * share;
    let before_update = &smoothed[next].correction + &chain.stages[next].correction;
    let correction = &smoothed[last].correction * (1.0 - share) + before_update * share;
    let way = chain
        .way
        .partition_point(|way| way.nominal.time_ns <= time_ns)
        .checked_sub(1)
        .map(|at| chain.way[at])
        .filter(|way| way.stage == next);
    let mut nominal = way.map_or(chain.standing[last].nominal, |way| way.nominal);
    nominal.coast(time_ns);
    Some(State {
        nominal: corrected(&nominal, &correction),
        covariance: mix(&smoothed[last].covariance, &smoothed[next].covariance),
        standing: chain.standing[last].clone(),
        filtered: chain.stages[last].filtered.clone(),
    })
}

fn corrected(nominal: &Nominal, correction: &DVector<f64>) -> Nominal {
    let mut errors = [0.0; cslam_core::estimator::PLANES];
    for (error, value) in errors.iter_mut().zip(correction.iter()) {
        *error = *value;
    }
    let mut corrected = *nominal;
    corrected.correct(&errors);
    corrected
}

impl State {
    /// Standard deviation of the position as the filter's own state has it: the norm over three axes, m.
    pub(super) fn position_sigma_m(&self) -> f64 {
        let sum: f64 = (POSITION..POSITION + 3).map(|i| self.covariance[(i, i)]).sum();
        sum.max(0.0).sqrt()
    }

    /// The state as a pose. What the filter's pose is unsure of beside its state, the beacon and the mast, is so in this one. `None` when the filter
    /// handed out none.
    pub(super) fn pose(&self) -> Option<Pose> {
        let own = self.standing.pose.as_ref()?;
        let of =
            |of: &DMatrix<f64>, i: usize, j: usize| -> Matrix3<f64> { of.fixed_view::<3, 3>(i, j).into() };
        let block = |given: &Matrix3<f32>, i: usize, j: usize| {
            let beside = given.map(f64::from) - of(&self.filtered, i, j);
            (of(&self.covariance, i, j) + beside).map(|c| c as f32)
        };
        let sigma = |state: usize| self.covariance[(state, state)].max(0.0).sqrt() as f32;
        let nominal = &self.nominal;
        Some(Pose {
            time_ns: nominal.time_ns,
            position: cslam_core::geometry::Position::from_vector(nominal.position_m).ok()?,
            velocity_m_per_s: nominal.velocity_m_per_s.map(|c| c as f32),
            attitude: Rotation::from_matrix(nominal.attitude.map(|c| c as f32)).ok()?,
            clock: ClockEstimate {
                offset_m: nominal.clock_offset_m,
                offset_sigma_m: sigma(CLOCK_OFFSET),
                drift_m_per_s: nominal.clock_drift_m_per_s as f32,
                drift_sigma_m_per_s: sigma(CLOCK_DRIFT),
            },
            position_covariance_m2: block(&own.position_covariance_m2, POSITION, POSITION),
            velocity_covariance_m2_per_s2: of(&self.covariance, VELOCITY, VELOCITY).map(|c| c as f32),
            attitude_covariance_rad2: block(&own.attitude_covariance_rad2, ATTITUDE, ATTITUDE),
            position_attitude_covariance_m_rad: block(
                &own.position_attitude_covariance_m_rad,
                POSITION,
                ATTITUDE,
            ),
            resets: own.resets,
        })
    }
}
