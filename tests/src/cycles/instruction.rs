//! One instruction, read from its disassembly: what it is, what it needs, how long it takes.

use std::ops::Range;

/// What a table counts. An instruction has one class; moves, integer arithmetic and the like are [`Class::Other`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Class {
    /// Reads memory.
    Load,
    /// Writes memory.
    Store,
    /// Single-precision arithmetic, comparison or conversion.
    Single,
    /// Double-precision arithmetic, comparison or conversion.
    Double,
    /// Division or square root, of integers or of either precision.
    Division,
    /// Branch, call or return.
    Branch,
    /// On two 16-bit halves or four bytes at once.
    Simd,
    /// Anything else.
    Other,
}

/// What there is once in the processor: a second instruction that needs it waits for the next cycle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Unit {
    /// Stores.
    Store,
    /// Multiplies and multiplies with accumulation.
    Multiplier,
    /// Bit fields, extensions, saturation, sums of halves.
    Fields,
    /// Floating point.
    Float,
    /// Branches.
    Branch,
}

/// Units.
pub const UNITS: usize = 5;
/// Registers: r0 to r15, s0 to s31, the flags of comparisons of floats, and the adder that a multiplication with accumulation holds.
pub const REGISTERS: usize = 50;
const FLOATS: usize = 16;
const FLAGS: usize = 48;
const ADDER: usize = 49;

/// How instructions of a kind behave.
struct Rule {
    /// Beginnings of their disassembly; `*` stands for anything. The first rule that fits is taken.
    texts: &'static [&'static str],
    class: Class,
    issue: Issue,
    /// Least and most cycles until the next one is issued, and the most until the result may be read.
    cycles: [u32; 3],
}

/// How it is issued.
#[derive(Clone, Copy)]
enum Issue {
    /// Beside another one that does not need the same unit.
    Paired(Option<Unit>),
    /// With nothing beside it.
    Alone,
    /// Alone, and two words of its list a cycle; the rule's cycles come on top.
    List,
}

use Class::{Branch, Division, Double, Load, Other, Simd, Single, Store};
use Issue::{Alone, List, Paired};

const fn rule(texts: &'static [&'static str], class: Class, issue: Issue, cycles: [u32; 3]) -> Rule {
    Rule {
        texts,
        class,
        issue,
        cycles,
    }
}

const MULTIPLIER: Issue = Paired(Some(Unit::Multiplier));
const FIELDS: Issue = Paired(Some(Unit::Fields));
const FLOAT: Issue = Paired(Some(Unit::Float));
const STORE: Issue = Paired(Some(Unit::Store));

