//! Instructions of each stage: of each piece of work, and of each sweep.

use cslam_core::paths::{self, Meter};
use cslam_firmware::app::Stage;

use crate::clock::{instructions, ticks};
use crate::stages::Stages;

const STAGES: usize = Stage::ALL.len();

/// Work of one stage.
#[derive(Clone, Copy, Default)]
struct Work {
    sum: u64,
    times: u32,
    most: u64,
    this_sweep: u64,
    most_sweep: u64,
}

/// All of a flight.
pub(crate) struct Counts {
    /// What path estimation is made of.
    meter: &'static Stages,
    estimation: [Work; paths::Stage::ALL.len()],
    stages: [Work; STAGES],
    whole: Sweeps,
    /// Without the checksum of the frames, which a unit of the chip makes on a real board.
    without_checksum: Sweeps,
    /// The same of sweeps in which no path was heard.
    silent: Sweeps,
}

/// Whole sweeps.
#[derive(Clone, Copy, Default)]
struct Sweeps {
    sum: u64,
    times: u32,
    most: u64,
}

impl Sweeps {
    fn add(&mut self, instructions: u64) {
        self.sum += instructions;
        self.times += 1;
        self.most = self.most.max(instructions);
    }

    fn print(&self, name: &str) {
        let mean = self.sum.checked_div(u64::from(self.times)).unwrap_or(0);
        defmt::println!("instructions, {=str}, mean: {=u64}", name, mean);
        defmt::println!("instructions, {=str}, most: {=u64}", name, self.most);
    }
}

impl Counts {
    pub(crate) fn new(meter: &'static Stages) -> Self {
        Self {
            meter,
            estimation: [Work::default(); paths::Stage::ALL.len()],
            stages: [Work::default(); STAGES],
            whole: Sweeps::default(),
            without_checksum: Sweeps::default(),
            silent: Sweeps::default(),
        }
    }

    /// Counts a piece of work.
    #[inline(never)]
    pub(crate) fn measure<R>(&mut self, stage: Stage, work: impl FnOnce() -> R) -> R {
        let start = ticks();
        self.meter.begin();
        let result = work();
        let instructions = instructions(u64::from(ticks().wrapping_sub(start)));
        let _outer = self.meter.enter(paths::Stage::Rest);
        if let Some(of) = self.stages.get_mut(stage as usize) {
            of.sum += instructions;
            of.times += 1;
            of.most = of.most.max(instructions);
            of.this_sweep += instructions;
        }
        result
    }

    /// A sweep has ended, in which paths were heard or none: what was done since the one before is its own.
    pub(crate) fn end_sweep(&mut self, is_silent: bool) {
        let mut sum = 0;
        let checksum = self
            .stages
            .get(Stage::Frame as usize)
            .map_or(0, |frame| frame.this_sweep);
        for stage in &mut self.stages {
            stage.most_sweep = stage.most_sweep.max(stage.this_sweep);
            sum += stage.this_sweep;
            stage.this_sweep = 0;
        }
        for (stage, work) in paths::Stage::ALL.into_iter().zip(&mut self.estimation) {
            let instructions = self.meter.take(stage);
            work.sum += instructions;
            work.most_sweep = work.most_sweep.max(instructions);
        }
        self.whole.add(sum);
        self.without_checksum.add(sum - checksum);
        if is_silent {
            self.silent.add(sum - checksum);
        }
    }

    /// Lines of a table, `name: instructions`: of each stage the mean and the most of a piece, and the most of a sweep; then whole
    /// sweeps.
    pub(crate) fn print(&self) {
        for (stage, work) in Stage::ALL.iter().zip(&self.stages) {
            let name = stage.name();
            let mean = work.sum.checked_div(u64::from(work.times)).unwrap_or(0);
            defmt::println!("instructions, {=str}, mean: {=u64}", name, mean);
            defmt::println!("instructions, {=str}, most: {=u64}", name, work.most);
            defmt::println!(
                "instructions, {=str}, most a sweep: {=u64}",
                name,
                work.most_sweep
            );
        }
        for (stage, work) in paths::Stage::ALL.iter().zip(&self.estimation) {
            // Outside of path estimation the meter stands at rest, so that one says nothing.
            if *stage == paths::Stage::Rest {
                continue;
            }
            let name = stage.name();
            let mean = work.sum.checked_div(u64::from(self.whole.times)).unwrap_or(0);
            defmt::println!("instructions, paths: {=str}, mean a sweep: {=u64}", name, mean);
            defmt::println!(
                "instructions, paths: {=str}, most a sweep: {=u64}",
                name,
                work.most_sweep
            );
        }
        self.whole.print("whole sweep");
        self.without_checksum.print("sweep without checksum");
        self.silent.print("sweep without paths");
    }
}
