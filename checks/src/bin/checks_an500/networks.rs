//! Instruction counts of the link state networks, and their equality with the portable form.
//!
//! One line a step, `name: instructions`, then one line a link, `link index digest` of the networks of the crate,
//! `random index digest` of random ones and `trees index digest` of the trees. It fails when the assembly and the portable form differ.

use core::hint::black_box;

use cslam_checks::link_state::{LINKS, Link, ModelFile, Networks, PAPER_INPUTS, PATHS, Which, trees_digest};
use cslam_core::kernels::{Kernels, Native, Portable};
use cslam_core::link_state::{
    Activations, Features, Network, PathClassifier, Probabilities, models, paper_inputs,
};
use cslam_core::reflection::InputError;

use crate::clock::ticks;
use crate::exit::Exit;
use crate::measure::{between, report};
use crate::rivals;

pub(crate) fn run() -> Result<(), Exit> {
    let files = cortex_m::singleton!(: [ModelFile; 3] = [ModelFile::EMPTY; 3]);
    let [a, b, c] = files.ok_or(Exit::Panic)?;
    let (Ok(a), Ok(b), Ok(c)) = (
        a.random(Which::WithDeparture),
        b.random(Which::WithoutDeparture),
        c.random(Which::Paper),
    ) else {
        return Err(Exit::Panic);
    };
    report("", "empty", || ());
    let nominal = Link::random(0).map_err(|_| Exit::Panic)?;
    let (Ok(native), Ok(portable)) = (Networks::<Native>::shipped(), Networks::<Portable>::shipped()) else {
        return Err(Exit::Panic);
    };
    steps("geometric", &native.with_departure, &GEOMETRIC);
    steps("paper", &native.paper, &PAPER);
    inference("portable ", &portable, &nominal);
    inference("", &native, &nominal);
    let trees = models::trees().map_err(|_| Exit::Panic)?;
    count_trees(&trees, &nominal);
    rivals::count();
    let random = [a, b, c];
    let equal =
        links("link", &native, &portable) & links("random", &Networks::new(random), &Networks::new(random));
    for index in 0..LINKS {
        let link = Link::random(index).map_err(|_| Exit::Panic)?;
        let digest = trees_digest(&trees, &link).map_err(|_| Exit::Panic)?;
        defmt::println!("trees {=u32} {=u64:016x}", index, digest);
    }
    if equal { Ok(()) } else { Err(Exit::Failed) }
}

/// Steps of the geometric network.
const GEOMETRIC: [&str; 4] = ["round the inputs", "23x48", "48x32", "32x3"];
/// Steps of the paper's network.
const PAPER: [&str; 5] = ["round the inputs", "3x10", "34x50", "50x100", "100x3"];

/// Counts every step of an inference.
fn steps<K: Kernels, const N: usize>(set: &str, network: &Network<'_, K>, names: &[&str; N]) {
    let (inputs, mut work) = ([0.25; PAPER_INPUTS], Activations::new());
    let inputs = inputs.get(..network.model().shape().inputs()).unwrap_or(&[]);
    let mut stamps = [0; N];
    let mut done = 0;
    let start = ticks();
    black_box(
        network
            .sums_observed(black_box(inputs), &mut work, || {
                if let Some(stamp) = stamps.get_mut(done) {
                    *stamp = ticks();
                }
                done += 1;
            })
            .is_ok(),
    );
    let mut before = start;
    for (name, stamp) in names.iter().zip(stamps) {
        defmt::println!("{=str}, {=str}: {=u32}", set, name, between(before, stamp));
        before = stamp;
    }
}

/// Counts whole inferences, and a link of nine paths from measurements to probabilities.
fn inference<K: Kernels>(set: &str, networks: &Networks<'_, K>, link: &Link) {
    let (geometric, paper) = (&networks.with_departure, &networks.paper);
    let (mut inputs, mut work) = ([0.0; PAPER_INPUTS], Activations::new());
    paper_inputs(link.paths(), &mut inputs);
    black_box(report(set, "paper K = 9, one link", || {
        paper.classify(black_box(&inputs), &mut work).is_ok()
    }));
    let features = one(link);
    if let Some(inputs) = features.as_ref().ok().and_then(Features::with_departure) {
        black_box(report(set, "geometric 23-48-32-3, one path", || {
            geometric.classify(black_box(inputs), &mut work).is_ok()
        }));
        black_box(report(set, "sums of geometric 23-48-32-3", || {
            geometric.sums(black_box(inputs), &mut work).is_ok()
        }));
    }
    black_box(report(set, "features, one path", || one(black_box(link)).is_ok()));
    black_box(report(set, "features and geometric, nine paths", || {
        classify(geometric, black_box(link), &mut work)
    }));
}

/// Counts what the trees take of a path, and of a link of nine.
fn count_trees(classifier: &PathClassifier<'_>, link: &Link) {
    let geometry = || link.geometry();
    let path = link.paths().first();
    if let Some((geometry, path)) = geometry().ok().zip(path) {
        if let Ok(inputs) = geometry.tree_inputs(path) {
            black_box(report("", "trees, one path", || {
                classifier.trees().classify(black_box(&inputs)).is_ok()
            }));
        }
        black_box(report("", "inputs of the trees, one path", || {
            geometry.tree_inputs(black_box(path)).is_ok()
        }));
    }
    black_box(report("", "inputs and trees, nine paths", || {
        let mut all = [None; PATHS];
        if let Ok(geometry) = geometry() {
            for (path, place) in black_box(link).paths().iter().zip(&mut all) {
                *place = classifier.path(&geometry, path).ok();
            }
        }
        all
    }));
}

fn one(link: &Link) -> Result<Features, InputError> {
    let geometry = link.geometry()?;
    geometry.features(link.paths().first().ok_or(InputError::NotFinite)?)
}

/// Probabilities of the paths of a link.
fn classify<K: Kernels>(
    network: &Network<'_, K>,
    link: &Link,
    work: &mut Activations,
) -> [Option<Probabilities>; PATHS] {
    let mut all = [None; PATHS];
    if let Ok(geometry) = link.geometry() {
        for (path, place) in link.paths().iter().zip(&mut all) {
            *place = geometry.features(path).ok().and_then(|features| {
                // A path without angle of departure costs no more: it takes the smaller network.
                network.classify(features.with_departure()?, work).ok()
            });
        }
    }
    all
}

/// Prints the digest of every link; whether the portable form gives the same.
fn links(name: &str, native: &Networks<'_, Native>, portable: &Networks<'_, Portable>) -> bool {
    let (mut work, mut equal) = (Activations::new(), true);
    for index in 0..LINKS {
        let Ok(link) = Link::random(index) else {
            return false;
        };
        let digest = native.digest(&link, &mut work);
        if digest.is_err() || portable.digest(&link, &mut work) != digest {
            equal = false;
            defmt::println!("{=str} {=u32}: the portable form differs", name, index);
        }
        defmt::println!("{=str} {=u32} {=u64:016x}", name, index, digest.unwrap_or(0));
    }
    equal
}
