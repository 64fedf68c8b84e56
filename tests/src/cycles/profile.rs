//! The profile that `tests/tools/instruction_profile.c` writes, and what it comes to: work by kernel, and by piece of work.

use std::collections::BTreeMap;

use super::block::{Cycles, cycles};
use super::instruction::{Class, read};

/// Cycles that a branch which was predicted wrongly costs at most: 6 to 8 were measured.
const MISPREDICTED: f64 = 8.0;
/// Cycles until a line of 32 bytes of code, or of data, is there at most. An assumption: no manual says. The bus has half the processor's
/// clock. Flash answers after 4 wait states, and 4 beats follow; SRAM1 has a bridge more in its way, and 8 beats; a line that was written goes
/// out first.
const MISSED: [f64; 2] = [40.0, 50.0];
/// The piece of work that a unit of the chip does on a real board.
const CHECKSUM: &str = "frame";
/// So near must the mean of a piece of work be to the committed one to be taken for it.
const SAME: f64 = 0.02;

/// What some code did.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Work {
    /// Instructions.
    pub instructions: f64,
    /// Instructions of each class.
    pub classes: [f64; 8],
    /// Cycles without waits.
    cycles: Cycles,
    /// Branches predicted wrongly, lines that the caches for code and for data did not have.
    waits: [f64; 3],
}

impl Work {
    /// Of a run of instructions, once.
    fn of(lines: &[&str]) -> Self {
        let run: Vec<_> = lines.iter().map(|line| read(line)).collect();
        let mut work = Self {
            instructions: run.len() as f64,
            cycles: cycles(&run),
            ..Self::default()
        };
        for one in &run {
            work.classes[one.class as usize] += 1.0;
        }
        work
    }

    /// Adds what was done so many times.
    fn add(&mut self, other: &Self, times: f64) {
        self.instructions += times * other.instructions;
        self.cycles.least += times * other.cycles.least;
        self.cycles.most += times * other.cycles.most;
        let sums = self.classes.iter_mut().chain(&mut self.waits);
        for (sum, one) in sums.zip(other.classes.iter().chain(&other.waits)) {
            *sum += times * one;
        }
    }

    /// Cycles of an instruction in the mean: the most with all waits.
    pub fn cycles(&self) -> Cycles {
        let [mispredicted, code, data] = self.waits;
        let waits = MISPREDICTED * mispredicted + MISSED[0] * code + MISSED[1] * data;
        Cycles {
            least: self.cycles.least / self.instructions,
            most: (self.cycles.most + waits) / self.instructions,
        }
    }

    /// Cycles of an instruction that it waits for memory at most.
    pub fn memory(&self) -> f64 {
        (MISSED[0] * self.waits[1] + MISSED[1] * self.waits[2]) / self.instructions
    }

    /// Share of a class.
    pub fn share(&self, class: Class) -> f64 {
        self.classes[class as usize] / self.instructions
    }
}

/// A profile of a flight, without the checksum of the frames.
#[derive(Clone, Debug, Default)]
pub struct Profile {
    /// Sweeps that were flown.
    pub sweeps: f64,
    /// Work of each function, by name, the most first.
    pub kernels: Vec<(String, Work)>,
    /// Work of each piece that the committed table names.
    pub pieces: BTreeMap<String, Work>,
    /// All of it.
    pub all: Work,
}

/// A piece of work, and how often it was entered.
struct Piece {
    work: Work,
    entries: f64,
}

/// A run of instructions, and how often each piece of work came to it.
struct Block {
    symbol: String,
    work: Work,
    waits: [f64; 3],
    counts: Vec<f64>,
}

impl Profile {
    /// Reads a profile. `committed` holds the instructions of each piece of work in the mean, as `tests/golden/receiver_cost.txt` does: by them the
    /// pieces are told apart, since in the image they have no names.
    ///
    /// # Errors
    /// What cannot be read; a piece of work that is needed and not found.
    pub fn read(text: &str, committed: &BTreeMap<String, f64>) -> Result<Self, String> {
        let (mut pieces, blocks) = parse(text)?;
        for block in &blocks {
            for (piece, times) in pieces.iter_mut().zip(&block.counts) {
                piece.work.add(&block.work, *times);
            }
        }
        let names: Vec<Option<&str>> = pieces
            .iter()
            .map(|piece| name_of(piece.work.instructions / piece.entries, committed))
            .collect();
        let place = |name: &str| {
            let place = names.iter().position(|one| *one == Some(name));
            place.ok_or_else(|| {
                format!("no piece of work has the instructions of `{name}` in the committed table")
            })
        };
        let (checksum, end) = (place(CHECKSUM)?, place("end of sweep")?);
        let mut profile = Self {
            sweeps: pieces[end].entries,
            ..Self::default()
        };
        let mut kernels = BTreeMap::<String, Work>::new();
        for block in &blocks {
            let all: f64 = block.counts.iter().sum();
            let times = all - block.counts[checksum];
            if times == 0.0 {
                continue;
            }
            let kernel = match block.counts.iter().position(|count| *count > 0.0) {
                Some(piece) if block.symbol.contains("Counts7measure") => {
                    names[piece].unwrap_or("other").to_owned()
                }
                _ => readable(&block.symbol),
            };
            let once = Work {
                waits: block.waits.map(|wait| wait / all),
                ..block.work
            };
            kernels.entry(kernel).or_default().add(&once, times);
            profile.all.add(&once, times);
        }
        profile.kernels = kernels.into_iter().collect();
        profile
            .kernels
            .sort_by(|a, b| b.1.instructions.total_cmp(&a.1.instructions));
        let named = names
            .iter()
            .zip(&pieces)
            .filter(|(name, _)| **name != Some(CHECKSUM));
        profile.pieces = named
            .filter_map(|(name, piece)| Some(((*name)?.to_owned(), piece.work)))
            .collect();
        Ok(profile)
    }
}

