//! What a filter did in a flight, stage by stage.

use std::sync::{Mutex, PoisonError};

use cslam_core::estimator::Pose;
use cslam_core::estimator::{
    Covariance, Filter, MAX_PLANES, Nominal, PLANES, Step, Transition, Transmitter, Watch,
};
use nalgebra::{DMatrix, DVector};

use super::errors::errors;
use super::rts::{Link, Stage};

/// A motion without an update is cut after this, ns: corrections are interpolated within it.
const LONGEST_MOTION_NS: u64 = 200_000_000;

/// The state after a stage.
#[derive(Clone, Debug)]
pub(super) struct Standing {
    pub(super) nominal: Nominal,
    /// The same as the filter hands it out.
    pub(super) pose: Option<Pose>,
    /// The GMT as it was taken at the last sweep.
    pub(super) transmitter: Option<Transmitter>,
    /// Surfaces in the state: of these the paths have told already.
    pub(super) held: heapless::Vec<u16, MAX_PLANES>,
}

/// A state on the way to a stage.
#[derive(Clone, Copy, Debug)]
pub(super) struct OnTheWay {
    /// The stage that it leads to.
    pub(super) stage: usize,
    pub(super) nominal: Nominal,
}

/// A time in which the filter kept its pose.
#[derive(Clone, Debug, Default)]
pub(super) struct Chain {
    pub(super) stages: Vec<Stage>,
    /// One for each stage.
    pub(super) standing: Vec<Standing>,
    pub(super) way: Vec<OnTheWay>,
}

/// A state and its covariance.
#[derive(Clone, Debug)]
struct State<const N: usize> {
    nominal: Nominal,
    covariance: Covariance<f32, N>,
}

impl<const N: usize> State<N> {
    fn of(filter: &Filter<f32, N>) -> Self {
        Self {
            nominal: *filter.nominal(),
            covariance: filter.covariance().clone(),
        }
    }

    fn variances(&self) -> DVector<f64> {
        DVector::from_fn(N, |i, _| f64::from(self.covariance.at(i, i)))
    }
}

fn wide<const N: usize>(covariance: &Covariance<f32, N>) -> DMatrix<f64> {
    DMatrix::from_fn(N, N, |i, j| f64::from(covariance.at(i, j)))
}

/// A stage in the making.
#[derive(Clone, Debug)]
struct Open<const N: usize> {
    since_ns: u64,
    transition: DMatrix<f64>,
    noise: DMatrix<f64>,
    /// After the last motion or change.
    predicted: State<N>,
    /// What updates have added to the planes since.
    planes: DVector<f64>,
    /// As it stood last, and as it was handed out then.
    last: State<N>,
    standing: Standing,
}

impl<const N: usize> Open<N> {
    fn new(filter: &Filter<f32, N>) -> Self {
        let state = State::of(filter);
        Self {
            since_ns: state.nominal.time_ns,
            transition: DMatrix::identity(N, N),
            noise: DMatrix::zeros(N, N),
            predicted: state.clone(),
            planes: DVector::zeros(N),
            standing: standing(filter),
            last: state,
        }
    }

    fn is_updated(&self) -> bool {
        self.last.nominal != self.predicted.nominal || self.last.covariance != self.predicted.covariance
    }

    /// The stage as far as it came.
    fn stage(self) -> (Stage, Standing) {
        let mut from = self.predicted.nominal;
        // Time stamps that were rounded move the state without a motion.
        from.coast(self.last.nominal.time_ns);
        let mut correction = self.planes;
        for (i, error) in errors(&from, &self.last.nominal).into_iter().enumerate() {
            correction[i] = error;
        }
        let stage = Stage {
            link: Link::Motion {
                transition: self.transition,
                noise: self.noise,
            },
            predicted: wide(&self.predicted.covariance),
            correction,
            filtered: wide(&self.last.covariance),
        };
        (stage, self.standing)
    }
}

fn standing<const N: usize>(filter: &Filter<f32, N>) -> Standing {
    Standing {
        nominal: *filter.nominal(),
        pose: filter.pose(),
        transmitter: filter.transmitter().copied(),
        held: filter
            .planes()
            .filter_map(|held| u16::try_from(held.id).ok())
            .collect(),
    }
}

/// What the filter has told so far.
#[derive(Debug)]
struct Told<const N: usize> {
    chains: Vec<Chain>,
    open: Option<Open<N>>,
}

