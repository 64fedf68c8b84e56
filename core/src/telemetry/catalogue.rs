//! The surfaces of a batch of points: each is written once, and a point says its place in the list.
//!
//! Numbers of surfaces rise through a flight, so those of a batch lie far apart but are few.

use super::MAX_POINTS;
use super::bits::{BitReader, BitWriter, width};

/// Different surfaces, in ascending order of their codes.
#[derive(Clone, Debug, Default)]
pub(super) struct Catalogue {
    codes: heapless::Vec<u32, MAX_POINTS>,
}

/// Code of no surface; that of a surface is one more than its number.
const NONE: u32 = 0;

fn code(surface: Option<u16>) -> u32 {
    surface.map_or(NONE, |number| u32::from(number) + 1)
}

impl Catalogue {
    /// Adds a surface, unless it is there. There is room for those of a full batch.
    pub(super) fn add(&mut self, surface: Option<u16>) {
        let mut carried = code(surface);
        if self.codes.contains(&carried) {
            return;
        }
        for place in &mut self.codes {
            if carried < *place {
                core::mem::swap(place, &mut carried);
            }
        }
        let _fits = self.codes.push(carried);
    }

    /// Bits of a place in the list.
    fn place_bits(&self) -> u32 {
        width((self.codes.len() as u64).saturating_sub(1))
    }

    /// Writes the list, which is not empty: the first code, then how far each is above the one before it.
    pub(super) fn write(&self, to: &mut BitWriter<'_>) {
        to.put((self.codes.len() as u64).saturating_sub(1), 5);
        let mut below = 0;
        for code in &self.codes {
            to.put_sized(u64::from(code.saturating_sub(below)));
            below = *code;
        }
    }

    /// Reads a list.
    pub(super) fn read(from: &mut BitReader<'_>) -> Option<Self> {
        let mut codes = heapless::Vec::<u32, MAX_POINTS>::new();
        for _ in 0..=from.take(5)? {
            let above = u32::try_from(from.take_sized()?).ok()?;
            let code = match codes.last() {
                Some(_) if above == 0 => return None,
                Some(below) => below.checked_add(above)?,
                None => above,
            };
            if code > u32::from(u16::MAX) + 1 {
                return None;
            }
            codes.push(code).ok()?;
        }
        Some(Self { codes })
    }

    /// Writes the place of a surface in the list.
    pub(super) fn write_place(&self, surface: Option<u16>, to: &mut BitWriter<'_>) {
        let wanted = code(surface);
        match self.codes.iter().position(|code| *code == wanted) {
            Some(place) => to.put(place as u64, self.place_bits()),
            None => to.spoil(),
        }
    }

    /// Reads a place in the list: the surface that is there.
    pub(super) fn read_place(&self, from: &mut BitReader<'_>) -> Option<Option<u16>> {
        let place = from.take(self.place_bits())? as usize;
        let code = *self.codes.get(place)?;
        match code.checked_sub(1) {
            None => Some(None),
            Some(number) => u16::try_from(number).ok().map(Some),
        }
    }
}
