//! What is stored.

use core::fmt;

use cslam_core::inertial::ImuSample;
use cslam_core::receiver::{Config, Localization};
use nalgebra::Vector3;

use super::error::RecordError;
use super::radio::RadioSettings;
use super::site::{EarthField, GmtPlace};

/// How the inertial sensor sits in the UAV, and the magnetometer beside it: each axis of the body (forward, left, up) is an axis of
/// the sensor, or its opposite.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Mount([i8; 3]);

impl Default for Mount {
    /// Sensor axes and body axes are the same.
    fn default() -> Self {
        Self([1, 2, 3])
    }
}

impl Mount {
    /// Body axes x, y, z as axes of the sensor: 1, 2, 3 for its x, y, z, negative for the opposite. `None` unless that is a
    /// rotation: every axis once, right-handed.
    #[must_use]
    pub fn new(axes: [i8; 3]) -> Option<Self> {
        let mount = Self(axes);
        let [x, y, z] = [Vector3::x(), Vector3::y(), Vector3::z()].map(|axis| mount.vector_to_body(&axis));
        let every = axes.iter().all(|axis| (1..=3).contains(&axis.unsigned_abs()));
        // The volume of the turned axes is +1 for a rotation, -1 for a reflection, 0 when an axis is missing.
        (every && x.cross(&y).dot(&z) == 1.0).then_some(mount)
    }

    /// The axes it was made of.
    #[must_use]
    pub const fn axes(self) -> [i8; 3] {
        self.0
    }

    /// A vector in sensor axes, in body axes.
    #[must_use]
    pub fn vector_to_body(self, v: &Vector3<f32>) -> Vector3<f32> {
        Vector3::from(self.0.map(|axis| {
            let size = match axis.unsigned_abs() {
                1 => v.x,
                2 => v.y,
                _ => v.z,
            };
            if axis < 0 { -size } else { size }
        }))
    }

    /// A sample in sensor axes, in body axes.
    #[must_use]
    pub fn to_body(self, sample: &ImuSample) -> ImuSample {
        ImuSample {
            time_ns: sample.time_ns,
            rate_rad_per_s: self.vector_to_body(&sample.rate_rad_per_s),
            specific_force_m_per_s2: self.vector_to_body(&sample.specific_force_m_per_s2),
        }
    }
}

/// All of it. The key is never printed.
#[derive(Clone, PartialEq, Eq)]
pub struct Settings {
    /// Number of the UAV on its link.
    pub uav: u8,
    /// How the inertial sensor sits.
    pub mount: Mount,
    /// Secret of the link; `None` when there is none yet.
    pub key: Option<[u8; 32]>,
    /// The downlink has used no counter from here on.
    pub downlink_counter: u32,
    /// The uplink has taken no counter from here on, and a start takes none before.
    pub uplink_counter: u32,
    /// Session that was last opened with the front end.
    pub session: u16,
    /// Where the GMT was set up; `None` when nobody has said.
    pub gmt_place: Option<GmtPlace>,
    /// The earth's field where it flies; without it the magnetometer is not used.
    pub magnetic_field: Option<EarthField>,
    /// The radio, where it is not the default one.
    pub radio: Option<RadioSettings>,
}

impl Default for Settings {
    /// Those of a receiver that has never been told anything: UAV 1, no key.
    fn default() -> Self {
        Self {
            uav: 1,
            mount: Mount::default(),
            key: None,
            downlink_counter: 0,
            uplink_counter: 0,
            session: 0,
            gmt_place: None,
            magnetic_field: None,
            radio: None,
        }
    }
}

impl fmt::Debug for Settings {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Settings")
            .field("uav", &self.uav)
            .field("mount", &self.mount)
            .field("has_key", &self.key.is_some())
            .field("downlink_counter", &self.downlink_counter)
            .field("uplink_counter", &self.uplink_counter)
            .field("session", &self.session)
            .field("gmt_place", &self.gmt_place)
            .field("magnetic_field", &self.magnetic_field)
            .field("radio", &self.radio)
            .finish()
    }
}

