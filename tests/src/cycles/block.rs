//! Cycles of a straight run of instructions, which a branch ends: the least and the most.

use super::instruction::{Instruction, REGISTERS, UNITS};

/// Cycles that something takes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Cycles {
    /// As if two instructions were issued in every cycle in which the units allow it, nothing waited for a result, every branch was
    /// predicted, and all memory answered in a cycle.
    pub least: f64,
    /// As if one instruction was issued at a time, each waited for the whole latency of what it reads, and the next run began when all
    /// results of this one are there. Memory and branches that are predicted wrongly come on top.
    pub most: f64,
}

/// Of a run that is executed once.
pub fn cycles(run: &[Instruction]) -> Cycles {
    Cycles {
        least: least(run),
        most: f64::from(most(run)),
    }
}

fn least(run: &[Instruction]) -> f64 {
    let (mut alone, mut paired) = (0, 0);
    let mut units = [0; UNITS];
    for one in run {
        if one.is_alone {
            alone += one.least;
            continue;
        }
        paired += 1;
        if let Some(unit) = one.unit {
            units[unit as usize] += one.least;
        }
    }
    let busiest = units.into_iter().max().unwrap_or(0);
    f64::from(alone) + (f64::from(paired) / 2.0).max(f64::from(busiest))
}

fn most(run: &[Instruction]) -> u32 {
    let mut ready = [0_u32; REGISTERS];
    let mut now = 0;
    for one in run {
        let start = one
            .waits
            .iter()
            .map(|&(register, is_early)| match ready[register] {
                0 => 0,
                ready => ready + u32::from(is_early),
            })
            .fold(now, u32::max);
        now = start + one.most;
        for &register in &one.writes {
            ready[register] = start + one.latency;
        }
    }
    ready.into_iter().fold(now, u32::max)
}

#[cfg(test)]
mod tests {
    use super::super::instruction::read;
    use super::*;

    fn of(lines: &[&str]) -> Cycles {
        cycles(&lines.iter().map(|line| read(line)).collect::<Vec<_>>())
    }

    #[test]
    fn independent_additions_go_in_pairs_or_one_by_one() {
        let run = of(&["add r0, r1, r2", "add r3, r4, r5", "add r6, r7, r8", "b #0x10"]);
        assert_eq!(
            run,
            Cycles {
                least: 2.0,
                most: 4.0
            }
        );
    }

    #[test]
    fn one_unit_and_what_is_issued_alone_bound_the_pairs() {
        // Three multiplies, with an addition beside each; the pair of loads goes alone.
        let multiplies = ["smlad r0, r1, r2, r0", "smuad r3, r1, r2", "mul r4, r1, r2"];
        let additions = ["add r5, r1, r2", "add r6, r1, r2", "add r7, r1, r2"];
        assert_eq!(of(&[&multiplies[..], &additions[..]].concat()).least, 3.0);
        assert_eq!(
            of(&[&["ldrd r8, r9, [r10]"], &multiplies[..]].concat()).least,
            4.0
        );
        assert_eq!(of(&["ldm.w r0!, {r1, r2, r3, r4}"]).least, 2.0);
    }

    #[test]
    fn a_dependent_instruction_waits_and_so_does_the_next_run() {
        // Loaded at 0, there at 2, a cycle more for an address.
        assert_eq!(of(&["ldr r0, [r1]", "add r2, r0, r3"]).most, 3.0);
        assert_eq!(of(&["ldr r0, [r1]", "ldr r2, [r0]"]).most, 5.0);
        assert_eq!(of(&["ldr r0, [r1]", "add r2, r4, r3"]).most, 2.0);
        // A double-precision sum of products: the sum there after 12, the next after 12 more.
        let chain = ["vmla.f64 d0, d1, d2", "vmla.f64 d0, d3, d4"];
        assert_eq!(
            of(&chain),
            Cycles {
                least: 10.0,
                most: 24.0
            }
        );
        // s1 is half of d0.
        assert_eq!(of(&["vadd.f64 d0, d1, d2", "vadd.f32 s2, s1, s3"]).most, 8.0);
    }
}
