//! The Rauch-Tung-Striebel recursion (Rauch, Tung and Striebel 1965) over a chain of error states.
//!
//! A stage is what a filter knew of its state before and after an update. Smoothing goes back from the last stage: what later
//! measurements say of a state reaches the stage before through the gain `C = P F^T P_next^-1`. How an update came about does not matter,
//! so gates and mixtures need no record.

use nalgebra::{Cholesky, DMatrix, DVector};

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

/// Smooths a chain of stages: one result for each. `rounding` is what the covariances are rounded to, in parts of their variances: correlations
/// that come nearer to one are not believed.
#[must_use]
pub fn smooth(stages: &[Stage], rounding: f64) -> Vec<Smoothed> {
    let mut backwards: Vec<Smoothed> = Vec::with_capacity(stages.len());
    for (at, stage) in stages.iter().enumerate().rev() {
        let smoothed = match (backwards.last(), stages.get(at + 1)) {
            (Some(later), Some(next)) => before(stage, next, later, rounding),
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
fn before(stage: &Stage, next: &Stage, later: &Smoothed, rounding: f64) -> Smoothed {
    let learnt = &later.correction + &next.correction;
    let narrowed = &later.covariance - &next.predicted;
    let gain = match &next.link {
        Link::Motion { transition, noise } => motion_gain(transition, noise, &next.predicted, rounding),
        Link::Forgot { first, count } => Some(forgetting_gain(&stage.filtered, *first, *count, rounding)),
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
    rounding: f64,
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
        identity - noise * inverse(predicted, rounding)
    };
    // Transitions are products of 1 + F dt with F nilpotent but for the accelerations of a short step: never singular.
    Some(transition.clone().lu().solve(&kept).unwrap_or(kept))
}

/// States that began anew know of the later ones only what they share with the states that stayed.
fn forgetting_gain(filtered: &DMatrix<f64>, first: usize, count: usize, rounding: f64) -> DMatrix<f64> {
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
        .copy_from(&(shared * inverse(&kept, rounding)));
    gain
}

/// Inverse of a covariance as far as its rounding carries it: scaled to correlations, and these a little short of one. States without variance have
/// none.
fn inverse(covariance: &DMatrix<f64>, rounding: f64) -> DMatrix<f64> {
    let states = covariance.nrows();
    // Of what is no number nothing can be made, however much is added.
    if !covariance.iter().all(|value| value.is_finite()) {
        return DMatrix::zeros(states, states);
    }
    // A state without variance is known, and stays so.
    let scale = covariance.diagonal().map(|variance| {
        if variance > 0.0 {
            variance.sqrt().recip()
        } else {
            0.0
        }
    });
    let mut correlation = DMatrix::from_fn(states, states, |i, j| covariance[(i, j)] * scale[i] * scale[j]);
    let mut added = rounding;
    loop {
        for i in 0..states {
            correlation[(i, i)] = 1.0 + added;
        }
        if let Some(factor) = Cholesky::new(correlation.clone()) {
            let inverse = factor.inverse();
            return DMatrix::from_fn(states, states, |i, j| inverse[(i, j)] * scale[i] * scale[j]);
        }
        added = (10.0 * added).max(f64::EPSILON);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Stream;

    /// A Kalman filter of three states, and all that it depends on as combinations of unit normal numbers: `x_k = start + basis_k u`.
    struct Toy {
        random: Stream,
        state: DVector<f64>,
        covariance: DMatrix<f64>,
        stages: Vec<Stage>,
        filtered: Vec<DVector<f64>>,
        /// Of each stage, as wide as there are numbers by then.
        bases: Vec<DMatrix<f64>>,
        /// Measurements: stage, row, value, variance.
        measured: Vec<(usize, DVector<f64>, f64, f64)>,
    }

    const STATES: usize = 3;

    #[test]
    fn a_covariance_that_is_no_number_ends_and_tells_nothing() {
        let mut covariance = DMatrix::identity(STATES, STATES);
        covariance[(1, 1)] = f64::NAN;
        assert_eq!(inverse(&covariance, 1e-6), DMatrix::zeros(STATES, STATES));
    }

    impl Toy {
        fn new() -> Self {
            let covariance = DMatrix::from_diagonal(&DVector::from_vec(vec![4.0, 1.0, 0.01]));
            Self {
                random: Stream::new(5, 0),
                state: DVector::zeros(STATES),
                stages: Vec::new(),
                filtered: Vec::new(),
                bases: vec![covariance.map(f64::sqrt)],
                covariance,
                measured: Vec::new(),
            }
        }

        /// Goes over a link, and takes in a measurement of the first state, of position and bias, every second time of none.
        fn stage(&mut self, link: Link) {
            let (mut transition, mut root) =
                (DMatrix::identity(STATES, STATES), DMatrix::zeros(STATES, STATES));
            match &link {
                Link::Motion { transition: f, noise } => {
                    transition.copy_from(f);
                    root = noise.map(f64::sqrt);
                }
                Link::Forgot { first, count } => {
                    for i in *first..first + count {
                        transition[(i, i)] = 0.0;
                        root[(i, i)] = 0.7;
                    }
                }
            }
            let at = self.stages.len();
            if at > 0 {
                let before = self.bases.last().expect("a beginning");
                let mut basis = DMatrix::zeros(STATES, before.ncols() + STATES);
                basis
                    .columns_mut(0, before.ncols())
                    .copy_from(&(&transition * before));
                basis.columns_mut(before.ncols(), STATES).copy_from(&root);
                self.bases.push(basis);
                self.state = &transition * &self.state;
                self.covariance =
                    &transition * &self.covariance * transition.transpose() + &root * root.transpose();
            }
            let predicted = self.covariance.clone();
            let mut correction = DVector::zeros(STATES);
            if at.is_multiple_of(2) {
                let row = DVector::from_vec(vec![1.0, 0.0, if at.is_multiple_of(4) { 1.0 } else { 0.0 }]);
                let (value, variance) = (3.0 * self.random.normal(), 0.3);
                let along = &self.covariance * &row;
                let gain = &along / (row.dot(&along) + variance);
                correction = &gain * (value - row.dot(&self.state));
                self.covariance -= &gain * along.transpose();
                self.measured.push((at, row, value, variance));
            }
            self.state += &correction;
            self.filtered.push(self.state.clone());
            self.stages.push(Stage {
                link,
                predicted,
                correction,
                filtered: self.covariance.clone(),
            });
        }

        /// Mean and covariance of a stage's state by least squares over all measurements.
        fn batch(&self, stage: usize) -> (DVector<f64>, DMatrix<f64>) {
            let numbers = self.bases.last().expect("stages").ncols();
            let widened = |basis: &DMatrix<f64>| basis.clone().resize_horizontally(numbers, 0.0);
            let mut information = DMatrix::identity(numbers, numbers);
            let mut sum = DVector::zeros(numbers);
            for (at, row, value, variance) in &self.measured {
                let row = widened(&self.bases[*at]).transpose() * row;
                information += &row * row.transpose() / *variance;
                sum += row * (*value / *variance);
            }
            let covariance = information.try_inverse().expect("regular");
            let basis = widened(&self.bases[stage]);
            (
                &basis * &covariance * sum,
                &basis * covariance * basis.transpose(),
            )
        }
    }

    fn motion(velocity_noise: f64) -> Link {
        let mut transition = DMatrix::identity(STATES, STATES);
        transition[(0, 1)] = 0.5;
        let noise = DMatrix::from_diagonal(&DVector::from_vec(vec![0.0, velocity_noise, 0.0]));
        Link::Motion { transition, noise }
    }

    #[test]
    fn smoothing_is_least_squares_over_the_whole_flight() {
        let mut toy = Toy::new();
        for k in 0..24 {
            toy.stage(match k {
                // Nothing moves, a bias is doubted, and then begins anew.
                7 => Link::still(STATES),
                11 => {
                    let mut noise = DMatrix::zeros(STATES, STATES);
                    noise[(2, 2)] = 0.5;
                    Link::Motion {
                        transition: DMatrix::identity(STATES, STATES),
                        noise,
                    }
                }
                16 => Link::Forgot { first: 2, count: 1 },
                _ => motion(0.04),
            });
        }
        let smoothed = smooth(&toy.stages, 0.0);
        for (stage, smoothed) in smoothed.iter().enumerate() {
            let (mean, covariance) = toy.batch(stage);
            let off = (&toy.filtered[stage] + &smoothed.correction - mean).norm();
            assert!(off < 1e-9, "stage {stage} is {off} off");
            let off = (&smoothed.covariance - covariance).norm();
            assert!(off < 1e-9, "the covariance of stage {stage} is {off} off");
        }
        // What later measurements add is not nothing.
        assert!(smoothed[0].correction.norm() > 0.1);
    }

    #[test]
    fn one_stage_stays_as_it_is() {
        let mut toy = Toy::new();
        toy.stage(Link::still(STATES));
        let smoothed = smooth(&toy.stages, 1e-6);
        assert_eq!(smoothed.len(), 1);
        assert_eq!(smoothed[0].correction, DVector::zeros(STATES));
        assert_eq!(smoothed[0].covariance, toy.stages[0].filtered);
        assert!(smooth(&[], 1e-6).is_empty());
    }

    #[test]
    fn a_state_that_rests_is_not_touched_by_rounding() {
        // Correlations of one, as single precision leaves them after a long outage.
        let mut toy = Toy::new();
        toy.covariance = DMatrix::from_element(STATES, STATES, 100.0);
        for _ in 0..40 {
            toy.stage(motion(1e-4));
        }
        let smoothed = smooth(&toy.stages, 1e-6);
        let bias = |k: usize| toy.filtered[k][2] + smoothed[k].correction[2];
        assert!((bias(0) - bias(39)).abs() < 1e-9, "{} and {}", bias(0), bias(39));
    }
}
