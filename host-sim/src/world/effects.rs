//! What sets the world `real` apart from `budget`, effect by effect, so that each can be switched on or off alone.

use toml::Table;

use super::config::{Profile, WorldConfig};
use crate::input::toml_keys::{find, put};

/// One effect of the world `real`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Effect {
    /// Name, as in the names of worlds.
    pub name: &'static str,
    /// Its keys of the configuration, each a value or a table.
    keys: &'static [&'static str],
}

/// All of them.
pub const EFFECTS: [Effect; 31] = [
    effect("diffraction", &["propagation.diffraction"]),
    effect(
        "diffuse-scattering",
        &["propagation.diffuse", "propagation.diffuse_most_paths"],
    ),
    effect("materials", &["propagation.materials", "propagation.roughness"]),
    effect("relief", &["scene.surfaces.ground_relief_rms_m"]),
    effect("panels", &["scene.surfaces.panels"]),
    effect("movers", &["propagation.movers"]),
    effect("trees", &["propagation.vegetation"]),
    effect("thin-walls", &["propagation.transmission"]),
    effect("wind", &["flight.wind"]),
    effect(
        "imu-temperature",
        &[
            "sensors.imu.temperature",
            "sensors.imu.gyro_bias_walk_mdps_per_sqrt_s",
            "sensors.imu.accel_bias_walk_ug_per_sqrt_s",
        ],
    ),
    effect(
        "vibration",
        &[
            "sensors.imu.vibration",
            "sensors.imu.g_sensitivity",
            "sensors.imu.sampling",
        ],
    ),
    effect("imu-mounting", &["sensors.imu.mounting"]),
    effect("imu-clock", &["sensors.imu.clock_rms_ppm"]),
    effect("motor-currents", &["sensors.magnetometer.motor_ut"]),
    effect("iron-in-walls", &["sensors.magnetometer.wall_dipole_ut"]),
    effect("barometer", &["sensors.barometer"]),
    effect("beacons-over-air", &["sensors.beacon"]),
    effect("timing-over-air", &["sensors.timing"]),
    effect(
        "element-gain-and-drift",
        &[
            "channel.impairments.uav_arrays.gain_rms_db",
            "channel.impairments.uav_arrays.centre_rms_mm",
            "channel.impairments.uav_arrays.phase_drift_rms_deg_per_k",
            "channel.impairments.uav_arrays.delay_drift_rms_ps_per_k",
        ],
    ),
    effect(
        "element-patterns",
        &[
            "channel.impairments.uav_arrays.ripple_rms_db",
            "channel.impairments.uav_arrays.ripple_rms_deg",
        ],
    ),
    effect(
        "cross-polarisation",
        &[
            "propagation.cross_polarisation",
            "channel.impairments.uav_arrays.cross_polarisation_db",
        ],
    ),
    effect(
        "mutual-coupling",
        &["channel.impairments.uav_arrays.coupling_unknown_share"],
    ),
    effect("squint-in-array", &["channel.impairments.uav_arrays.squint"]),
    effect("gmt-faces", &["channel.impairments.gmt_arrays"]),
    effect("airframe", &["channel.impairments.airframe.shadow"]),
    effect("rotors", &["channel.impairments.airframe.rotors"]),
    effect("amplifier", &["channel.impairments.amplifier"]),
    effect("phase-noise", &["channel.impairments.oscillators.phase_noise"]),
    effect(
        "carrier-offset",
        &[
            "channel.impairments.oscillators.offset_rms_hz",
            "channel.impairments.oscillators.wander_rms_hz_per_s",
            "channel.impairments.oscillators.phase_walk_rad_per_root_s",
        ],
    ),
    effect("mixers-and-converters", &["channel.impairments.receiver"]),
    effect("interference", &["channel.impairments.interference"]),
];

const fn effect(name: &'static str, keys: &'static [&'static str]) -> Effect {
    Effect { name, keys }
}

impl Effect {
    /// The world `budget` with this effect alone.
    ///
    /// # Errors
    /// What is no configuration: never, but for a key that there is not.
    pub fn alone(&self) -> Result<WorldConfig, toml::de::Error> {
        self.taken(Profile::Real, Profile::Budget)
    }

    /// The world `real` without this effect.
    ///
    /// # Errors
    /// As [`alone`](Self::alone).
    pub fn left_out(&self) -> Result<WorldConfig, toml::de::Error> {
        self.taken(Profile::Budget, Profile::Real)
    }

    /// The keys as in one world, all else as in another.
    fn taken(&self, from: Profile, rest: Profile) -> Result<WorldConfig, toml::de::Error> {
        let (from, mut all) = (table(from)?, table(rest)?);
        for key in self.keys {
            put(&mut all, key, find(&from, key).cloned());
        }
        all.try_into()
    }
}

fn table(profile: Profile) -> Result<Table, toml::de::Error> {
    Table::try_from(WorldConfig::of(profile)).map_err(serde::de::Error::custom)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_effects_together_are_the_difference_and_each_is_one() {
        let mut all = table(Profile::Budget).expect("a configuration");
        let real = table(Profile::Real).expect("a configuration");
        for effect in &EFFECTS {
            let before = all.clone();
            for key in effect.keys {
                put(&mut all, key, find(&real, key).cloned());
            }
            assert_ne!(all, before, "{}: no such key, or no effect", effect.name);
        }
        put(&mut all, "profile", find(&real, "profile").cloned());
        assert_eq!(all, real, "what no effect names");
    }

    #[test]
    fn one_alone_and_all_but_one_meet_the_worlds_that_they_come_from() {
        let [budget, real] = [Profile::Budget, Profile::Real].map(WorldConfig::of);
        for effect in &EFFECTS {
            let (alone, left_out) = (effect.alone().expect("sound"), effect.left_out().expect("sound"));
            alone.check().expect("in range");
            left_out.check().expect("in range");
            assert!(alone != budget && left_out != real, "{}", effect.name);
            assert_eq!(
                (alone.profile, left_out.profile),
                (Profile::Budget, Profile::Real)
            );
        }
        // An optional table is there or not.
        let of = |name| EFFECTS.iter().find(|effect| effect.name == name).expect("listed");
        let amplifier = of("amplifier");
        assert!(
            amplifier
                .alone()
                .expect("sound")
                .channel
                .impairments
                .amplifier
                .is_some()
        );
        assert!(
            amplifier
                .left_out()
                .expect("sound")
                .channel
                .impairments
                .amplifier
                .is_none()
        );
    }
}
