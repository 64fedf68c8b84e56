//! Instruction counts of the path estimator's kernels, and their equality with the portable form.
//!
//! One line a kernel, `name: instructions`, then one line a block, `block index digest clips unexamined exponent`. It fails when the
//! assembly and the portable form differ.

use core::hint::black_box;

use cslam_checks::front_end::{self as check, BLOCKS, SUBSET};
use cslam_core::kernels::{Channel, Kernels, Native, Portable};
use cslam_core::profile::Samples;
use cslam_core::profile::quad_4x8_gmt_72::CHANNELS;
use cslam_core::signal::{Correlator, Detector, Iq, SAMPLES, Waveform, Workspace};
use cslam_firmware::front_end::{Checksum, SoftwareCrc};

use crate::exit::Exit;
use crate::measure::report;

/// A block like those of a receiver whose gain control works: two paths well over the noise, 12 bits, near -12 dB of full
/// scale. Not noise: a path gathers its energy in few words of the last stages, where it might meet a limit.
const NOMINAL: u32 = 31;
/// A tone at the strongest level, another in each channel.
const JAMMED: u32 = 10;
/// Noise far below the level of the gain control.
const WEAK: u32 = 20;

pub(crate) fn run() -> Result<(), Exit> {
    let buffers = cortex_m::singleton!(: (Samples, Workspace, Workspace) = ([[Iq::ZERO; SAMPLES]; CHANNELS], Workspace::new(), Workspace::new()));
    let (block, work, other) = buffers.ok_or(Exit::Panic)?;
    let waveform = Waveform::default();
    let native = Correlator::<Native>::new(&waveform);
    let portable = Correlator::<Portable>::new(&waveform);

    report("", "empty", || ());
    costs("", &native, block, work);
    irregular_costs(&native, block, work);
    black_box(report("", "checksum of a frame, 64 KiB", || {
        SoftwareCrc.samples(black_box(block))
    }));
    costs("portable ", &portable, block, work);

    let mut equal = true;
    for index in 0..BLOCKS {
        let outcome = check::run(&native, block, index, work);
        defmt::println!("block {=u32} {}", index, defmt::Display2Format(&outcome));
        if check::run(&portable, block, index, other) != outcome {
            equal = false;
            defmt::println!("block {=u32}: the portable form differs", index);
        }
    }
    if equal { Ok(()) } else { Err(Exit::Failed) }
}

/// Counts every kernel of a set on a nominal block.
fn costs<K: Kernels>(set: &str, correlator: &Correlator<K>, block: &mut Samples, work: &mut Workspace) {
    check::fill(block, NOMINAL);
    let mut spectrum: Channel = [Iq::ZERO; SAMPLES];
    if let Some(channel) = block.first() {
        report(set, "fft 512", || {
            correlator.spectrum(black_box(channel), black_box(&mut spectrum), work)
        });
    }
    let beam = report(set, "level, 32 channels", || {
        correlator.scale(check::as_captured(black_box(block), NOMINAL))
    });
    let detector = Detector::new(SUBSET.len(), 1e-2, 72 * 256);
    let folded = report(set, "detect, 8 channels folded", || {
        correlator.detect(black_box(&beam), &SUBSET, work)
    });
    black_box(report(set, "median and peak, 256 taps", || {
        detector.peak(black_box(folded.profile))
    }));
    let taps = report(set, "correlate, 32 channels", || {
        correlator.correlate(black_box(beam), work)
    });
    let detector = Detector::new(CHANNELS, 1e-2, 72 * 512);
    black_box(report(set, "median and peak, 512 taps", || {
        detector.peak(black_box(taps.profile()))
    }));
    black_box(taps.into_block());
}

/// Counts what is dear only for captures that are not regular.
fn irregular_costs<K: Kernels>(correlator: &Correlator<K>, block: &mut Samples, work: &mut Workspace) {
    check::fill(block, JAMMED);
    let beam = correlator.scale(check::as_captured(block, JAMMED));
    black_box(report("", "correlate, a tone clips in every channel", || {
        correlator.correlate(black_box(beam), work)
    }));
    check::fill(block, WEAK);
    black_box(report("", "level, 32 channels, with a shift", || {
        correlator.scale(check::as_captured(black_box(block), WEAK))
    }));
}
