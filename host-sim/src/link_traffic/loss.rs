//! The map on the ground when packets are lost and overtake each other.

use cslam_core::telemetry::{
    Decoder, HealthReport, Key, MAX_FRAME, Message, PointBatch, PointReport, REORDERING, Sender,
};
use rayon::prelude::*;

use super::channel;
use crate::random::Stream;
use crate::table::Table;

/// Losses, bursts and delays of the grid.
pub const LOSSES: [f64; 6] = [0.0, 0.001, 0.01, 0.05, 0.1, 0.3];
/// Packets lost in a row.
pub const BURSTS: [usize; 3] = [1, 8, 64];
/// Places that a packet may be late.
pub const LATE: [usize; 3] = [0, 8, 63];

/// Packets of a cell: so many that the smallest loss is one burst of the longest.
const PACKETS: usize = 64_000;
/// Points of a packet of points.
const POINTS: usize = 14;
/// Time between packets at full rate, ms: ten poses, two sweeps, one health report and a batch of points in eight seconds.
const INTERVAL_MS: f64 = 1000.0 / 13.125;

/// A cell of the grid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cell {
    /// Share of packets that the radio is to lose.
    pub loss: f64,
    /// Packets lost in a row.
    pub burst: usize,
    /// Places that a packet may be late.
    pub late: usize,
    /// Share of packets that it lost.
    pub lost: f64,
    /// Share of the points that arrived.
    pub map_share: f64,
    /// Packets that arrived and were not taken.
    pub refused: usize,
    /// Longest time without a packet taken, from the last one lost to the next taken, ms: at full rate, in the order of arrival.
    pub resynchronised_ms: f64,
    /// Most sound packets between those two.
    pub good_frames_lost: usize,
}

/// All cells.
pub fn grid(seed: u64) -> Vec<Cell> {
    let frames = frames();
    let cells: Vec<_> = LOSSES
        .iter()
        .flat_map(|&loss| BURSTS.iter().map(move |&burst| (loss, burst)))
        .flat_map(|(loss, burst)| LATE.iter().map(move |&late| (loss, burst, late)))
        .collect();
    cells
        .into_par_iter()
        .enumerate()
        .map(|(index, (loss, burst, late))| {
            cell(&frames, loss, burst, late, &mut Stream::new(seed, index as u64))
        })
        .collect()
}

/// What a UAV sends: every second packet has points, so that the map's share is known well.
fn frames() -> Vec<Vec<u8>> {
    let mut sender = Sender::new(1, &Key::TEST, 0);
    let mut frame = [0; MAX_FRAME];
    (0..PACKETS)
        .map(|number| {
            let message = if number % 2 == 0 {
                Message::Points(batch(number))
            } else {
                Message::Health(HealthReport::default())
            };
            let bytes = sender.encode(&message, &mut frame);
            bytes
                .expect("a batch of points near the origin can be sent")
                .to_vec()
        })
        .collect()
}

fn batch(number: usize) -> PointBatch {
    let mut batch = PointBatch::new();
    for place in 0..POINTS {
        let report = PointReport {
            sweep: number as u32,
            stop: 0,
            position_m: [place as f32, (number % 1000) as f32 * 0.1, 2.0],
            sigma_m: 0.1,
            probability: 1.0,
            surface: None,
        };
        batch.push(&report).expect("few points of one sweep");
    }
    batch
}

fn cell(frames: &[Vec<u8>], loss: f64, burst: usize, late: usize, stream: &mut Stream) -> Cell {
    let lost = channel::lost(frames.len(), loss, burst, stream);
    let order = channel::order(frames.len(), late, stream);
    let mut decoder = Decoder::new(1, &Key::TEST);
    let (mut points, mut refused) = (0, 0);
    // Since the last one lost: places in the order of arrival, and sound packets that were not taken.
    let (mut waiting, mut longest) = (None::<(usize, usize)>, (0, 0));
    for (place, sent) in order.into_iter().enumerate() {
        if lost[sent] {
            waiting = Some((place, 0));
            continue;
        }
        let taken = frames[sent]
            .iter()
            .filter_map(|byte| decoder.push(*byte))
            .fold(false, |_, result| match result {
                Ok(packet) => {
                    if let Message::Points(batch) = packet.message {
                        points += batch.len();
                    }
                    true
                }
                Err(_) => false,
            });
        if !taken {
            refused += 1;
            if let Some((_, good)) = &mut waiting {
                *good += 1;
            }
        } else if let Some((since, good)) = waiting.take() {
            longest = (longest.0.max(place - since), longest.1.max(good));
        }
    }
    let count = lost.iter().filter(|lost| **lost).count();
    Cell {
        loss,
        burst,
        late,
        lost: count as f64 / frames.len() as f64,
        map_share: points as f64 / (frames.len() / 2 * POINTS) as f64,
        refused,
        resynchronised_ms: longest.0 as f64 * INTERVAL_MS,
        good_frames_lost: longest.1,
    }
}

/// The grid as a table.
pub fn table(cells: &[Cell]) -> Table {
    let mut table = Table::new([
        "packets lost, %",
        "in a row",
        "late by up to",
        "of the map arrived, %",
        "sound packets refused",
        "sound frames lost after a loss",
        "in step again after, ms",
    ]);
    for cell in cells {
        table.row([
            format!("{:.1}", 100.0 * cell.lost),
            cell.burst.to_string(),
            cell.late.to_string(),
            format!("{:.2}", 100.0 * cell.map_share),
            cell.refused.to_string(),
            cell.good_frames_lost.to_string(),
            format!("{:.0}", cell.resynchronised_ms),
        ]);
    }
    table
}

const _: () = assert!(
    LATE[2] < REORDERING as usize,
    "later packets are refused by design"
);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_not_lost_arrives_at_once() {
        let grid = grid(1);
        let golden = include_str!("../../../tests/golden/telemetry_loss.txt");
        assert_eq!(table(&grid).to_string(), golden, "the committed table");
        for cell in grid {
            assert!((cell.lost - cell.loss).abs() < 0.001, "{cell:?}");
            assert!((cell.map_share - (1.0 - cell.loss)).abs() < 0.01, "{cell:?}");
            assert_eq!((cell.refused, cell.good_frames_lost), (0, 0), "{cell:?}");
            let one_frame = cell.resynchronised_ms <= INTERVAL_MS;
            assert!(one_frame, "the first sound packet is taken: {cell:?}");
        }
    }

    #[test]
    fn a_packet_later_than_the_window_is_refused() {
        let frames = frames();
        let cell = cell(&frames[..4000], 0.0, 1, 200, &mut Stream::new(1, 1));
        assert!(cell.refused > 100, "{cell:?}");
    }
}
