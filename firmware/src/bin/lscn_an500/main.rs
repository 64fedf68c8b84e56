//! Instruction counts of the link state networks on an emulated Cortex-M7, and their equality with the portable form. Run
//! with `CSLAM_ICOUNT=10`, as `kernels_an500`; these are instructions, not cycles.
//!
//! One line a step, `name: instructions`, then one line a link, `link index digest` of the models that fly and
//! `random index digest` of random ones. Exit code 0 unless the assembly and the portable form differ.
#![no_std]
#![no_main]

mod rivals;

use core::hint::black_box;
use core::panic::PanicInfo;
use core::ptr;

use cortex_m_rt::entry;
use cslam_core::lscn::kernels::{Kernels, Native, Portable};
use cslam_core::lscn::{Activations, Features, LinkGeometry, Network, Probabilities, paper_inputs};
use cslam_core::reflection::InputError;
use cslam_firmware::lscn_check::{LINKS, Link, ModelFile, Networks, PAPER_INPUTS, PATHS, Which};
use defmt_semihosting as _;
use semihosting::process::exit;

/// 32-bit up-counter of the board's FPGA, 25 MHz.
const COUNTER: usize = 0x4002_8018;

#[entry]
fn main() -> ! {
    let files = cortex_m::singleton!(: [ModelFile; 3] = [ModelFile::EMPTY; 3]);
    let Some([a, b, c]) = files else { exit(101) };
    let (Ok(a), Ok(b), Ok(c)) = (
        a.random(Which::WithDeparture),
        b.random(Which::WithoutDeparture),
        c.random(Which::Paper),
    ) else {
        exit(101)
    };
    report("empty", || ());
    let Ok(nominal) = Link::random(0) else { exit(101) };
    let (Ok(native), Ok(portable)) = (Networks::<Native>::shipped(), Networks::<Portable>::shipped()) else {
        exit(101)
    };
    steps("geometric", &native.with_departure, &GEOMETRIC);
    steps("paper", &native.paper, &PAPER);
    inference("portable ", &portable, &nominal);
    inference("", &native, &nominal);
    rivals::count();
    let random = [a, b, c];
    let equal =
        links("link", &native, &portable) & links("random", &Networks::new(random), &Networks::new(random));
    exit(i32::from(!equal))
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
        defmt::println!("{=str}, {=str}: {=u32}", set, name, instructions(before, stamp));
        before = stamp;
    }
}

/// Counts whole inferences, and a link of nine paths from measurements to probabilities.
fn inference<K: Kernels>(set: &str, networks: &Networks<'_, K>, link: &Link) {
    let (geometric, paper) = (&networks.with_departure, &networks.paper);
    let (mut inputs, mut work) = ([0.0; PAPER_INPUTS], Activations::new());
    paper_inputs(link.paths(), &mut inputs);
    black_box(report_in(set, "paper K = 9, one link", || {
        paper.classify(black_box(&inputs), &mut work).is_ok()
    }));
    let features = one(link);
    if let Some(inputs) = features.as_ref().ok().and_then(Features::with_departure) {
        black_box(report_in(set, "geometric 23-48-32-3, one path", || {
            geometric.classify(black_box(inputs), &mut work).is_ok()
        }));
        black_box(report_in(set, "sums of geometric 23-48-32-3", || {
            geometric.sums(black_box(inputs), &mut work).is_ok()
        }));
    }
    black_box(report_in(set, "features, one path", || {
        one(black_box(link)).is_ok()
    }));
    black_box(report_in(set, "features and geometric, nine paths", || {
        classify(geometric, black_box(link), &mut work)
    }));
}

fn one(link: &Link) -> Result<Features, InputError> {
    let geometry = LinkGeometry::new(link.ends(), link.paths())?;
    geometry.features(link.paths().first().ok_or(InputError::NotFinite)?)
}

/// Probabilities of the paths of a link.
fn classify<K: Kernels>(
    network: &Network<'_, K>,
    link: &Link,
    work: &mut Activations,
) -> [Option<Probabilities>; PATHS] {
    let mut all = [None; PATHS];
    if let Ok(geometry) = LinkGeometry::new(link.ends(), link.paths()) {
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

/// Instructions of a step in a set, printed.
fn report_in<R>(set: &str, name: &str, step: impl FnOnce() -> R) -> R {
    let (result, instructions) = measure(step);
    defmt::println!("{=str}{=str}: {=u32}", set, name, instructions);
    result
}

fn report<R>(name: &str, step: impl FnOnce() -> R) -> R {
    report_in("", name, step)
}

/// Instructions of a step.
#[inline(never)]
fn measure<R>(step: impl FnOnce() -> R) -> (R, u32) {
    let start = ticks();
    let result = step();
    let end = ticks();
    (result, instructions(start, end))
}

/// Instructions between two readings of the counter: 25.6 ticks each.
fn instructions(start: u32, end: u32) -> u32 {
    (u64::from(end.wrapping_sub(start)) * 10 / 256) as u32
}

fn ticks() -> u32 {
    // SAFETY: an aligned 32-bit register that exists on this board and that reading does not change.
    unsafe { ptr::read_volatile(COUNTER as *const u32) }
}

#[panic_handler]
fn panic(info: &PanicInfo<'_>) -> ! {
    defmt::error!("{}", defmt::Display2Format(info));
    exit(101)
}
