//! Everything in static memory: what a board does. Nothing is allocated, and the block of samples is where a DMA would write.
//!
//! A board puts the same statics behind the mutex of `critical-section`, or hands them to one task at start.

use std::error::Error;
use std::mem::MaybeUninit;
use std::sync::Mutex;

use cslam_core::paths::PathEstimator;
use cslam_core::profile::quad_4x8_gmt_72::BEAMS;
use cslam_core::profile::{Block, FlightConfig, FlightEstimator, Samples};
use cslam_core::signal::Iq;

/// All that path estimation works in.
struct Memory {
    samples: Samples,
    estimator: MaybeUninit<FlightEstimator>,
}

static MEMORY: Mutex<Memory> = Mutex::new(Memory {
    samples: [[Iq::ZERO; 512]; 32],
    estimator: MaybeUninit::uninit(),
});

fn main() -> Result<(), Box<dyn Error>> {
    println!("static memory: {} bytes", size_of::<Memory>());
    let memory = &mut *MEMORY.lock()?;
    let config = FlightConfig::default();
    config.check(BEAMS)?;
    // Its tables are computed where they lie: the stack of a task is short.
    let estimator = FlightEstimator::init(&mut memory.estimator, &config, ());
    for beam in 0..72 {
        // A front end would fill `memory.samples` here, and say with which exponent: that of this beam.
        let exponent = -38;
        let report = estimator.push_beam(Block {
            samples: &mut memory.samples,
            beam,
            exponent,
        });
        assert_eq!(report.paths, 0, "silence");
    }
    println!("paths in silence: {}", estimator.finish().len());
    Ok(())
}
