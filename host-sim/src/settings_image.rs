//! The settings of a UAV as they lie in its flash: how a key gets there.
//!
//! The image is the first record of an empty store, written by the store itself (`cslam_firmware::storage`), so a receiver finds it
//! where it looks. Its counters begin at 0: with a key that was used before, what was recorded then would be taken again.

use std::convert::Infallible;

use cslam_firmware::storage::{SLOT, Settings, StorageError, Store};
use embedded_storage::nor_flash::{ErrorType, NorFlash, ReadNorFlash};

use crate::config::Config;
use crate::input::InputError;

/// Settings for a UAV that has never flown with this key: of the configuration, what a board is told.
///
/// # Errors
/// [`InputError`] naming a figure of the radio that no board can be told.
pub fn settings(uav: u8, key: [u8; 32], config: &Config) -> Result<Settings, InputError> {
    Ok(Settings {
        uav,
        radio: config.radio.for_board().map_err(|error| error.under("radio"))?,
        mount: config.board.mount,
        key: Some(key),
        gmt_place: config.receiver.gmt_setup.for_board(),
        magnetic_field: config.receiver.magnetic_field.and_then(|field| field.for_board()),
        ..Settings::default()
    })
}

/// The bytes to write to the beginning of an erased store.
///
/// # Errors
/// [`StorageError`], which a memory without faults does not have.
pub fn image(settings: &Settings) -> Result<[u8; SLOT], StorageError<Infallible>> {
    let mut bytes = [0xff; 2 * SLOT];
    Store::open(Blank(&mut bytes))?.store(settings)?;
    Ok(*bytes.first_chunk().unwrap_or(&[0xff; SLOT]))
}

/// A flash of two sectors without faults. The store keeps within its bounds.
struct Blank<'a>(&'a mut [u8; 2 * SLOT]);

impl ErrorType for Blank<'_> {
    type Error = Infallible;
}

impl ReadNorFlash for Blank<'_> {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Infallible> {
        bytes.copy_from_slice(&self.0[offset as usize..][..bytes.len()]);
        Ok(())
    }

    fn capacity(&self) -> usize {
        self.0.len()
    }
}

impl NorFlash for Blank<'_> {
    const WRITE_SIZE: usize = 1;
    const ERASE_SIZE: usize = SLOT;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), Infallible> {
        self.0[from as usize..to as usize].fill(0xff);
        Ok(())
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Infallible> {
        self.0[offset as usize..][..bytes.len()].copy_from_slice(bytes);
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use cslam_firmware::storage::{EarthField, GmtPlace};

    use super::*;

    #[test]
    fn a_receiver_finds_its_settings_in_the_image() {
        let text = "[board]\nmount = [-2, 1, 3]\n[receiver.gmt_setup]\nposition_m = [1.5, -2.25, 0.0004]\nwithin_m = 0.8\n\
            [receiver.magnetic_field]\nstrength_ut = 48.0\ninclination_deg = 65.0\ndeclination_deg = -3.0\n";
        let config = Config::parse(Path::new("c.toml"), text, None).expect("sound");
        let settings = settings(7, [0xc5; 32], &config).expect("has room");
        assert_eq!(settings.mount.axes(), [-2, 1, 3]);
        assert_eq!(settings.gmt_place, GmtPlace::new([1500, -2250, 0], 800));
        assert_eq!(settings.magnetic_field, EarthField::new(48_000, 65_000, -3_000));
        let image = image(&settings).expect("no faults");
        let mut flash = [0xff; 2 * SLOT];
        flash[..SLOT].copy_from_slice(&image);
        let store = Store::open(Blank(&mut flash)).expect("two sectors");
        assert_eq!(store.settings(), Ok(&settings));
        assert_eq!((settings.downlink_counter, settings.uplink_counter), (0, 0));
    }
}