/// Pieces of work with their entries, and blocks.
fn parse(text: &str) -> Result<(Vec<Piece>, Vec<Block>), String> {
    let (mut pieces, mut blocks) = (Vec::new(), Vec::<Block>::new());
    let mut lines = text.lines().peekable();
    while let Some(line) = lines.next() {
        let wrong = || format!("`{line}` is no line of a profile");
        let mut words = line.split(' ');
        let kind = words.next();
        let symbol = if kind == Some("block") { words.next() } else { None };
        let numbers: Vec<f64> = words
            .map(str::parse)
            .collect::<Result<_, _>>()
            .map_err(|_| wrong())?;
        let (waits, counts) = numbers.split_first_chunk::<3>().ok_or_else(wrong)?;
        match (kind, symbol, counts) {
            (Some("stage"), None, &[entries]) => {
                let work = Work {
                    waits: *waits,
                    ..Work::default()
                };
                pieces.push(Piece { work, entries });
            }
            (_, Some(symbol), counts) if counts.len() == pieces.len() => {
                let mut run = Vec::new();
                while let Some(text) = lines.next_if(|line| line.starts_with("  ")) {
                    run.push(text);
                }
                blocks.push(Block {
                    symbol: symbol.to_owned(),
                    work: Work::of(&run),
                    waits: *waits,
                    counts: counts.to_vec(),
                });
            }
            _ => return Err(wrong()),
        }
    }
    Ok((pieces, blocks))
}

/// The piece of work that takes so many instructions in the mean.
fn name_of(mean: f64, committed: &BTreeMap<String, f64>) -> Option<&str> {
    committed.iter().find_map(|(name, count)| {
        let name = name.strip_prefix("instructions, ")?.strip_suffix(", mean")?;
        ((mean / count - 1.0).abs() < SAME).then_some(name)
    })
}

/// The last two parts of a function's path, from its symbol; without types and hashes.
fn readable(symbol: &str) -> String {
    let mut rest = symbol.strip_prefix("_ZN").unwrap_or_default();
    let mut parts = Vec::new();
    while let Some(digits) = rest
        .find(|c: char| !c.is_ascii_digit())
        .filter(|digits| *digits > 0)
    {
        let length: usize = rest[..digits].parse().unwrap_or_default();
        let Some(part) = rest.get(digits..digits + length) else {
            break;
        };
        rest = &rest[digits + length..];
        parts.push(part.split('$').next().unwrap_or_default());
    }
    // The hash.
    parts.pop();
    parts.retain(|part| !part.is_empty() && *part != "_");
    match &parts[..] {
        [] => symbol.trim_start_matches('_').to_owned(),
        [.., module, name] => format!("{module}::{name}"),
        [name] => (*name).to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PROFILE: &str = "\
stage 0 0 0 2
stage 1 2 3 4
block _ZN10cslam_core5paths6search19Search$LT$_$C$_$GT$6change17hf808b52768d6a413E 1 2 3 5 20
  ldr r0, [r1]
  adds r0, #1
block _ZN14receiver_an5006counts6Counts7measure17h4f99527f2255d4dfE 0 0 0 90 0
  b #0x10
";

    fn committed() -> BTreeMap<String, f64> {
        let text = "instructions, frame, mean: 50\ninstructions, end of sweep, mean: 10\n";
        crate::cost::counts(text)
    }

    #[test]
    fn work_is_added_up_without_the_checksum() {
        let profile = Profile::read(PROFILE, &committed()).expect("a profile");
        assert_eq!(profile.sweeps, 4.0);
        let [(name, work)] = &profile.kernels[..] else {
            panic!("{:?}", profile.kernels);
        };
        assert_eq!(name, "Search::change");
        assert_eq!(work.instructions, 40.0);
        assert_eq!(work.share(Class::Load), 0.5);
        // Half a cycle an instruction; the sum waits for what is loaded, and of 25 executions these 20 have their part of the waits.
        assert_eq!(work.cycles().least, 0.5);
        let waits = (8.0 + 2.0 * 40.0 + 3.0 * 50.0) * 20.0 / 25.0;
        assert!((work.cycles().most - (3.0 * 20.0 + waits) / 40.0).abs() < 1e-9);
        let pieces: Vec<_> = profile.pieces.keys().collect();
        assert_eq!(pieces, ["end of sweep"]);
    }

    #[test]
    fn a_profile_of_another_image_and_a_torn_one_are_refused() {
        let other = crate::cost::counts("instructions, frame, mean: 60\n");
        let error = Profile::read(PROFILE, &other).expect_err("another image");
        assert!(error.contains("`frame`"), "{error}");
        let torn = PROFILE.replace(" 5 20\n", " 5\n");
        let error = Profile::read(&torn, &committed()).expect_err("a torn profile");
        assert!(error.contains("no line of a profile"), "{error}");
    }
}