#[rustfmt::skip]
const RULES: &[Rule] = &[
    // Floating point: moves, loads and stores.
    rule(&["vldm", "vpop"], Load, List, [0, 0, 3]),
    rule(&["vstm", "vpush"], Store, List, [0, 1, 0]),
    rule(&["vldr d"], Load, Alone, [1, 1, 3]),
    rule(&["vldr"], Load, Paired(None), [1, 1, 3]),
    rule(&["vstr d"], Store, Alone, [1, 1, 0]),
    rule(&["vstr"], Store, STORE, [1, 1, 0]),
    rule(&["vmrs", "vmsr", "vmov *,*,"], Other, Alone, [1, 1, 3]),
    rule(&["vmov"], Other, Paired(None), [1, 1, 3]),
    // Double precision is not pipelined; how long it takes depends on the numbers.
    rule(&["vdiv.f64", "vsqrt.f64"], Division, Alone, [30, 30, 33]),
    rule(&["vdiv"], Division, Alone, [16, 16, 19]),
    rule(&["vsqrt"], Division, Alone, [14, 16, 19]),
    rule(&["vmla.f64", "vmls.f64", "vnmla.f64", "vnmls.f64", "vfma.f64", "vfms.f64", "vfnma.f64", "vfnms.f64"], Double, FLOAT, [5, 10, 12]),
    rule(&["vmul.f64", "vnmul.f64"], Double, FLOAT, [4, 5, 7]),
    rule(&["v*.f64"], Double, FLOAT, [1, 3, 5]),
    rule(&["vmla", "vmls", "vnmla", "vnmls", "vfma", "vfms", "vfnma", "vfnms"], Single, FLOAT, [1, 1, 6]),
    rule(&["v"], Single, FLOAT, [1, 1, 3]),
    // Memory. A byte or a half is merged into its word, which takes four cycles where many are stored one after the other.
    rule(&["tbb", "tbh"], Branch, Alone, [2, 2, 0]),
    rule(&["ldm", "pop"], Load, List, [0, 0, 2]),
    rule(&["stm", "push"], Store, List, [0, 1, 0]),
    rule(&["ldrd"], Load, Alone, [1, 1, 2]),
    rule(&["strd"], Store, Alone, [1, 1, 0]),
    rule(&["ldr"], Load, Paired(None), [1, 1, 2]),
    rule(&["strb", "strh"], Store, STORE, [1, 4, 0]),
    rule(&["str"], Store, STORE, [1, 1, 0]),
    // Halves and bytes.
    rule(&["smlad", "smlsd", "smuad", "smusd", "smlald", "smlsld"], Simd, MULTIPLIER, [1, 1, 2]),
    rule(&["*add16", "*sub16", "*add8", "*sub8", "*asx", "*sax", "*sat16", "*xtb16", "*xtab16", "pkh", "sel", "usad"], Simd, FIELDS, [1, 1, 2]),
    // Integers.
    rule(&["sdiv", "udiv"], Division, Alone, [2, 12, 12]),
    rule(&["mul", "mla", "mls", "smul", "smla", "smml", "smmul", "smlsl", "umul", "umla", "umaal"], Other, MULTIPLIER, [1, 1, 2]),
    rule(&["sxt", "uxt", "bfi", "bfc", "sbfx", "ubfx", "rbit", "rev", "clz", "ssat", "usat", "qadd", "qsub", "qd"], Other, FIELDS, [1, 1, 2]),
    rule(&["mrs", "msr", "dmb", "dsb", "isb", "bkpt", "svc", "wf"], Other, Alone, [1, 3, 3]),
    rule(&["bic"], Other, Paired(None), [1, 1, 1]),
    rule(&["b", "cbz", "cbnz"], Branch, Paired(Some(Unit::Branch)), [1, 1, 0]),
    rule(&[""], Other, Paired(None), [1, 1, 1]),
];

/// What an instruction needs and takes. Times are cycles.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Instruction {
    /// For the table.
    pub class: Class,
    /// What it holds, for `least` cycles.
    pub unit: Option<Unit>,
    /// It is issued alone: nothing goes beside it.
    pub is_alone: bool,
    /// Fewest cycles until the next one is issued.
    pub least: u32,
    /// Most cycles until the next one is issued.
    pub most: u32,
    /// Most cycles from its issue until what it writes may be read.
    pub latency: u32,
    /// Registers that it reads or writes: it waits for them all. Those of addresses and shifts are needed a cycle earlier.
    pub waits: Vec<(usize, bool)>,
    /// Registers that it writes.
    pub writes: Vec<usize>,
}

/// Reads a line of disassembly, such as `vldr s1, [r0, #8]`.
///
/// # Panics
/// Never: the last rule fits everything.
pub fn read(text: &str) -> Instruction {
    let text = text.trim().replacen(".w ", " ", 1);
    let operands = text.split_once(' ').map_or("", |(_, operands)| operands);
    let is = |names: &[&str]| names.iter().any(|name| fits(&text, name));
    let rule = RULES
        .iter()
        .find(|rule| is(rule.texts))
        .expect("the last one fits");
    let (unit, words) = match rule.issue {
        Paired(unit) => (unit, 0),
        Alone => (None, 0),
        List => (None, words(operands).div_ceil(2)),
    };
    let mut read = Instruction {
        class: rule.class,
        unit,
        is_alone: !matches!(rule.issue, Paired(_)),
        least: rule.cycles[0] + words,
        most: rule.cycles[1] + words,
        latency: rule.cycles[2] + words,
        waits: Vec::new(),
        writes: Vec::new(),
    };
    let is_shifted = is(&["* lsl", "* lsr", "* asr", "* ror"]);
    let mut is_address = false;
    for word in operands.split_inclusive([' ', ',', '[', ']', '{', '}', '!']) {
        let name = word.trim_end_matches([' ', ',', '[', ']', '{', '}', '!']);
        let is_early = is_address || is_shifted;
        read.waits
            .extend(registers(name).map(|register| (register, is_early)));
        is_address = word.ends_with('[') || is_address && !word.ends_with(']');
    }
    let written = match read.class {
        Store | Branch => 0,
        _ if is(&["cmp", "cmn", "tst", "teq", "vcmp"]) => 0,
        Load if matches!(rule.issue, List) => usize::MAX,
        _ if is(&["ldrd", "vmov *,*,", "*mull", "*mlal", "umaal", "smlsl", "smlsld"]) => 2,
        _ => 1,
    };
    let written = operands.split(',').take(written);
    read.writes
        .extend(written.flat_map(|operand| registers(operand.trim_matches([' ', '{', '}', '!']))));
    if is(&["vcmp"]) {
        read.writes.push(FLAGS);
    }
    // A multiplication with accumulation keeps the adder and the ports of the registers until its sum is there.
    if rule.class == Single && rule.cycles[2] == 6 {
        read.writes.push(ADDER);
    }
    if is(&["vadd", "vsub", "vldm", "vstm", "vldr", "vstr", "vmov"]) {
        read.waits.push((ADDER, false));
    }
    read
}

