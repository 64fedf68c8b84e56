//! Lost packets of a link, from the gaps between their numbers.

use serde::Serialize;

/// Numbers of the last packets that may still come late.
const WINDOW: u32 = 64;

/// How many packets may come between a gap and the word that the UAV began anew.
const PATIENCE: u32 = 64;

/// What became of the packets of a link.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Losses {
    /// Packets that came.
    pub received: u64,
    /// Packets sent between the first and the last that came, and not come (yet).
    pub lost: u64,
    /// Packets that came after a later one.
    pub late: u64,
    /// Restarts of the UAV: it had reserved numbers ahead, and what it skipped of them was never sent.
    pub restarts: u64,
    #[serde(skip)]
    last: Option<u32>,
    /// The last gap, and how many packets have come since.
    #[serde(skip)]
    gap: (u32, u32),
}

impl Losses {
    /// Counts a packet. Numbers must be fresh: repeated ones are refused before.
    pub fn count(&mut self, counter: u32) {
        self.received += 1;
        self.gap.1 = self.gap.1.saturating_add(1);
        match self.last {
            Some(last) if counter > last => {
                let gap = counter - last - 1;
                if gap > 0 {
                    self.lost += u64::from(gap);
                    self.gap = (gap, 0);
                }
                self.last = Some(counter);
            }
            Some(last) => {
                self.late += 1;
                if last - counter <= WINDOW {
                    self.lost = self.lost.saturating_sub(1);
                }
            }
            None => self.last = Some(counter),
        }
    }

    /// The UAV has begun anew, as its clock says: the gap just before was no loss.
    pub fn restart(&mut self) {
        self.restarts += 1;
        if self.gap.1 <= PATIENCE {
            self.lost = self.lost.saturating_sub(u64::from(self.gap.0));
            self.gap = (0, 0);
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
            losses.count(counter);
        }
        assert_eq!((losses.received, losses.lost, losses.late), (5, 2, 1));
        // A long silence is loss, however long.
        losses.count(3000);
        assert_eq!((losses.lost, losses.restarts), (2 + 2983, 0));
    }

    #[test]
    fn what_a_restart_skipped_is_no_loss() {
        let mut losses = Losses::default();
        for counter in [1, 2, 5, 1024, 1025] {
            losses.count(counter);
        }
        losses.restart();
        assert_eq!((losses.lost, losses.restarts), (2, 1));
        // A restart without a gap takes nothing off.
        for counter in 1026..1100 {
            losses.count(counter);
        }
        losses.restart();
        assert_eq!((losses.lost, losses.restarts), (2, 2));
    }
}
