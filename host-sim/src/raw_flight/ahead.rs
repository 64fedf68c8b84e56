//! Sweeps that are made, or read, while the receiver works on those before them.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread::Scope;

use super::source::{Given, Source};
use crate::input::InputError;

/// Sweeps that may lie ready on each thread: 8.5 MB each by default.
const AHEAD: usize = 2;

/// A sweep by its number, ready to be heard.
type Ready<const CHANNELS: usize> = (u32, Result<Given<CHANNELS>, InputError>);

/// The threads that make sweeps. With n of them, thread k makes sweeps k, k + n, k + 2 n ...
pub(super) struct Ahead<const CHANNELS: usize>(Vec<Receiver<Ready<CHANNELS>>>);

impl<const CHANNELS: usize> Ahead<CHANNELS> {
    /// Begins to make the first `sweeps` sweeps of a source, until `stop` or until this is dropped.
    pub(super) fn begin<'scope, 'env>(
        scope: &'scope Scope<'scope, 'env>,
        source: &'env impl Source<CHANNELS>,
        sweeps: u32,
        stop: &'env AtomicBool,
    ) -> Self {
        let makers = source.makers().max(1);
        let begin = |first| {
            let (sender, receiver) = sync_channel(AHEAD);
            let own = (0..sweeps).skip(first).step_by(makers);
            scope.spawn(move || make(source, own, stop, &sender));
            receiver
        };
        Self((0..makers).map(begin).collect())
    }

    /// A sweep, which must be a later one than those taken before; `None` beyond the last. The error may be that of one before it.
    pub(super) fn take(&self, sweep: u32) -> Option<Result<Given<CHANNELS>, InputError>> {
        let own = self.0.get(sweep as usize % self.0.len())?;
        let found = own
            .iter()
            .find(|(number, given)| *number >= sweep || given.is_err());
        found.map(|(_, given)| given)
    }
}

/// Makes one sweep after the other until nobody wants more.
fn make<const CHANNELS: usize>(
    source: &impl Source<CHANNELS>,
    sweeps: impl Iterator<Item = u32>,
    stop: &AtomicBool,
    sender: &SyncSender<Ready<CHANNELS>>,
) {
    for sweep in sweeps {
        if stop.load(Ordering::Relaxed) || sender.send((sweep, source.sweep(sweep))).is_err() {
            return;
        }
    }
}
