//! Checksums of frames by the chip's CRC unit: a store a word, where tables take sixteen instructions.

use cslam_core::signal::Iq;
use cslam_firmware::front_end::{Block, Checksum, SoftwareCrc};
use embassy_stm32::Peri;
use embassy_stm32::crc::{Config, Crc, InputReverseConfig, PolySize};
use embassy_stm32::peripherals::CRC;

/// The unit, set up for CRC-32/ISO-HDLC.
pub(crate) struct CrcUnit {
    /// `None` when it did not give the checksum that the tables give: then these do the work.
    unit: Option<Crc<'static>>,
}

impl CrcUnit {
    /// Sets it up, and compares it with the tables.
    pub(crate) fn new(unit: Peri<'static, CRC>, scratch: &mut Block) -> Self {
        let config = Config::new(
            InputReverseConfig::Word,
            true,
            PolySize::Width32,
            u32::MAX,
            0x04c1_1db7,
        );
        let mut checked = Self {
            unit: config.ok().map(|config| Crc::new(unit, config)),
        };
        for (word, sample) in (0u32..).zip(scratch.as_flattened_mut()) {
            *sample = Iq::from_word(word.wrapping_mul(0x9e37_79b9));
        }
        if checked.samples(scratch) != SoftwareCrc.samples(scratch) {
            defmt::error!("the CRC unit and the tables disagree: the tables are used");
            checked.unit = None;
        }
        checked
    }
}

impl Checksum for CrcUnit {
    fn samples(&mut self, samples: &Block) -> u32 {
        let Some(unit) = &mut self.unit else {
            return SoftwareCrc.samples(samples);
        };
        unit.reset();
        for sample in samples.as_flattened() {
            unit.feed_word(sample.word());
        }
        !unit.read()
    }
}
