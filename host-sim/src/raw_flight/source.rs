//! Where a flight's events and samples come from: a simulated world, or a recording.

use std::thread;

use cslam_firmware::app::Estimated;

use crate::channel::Sweep;
use crate::flight_log::PoseTruth;
use crate::input::InputError;
use crate::paths::Link;
use crate::sensors::{Stamped, Truth};
use crate::world::World;

/// Threads that make the sweeps of a world; a sweep takes a thread up to ten times as long as the receiver.
const MOST_MAKERS: usize = 8;

/// The samples of one sweep.
#[derive(Clone, Debug, Default)]
pub struct Given<const CHANNELS: usize = 32> {
    /// Blocks of the transmit beams; lost ones are absent.
    pub beams: Sweep<CHANNELS>,
    /// Blocks of the beam squint symbols that follow them.
    pub squint: Sweep<CHANNELS>,
    /// Blocks of the pilots, of each beam the first and the second one.
    pub pilots: Sweep<CHANNELS>,
    /// What was made of all of these blocks, where that is kept instead of them.
    pub estimated: Option<Estimated>,
    /// Where the UAV was at the first beam, and the true paths, where both are known: not for the receiver.
    pub truth: Option<(PoseTruth, Link)>,
}

/// What a receiver of so many channels is given in a flight, and what is known of the truth behind it.
pub trait Source<const CHANNELS: usize = 32>: Sync {
    /// Number of sweeps.
    fn sweeps(&self) -> u32;

    /// All but samples, in the order in which it arrives.
    fn events(&self) -> Box<dyn Iterator<Item = Stamped> + '_>;

    /// Threads that may ask for samples at the same time. Each asks in order, for sweeps ahead of the receiver.
    fn makers(&self) -> usize {
        1
    }

    /// The samples of a sweep.
    ///
    /// # Errors
    /// [`InputError`] naming the sweep, or the file, that gives no samples.
    fn sweep(&self, sweep: u32) -> Result<Given<CHANNELS>, InputError>;

    /// Where the UAV was when its clock showed `uav_time_ns`; `None` when nobody knows.
    fn truth(&self, uav_time_ns: u64) -> Option<PoseTruth>;
}

impl<const ARRAYS: usize, const ELEMENTS: usize, const CHANNELS: usize> Source<CHANNELS>
    for World<'_, ARRAYS, ELEMENTS, CHANNELS>
{
    fn sweeps(&self) -> u32 {
        self.sweeps()
    }

    fn events(&self) -> Box<dyn Iterator<Item = Stamped> + '_> {
        Box::new(self.flight().events())
    }

    fn makers(&self) -> usize {
        thread::available_parallelism()
            .map_or(1, usize::from)
            .min(MOST_MAKERS)
    }

    fn sweep(&self, sweep: u32) -> Result<Given<CHANNELS>, InputError> {
        let heard = self.sweep(sweep)?;
        Ok(Given {
            beams: heard.beams,
            squint: heard.squint,
            pilots: heard.pilots,
            estimated: None,
            truth: Some(((&heard.truth).into(), heard.link)),
        })
    }

    fn truth(&self, uav_time_ns: u64) -> Option<PoseTruth> {
        // The clock is off by microseconds, so one correction does.
        let shown_s = uav_time_ns as f64 * 1e-9;
        let gmt_time_s = 2.0 * shown_s - self.flight().clock().reading_s(shown_s);
        Some((&self.flight().truth(gmt_time_s)).into())
    }
}

impl From<&Truth> for PoseTruth {
    fn from(truth: &Truth) -> Self {
        Self {
            position_m: truth.uav.position_m.into(),
            quaternion_wb: truth.uav.quaternion_wb(),
            velocity_m_per_s: truth.uav.velocity_m_per_s.into(),
            clock_offset_s: truth.clock_offset_s,
        }
    }
}