/// Bytes of settings in a record.
pub(super) const CONTENT: usize = 110;
/// The same before a radio stood there; zeros, which follow, say that it is the default one.
pub(super) const CONTENT_WITHOUT_RADIO: usize = 77;

impl Settings {
    /// The next session of the front end: never 0, which a front end shows that has just started.
    #[must_use]
    pub fn next_session(&self) -> u16 {
        self.session.checked_add(1).unwrap_or(1)
    }

    /// Tells a receiver what is stored about where it flies, and with which radio.
    pub fn configure(&self, config: &mut Config<'_>) {
        if let (Some(place), Localization::Filter(filter)) = (self.gmt_place, &mut config.localization) {
            filter.beacon.setup = Some(place.setup());
        }
        if let Some(field) = self.magnetic_field {
            config.magnetic_field = Some(field.field());
        }
        if let Some(radio) = self.radio {
            config.radio = radio.config();
        }
    }

    pub(super) fn encode(&self) -> [u8; CONTENT] {
        let mut bytes = [0; CONTENT];
        let mut rest = bytes.as_mut_slice();
        let [x, y, z] = self.mount.0.map(i8::cast_unsigned);
        put(&mut rest, [self.uav, x, y, z]);
        put(&mut rest, self.session.to_le_bytes());
        put(&mut rest, self.downlink_counter.to_le_bytes());
        put(&mut rest, self.uplink_counter.to_le_bytes());
        put(&mut rest, [u8::from(self.key.is_some())]);
        put(&mut rest, self.key.unwrap_or_default());
        put_words(&mut rest, self.gmt_place.map(GmtPlace::to_words));
        put_words(&mut rest, self.magnetic_field.map(EarthField::to_words));
        put_words(&mut rest, self.radio.map(RadioSettings::to_words));
        bytes
    }

    pub(super) fn decode(bytes: &[u8; CONTENT]) -> Result<Self, RecordError> {
        let mut rest = bytes.as_slice();
        let [uav, x, y, z] = take(&mut rest);
        let mount = Mount::new([x, y, z].map(u8::cast_signed)).ok_or(RecordError::Content)?;
        let session = u16::from_le_bytes(take(&mut rest));
        let downlink_counter = u32::from_le_bytes(take(&mut rest));
        let uplink_counter = u32::from_le_bytes(take(&mut rest));
        let [has_key] = take(&mut rest);
        let key: [u8; 32] = take(&mut rest);
        let key = match has_key {
            0 if key == [0; 32] => None,
            1 => Some(key),
            _ => return Err(RecordError::Content),
        };
        let gmt_place = take_words(&mut rest, GmtPlace::from_words)?;
        let magnetic_field = take_words(&mut rest, EarthField::from_words)?;
        let radio = take_words(&mut rest, RadioSettings::from_words)?;
        Ok(Self {
            uav,
            mount,
            key,
            downlink_counter,
            uplink_counter,
            session,
            gmt_place,
            magnetic_field,
            radio,
        })
    }
}

fn put<const N: usize>(rest: &mut &mut [u8], field: [u8; N]) {
    if let Some((place, after)) = core::mem::take(rest).split_first_chunk_mut() {
        *place = field;
        *rest = after;
    }
}

fn take<const N: usize>(rest: &mut &[u8]) -> [u8; N] {
    match rest.split_first_chunk() {
        Some((field, after)) => {
            *rest = after;
            *field
        }
        None => [0; N],
    }
}

/// A byte that says whether there is one, and its words; zeros where there is none.
fn put_words<const N: usize>(rest: &mut &mut [u8], words: Option<[i32; N]>) {
    put(rest, [u8::from(words.is_some())]);
    for word in words.unwrap_or([0; N]) {
        put(rest, word.to_le_bytes());
    }
}

fn take_words<T, const N: usize>(
    rest: &mut &[u8],
    make: impl FnOnce([i32; N]) -> Option<T>,
) -> Result<Option<T>, RecordError> {
    let [is_there] = take(rest);
    let words = [(); N].map(|()| i32::from_le_bytes(take(rest)));
    match is_there {
        0 if words == [0; N] => Ok(None),
        1 => make(words).map(Some).ok_or(RecordError::Content),
        _ => Err(RecordError::Content),
    }
}

