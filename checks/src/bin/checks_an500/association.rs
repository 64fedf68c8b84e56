//! Instructions of data association: of a sweep with a pose as in flight and as after an outage, and of learning from its verdicts.
//!
//! Lines `association, NAME, mean` and `most: instructions`, then one line a sweep, `sweep number digest`.

use cslam_checks::association::{self, Work};
use cslam_core::receiver::SURFACES;
use cslam_core::surfaces::{SurfaceConfig, Surfaces};

use crate::clock::ticks;
use crate::exit::Exit;
use crate::measure::between;

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
}

const NAMES: [&str; 3] = ["pose as in flight", "learning", "pose as after an outage"];

pub(crate) fn run() -> Result<(), Exit> {
    let place = cortex_m::singleton!(: Option<Surfaces<SURFACES>> = None).ok_or(Exit::Panic)?;
    let surfaces = place.insert(Surfaces::new(SurfaceConfig::default()));
    let mut kinds = [Kind::default(); NAMES.len()];
    let measure = |work: Work, each: &mut dyn FnMut()| {
        let start = ticks();
        each();
        let instructions = between(start, ticks());
        if let Some(kind) = kinds.get_mut(work as usize) {
            kind.add(instructions);
        }
    };
    association::run(surfaces, measure, |number, digest| {
        defmt::println!("sweep {=u32} {=u64:016x}", number, digest);
    })
    .ok_or(Exit::Failed)?;
    for (name, kind) in NAMES.into_iter().zip(kinds) {
        let mean = kind.sum.checked_div(u64::from(kind.times)).unwrap_or(0);
        defmt::println!("association, {=str}, mean: {=u64}", name, mean);
        defmt::println!("association, {=str}, most: {=u32}", name, kind.most);
    }
    Ok(())
}
