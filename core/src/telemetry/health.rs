//! How the receiver itself is: load, memory, and what became of everything that came in.

use super::bits::{BitReader, BitWriter};

/// What the processor began from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum ResetCause {
    /// Not known.
    #[default]
    Unknown,
    /// Power came on.
    PowerOn,
    /// Power was too low for a while.
    BrownOut,
    /// The reset pin.
    Pin,
    /// Asked for by a command.
    Command,
    /// The watchdog: something took too long.
    Watchdog,
    /// The processor met a fault.
    Fault,
    /// The program ended itself.
    Panic,
}

impl ResetCause {
    /// Every cause, in the order of the wire format.
    pub const ALL: [Self; 8] = [
        Self::Unknown,
        Self::PowerOn,
        Self::BrownOut,
        Self::Pin,
        Self::Command,
        Self::Watchdog,
        Self::Fault,
        Self::Panic,
    ];

    /// The cause in words.
    #[must_use]
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Unknown => "unknown",
            Self::PowerOn => "power on",
            Self::BrownOut => "brown-out",
            Self::Pin => "reset pin",
            Self::Command => "command",
            Self::Watchdog => "watchdog",
            Self::Fault => "fault",
            Self::Panic => "panic",
        }
    }

    pub(super) fn write(self, to: &mut BitWriter<'_>) {
        to.put(self as u64, 4);
    }

    pub(super) fn read(from: &mut BitReader<'_>) -> Option<Self> {
        Self::ALL.get(from.take(4)? as usize).copied()
    }
}

/// Writes the struct of counters once: fields, their names, and their order on the wire.
macro_rules! counters {
    ($($(#[$doc:meta])* $name:ident,)*) => {
        /// What became of everything that came in and went out, saturating. The order is that of the wire format.
        #[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
        #[cfg_attr(feature = "defmt", derive(defmt::Format))]
        pub struct HealthCounters {
            $($(#[$doc])* pub $name: u32,)*
        }

        impl HealthCounters {
            /// Names of the counters, in the order of the wire format.
            pub const NAMES: [&'static str; [$(stringify!($name)),*].len()] = [$(stringify!($name)),*];

            /// The counters in the order of their names.
            #[must_use]
            pub fn to_array(&self) -> [u32; Self::NAMES.len()] {
                [$(self.$name),*]
            }

            fn each(&mut self) -> [&mut u32; Self::NAMES.len()] {
                [$(&mut self.$name),*]
            }
        }
    };
}

counters! {
    /// Sweeps that ended.
    sweeps,
    /// Blocks of samples taken.
    blocks,
    /// Blocks whose checksum did not match.
    blocks_damaged,
    /// Blocks that never came: gaps in their numbers.
    blocks_lost,
    /// Blocks that came again.
    blocks_repeated,
    /// Blocks that came after their sweep had ended.
    blocks_late,
    /// Blocks that the front end overwrote before they were read.
    blocks_overrun,
    /// Samples of the inertial sensor taken.
    imu_samples,
    /// Samples that it lost.
    imu_lost,
    /// Packets of it that were damaged.
    imu_damaged,
    /// Samples of the magnetometer taken.
    magnetometer,
    /// Beacons of the GMT taken.
    beacons,
    /// Two-way timing exchanges taken.
    timing,
    /// Commands carried out.
    commands,
    /// Packets from the ground that were damaged.
    uplink_damaged,
    /// Packets from the ground that were not signed, or with another key.
    uplink_unsigned,
    /// Packets from the ground that came before, or too late to tell.
    uplink_replayed,
    /// Packets from the ground that were for another link.
    uplink_wrong_link,
    /// Packets from the ground that said nothing known.
    uplink_unknown,
    /// Measured paths that became points.
    points,
    /// Measured paths that a gate rejected.
    rejected,
    /// Measured paths that were none.
    invalid,
    /// Occupied voxels of the map.
    map_points,
    /// Points that a full or too small map did not take.
    map_dropped,
    /// Packets handed to the downlink.
    packets_sent,
    /// Packets that the downlink did not take.
    packets_dropped,
    /// Two-way timing exchanges that contradict the clock, or whose time cannot be.
    timing_refused,
    /// Steps of the clock that were believed.
    clock_steps,
    /// Sweeps whose beacon was not believed.
    beacons_refused,
    /// Packets from the ground that were genuine, but whose counters could not be stored ahead of their use.
    uplink_unreserved,
    /// Starts and re-fixes that the magnetic heading contradicts.
    starts_refused,
    /// Sweeps whose first path proves the pose wrong: shorter than the straight way.
    contrary,
    /// Samples of the inertial sensor that never came: holes in its time stamps.
    imu_missing,
    /// Samples of the inertial sensor that were not integrated: they came again, too late, or with a value that is no number.
    imu_refused,
    /// Samples of the inertial sensor with a value that was replaced as a spike.
    imu_spikes,
    /// Samples of the inertial sensor with an axis at the end of its range.
    imu_saturated,
    /// Samples of the inertial sensor that were not integrated because an axis repeated its value.
    imu_stuck,
    /// Times that the inertial sensor stopped.
    imu_stops,
}

/// Counters that every report of this version has. Those after them came later, and are sent up to the last that is not zero.
const FIRST_EDITION: usize = 26;

impl HealthCounters {
    fn write(&self, to: &mut BitWriter<'_>) {
        let counters = self.to_array();
        let last = counters.iter().rposition(|counter| *counter != 0);
        let sent = last.map_or(0, |last| last + 1).max(FIRST_EDITION);
        to.put(sent as u64, 6);
        for counter in counters.iter().take(sent) {
            to.put_sized(u64::from(*counter));
        }
    }

    /// A sender of another edition of this version may have fewer counters, which are zero then, or more at the end, which
    /// are left out.
    fn read(from: &mut BitReader<'_>) -> Option<Self> {
        let mut counters = Self::default();
        let mut places = counters.each().into_iter();
        for _ in 0..from.take(6)? {
            let counter = u32::try_from(from.take_sized()?).ok()?;
            if let Some(place) = places.next() {
                *place = counter;
            }
        }
        drop(places);
        Some(counters)
    }
}

/// How the receiver is.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct HealthReport {
    /// UAV clock, ns; sent in whole microseconds, rounded down.
    pub time_ns: u64,
    /// Time since the start of the program, ms.
    pub uptime_ms: u32,
    /// Share of the time that the processor worked since the last report, 0..=1; sent in steps of 0.5 %.
    pub load: f32,
    /// Stack that was never used, bytes.
    pub free_stack: u32,
    /// What the program began from.
    pub reset: ResetCause,
    /// Counters since the start of the program.
    pub counters: HealthCounters,
}

impl HealthReport {
    pub(super) fn write(&self, to: &mut BitWriter<'_>) {
        super::pose::put_time(to, self.time_ns);
        to.put(u64::from(self.uptime_ms), 32);
        if (0.0..=1.0).contains(&self.load) {
            to.put((self.load * 200.0 + 0.5) as u64, 8);
        } else {
            to.spoil();
        }
        to.put_sized(u64::from(self.free_stack));
        self.reset.write(to);
        self.counters.write(to);
    }

    pub(super) fn read(from: &mut BitReader<'_>) -> Option<Self> {
        Some(Self {
            time_ns: super::pose::take_time(from)?,
            uptime_ms: from.take_u32(32)?,
            load: from.take_u8(8).filter(|load| *load <= 200).map(f32::from)? / 200.0,
            free_stack: u32::try_from(from.take_sized()?).ok()?,
            reset: ResetCause::read(from)?,
            counters: HealthCounters::read(from)?,
        })
    }
}
