//! Faults as a TOML file describes them.

use serde::{Deserialize, Serialize};

use crate::input::InputError;

/// Faults of a flight; none by default. Times are by the GMT clock, which is also the time of the flight.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct FaultsConfig {
    /// Faults of the inertial sensor.
    pub imu: Vec<ImuFault>,
    /// Lies of the beacon.
    pub beacon: Vec<BeaconFault>,
    /// Lies of two-way timing.
    pub timing: Vec<TimingFault>,
    /// Steps of the UAV clock.
    pub clock: Vec<ClockStep>,
    /// Sweeps that see the GMT where it is not.
    pub fix: Vec<WrongFix>,
    /// What happens to events on their way.
    pub transport: Vec<TransportFault>,
}

/// When a fault is there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Span {
    /// Beginning, s.
    pub start_s: f64,
    /// Length, s.
    pub duration_s: f64,
}

impl Span {
    /// Whether `time_s` lies in it: from the beginning up to but without the end.
    pub fn contains(&self, time_s: f64) -> bool {
        time_s >= self.start_s && time_s < self.start_s + self.duration_s
    }
}

/// How an inertial sensor fails.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ImuFaultKind {
    /// No samples.
    Stop,
    /// The values of the first sample again and again.
    Stick,
    /// The end of the range.
    Saturate,
    /// Now and then a wild value.
    Spike,
}

/// Which values of the inertial sensor fail.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ImuAxis {
    /// All six.
    #[default]
    All,
    /// Gyroscope about x.
    GyroX,
    /// Gyroscope about y.
    GyroY,
    /// Gyroscope about z.
    GyroZ,
    /// Accelerometer along x.
    AccelX,
    /// Accelerometer along y.
    AccelY,
    /// Accelerometer along z.
    AccelZ,
}

impl ImuAxis {
    /// The values meant, in the order gyroscope x y z, accelerometer x y z.
    pub(super) fn values(self) -> core::ops::Range<usize> {
        match self {
            Self::All => 0..6,
            Self::GyroX => 0..1,
            Self::GyroY => 1..2,
            Self::GyroZ => 2..3,
            Self::AccelX => 3..4,
            Self::AccelY => 4..5,
            Self::AccelZ => 5..6,
        }
    }
}

/// A fault of the inertial sensor. An axis has no meaning when the sensor stops.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ImuFault {
    /// How it fails.
    pub kind: ImuFaultKind,
    /// Beginning, s.
    pub start_s: f64,
    /// Length, s.
    pub duration_s: f64,
    /// Which values fail.
    #[serde(default)]
    pub axis: ImuAxis,
    /// Spikes per second, of 10 % to 100 % of the range.
    #[serde(default = "ten")]
    pub spikes_per_s: f64,
}

fn ten() -> f64 {
    10.0
}

/// A beacon that tells a wrong position: an offset that stands at once and one that grows.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BeaconFault {
    /// Beginning, s.
    pub start_s: f64,
    /// Length, s.
    pub duration_s: f64,
    /// Offset of the told position, m, world frame.
    #[serde(default)]
    pub offset_m: [f64; 3],
    /// Growth of the offset, m/s.
    #[serde(default)]
    pub drift_m_per_s: [f64; 3],
}

/// Two-way timing that tells a wrong offset: an error that stands at once and one that grows. The clock itself is right.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TimingFault {
    /// Beginning, s.
    pub start_s: f64,
    /// Length, s.
    pub duration_s: f64,
    /// Error of the told offset, ns.
    #[serde(default)]
    pub offset_ns: f64,
    /// Growth of the error, ns/s.
    #[serde(default)]
    pub drift_ns_per_s: f64,
}

/// A step of the UAV clock: it stays.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ClockStep {
    /// When, s.
    pub at_s: f64,
    /// By how much the clock jumps forward, ns.
    pub step_ns: f64,
}

/// Sweeps whose strongest path is another than the one that is taken for it: as if the UAV were elsewhere, in a
/// direction that the seed picks, the same for all of them.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WrongFix {
    /// First sweep, from 0.
    pub sweep: u32,
    /// Number of sweeps.
    pub sweeps: u32,
    /// How far off, m.
    pub distance_m: f64,
}

