//! What is wrong with the inertial sensor, and how often it was.

use super::ImuConfig;

/// Faults of the inertial sensor that were seen within the last [`ImuConfig::flag_ns`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct ImuHealth {
    /// No samples, or none that can be used: the pose coasts.
    pub stopped: bool,
    /// An axis repeats its value: the pose coasts.
    pub stuck: bool,
    /// An axis is at the end of its range: the motion is larger than what is integrated.
    pub saturated: bool,
    /// Single values were far from their neighbours and have been replaced.
    pub spiking: bool,
}

impl ImuHealth {
    /// No fault.
    pub fn is_sound(&self) -> bool {
        *self == Self::default()
    }
}

/// What became of the samples, saturating.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct ImuCounters {
    /// Integrated.
    pub used: u32,
    /// Never arrived: holes in the time stamps.
    pub missing: u32,
    /// Dropped: their time stamp had been used already.
    pub repeated: u32,
    /// Dropped: older than what has been integrated.
    pub late: u32,
    /// Dropped: a value was not a number.
    pub invalid: u32,
    /// Had values replaced as spikes.
    pub spikes: u32,
    /// Had an axis at the end of its range.
    pub saturated: u32,
    /// Not used because an axis was stuck.
    pub stuck: u32,
    /// Times that the sensor stopped.
    pub stops: u32,
    /// Times that the clock was set back and integration began anew.
    pub restarts: u32,
}

/// A kind of fault.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Fault {
    Stopped,
    Stuck,
    Saturated,
    Spike,
}

/// When each kind of fault was last seen.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Flags {
    /// In the order of [`Fault`].
    seen_ns: [Option<u64>; 4],
}

impl Flags {
    pub(super) fn raise(&mut self, fault: Fault, now_ns: u64) {
        if let Some(seen) = self.seen_ns.get_mut(fault as usize) {
            *seen = Some(now_ns);
        }
    }

    /// Which flags stand at `now_ns`.
    pub(super) fn at(&self, now_ns: u64, config: &ImuConfig) -> ImuHealth {
        let stands = |fault: Fault| {
            self.seen_ns
                .get(fault as usize)
                .copied()
                .flatten()
                .is_some_and(|seen| now_ns.saturating_sub(seen) <= config.flag_ns)
        };
        ImuHealth {
            stopped: stands(Fault::Stopped),
            stuck: stands(Fault::Stuck),
            saturated: stands(Fault::Saturated),
            spiking: stands(Fault::Spike),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_flag_stands_for_its_time_and_alone() {
        let config = ImuConfig::default();
        for (fault, expected) in [
            (
                Fault::Stopped,
                ImuHealth {
                    stopped: true,
                    ..ImuHealth::default()
                },
            ),
            (
                Fault::Stuck,
                ImuHealth {
                    stuck: true,
                    ..ImuHealth::default()
                },
            ),
            (
                Fault::Saturated,
                ImuHealth {
                    saturated: true,
                    ..ImuHealth::default()
                },
            ),
            (
                Fault::Spike,
                ImuHealth {
                    spiking: true,
                    ..ImuHealth::default()
                },
            ),
        ] {
            let mut flags = Flags::default();
            assert!(flags.at(5, &config).is_sound());
            flags.raise(fault, 5);
            assert_eq!(flags.at(5, &config), expected);
            assert_eq!(flags.at(5 + config.flag_ns, &config), expected);
            assert!(flags.at(6 + config.flag_ns, &config).is_sound());
        }
    }
}