/// Whether a text begins as a rule says.
fn fits(text: &str, rule: &str) -> bool {
    let mut parts = rule.split('*');
    let Some(mut rest) = parts.next().and_then(|first| text.strip_prefix(first)) else {
        return false;
    };
    parts.all(|part| match rest.split_once(part) {
        Some((_, after)) => {
            rest = after;
            true
        }
        None => false,
    })
}

/// The numbers of a register by its name; none for anything else.
fn registers(name: &str) -> Range<usize> {
    let number = |prefix: char| name.strip_prefix(prefix)?.parse::<usize>().ok();
    let aliases = ["sb", "sl", "fp", "ip", "sp", "lr", "pc"];
    let (first, count) = match (number('r'), number('s'), number('d')) {
        (Some(register @ ..16), ..) => (register, 1),
        (_, Some(register @ ..32), _) => (FLOATS + register, 1),
        (.., Some(register @ ..16)) => (FLOATS + 2 * register, 2),
        _ if name == "fpscr" => (FLAGS, 1),
        _ => aliases
            .iter()
            .position(|alias| *alias == name)
            .map_or((0, 0), |alias| (9 + alias, 1)),
    };
    first..first + count
}

/// Words of the registers in a list.
fn words(operands: &str) -> u32 {
    let list = operands.split('{').nth(1).unwrap_or_default();
    list.split(['}', ',', ' '])
        .map(|name| registers(name).len() as u32)
        .sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn instructions_are_told_apart() {
        for (text, class) in [
            ("ldrsh.w r0, [r1, #2]", Load),
            ("pop.w {r4, r5, pc}", Load),
            ("vldr d16, [sp, #8]", Load),
            ("vpush {d8, d9}", Store),
            ("strd r0, r1, [sp]", Store),
            ("vcvt.f64.s32 d0, s1", Double),
            ("vadd.f32 s0, s1, s2", Single),
            ("vsqrt.f64 d0, d1", Division),
            ("udiv r0, r1, r2", Division),
            ("bls #0x1234", Branch),
            ("cbnz r0, #0x1234", Branch),
            ("tbh [pc, r0, lsl #1]", Branch),
            ("qasx r0, r1, r2", Simd),
            ("smlsdx r0, r1, r2, r3", Simd),
            ("pkhtb r0, r1, r2, asr #16", Simd),
            ("bic r0, r1, r2", Other),
            ("bfi r0, r1, #4, #8", Other),
            ("smull r0, r1, r2, r3", Other),
            ("it eq", Other),
        ] {
            assert_eq!(read(text).class, class, "{text}");
        }
    }

    #[test]
    fn registers_are_read_off() {
        let load = read("ldrd r0, r1, [r2, #8]");
        assert_eq!(load.writes, [0, 1]);
        assert_eq!(load.waits, [(0, false), (1, false), (2, true)]);
        assert_eq!(read("vmul.f64 d1, d2, d3").writes, [18, 19]);
        assert!(read("str r0, [r1], #4").writes.is_empty());
        assert_eq!(read("ldm.w sp!, {r4, lr}").writes, [13, 4, 14]);
        assert_eq!(read("vldm r0!, {d8, d9, d10}").least, 3);
        assert_eq!(read("pop {r4, r5, pc}").least, 2);
        assert_eq!(read("add r0, r1, r2, lsl #3").waits[1], (1, true));
        assert_eq!(read("vcmp.f64 d0, d1").writes, [FLAGS]);
    }
}
