//! The Rauch-Tung-Striebel recursion (Rauch, Tung and Striebel 1965) over a chain of error states.
//!
//! A stage is what a filter knew of its state before and after an update. Smoothing goes back from the last stage: what later
//! measurements say of a state reaches the stage before through the gain `C = P F^T P_next^-1`. How an update came about does not matter,
//! so gates, votes and mixtures need no record.

use nalgebra::{Cholesky, DMatrix, DVector};

/// Correlations of the covariance that is inverted are given up from here on: it comes from single precision.
const ROUNDING: f64 = 1e-6;

/// How a state came from that of the stage before.
#[derive(Clone, Debug, PartialEq)]
pub enum Link {
    /// By a motion `x <- F x + w`.
    Motion {
        /// Transition F of the errors.
        transition: DMatrix<f64>,
        /// Covariance of w.
        noise: DMatrix<f64>,
    },
    /// Some neighbouring states began anew, the others stayed.
    Forgot {
        /// The first of them.
        first: usize,
        /// How many.
        count: usize,
    },
}

impl Link {
    /// No motion at all.
    #[must_use]
    pub fn still(states: usize) -> Self {
        Self::Motion {
            transition: DMatrix::identity(states, states),
            noise: DMatrix::zeros(states, states),
        }
    }
}

/// A stage of a filter: its state before and after an update.
#[derive(Clone, Debug, PartialEq)]
pub struct Stage {
    /// How the state came from the stage before; of the first stage it does not count.
    pub link: Link,
    /// Covariance before the update.
    pub predicted: DMatrix<f64>,
    /// What the update added to the state.
    pub correction: DVector<f64>,
    /// Covariance after the update.
    pub filtered: DMatrix<f64>,
}

/// What smoothing makes of a stage.
#[derive(Clone, Debug, PartialEq)]
pub struct Smoothed {
    /// Smoothed less filtered state.
    pub correction: DVector<f64>,
    /// Covariance of the smoothed state.
    pub covariance: DMatrix<f64>,
}

/// Smooths a chain of stages: one result for each.
#[must_use]
pub fn smooth(stages: &[Stage]) -> Vec<Smoothed> {
    let mut backwards: Vec<Smoothed> = Vec::with_capacity(stages.len());
    for (at, stage) in stages.iter().enumerate().rev() {
        let smoothed = match (backwards.last(), stages.get(at + 1)) {
            (Some(later), Some(next)) => before(stage, next, later),
            _ => Smoothed {
                correction: DVector::zeros(stage.correction.len()),
                covariance: stage.filtered.clone(),
            },
        };
        backwards.push(smoothed);
    }
    backwards.reverse();
    backwards
}

/// What is known of a stage once the next one is smoothed.
fn before(stage: &Stage, next: &Stage, later: &Smoothed) -> Smoothed {
    let learnt = &later.correction + &next.correction;
    let narrowed = &later.covariance - &next.predicted;
    let gain = match &next.link {
        Link::Motion { transition, noise } => motion_gain(transition, noise, &next.predicted),
        Link::Forgot { first, count } => forgetting_gain(&stage.filtered, *first, *count),
    };
    let Some(gain) = gain else {
        return Smoothed {
            correction: learnt,
            covariance: later.covariance.clone(),
        };
    };
    let covariance = &stage.filtered + &gain * narrowed * gain.transpose();
    Smoothed {
        correction: gain * learnt,
        covariance: (&covariance + covariance.transpose()) * 0.5,
    }
}

/// `C = P F^T P_next^-1 = F^-1 (1 - Q P_next^-1)`: in this form a state that does not move is not touched by rounding. `None` of no motion.
fn motion_gain(
    transition: &DMatrix<f64>,
    noise: &DMatrix<f64>,
    predicted: &DMatrix<f64>,
) -> Option<DMatrix<f64>> {
    let states = transition.nrows();
    let identity = DMatrix::identity(states, states);
    let is_quiet = noise.iter().all(|q| *q == 0.0);
    if is_quiet && *transition == identity {
        return None;
    }
    let kept = if is_quiet {
        identity
    } else {
        identity - noise * inverse(predicted)
    };
    // Transitions are products of 1 + F dt with F nilpotent but for the accelerations of a short step: never singular.
    Some(transition.clone().lu().solve(&kept).unwrap_or(kept))
}

/// States that began anew know of the later ones only what they share with the states that stayed.
fn forgetting_gain(filtered: &DMatrix<f64>, first: usize, count: usize) -> Option<DMatrix<f64>> {
    let states = filtered.nrows();
    let forgotten = first..first + count;
    let mut kept = filtered.clone();
    for i in forgotten.clone() {
        kept.row_mut(i).fill(0.0);
        kept.column_mut(i).fill(0.0);
    }
    let mut gain = DMatrix::identity(states, states);
    for i in forgotten.clone() {
        gain[(i, i)] = 0.0;
    }
    let mut shared = filtered.rows(first, count).into_owned();
    for i in forgotten {
        shared.column_mut(i).fill(0.0);
    }
    gain.rows_mut(first, count)
        .copy_from(&(shared * inverse(&kept)));
    Some(gain)
}

/// Inverse of a covariance as far as single precision carries it: in standard deviations, correlations a little short of one.
fn inverse(covariance: &DMatrix<f64>) -> DMatrix<f64> {
    let states = covariance.nrows();
    // A state without variance is known, and stays so.
    let scale = covariance
        .diagonal()
        .map(|variance| if variance > 0.0 { variance.sqrt().recip() } else { 0.0 });
    let mut correlation =
        DMatrix::from_fn(states, states, |i, j| covariance[(i, j)] * scale[i] * scale[j]);
    let mut added = ROUNDING;
    loop {
        for i in 0..states {
            correlation[(i, i)] = 1.0 + added;
        }
        if let Some(factor) = Cholesky::new(correlation.clone()) {
            let inverse = factor.inverse();
            return DMatrix::from_fn(states, states, |i, j| inverse[(i, j)] * scale[i] * scale[j]);
        }
        added *= 10.0;
    }
}
