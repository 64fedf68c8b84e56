//! Instructions of each kind of work: mean and most.

use cslam_core::localization::filter::{SweepVerdict, TimingVerdict};
use cslam_core::localization::imu::{HeadingRefusal, ImuStep};
use cslam_firmware::flight_check::Observer;

use crate::measure::measure;

/// Work of one kind.
#[derive(Clone, Copy, Default)]
struct Kind {
    sum: u64,
    times: u32,
    most: u32,
}

impl Kind {
    fn add(&mut self, instructions: u32) {
        self.sum += u64::from(instructions);
        self.times += 1;
        self.most = self.most.max(instructions);
    }

    fn print(&self, states: usize, name: &str) {
        if let Some(mean) = self.sum.checked_div(u64::from(self.times)) {
            defmt::println!("{=usize} states, {=str}, mean: {=u64}", states, name, mean);
            defmt::println!("{=usize} states, {=str}, most: {=u32}", states, name, self.most);
        }
    }
}

/// All of a flight.
#[derive(Clone, Copy, Default)]
pub(crate) struct Counts {
    /// Whether the pose has been found: before, samples are looked at for rest as well.
    flying: bool,
    before: Kind,
    sample: Kind,
    step: Kind,
    covariance: Kind,
    two_way: Kind,
    magnetic: Kind,
    sight: Kind,
    sweep: Kind,
}

impl Counts {
    /// A line for the mean and one for the most of each kind.
    pub(crate) fn print(&self, states: usize) {
        self.before.print(states, "inertial sample before the start");
        self.sample.print(states, "inertial sample");
        self.step.print(states, "inertial sample that ends a step");
        self.covariance.print(states, "covariance step");
        self.two_way.print(states, "two-way exchange");
        self.magnetic.print(states, "magnetometer sample");
        self.sight.print(states, "updates of a sweep with line of sight");
        self.sweep.print(states, "updates of a sweep of reflections");
    }
}

impl Observer for Counts {
    fn sample(&mut self, work: impl FnOnce() -> Option<ImuStep>) -> Option<ImuStep> {
        let (step, instructions) = measure(work);
        let kind = match (self.flying, step) {
            (false, _) => &mut self.before,
            (true, None) => &mut self.sample,
            (true, Some(_)) => &mut self.step,
        };
        kind.add(instructions);
        step
    }

    fn advance(&mut self, steps: u32, work: impl FnOnce()) {
        let ((), instructions) = measure(work);
        if let Some(each) = instructions.checked_div(steps) {
            self.covariance.add(each);
        }
    }

    fn sweep(&mut self, work: impl FnOnce() -> SweepVerdict) -> SweepVerdict {
        let (verdict, instructions) = measure(work);
        self.flying |= verdict == SweepVerdict::Started;
        let kind = match verdict {
            SweepVerdict::NoSight => &mut self.sweep,
            _ => &mut self.sight,
        };
        kind.add(instructions);
        verdict
    }

    fn two_way(&mut self, work: impl FnOnce() -> TimingVerdict) -> TimingVerdict {
        let (verdict, instructions) = measure(work);
        self.two_way.add(instructions);
        verdict
    }

    fn magnetic(&mut self, work: impl FnOnce() -> Result<(), HeadingRefusal>) -> Result<(), HeadingRefusal> {
        let (result, instructions) = measure(work);
        self.magnetic.add(instructions);
        result
    }
}