/// Kinds of events that travel.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Traveller {
    /// Samples of the inertial sensor.
    Imu,
    /// Samples of the magnetometer.
    Magnetometer,
    /// Two-way timing exchanges.
    Timing,
    /// Beginnings of sweeps.
    Sweep,
    /// Beacons.
    Beacon,
    /// Samples of the barometer.
    Barometer,
}

/// Events that are lost, doubled, or arrive late with their old time stamp.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TransportFault {
    /// Kinds of events.
    pub events: Vec<Traveller>,
    /// Beginning, s.
    #[serde(default)]
    pub start_s: f64,
    /// Length, s.
    #[serde(default = "for_ever")]
    pub duration_s: f64,
    /// Share that is lost, 0..=1.
    #[serde(default)]
    pub lost: f64,
    /// Share that arrives twice, 0..=1.
    #[serde(default)]
    pub doubled: f64,
    /// Share that arrives late, 0..=1.
    #[serde(default)]
    pub late: f64,
    /// How late, s.
    #[serde(default)]
    pub late_by_s: f64,
}

fn for_ever() -> f64 {
    1e9
}

impl FaultsConfig {
    /// Whether nothing fails.
    pub fn is_empty(&self) -> bool {
        *self == Self::default()
    }

    /// Whether events may arrive in another order than that of their time stamps, or sweeps not once each.
    pub fn reorders(&self) -> bool {
        self.transport.iter().any(|f| {
            let of_sweeps = f.events.contains(&Traveller::Sweep);
            f.late > 0.0 && f.late_by_s > 0.0 || of_sweeps && f.lost + f.doubled > 0.0
        })
    }