#[cfg(test)]
mod tests {
    use cslam_core::radio::RadioConfig;

    use super::*;

    #[test]
    fn only_rotations_are_mounts() {
        let mut rotations = 0;
        for x in -4..=4 {
            for y in -4..=4 {
                for z in -4..=4 {
                    rotations += i32::from(Mount::new([x, y, z]).is_some());
                }
            }
        }
        assert_eq!(rotations, 24);
        assert_eq!(Mount::new([1, 2, -3]), None, "a reflection");
        // Upside down, nose ahead: left and up turn round.
        let mount = Mount::new([1, -2, -3]).expect("half a turn about x");
        let turned = mount.vector_to_body(&Vector3::new(1.0, 2.0, 3.0));
        assert_eq!(turned, Vector3::new(1.0, -2.0, -3.0));
    }

    #[test]
    fn a_session_is_never_zero() {
        let mut settings = Settings::default();
        assert_eq!(settings.next_session(), 1);
        settings.session = u16::MAX;
        assert_eq!(settings.next_session(), 1);
    }

    #[test]
    fn a_receiver_is_told_where_it_flies() {
        let model = cslam_core::link_state::models::paper().expect("sound");
        let network = cslam_core::link_state::PaperClassifier::new(model).expect("fits");
        let config = || Config::best(cslam_core::receiver::LinkStates::Paper(network));
        let mut told = config();
        Settings::default().configure(&mut told);
        assert!(told.magnetic_field.is_none());
        let setup = |config: &Config<'_>| match &config.localization {
            Localization::Filter(filter) => filter.beacon.setup,
            Localization::Baseline(..) => None,
        };
        assert!(setup(&told).is_none());
        let settings = Settings {
            gmt_place: GmtPlace::new([1500, -2250, 1], 800),
            magnetic_field: EarthField::new(48_000, 65_000, 3_000),
            ..Settings::default()
        };
        settings.configure(&mut told);
        let place = setup(&told).expect("said");
        assert_eq!(
            (place.position_m, place.within_m),
            (Vector3::new(1.5, -2.25, 0.001), 0.8)
        );
        let field = told.magnetic_field.expect("said").earth_ut;
        assert!((field.norm() - 48.0).abs() < 1e-4 && field.z < -43.0, "{field}");
        assert_eq!(Settings::decode(&settings.encode()), Ok(settings));
    }

    #[test]
    fn a_receiver_is_told_of_its_radio_and_one_that_cannot_work_is_damage() {
        let told = RadioSettings {
            carrier_khz: 28_000_000,
            sequence: [409, 136],
            radius_tenth_mm: 1_500,
            tilt_udeg: 35_264_390,
            spacing: [50_000, 45_000],
            sector_cdeg: 6_000,
            elevations_udeg: [0, 12_000_000, -25_000_000],
        };
        let radio = told.config();
        assert_eq!((radio.waveform.carrier_hz, radio.waveform.root), (28e9, 136));
        assert_eq!(
            (radio.waveform.sequence_length, radio.uav_arrays.radius_m),
            (409, 0.15)
        );
        let default = RadioConfig::default();
        assert!((radio.uav_arrays.tilt_rad - default.uav_arrays.tilt_rad).abs() < 1e-8);
        assert!((radio.codebook.sector_rad - default.codebook.sector_rad).abs() < 1e-12);
        assert_eq!(
            (
                radio.uav_arrays.spacing_wavelengths,
                radio.gmt_arrays.spacing_wavelengths
            ),
            (0.5, 0.45)
        );
        assert_eq!(radio.codebook.elevations_rad[2], (-25_f64).to_radians());
        let settings = Settings {
            radio: Some(told),
            ..Settings::default()
        };
        assert_eq!(Settings::decode(&settings.encode()), Ok(settings));
        let wrong = Settings {
            radio: Some(RadioSettings {
                sequence: [409, 0],
                ..told
            }),
            ..Settings::default()
        };
        assert_eq!(Settings::decode(&wrong.encode()), Err(RecordError::Content));
        assert_eq!(wrong.radio.and_then(RadioSettings::checked), None);
    }
}
