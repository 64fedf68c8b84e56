//! Faults of the inertial sensor.

use cslam_firmware::icm42688::packet::{ACCELERATION_CODE_MAX, RATE_CODE_MAX, RawSample};

use super::{ImuFault, ImuFaultKind, Span};
use crate::seeded::{Seeded, Source};

/// A fault with what it must remember.
#[derive(Clone, Debug)]
struct Active {
    fault: ImuFault,
    /// Values of the first sample of a stuck sensor.
    held: Option<[i32; 6]>,
    random: Seeded,
    last_s: Option<f64>,
}

/// All faults of one sensor.
#[derive(Clone, Debug)]
pub(super) struct ImuFaults(Vec<Active>);

impl ImuFaults {
    pub(super) fn new(faults: &[ImuFault], seed: u64) -> Self {
        let active = faults.iter().zip(0u32..).map(|(fault, number)| Active {
            fault: fault.clone(),
            held: None,
            random: Seeded::numbered(seed, Source::ImuFault, number),
            last_s: None,
        });
        Self(active.collect())
    }

    /// A sample as the faulty sensor gives it; `None` when it gives none.
    pub(super) fn apply(&mut self, sample: &RawSample, time_s: f64) -> Option<RawSample> {
        let mut values = [0; 6];
        values[..3].copy_from_slice(&sample.rate);
        values[3..].copy_from_slice(&sample.acceleration);
        for active in &mut self.0 {
            if !active.apply(&mut values, time_s) {
                return None;
            }
        }
        let [gx, gy, gz, ax, ay, az] = values;
        Some(RawSample {
            rate: [gx, gy, gz],
            acceleration: [ax, ay, az],
            ..*sample
        })
    }
}

/// End of the range of a value.
fn end(value: usize) -> i32 {
    if value < 3 {
        RATE_CODE_MAX
    } else {
        ACCELERATION_CODE_MAX
    }
}

impl Active {
    /// Changes the values; `false` when there is no sample.
    fn apply(&mut self, values: &mut [i32; 6], time_s: f64) -> bool {
        let span = Span {
            start_s: self.fault.start_s,
            duration_s: self.fault.duration_s,
        };
        let since_last_s = self.last_s.replace(time_s).map_or(0.0, |last| time_s - last);
        if !span.contains(time_s) {
            self.held = None;
            return true;
        }
        match self.fault.kind {
            ImuFaultKind::Stop => return false,
            ImuFaultKind::Stick => {
                let held = *self.held.get_or_insert(*values);
                for value in self.fault.axis.values() {
                    values[value] = held[value];
                }
            }
            ImuFaultKind::Saturate => {
                for value in self.fault.axis.values() {
                    values[value] = if values[value] < 0 {
                        -end(value)
                    } else {
                        end(value)
                    };
                }
            }
            ImuFaultKind::Spike => {
                // Drawn whether there is a spike or not, so that other rates give other subsets of the same spikes.
                let (chance, which) = (self.random.uniform(), self.random.uniform());
                let (size, sign) = (self.random.between(0.1, 1.0), self.random.uniform());
                if chance < self.fault.spikes_per_s * since_last_s {
                    let choice = self.fault.axis.values();
                    let value = choice.start + (which * choice.len() as f64) as usize;
                    let size = (size * f64::from(end(value))) as i32;
                    values[value] = if sign < 0.5 { -size } else { size };
                }
            }
        }
        true
    }
}
