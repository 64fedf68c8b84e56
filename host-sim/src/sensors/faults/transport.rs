//! The way of events to the receiver: some are lost, some come twice, some late.

use super::{Span, TransportFault, Traveller};
use crate::seeded::{Seeded, Source};
use crate::sensors::{Event, Stamped};

/// Events on their way.
#[derive(Clone, Debug)]
pub(super) struct Transport {
    faults: Vec<(TransportFault, Seeded)>,
    /// Late ones and when they arrive (UAV clock, ns), earliest last.
    late: Vec<(u64, Stamped)>,
    /// What has arrived and not been taken, latest first.
    arrived: Vec<Stamped>,
}

impl Transport {
    pub(super) fn new(faults: &[TransportFault], seed: u64) -> Self {
        let seeded = faults
            .iter()
            .zip(0u32..)
            .map(|(fault, number)| (fault.clone(), Seeded::numbered(seed, Source::Transport, number)));
        Self {
            faults: seeded.collect(),
            late: Vec::new(),
            arrived: Vec::new(),
        }
    }

    /// The next event that has arrived.
    pub(super) fn arrived(&mut self) -> Option<Stamped> {
        self.arrived.pop()
    }

    /// The next event when no more are sent.
    pub(super) fn rest(&mut self) -> Option<Stamped> {
        self.late.pop().map(|(_, stamped)| stamped)
    }

    /// Sends an event. Late ones that are due arrive before it.
    pub(super) fn send(&mut self, stamped: Stamped) {
        let mut copies = 1;
        let mut late_by_s = 0.0;
        let time_s = stamped.uav_time_ns as f64 * 1e-9;
        for (fault, random) in &mut self.faults {
            if !fault.events.contains(&kind(&stamped.event)) {
                continue;
            }
            let chance = random.uniform();
            let span = Span {
                start_s: fault.start_s,
                duration_s: fault.duration_s,
            };
            if !span.contains(time_s) {
                continue;
            }
            if chance < fault.lost {
                copies = 0;
            } else if chance < fault.lost + fault.doubled {
                copies *= 2;
            } else if chance < fault.lost + fault.doubled + fault.late {
                late_by_s += fault.late_by_s;
            }
        }
        let mut arriving = Vec::new();
        while self
            .late
            .last()
            .is_some_and(|(due_ns, _)| *due_ns < stamped.uav_time_ns)
        {
            arriving.extend(self.late.pop().map(|(_, late)| late));
        }
        for _ in 0..copies {
            if late_by_s > 0.0 {
                let due_ns = stamped.uav_time_ns + (late_by_s * 1e9) as u64;
                let place = self.late.partition_point(|(other_ns, _)| *other_ns > due_ns);
                self.late.insert(place, (due_ns, stamped));
            } else {
                arriving.push(stamped);
            }
        }
        self.arrived.extend(arriving.into_iter().rev());
    }
}

fn kind(event: &Event) -> Traveller {
    match event {
        Event::Imu(_) => Traveller::Imu,
        Event::Magnetometer(_) => Traveller::Magnetometer,
        Event::Timing(_) => Traveller::Timing,
        Event::Sweep { .. } => Traveller::Sweep,
        Event::Beacon(_) => Traveller::Beacon,
        Event::Barometer(_) => Traveller::Barometer,
    }
}
