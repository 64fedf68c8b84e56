//! The key of a link, and what it proves.

use core::fmt;

use blake2::Blake2sMac;
use blake2::digest::Mac;
use blake2::digest::consts::U8;

use super::TAG_LENGTH;

/// The secret that both ends of a link hold; one key a UAV.
///
/// It is never printed: `Debug` and defmt show that there is a key, not which. There is no way to read it back. Its copies
/// in memory are not wiped; whoever reads the memory of a UAV has its key.
#[derive(Clone)]
pub struct Key([u8; Key::LENGTH]);

impl Key {
    /// Bytes of a key.
    pub const LENGTH: usize = 32;

    /// The key of simulations and tests. It is published with this source: what it signs, anybody can forge. A receiver
    /// that flies must refuse it ([`Key::is_test`]).
    pub const TEST: Self = Self(*b"PUBLISHED TEST KEY, NOT A SECRET");

    /// A key of these bytes, which must be drawn at random and kept secret.
    #[must_use]
    pub const fn new(bytes: [u8; Self::LENGTH]) -> Self {
        Self(bytes)
    }

    /// Whether it is the published key, which proves nothing.
    #[must_use]
    pub fn is_test(&self) -> bool {
        self.0 == Self::TEST.0
    }

    /// What two people may compare to see that they hold the same key; it tells nothing else about it.
    #[must_use]
    pub fn fingerprint(&self) -> [u8; 8] {
        // No packet begins with a zero: that is no version.
        self.tag(&[0]).unwrap_or_default()
    }

    /// The authentication code of a packet: BLAKE2s with a key (RFC 7693), 8 bytes long.
    pub(super) fn tag(&self, packet: &[u8]) -> Option<[u8; TAG_LENGTH]> {
        Some(self.mac(packet)?.finalize().into_bytes().into())
    }

    /// Whether `tag` is the authentication code of a packet; takes the same time whatever the tag is.
    pub(super) fn verifies(&self, packet: &[u8], tag: &[u8; TAG_LENGTH]) -> bool {
        self.mac(packet)
            .is_some_and(|mac| mac.verify(&(*tag).into()).is_ok())
    }

    /// `None` never happens: the length of the key is right.
    fn mac(&self, packet: &[u8]) -> Option<Blake2sMac<U8>> {
        let mut mac = Blake2sMac::<U8>::new_with_salt_and_personal(Some(&self.0), &[], &[]).ok()?;
        mac.update(packet);
        Some(mac)
    }
}

impl fmt::Debug for Key {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(if self.is_test() {
            "Key(test)"
        } else {
            "Key(secret)"
        })
    }
}

#[cfg(feature = "defmt")]
impl defmt::Format for Key {
    fn format(&self, f: defmt::Formatter<'_>) {
        defmt::write!(f, "Key({=str})", if self.is_test() { "test" } else { "secret" });
    }
}

#[cfg(test)]
mod tests {
    extern crate std;

    use std::format;

    use super::*;

    #[test]
    fn it_is_never_printed() {
        let secret = Key::new([0xa5; 32]);
        assert_eq!(format!("{secret:?} {secret:#?}"), "Key(secret) Key(secret)");
        assert_eq!(format!("{:?}", Key::TEST), "Key(test)");
        assert!(Key::TEST.is_test() && !secret.is_test());
    }

    #[test]
    fn another_key_packet_or_tag_does_not_verify() {
        let key = Key::new([7; 32]);
        let tag = key.tag(b"packet").expect("a key of the right length");
        assert!(key.verifies(b"packet", &tag));
        assert!(!key.verifies(b"packer", &tag));
        assert!(!Key::new([8; 32]).verifies(b"packet", &tag));
        for bit in 0..64 {
            let mut forged = tag;
            forged[bit / 8] ^= 1 << (bit % 8);
            assert!(!key.verifies(b"packet", &forged), "bit {bit}");
        }
    }
}
