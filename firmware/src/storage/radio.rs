//! The radio that a receiver is told of, where it is not the default one. How many arrays, elements and beams there are, its program says.

use cslam_core::radio::RadioConfig;

/// What of a radio is another than by default, in whole numbers, so that settings compare exactly.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RadioSettings {
    /// Carrier, kHz.
    pub carrier_khz: u32,
    /// Length and root of the Zadoff-Chu sequence.
    pub sequence: [u16; 2],
    /// Distance of the receive arrays from the body's origin, tenths of a millimetre.
    pub radius_tenth_mm: u16,
    /// Their tilt out of the horizontal, millionths of a degree.
    pub tilt_udeg: i32,
    /// Element spacing at the UAV and at the GMT, hundred-thousandths of a wavelength.
    pub spacing: [u16; 2],
    /// Half the sector of a face of the GMT, hundredths of a degree.
    pub sector_cdeg: u16,
    /// Elevations of the beams, millionths of a degree.
    pub elevations_udeg: [i32; 3],
}

impl RadioSettings {
    /// These, if a receiver can be made for them ([`RadioConfig::check`]).
    #[must_use]
    pub fn checked(self) -> Option<Self> {
        self.config().check().is_ok().then_some(self)
    }

    /// As the receiver takes it.
    #[must_use]
    pub fn config(&self) -> RadioConfig {
        let radians = |udeg: i32| (f64::from(udeg) / 1e6).to_radians();
        let [length, root] = self.sequence.map(u32::from);
        let [of_uav, of_gmt] = self.spacing.map(|spacing| f64::from(spacing) / 1e5);
        let mut radio = RadioConfig::default();
        radio.waveform.carrier_hz = f64::from(self.carrier_khz) * 1e3;
        radio.waveform.sequence_length = length;
        radio.waveform.root = root;
        radio.uav_arrays.radius_m = f64::from(self.radius_tenth_mm) / 1e4;
        radio.uav_arrays.tilt_rad = radians(self.tilt_udeg);
        radio.uav_arrays.spacing_wavelengths = of_uav;
        radio.gmt_arrays.spacing_wavelengths = of_gmt;
        radio.codebook.sector_rad = (f64::from(self.sector_cdeg) / 1e2).to_radians();
        radio.codebook.elevations_rad = self.elevations_udeg.map(radians);
        radio
    }

    pub(super) fn to_words(self) -> [i32; 8] {
        let pair = |low: u16, high: u16| (u32::from(low) | u32::from(high) << 16).cast_signed();
        let ([length, root], [of_uav, of_gmt]) = (self.sequence, self.spacing);
        let [low, middle, high] = self.elevations_udeg;
        [
            self.carrier_khz.cast_signed(),
            pair(length, root),
            pair(self.radius_tenth_mm, of_uav),
            self.tilt_udeg,
            pair(of_gmt, self.sector_cdeg),
            low,
            middle,
            high,
        ]
    }

    pub(super) fn from_words(
        [carrier, sequence, radius, tilt_udeg, gmt, low, middle, high]: [i32; 8],
    ) -> Option<Self> {
        let pair = |word: i32| {
            let [a, b, c, d] = word.to_le_bytes();
            [u16::from_le_bytes([a, b]), u16::from_le_bytes([c, d])]
        };
        let ([radius_tenth_mm, of_uav], [of_gmt, sector_cdeg]) = (pair(radius), pair(gmt));
        let told = Self {
            carrier_khz: carrier.cast_unsigned(),
            sequence: pair(sequence),
            radius_tenth_mm,
            tilt_udeg,
            spacing: [of_uav, of_gmt],
            sector_cdeg,
            elevations_udeg: [low, middle, high],
        };
        told.checked()
    }
}