impl<const N: usize> Told<N> {
    fn close(&mut self) {
        if let (Some(open), Some(chain)) = (self.open.take(), self.chains.last_mut()) {
            let (stage, standing) = open.stage();
            chain.stages.push(stage);
            chain.standing.push(standing);
        }
    }

    fn stands(&mut self, filter: &Filter<f32, N>) {
        if !filter.is_running() {
            return;
        }
        let Some(open) = &mut self.open else {
            if self.chains.is_empty() {
                self.chains.push(Chain::default());
            }
            self.open = Some(Open::new(filter));
            return;
        };
        open.last = State::of(filter);
        open.standing = standing(filter);
        let since_ns = open.last.nominal.time_ns.saturating_sub(open.since_ns);
        if open.is_updated() || since_ns >= LONGEST_MOTION_NS {
            self.close();
            self.open = Some(Open::new(filter));
        }
    }

    fn carried(&mut self, filter: &Filter<f32, N>, transition: &Transition<f32>) {
        let Some(open) = &mut self.open else {
            return;
        };
        let transition = transition.to_f64();
        let over = |matrix: &mut DMatrix<f64>| {
            for mut column in matrix.column_iter_mut() {
                transition.carry(column.as_mut_slice());
            }
        };
        over(&mut open.transition);
        over(&mut open.noise);
        open.noise = open.noise.transpose();
        over(&mut open.noise);
        open.predicted = State::of(filter);
    }

    fn spread(&mut self, filter: &Filter<f32, N>) {
        let (Some(open), Some(chain)) = (&mut self.open, self.chains.last_mut()) else {
            return;
        };
        let before = open.predicted.variances();
        open.predicted = State::of(filter);
        let added = open.predicted.variances() - before;
        for (i, variance) in added.iter().enumerate() {
            open.noise[(i, i)] += variance;
        }
        chain.way.push(OnTheWay {
            stage: chain.stages.len(),
            nominal: open.predicted.nominal,
        });
    }

    fn corrected(&mut self, errors: &[f32; N]) {
        if let Some(open) = &mut self.open {
            for (sum, error) in open.planes.iter_mut().zip(errors).skip(PLANES) {
                *sum += f64::from(*error);
            }
        }
    }

    fn doubted(&mut self, filter: &Filter<f32, N>) {
        if let Some(open) = &mut self.open {
            let before = wide(&open.last.covariance);
            open.predicted = State::of(filter);
            open.noise += wide(&open.predicted.covariance) - before;
        }
    }

    fn forgot(&mut self, filter: &Filter<f32, N>, first: usize, count: usize) {
        if self.open.is_none() {
            return;
        }
        self.close();
        let (mut stage, standing) = Open::new(filter).stage();
        stage.link = Link::Forgot { first, count };
        if let Some(chain) = self.chains.last_mut() {
            chain.stages.push(stage);
            chain.standing.push(standing);
        }
        self.open = Some(Open::new(filter));
    }

    fn restarted(&mut self) {
        self.close();
        self.chains.push(Chain::default());
    }
}

/// Listens to a filter of `N` states.
#[derive(Debug)]
pub(super) struct Tape<const N: usize> {
    told: Mutex<Told<N>>,
}

impl<const N: usize> Tape<N> {
    pub(super) fn new() -> Self {
        Self {
            told: Mutex::new(Told {
                chains: Vec::new(),
                open: None,
            }),
        }
    }

    /// What `look` makes of what was told so far.
    pub(super) fn look<R>(&self, look: impl FnOnce(&[Chain]) -> R) -> R {
        let mut told = self.told.lock().unwrap_or_else(PoisonError::into_inner);
        told.close();
        look(&told.chains)
    }

    /// All that was told.
    pub(super) fn take(&self) -> Vec<Chain> {
        let mut told = self.told.lock().unwrap_or_else(PoisonError::into_inner);
        told.close();
        std::mem::take(&mut told.chains)
    }
}

impl<const N: usize> Watch<f32, N> for Tape<N> {
    fn step(&self, filter: &Filter<f32, N>, step: Step<'_, f32, N>) {
        let mut told = self.told.lock().unwrap_or_else(PoisonError::into_inner);
        match step {
            Step::Stands => told.stands(filter),
            Step::Carried(transition) => told.carried(filter, transition),
            Step::Spread => told.spread(filter),
            Step::Corrected(errors) => told.corrected(errors),
            Step::Doubted => told.doubted(filter),
            Step::Forgot { first, count } => told.forgot(filter, first, count),
            Step::Restarted => told.restarted(),
        }
    }
}
