//! The paths of one recorded sweep, as lines of numbers: `estimate NAME.sigmf-meta`.
//!
//! Each beam has an exponent of its own, and the strongest beam comes first.

mod recording;

use std::error::Error;

use cslam_core::paths::{ElementErrors, EstimatedPath, PathEstimator};
use cslam_core::profile::{Block, FlightConfig, FlightEstimator};

fn main() -> Result<(), Box<dyn Error>> {
    let name = std::env::args()
        .nth(1)
        .ok_or("expected a recording: NAME.sigmf-meta")?;
    let mut beams = recording::read(&name)?;
    let mut blocks: Vec<Block<'_>> = beams
        .iter_mut()
        .map(|heard| Block {
            samples: &mut heard.samples,
            beam: heard.beam,
            exponent: heard.exponent,
        })
        .collect();
    blocks.sort_by(|a, b| b.power().total_cmp(&a.power()));

    // One sweep teaches nothing of the arrays before its paths are wanted.
    let config = FlightConfig {
        element_errors: ElementErrors::BUDGET,
        ..FlightConfig::default()
    };
    let mut estimator = Box::new(FlightEstimator::checked(&config)?);
    for block in blocks {
        estimator.push_beam(block);
    }
    println!("{}", EstimatedPath::COLUMNS);
    for path in &estimator.finish() {
        println!("{path}");
    }
    Ok(())
}