    /// Checks the figures; the error names the key.
    pub(in crate::sensors) fn check(&self) -> Result<(), InputError> {
        let positive = super::super::not_negative;
        for (n, f) in self.imu.iter().enumerate() {
            positive(&[
                (&format!("faults.imu[{n}].start_s"), f.start_s),
                (&format!("faults.imu[{n}].duration_s"), f.duration_s),
                (&format!("faults.imu[{n}].spikes_per_s"), f.spikes_per_s),
            ])?;
        }
        for (n, f) in self.beacon.iter().enumerate() {
            positive(&[
                (&format!("faults.beacon[{n}].start_s"), f.start_s),
                (&format!("faults.beacon[{n}].duration_s"), f.duration_s),
            ])?;
            if let Some(v) = f.offset_m.iter().chain(&f.drift_m_per_s).find(|v| !v.is_finite()) {
                return Err(InputError::at_key(
                    format!("faults.beacon[{n}]"),
                    format!("has an offset of {v}, expected a number"),
                ));
            }
        }
        for (n, f) in self.timing.iter().enumerate() {
            positive(&[
                (&format!("faults.timing[{n}].start_s"), f.start_s),
                (&format!("faults.timing[{n}].duration_s"), f.duration_s),
            ])?;
            if let Some(v) = [f.offset_ns, f.drift_ns_per_s].iter().find(|v| !v.is_finite()) {
                return Err(InputError::at_key(
                    format!("faults.timing[{n}]"),
                    format!("has an error of {v}, expected a number"),
                ));
            }
        }
        for (n, f) in self.clock.iter().enumerate() {
            positive(&[(&format!("faults.clock[{n}].at_s"), f.at_s)])?;
            // A larger step would put ticks of the UAV clock in another order.
            if !(f.step_ns.is_finite() && f.step_ns.abs() <= 1e5) {
                return Err(InputError::at_key(
                    format!("faults.clock[{n}].step_ns"),
                    format!("is {}, expected -100000 to 100000", f.step_ns),
                ));
            }
        }
        for (n, f) in self.fix.iter().enumerate() {
            positive(&[(&format!("faults.fix[{n}].distance_m"), f.distance_m)])?;
        }
        for (n, f) in self.transport.iter().enumerate() {
            positive(&[
                (&format!("faults.transport[{n}].start_s"), f.start_s),
                (&format!("faults.transport[{n}].duration_s"), f.duration_s),
                (&format!("faults.transport[{n}].lost"), f.lost),
                (&format!("faults.transport[{n}].doubled"), f.doubled),
                (&format!("faults.transport[{n}].late"), f.late),
                (&format!("faults.transport[{n}].late_by_s"), f.late_by_s),
            ])?;
            for (key, share) in [("lost", f.lost), ("doubled", f.doubled), ("late", f.late)] {
                super::super::at_most_one(&format!("faults.transport[{n}].{key}"), share)?;
            }
            let sum = f.lost + f.doubled + f.late;
            if sum > 1.0 {
                return Err(InputError::at_key(
                    format!("faults.transport[{n}].lost"),
                    format!("makes {sum} with doubled and late, expected at most 1"),
                ));
            }
            if f.late_by_s > 60.0 {
                return Err(InputError::at_key(
                    format!("faults.transport[{n}].late_by_s"),
                    format!("is {}, expected 0 to 60", f.late_by_s),
                ));
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_toml_says_what_fails_and_leaves_out_what_is_usual() {
        let text = r#"
            [[imu]]
            kind = "stick"
            start_s = 20.0
            duration_s = 1.5
            axis = "gyro-z"
            [[beacon]]
            start_s = 30.0
            duration_s = 60.0
            drift_m_per_s = [0.1, 0.0, 0.0]
            [[clock]]
            at_s = 40.0
            step_ns = 100.0
            [[transport]]
            events = ["imu", "beacon"]
            lost = 0.01
        "#;
        let config: FaultsConfig = toml::from_str(text).expect("valid");
        assert_eq!(config.imu[0].axis, ImuAxis::GyroZ);
        assert_eq!(config.imu[0].spikes_per_s, 10.0);
        assert_eq!(config.beacon[0].offset_m, [0.0; 3]);
        assert_eq!(config.transport[0].duration_s, 1e9);
        assert!(config.check().is_ok() && !config.is_empty() && !config.reorders());
        let again = toml::to_string(&config).expect("serialisable");
        assert_eq!(
            toml::from_str::<FaultsConfig>(&again).expect("own output"),
            config
        );
        assert!(FaultsConfig::default().is_empty());
    }

    #[test]
    fn bad_figures_and_unknown_words_are_named() {
        let message = |text: &str| match toml::from_str::<FaultsConfig>(text) {
            Ok(config) => config.check().expect_err("must be refused").to_string(),
            Err(error) => error.message().to_owned(),
        };
        let imu = "[[imu]]\nkind = \"stop\"\n";
        assert!(message(&format!("{imu}start_s = -1.0\nduration_s = 1.0")).contains("faults.imu[0].start_s"));
        assert!(message("[[imu]]\nkind = \"melt\"\nstart_s = 0.0\nduration_s = 1.0").contains("melt"));
        assert!(message(&format!("{imu}start_s = 0.0")).contains("duration_s"));
        let beacon = "[[beacon]]\nstart_s = 0.0\nduration_s = 1.0\n";
        assert!(message(&format!("{beacon}offset_m = [inf, 0.0, 0.0]")).contains("faults.beacon[0]"));
        let timing = "[[timing]]\nstart_s = 0.0\nduration_s = 1.0\n";
        assert!(message(&format!("{timing}drift_ns_per_s = nan")).contains("faults.timing[0]"));
        assert!(message("[[clock]]\nat_s = 1.0\nstep_ns = 1e9").contains("faults.clock[0].step_ns"));
        assert!(message("[[fix]]\nsweep = 1\nsweeps = 1\ndistance_m = -3.0").contains("faults.fix[0]"));
        let transport = "[[transport]]\nevents = [\"imu\"]\n";
        assert!(message(&format!("{transport}lost = 0.6\nlate = 0.6")).contains("at most 1"));
        assert!(message(&format!("{transport}late_by_s = 100.0")).contains("late_by_s"));
        assert!(message("[[transport]]\nevents = [\"radio\"]").contains("radio"));
    }
}
