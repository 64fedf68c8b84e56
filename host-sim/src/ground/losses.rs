//! Lost packets of a link, from the gaps between their numbers.

use serde::Serialize;

/// Numbers of the last packets that may still come late.
const WINDOW: u32 = 64;

/// What became of the packets of a link.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Losses {
    /// Packets that came.
    pub received: u64,
    /// Packets sent between the first and the last that came, and not come (yet).
    pub lost: u64,
    /// Packets that came after a later one.
    pub late: u64,
    /// Gaps that were not loss: the sender reserved numbers ahead and was reset.
    pub jumps: u64,
    #[serde(skip)]
    last: Option<u32>,
}

impl Losses {
    /// Counts a packet. Numbers must be fresh: repeated ones are refused before.
    ///
    /// `reserved` is how many numbers a sender may skip at a reset: a gap that long or longer says nothing about loss.
    pub fn count(&mut self, counter: u32, reserved: u32) {
        self.received += 1;
        match self.last {
            Some(last) if counter > last => {
                let gap = counter - last - 1;
                if gap >= reserved {
                    self.jumps += 1;
                } else {
                    self.lost += u64::from(gap);
                }
                self.last = Some(counter);
            }
            Some(last) if last - counter <= WINDOW => {
                self.late += 1;
                self.lost = self.lost.saturating_sub(1);
            }
            Some(_) => self.late += 1,
            None => self.last = Some(counter),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gaps_are_loss_until_the_late_ones_come() {
        let mut losses = Losses::default();
        for counter in [10, 11, 15, 13, 16] {
            losses.count(counter, 1000);
        }
        assert_eq!((losses.received, losses.lost, losses.late), (5, 2, 1));
        // A reset with its reserve of numbers is no loss.
        losses.count(2000, 1000);
        assert_eq!((losses.lost, losses.jumps), (2, 1));
    }
}
