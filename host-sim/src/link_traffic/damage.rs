//! A serial line that loses, changes and inserts bytes.

use cslam_core::telemetry::{Deframer, Key, MAX_FRAME, Message, Opener, PoseReport, Sender};

use super::loss::BURSTS;
use crate::random::Stream;
use crate::table::Table;

/// What happens to a burst of bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Damage {
    /// They never arrive.
    Lost,
    /// They arrive as other bytes.
    Changed,
    /// Others arrive before them.
    Inserted,
}

/// Kinds of damage, in the order of the table.
pub const DAMAGES: [Damage; 3] = [Damage::Lost, Damage::Changed, Damage::Inserted];
/// Times that the line is damaged.
const TIMES: usize = 4000;
/// Frames from one damage to the next.
const APART: usize = 8;

/// What a kind of damage did.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Damaged {
    /// What happened.
    pub damage: Damage,
    /// To how many bytes in a row.
    pub burst: usize,
    /// Frames that were hit.
    pub hit: usize,
    /// Frames that were not hit and yet not taken.
    pub lost_with_them: usize,
    /// Most of these after one damage.
    pub most_lost_with_them: usize,
    /// Packets taken that were never sent.
    pub invented: usize,
}

/// Every kind of damage with every length.
pub fn grid(seed: u64) -> Vec<Damaged> {
    let kinds = DAMAGES
        .iter()
        .flat_map(|&damage| BURSTS.iter().map(move |&burst| (damage, burst)));
    kinds
        .zip(0..)
        .map(|((damage, burst), index)| run(damage, burst, &mut Stream::new(seed, index)))
        .collect()
}

fn run(damage: Damage, burst: usize, stream: &mut Stream) -> Damaged {
    let mut result = Damaged {
        damage,
        burst,
        hit: 0,
        lost_with_them: 0,
        most_lost_with_them: 0,
        invented: 0,
    };
    let mut sender = Sender::new(1, &Key::TEST, 0);
    let (mut deframer, mut opener) = (Deframer::new(), Opener::<Message>::new(1, &Key::TEST));
    for _ in 0..TIMES {
        let first = sender.counter();
        let frames: Vec<Vec<u8>> = (0..APART as u32).map(|n| frame(&mut sender, first + n)).collect();
        let (bytes, hit) = damaged(&frames, damage, burst, stream);
        let mut taken = [false; APART];
        for byte in bytes {
            let Some(Ok(frame)) = deframer.push(byte) else {
                continue;
            };
            let Ok(packet) = opener.open(&frame) else { continue };
            match packet.message {
                Message::Pose(pose) if pose == said(packet.counter) => {
                    taken[(packet.counter - first) as usize] = true;
                }
                _ => result.invented += 1,
            }
        }
        let lost = taken
            .iter()
            .zip(&hit)
            .filter(|(taken, hit)| !**taken && !**hit)
            .count();
        result.hit += hit.iter().filter(|hit| **hit).count();
        result.lost_with_them += lost;
        result.most_lost_with_them = result.most_lost_with_them.max(lost);
    }
    result
}

/// A pose that tells its number, exact on the wire.
fn said(number: u32) -> PoseReport {
    PoseReport {
        time_ns: u64::from(number) * 1000,
        position_m: [f64::from(number % 1000), 0.0, 0.0],
        velocity_m_per_s: [0.0; 3],
        quaternion_wb: [1.0, 0.0, 0.0, 0.0],
        clock: None,
        position: said_spread(),
        velocity: said_spread(),
        attitude: said_spread(),
        resets: 0,
        health: Default::default(),
        line_of_sight: false,
    }
}

fn said_spread() -> cslam_core::telemetry::Spread {
    cslam_core::telemetry::Spread {
        sigma: [1e-4; 3],
        correlation: [0.0; 3],
    }
}

fn frame(sender: &mut Sender, number: u32) -> Vec<u8> {
    let mut frame = [0; MAX_FRAME];
    let bytes = sender.encode(&Message::Pose(said(number)), &mut frame);
    bytes.expect("a pose near the origin can be sent").to_vec()
}

/// The frames as they arrive when something happens in the first half of them, and which were hit: those any byte of which,
/// closing zero included, was lost or changed, or before any byte of which something was inserted, the first excepted.
fn damaged(frames: &[Vec<u8>], damage: Damage, burst: usize, stream: &mut Stream) -> (Vec<u8>, Vec<bool>) {
    let mut bytes: Vec<u8> = frames.concat();
    let until: usize = frames[..APART / 2].iter().map(Vec::len).sum();
    let at = (stream.uniform() * until as f64) as usize;
    let mut noise = || (stream.uniform() * 256.0) as u8;
    match damage {
        Damage::Lost => drop(bytes.drain(at..at + burst)),
        // Another byte, whichever it was.
        Damage::Changed => bytes[at..at + burst]
            .iter_mut()
            .for_each(|byte| *byte ^= noise().max(1)),
        Damage::Inserted => {
            let inserted: Vec<u8> = (0..burst).map(|_| noise()).collect();
            bytes.splice(at..at, inserted);
        }
    }
    let mut start = 0;
    let hit = frames.iter().map(|frame| {
        let (first, last) = (start, start + frame.len());
        start = last;
        match damage {
            Damage::Inserted => at > first && at < last,
            _ => at < last && at + burst > first,
        }
    });
    let hit = hit.collect();
    (bytes, hit)
}

/// The grid as a table.
pub fn table(rows: &[Damaged]) -> Table {
    let mut table = Table::new([
        "bytes",
        "in a row",
        "times",
        "frames hit",
        "sound frames lost with them",
        "most at a time",
        "packets invented",
    ]);
    for row in rows {
        let damage = match row.damage {
            Damage::Lost => "lost",
            Damage::Changed => "changed",
            Damage::Inserted => "inserted",
        };
        let numbers = [
            row.burst,
            TIMES,
            row.hit,
            row.lost_with_them,
            row.most_lost_with_them,
            row.invented,
        ];
        table.row(
            [damage.to_owned()]
                .into_iter()
                .chain(numbers.map(|n| n.to_string())),
        );
    }
    table
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn at_most_one_sound_frame_is_lost_with_the_damaged() {
        let rows = grid(1);
        for row in &rows {
            assert!(row.hit >= TIMES / 2 && row.invented == 0, "{row:?}");
            assert!(row.most_lost_with_them <= 1, "{row:?}");
        }
        let lost: usize = rows.iter().map(|row| row.lost_with_them).sum();
        assert!(lost > 0, "a zero that is lost joins two frames");
    }
}
