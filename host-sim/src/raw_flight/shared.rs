//! One world that several receivers hear at the same time: each sweep is made once.

use std::collections::BTreeMap;
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};

use super::source::{Given, Source};
use crate::flight_log::PoseTruth;
use crate::input::InputError;
use crate::sensors::Stamped;

/// The first receiver may be so many sweeps before the last one: 8.5 MB each by default.
const WINDOW: u32 = 16;

/// A source for several listeners.
#[derive(Debug)]
pub struct Shared<'s, S, const CHANNELS: usize = 32> {
    source: &'s S,
    state: Mutex<State<CHANNELS>>,
    changed: Condvar,
}

#[derive(Debug, Default)]
struct State<const CHANNELS: usize> {
    /// For each listener, the latest sweep that it has asked for; `None` when it has left.
    asked: Vec<Option<u32>>,
    kept: BTreeMap<u32, Kept<CHANNELS>>,
}

#[derive(Debug)]
struct Kept<const CHANNELS: usize> {
    /// None while it is being made.
    given: Option<Result<Given<CHANNELS>, InputError>>,
    /// The listeners that have it.
    taken: Vec<bool>,
}

/// One of the receivers of a shared source. When it is dropped, the others no longer wait for it.
#[derive(Debug)]
pub struct Listener<'a, 's, S, const CHANNELS: usize = 32> {
    shared: &'a Shared<'s, S, CHANNELS>,
    number: usize,
}

impl<'s, S: Source<CHANNELS>, const CHANNELS: usize> Shared<'s, S, CHANNELS> {
    /// Shares a source.
    pub fn new(source: &'s S) -> Self {
        Self {
            source,
            state: Mutex::default(),
            changed: Condvar::new(),
        }
    }

    /// As many listeners. All must be made at once, before the first sweep.
    pub fn listeners(&self, count: usize) -> Vec<Listener<'_, 's, S, CHANNELS>> {
        self.state().asked = vec![Some(0); count];
        (0..count)
            .map(|number| Listener { shared: self, number })
            .collect()
    }
}

impl<S, const CHANNELS: usize> Shared<'_, S, CHANNELS> {
    // What panics here makes nothing wrong that others would read.
    fn state(&self) -> MutexGuard<'_, State<CHANNELS>> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn wait<'g>(&'g self, state: MutexGuard<'g, State<CHANNELS>>) -> MutexGuard<'g, State<CHANNELS>> {
        self.changed.wait(state).unwrap_or_else(PoisonError::into_inner)
    }
}

impl<const CHANNELS: usize> State<CHANNELS> {
    /// Whether a listener is too far ahead of the last one.
    fn is_ahead(&self, sweep: u32) -> bool {
        let last = self.asked.iter().flatten().min();
        last.is_some_and(|last| sweep > last.saturating_add(WINDOW))
    }

    /// Drops what everybody has who still listens.
    fn tidy(&mut self) {
        let Self { asked, kept } = self;
        kept.retain(|_, kept| {
            let wanted = asked
                .iter()
                .zip(&kept.taken)
                .any(|(asked, taken)| asked.is_some() && !taken);
            kept.given.is_none() || wanted
        });
    }
}

impl<S: Source<CHANNELS>, const CHANNELS: usize> Source<CHANNELS> for Listener<'_, '_, S, CHANNELS> {
    fn sweeps(&self) -> u32 {
        self.shared.source.sweeps()
    }

    fn events(&self) -> Box<dyn Iterator<Item = Stamped> + '_> {
        self.shared.source.events()
    }

    fn makers(&self) -> usize {
        self.shared.source.makers()
    }

    fn sweep(&self, sweep: u32) -> Result<Given<CHANNELS>, InputError> {
        let shared = self.shared;
        let mut state = shared.state();
        if let Some(Some(asked)) = state.asked.get_mut(self.number) {
            *asked = sweep.max(*asked);
        }
        shared.changed.notify_all();
        // The last one never waits here, and what is being made will be there: nobody waits for ever.
        while state.is_ahead(sweep) {
            state = shared.wait(state);
        }
        if !state.kept.contains_key(&sweep) {
            let taken = vec![false; state.asked.len()];
            state.kept.insert(sweep, Kept { given: None, taken });
            drop(state);
            let given = shared.source.sweep(sweep);
            state = shared.state();
            if let Some(kept) = state.kept.get_mut(&sweep) {
                kept.given = Some(given);
            }
            shared.changed.notify_all();
        }
        loop {
            if let Some(kept) = state.kept.get_mut(&sweep)
                && let Some(given) = &kept.given
            {
                let given = given.clone();
                kept.taken[self.number] = true;
                state.tidy();
                return given;
            }
            state = shared.wait(state);
        }
    }

    fn truth(&self, uav_time_ns: u64) -> Option<PoseTruth> {
        self.shared.source.truth(uav_time_ns)
    }
}

