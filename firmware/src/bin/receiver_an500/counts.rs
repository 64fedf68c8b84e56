//! Instructions of each stage: of each piece of work, and of each sweep.

use core::ptr;

use cslam_firmware::app::Stage;

/// 32-bit up-counter of the board's FPGA, 25 MHz.
const COUNTER: usize = 0x4002_8018;
const STAGES: usize = Stage::ALL.len();

/// Work of one stage.
#[derive(Clone, Copy, Default)]
struct Work {
    sum: u64,
    times: u32,
    most: u32,
    this_sweep: u64,
    most_sweep: u64,
}

/// All of a flight.
#[derive(Default)]
pub(crate) struct Counts {
    stages: [Work; STAGES],
    sweeps: u32,
    sum_sweeps: u64,
    most_sweeps: u64,
}

impl Counts {
    /// Counts a piece of work.
    #[inline(never)]
    pub(crate) fn measure<R>(&mut self, stage: Stage, work: impl FnOnce() -> R) -> R {
        let start = ticks();
        let result = work();
        let instructions = instructions(ticks().wrapping_sub(start));
        if let Some(of) = self.stages.get_mut(stage as usize) {
            of.sum += u64::from(instructions);
            of.times += 1;
            of.most = of.most.max(instructions);
            of.this_sweep += u64::from(instructions);
        }
        result
    }

    /// A sweep has ended: what was done since the one before is its own.
    pub(crate) fn end_sweep(&mut self) {
        let mut sum = 0;
        for stage in &mut self.stages {
            stage.most_sweep = stage.most_sweep.max(stage.this_sweep);
            sum += stage.this_sweep;
            stage.this_sweep = 0;
        }
        self.sweeps += 1;
        self.sum_sweeps += sum;
        self.most_sweeps = self.most_sweeps.max(sum);
    }

    /// Lines of a table: of each stage the pieces, their mean and their most, and the most of a sweep; then whole sweeps.
    pub(crate) fn print(&self) {
        for (stage, work) in Stage::ALL.iter().zip(&self.stages) {
            let mean = work.sum.checked_div(u64::from(work.times)).unwrap_or(0);
            defmt::println!(
                "stage {=str}: {=u32} times, mean {=u64}, most {=u32}, most a sweep {=u64}",
                stage.name(),
                work.times,
                mean,
                work.most,
                work.most_sweep
            );
        }
        let mean = self.sum_sweeps.checked_div(u64::from(self.sweeps)).unwrap_or(0);
        defmt::println!(
            "sweeps: {=u32}, mean {=u64}, most {=u64}",
            self.sweeps,
            mean,
            self.most_sweeps
        );
    }
}

/// An instruction takes 2^10 ns of the board's time under `CSLAM_ICOUNT=10`, a tick 40 ns.
fn instructions(ticks: u32) -> u32 {
    (u64::from(ticks) * 10 / 256) as u32
}

fn ticks() -> u32 {
    // SAFETY: an aligned 32-bit register that exists on this board and that reading does not change.
    unsafe { ptr::read_volatile(COUNTER as *const u32) }
}
