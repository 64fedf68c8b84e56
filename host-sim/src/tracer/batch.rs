//! Every transmitter with every receiver: in parallel, in order, in bounded memory.

use rayon::prelude::*;

use super::{ImageTree, TracedPath, Tracer};

/// Transmitters whose trees are in memory at a time, for each thread.
const TREES_PER_THREAD: usize = 2;

/// Links whose results wait in memory for their turn.
const LINKS: usize = 1024;

/// Traces every transmitter with every receiver. `each` turns the paths of a link into a result, on any thread; `sink`
/// takes the results on this thread, transmitter by transmitter in the order of the receivers. Runs in the current rayon
/// pool; memory does not grow with the number of links.
///
/// # Errors
/// The first error of `sink` ends the work.
pub fn for_each_link<T: Send, E>(
    tracer: &Tracer<'_>,
    transmitters_m: &[[f64; 3]],
    receivers_m: &[[f64; 3]],
    each: impl Fn(&ImageTree<'_>, [f64; 3], Vec<TracedPath>) -> T + Sync,
    mut sink: impl FnMut(T) -> Result<(), E>,
) -> Result<(), E> {
    for some in transmitters_m.chunks(TREES_PER_THREAD * rayon::current_num_threads()) {
        let trees: Vec<ImageTree<'_>> = some.par_iter().map(|tx| tracer.transmitter(*tx)).collect();
        let links = trees.len() * receivers_m.len();
        for start in (0..links).step_by(LINKS) {
            let results: Vec<T> = (start..links.min(start + LINKS))
                .into_par_iter()
                .map(|link| {
                    let (tree, rx_m) = (
                        &trees[link / receivers_m.len()],
                        receivers_m[link % receivers_m.len()],
                    );
                    each(tree, rx_m, tree.trace(rx_m))
                })
                .collect();
            results.into_iter().try_for_each(&mut sink)?;
        }
    }
    Ok(())
}