impl<S, const CHANNELS: usize> Drop for Listener<'_, '_, S, CHANNELS> {
    fn drop(&mut self) {
        let mut state = self.shared.state();
        if let Some(asked) = state.asked.get_mut(self.number) {
            *asked = None;
        }
        state.tidy();
        drop(state);
        self.shared.changed.notify_all();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::channel::{Block, Sweep};
    use std::sync::atomic::{AtomicU32, Ordering};
    use std::thread;

    /// A hundred sweeps of one block each, whose exponent is the sweep's number.
    #[derive(Debug, Default)]
    struct Counting {
        made: AtomicU32,
        latest: AtomicU32,
    }

    impl Source for Counting {
        fn sweeps(&self) -> u32 {
            100
        }

        fn events(&self) -> Box<dyn Iterator<Item = Stamped> + '_> {
            Box::new(std::iter::empty())
        }

        fn makers(&self) -> usize {
            2
        }

        fn sweep(&self, sweep: u32) -> Result<Given, InputError> {
            self.made.fetch_add(1, Ordering::SeqCst);
            self.latest.fetch_max(sweep, Ordering::SeqCst);
            if sweep == 70 {
                return Err(InputError::new("sweep 70: broken"));
            }
            let blocks = vec![Block::zero(0, sweep as i32)];
            Ok(Given {
                beams: Sweep { blocks },
                ..Given::default()
            })
        }

        fn truth(&self, _: u64) -> Option<PoseTruth> {
            None
        }
    }

    fn number(given: Result<Given, InputError>) -> Option<i32> {
        given.ok().map(|given| given.beams.blocks[0].exponent)
    }

    #[test]
    fn each_sweep_is_made_once_and_everybody_hears_it() {
        let source = Counting::default();
        let shared = Shared::new(&source);
        thread::scope(|scope| {
            let hear = |listener: &Listener<'_, '_, Counting>, sweeps: Vec<u32>| {
                for sweep in sweeps {
                    let expected = (sweep != 70).then_some(sweep as i32);
                    assert_eq!(number(listener.sweep(sweep)), expected);
                }
            };
            for listener in shared.listeners(2) {
                scope.spawn(move || {
                    // Two threads each, as a flight has.
                    thread::scope(|inner| {
                        for first in 0..2 {
                            let (listener, own) = (&listener, (first..100).step_by(2).collect());
                            inner.spawn(move || hear(listener, own));
                        }
                    });
                });
            }
        });
        assert_eq!(source.made.load(Ordering::SeqCst), 100);
        assert!(shared.state().kept.is_empty());
    }

    #[test]
    fn the_first_waits_for_the_last_until_that_leaves() {
        let source = Counting::default();
        let shared = Shared::new(&source);
        let mut listeners = shared.listeners(2);
        let (last, first) = (listeners.pop().expect("two"), listeners.pop().expect("two"));
        thread::scope(|scope| {
            let heard = scope.spawn(move || {
                (0..=40)
                    .map(|sweep| number(first.sweep(sweep)))
                    .collect::<Vec<_>>()
            });
            assert_eq!(number(last.sweep(0)), Some(0));
            // The first is held where the window ends: it asks for more, and it gets no more.
            while shared.state().asked[0] != Some(WINDOW + 1) {
                thread::yield_now();
            }
            assert_eq!(source.latest.load(Ordering::SeqCst), WINDOW);
            assert_eq!(number(last.sweep(3)), Some(3));
            while shared.state().asked[0] != Some(WINDOW + 4) {
                thread::yield_now();
            }
            assert_eq!(source.latest.load(Ordering::SeqCst), WINDOW + 3);
            drop(last);
            let heard = heard.join().expect("ends");
            assert_eq!(heard, (0..=40).map(Some).collect::<Vec<_>>());
        });
        assert!(shared.state().kept.is_empty());
    }
}
