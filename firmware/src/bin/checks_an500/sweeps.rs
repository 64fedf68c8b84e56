//! The whole path estimator: recorded sweeps in, what it makes of them out, bit for bit, and the instructions that each stage of it took:
//! lines `sweep INDEX, STAGE: instructions`. The recording's format: [`cslam_firmware::sweep_check`].

use cslam_core::ltd::{Estimator, EstimatorConfig, Iq, PaperEstimator, PathEstimator};
use cslam_core::waveform::SAMPLES;
use cslam_firmware::front_end_check::{Block, CHANNELS};
use cslam_firmware::sweep_check::{self, PATHS};

use crate::counter::Counter;
use crate::exit::Exit;
use crate::lines::Lines;
use crate::recording::Recording;
use crate::stages::Stages;
use crate::words::Word;

type Best = Estimator<4, 8, CHANNELS, 72, 3, 8, 8, 360, PATHS, &'static Stages>;
type Paper = PaperEstimator<4, 8, CHANNELS, 72, PATHS>;

/// Takes a recording through the estimator of a mode, `best` or `paper`.
pub(crate) fn run(mode: &Word, recording: &Word, lines: &Word) -> Result<(), Exit> {
    let stages = cortex_m::singleton!(: Stages = Stages::new()).ok_or(Exit::Panic)?;
    let (recording, lines) = (Recording::open(recording), Lines::create(lines));
    let (recording, lines) = recording.zip(lines).ok_or(Exit::Usage)?;
    let config = EstimatorConfig::default();
    match mode.path().to_bytes() {
        b"best" => {
            let estimator = cortex_m::singleton!(: Best = Best::with_meter(&config, stages));
            check(estimator.ok_or(Exit::Panic)?, stages, recording, lines)
        }
        b"paper" => {
            let estimator = cortex_m::singleton!(: Paper = Paper::new(&config));
            check(estimator.ok_or(Exit::Panic)?, stages, recording, lines)
        }
        _ => Err(Exit::Usage),
    }
}

fn check(
    estimator: &mut dyn PathEstimator<CHANNELS, PATHS>,
    stages: &'static Stages,
    mut recording: Recording,
    mut lines: Lines,
) -> Result<(), Exit> {
    let block = cortex_m::singleton!(: Block = [[Iq::ZERO; SAMPLES]; CHANNELS]).ok_or(Exit::Panic)?;
    let mut counter = Counter { stages, sweep: 0 };
    match sweep_check::run(&mut recording, estimator, block, &mut counter, &mut lines) {
        Ok(sweeps) if lines.flush().is_ok() => {
            defmt::println!("sweeps: {=u32}", sweeps);
            Ok(())
        }
        _ => {
            defmt::error!("the recording is damaged, or a file cannot be used");
            Err(Exit::Failed)
        }
    }
}
