//! A radio that loses packets in bursts and lets them overtake each other.

use crate::random::Stream;

/// Which of `packets` are lost: exactly the share `loss` of them, rounded, in bursts of `burst` that lie anywhere.
pub(super) fn lost(packets: usize, loss: f64, burst: usize, stream: &mut Stream) -> Vec<bool> {
    let bursts = (loss * packets as f64 / burst as f64).round() as usize;
    // Where the bursts begin when they take no room, which is then given to them one after the other.
    let room = packets.saturating_sub(bursts * burst);
    let mut starts: Vec<usize> = (0..bursts)
        .map(|_| (stream.uniform() * (room + 1) as f64) as usize)
        .collect();
    starts.sort_unstable();
    let mut lost = vec![false; packets];
    for (number, start) in starts.into_iter().enumerate() {
        let start = start + number * burst;
        lost[start..start + burst].fill(true);
    }
    lost
}

/// The order in which packets arrive when each is up to `most` places late.
pub(super) fn order(packets: usize, most: usize, stream: &mut Stream) -> Vec<usize> {
    let mut order: Vec<(usize, usize)> = (0..packets)
        .map(|sent| (sent + (stream.uniform() * (most + 1) as f64) as usize, sent))
        .collect();
    order.sort_by_key(|(place, _)| *place);
    order.into_iter().map(|(_, sent)| sent).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_share_is_exact_and_bursts_are_whole() {
        for (loss, burst, expected) in [(0.0, 1, 0), (0.1, 8, 800), (0.3, 64, 2432), (1.0, 8, 8000)] {
            let lost = lost(8000, loss, burst, &mut Stream::new(1, 2));
            assert_eq!(lost.iter().filter(|lost| **lost).count(), expected);
            let runs = lost.chunk_by(|a, b| a == b).filter(|run| run[0]);
            assert!(runs.clone().all(|run| run.len() % burst == 0));
            assert!(expected == 0 || runs.count() > 0);
        }
    }

    #[test]
    fn nothing_is_later_than_it_may_be() {
        assert!(order(100, 0, &mut Stream::new(1, 2)).iter().copied().eq(0..100));
        let order = order(5000, 32, &mut Stream::new(1, 2));
        let mut sorted = order.clone();
        sorted.sort_unstable();
        assert!(sorted.into_iter().eq(0..5000));
        let mut newest = 0;
        let mut overtaken = 0;
        for sent in order {
            assert!(newest <= sent + 32, "{sent} after {newest}");
            overtaken += u32::from(sent < newest);
            newest = newest.max(sent);
        }
        assert!(overtaken > 1000);
    }
}
