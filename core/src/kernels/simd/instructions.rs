//! Instruction text of the transform's kernels: what several of them do, as macros that give string literals.
//! No code of its own. Long: one vocabulary, whose words share their registers.
//!
//! Registers: r0..r3 data, r4..r6 factors, r8 temporary, r9 from, r10 to, r11 table, r12 rounding, lr ones, r7 loop.

/// Start of a kernel: saves what `asm!` may not name, takes the loop count from r0, clears Q.
macro_rules! enter {
    () => {
        "push {{r6, r7}}
         mov r7, r0
         mov r0, #0
         msr apsr_nzcvq, r0"
    };
}

/// End of a kernel: r0 = flags.
macro_rules! leave {
    () => {
        "mrs r0, apsr\npop {{r6, r7}}"
    };
}

/// `x = x w / 2`.
macro_rules! product {
    ($x:literal, $w:literal) => {
        concat!(
            "smladx r8, ",
            $x,
            ", ",
            $w,
            ", r12\n",
            "smlsd ",
            $x,
            ", ",
            $x,
            ", ",
            $w,
            ", r12\n",
            "pkhtb ",
            $x,
            ", r8, ",
            $x,
            ", asr #16\n",
        )
    };
}

/// `x = x conj(w) / 2`, with a temporary.
macro_rules! product_conj {
    ($x:literal, $w:literal, $t:literal) => {
        concat!(
            "smlad ",
            $t,
            ", ",
            $x,
            ", ",
            $w,
            ", r12\n",
            "smlsdx ",
            $x,
            ", ",
            $w,
            ", ",
            $x,
            ", r12\n",
            "pkhtb ",
            $x,
            ", ",
            $x,
            ", ",
            $t,
            ", asr #16\n",
        )
    };
}

/// `x = x w`, w in r11, rounding in r12, with a temporary.
macro_rules! full_product {
    ($x:literal, $t:literal) => {
        concat!(
            "smladx ",
            $t,
            ", ",
            $x,
            ", r11, r12\n",
            "smlsd ",
            $x,
            ", ",
            $x,
            ", r11, r12\n",
            "ssat ",
            $t,
            ", #16, ",
            $t,
            ", asr #15\n",
            "ssat ",
            $x,
            ", #16, ",
            $x,
            ", asr #15\n",
            "pkhbt ",
            $x,
            ", ",
            $x,
            ", ",
            $t,
            ", lsl #16\n",
        )
    };
}

/// Twiddled four-point transform of r0..r3.
macro_rules! butterfly {
    () => {
        concat!(
            product!("r1", "r4"),
            product!("r2", "r5"),
            product!("r3", "r6"),
            "shadd16 r0, r0, lr
             qadd16 r8, r0, r2
             qsub16 r0, r0, r2
             qadd16 r2, r1, r3
             qsub16 r3, r1, r3
             qsax r1, r0, r3
             qasx r3, r0, r3
             qadd16 r0, r8, r2
             qsub16 r2, r8, r2\n",
        )
    };
}

/// Inverse four-point transform of r0..r3, before its twiddles; the instructions for its first sums and differences.
macro_rules! inverse_sums {
    ($add:literal, $sub:literal) => {
        concat!(
            concat!($add, " r8, r0, r2\n", $sub, " r0, r0, r2\n"),
            concat!($add, " r2, r1, r3\n", $sub, " r3, r1, r3\n"),
            "qasx r1, r0, r3
             qsax r3, r0, r3
             qadd16 r0, r8, r2
             qsub16 r2, r8, r2\n",
        )
    };
}

/// Conjugate twiddles of r0..r3.
macro_rules! inverse_twiddles {
    () => {
        concat!(
            "shadd16 r0, r0, lr\n",
            product_conj!("r1", "r4", "r8"),
            product_conj!("r2", "r5", "r8"),
            product_conj!("r3", "r6", "r8"),
        )
    };
}

/// Repeats instructions. Not by `.rept`: the compiler takes the size of a block from its lines.
macro_rules! repeat_4 {
    ($x:expr) => {
        concat!($x, $x, $x, $x)
    };
}

macro_rules! repeat_8 {
    ($x:expr) => {
        concat!(repeat_4!($x), repeat_4!($x))
    };
}

/// Sets Q when a lane of r0..r3 exceeds half the range.
macro_rules! probe {
    () => {
        "ssat16 r8, #15, r0
         ssat16 r8, #15, r1
         ssat16 r8, #15, r2
         ssat16 r8, #15, r3\n"
    };
}

/// Loads or stores one word at a byte offset.
macro_rules! word {
    ($operation:literal, $x:literal, $base:literal, $offset:literal) => {
        concat!($operation, " ", $x, ", [", $base, ", #", $offset, "]\n")
    };
}

/// A forward butterfly from a row to a column: byte offsets of its four results.
macro_rules! row_to_column {
    ($a:literal, $b:literal, $c:literal, $d:literal) => {
        concat!(
            "ldmia r9!, {{r0, r1, r2, r3}}\n",
            butterfly!(),
            word!("str", "r0", "r10", $a),
            word!("str", "r1", "r10", $b),
            word!("str", "r2", "r10", $c),
            word!("str", "r3", "r10", $d),
            probe!(),
        )
    };
}

/// An inverse butterfly from a column to a row: byte offsets of its four inputs.
macro_rules! column_to_row {
    ($add:literal, $sub:literal, $a:literal, $b:literal, $c:literal, $d:literal) => {
        concat!(
            word!("ldr", "r0", "r9", $a),
            word!("ldr", "r1", "r9", $b),
            word!("ldr", "r2", "r9", $c),
            word!("ldr", "r3", "r9", $d),
            inverse_sums!($add, $sub),
            probe!(),
            inverse_twiddles!(),
            "stmia r10!, {{r0, r1, r2, r3}}\n",
        )
    };
}

/// First stage at one n: the odd pairs, then the even ones, with s and d, u and v as in `stages::first`.
macro_rules! first_step {
    () => {
        concat!(
            "ldr r0, [r9, #256]
             ldr r1, [r9, #1280]
             ldr r2, [r9, #768]
             ldr r3, [r9, #1792]
             shadd16 lr, r0, r1
             shsub16 r0, r0, r1
             shadd16 r1, r2, r3
             shsub16 r2, r2, r3
             shadd16 r3, lr, r1
             shsub16 lr, lr, r1
             shsax r1, r0, r2
             shasx r0, r0, r2\n",
            full_product!("r1", "r2"),
            full_product!("r0", "r2"),
            "ldr r4, [r9, #1024]
             ldr r5, [r9, #512]
             ldr r6, [r9, #1536]
             ldr r2, [r9], #4
             shadd16 r8, r2, r4
             shsub16 r2, r2, r4
             shadd16 r4, r5, r6
             shsub16 r5, r5, r6
             shadd16 r6, r8, r4
             shsub16 r8, r8, r4
             shsax r4, r2, r5
             shasx r2, r2, r5\n",
            "shsax r5, r8, lr
             shasx r8, r8, lr
             str r5, [r10, #256]
             str r8, [r10, #768]
             shadd16 r5, r4, r1
             shsub16 r4, r4, r1
             str r5, [r10, #1024]
             str r4, [r10, #1536]
             shsax r5, r2, r0
             shasx r2, r2, r0
             str r5, [r10, #1280]
             str r2, [r10, #1792]
             shadd16 r5, r6, r3
             shsub16 r6, r6, r3
             str r6, [r10, #512]
             str r5, [r10], #16\n"
        )
    };
}

/// First stage at one n, even bins.
macro_rules! first_folded_step {
    () => {
        concat!(
            "ldr r0, [r9, #256]
             ldr r1, [r9, #1280]
             ldr r2, [r9, #768]
             ldr r3, [r9, #1792]
             shadd16 r0, r0, r1
             shadd16 r2, r2, r3
             ldr r4, [r9, #1024]
             ldr r5, [r9, #512]
             ldr r6, [r9, #1536]
             ldr r1, [r9], #4
             shadd16 r3, r0, r2
             shsub16 r0, r0, r2
             shadd16 r1, r1, r4
             shadd16 r5, r5, r6
             shadd16 r2, r1, r5
             shsub16 r1, r1, r5
             shsax r4, r1, r0
             shasx r1, r1, r0
             str r4, [r10, #256]
             str r1, [r10, #768]
             shsub16 r4, r2, r3
             shadd16 r2, r2, r3
             str r4, [r10, #512]
             str r2, [r10], #16\n"
        )
    };
}

/// Final stage at one position, from r9: leaves g0..g3 in r6, r4, r8, r2 and h0..h3, turned by exp(j pi l / 4) but for
/// the factor j of l = 2, 3, in r3, r1, lr, r0. r5 is free; factor in r11, rounding in r12.
macro_rules! final_sums {
    () => {
        concat!(
            "ldr r0, [r9, #1024]
             ldr r1, [r9, #1536]
             ldr r2, [r9, #1280]
             ldr r3, [r9, #1792]
             shadd16 lr, r0, r1
             shsub16 r0, r0, r1
             shadd16 r1, r2, r3
             shsub16 r2, r2, r3
             qadd16 r3, lr, r1
             qsub16 lr, lr, r1
             qasx r1, r0, r2
             qsax r0, r0, r2\n",
            full_product!("r1", "r2"),
            full_product!("r0", "r2"),
            "ldr r4, [r9, #512]
             ldr r5, [r9, #256]
             ldr r6, [r9, #768]
             ldr r2, [r9], #4
             shadd16 r8, r2, r4
             shsub16 r2, r2, r4
             shadd16 r4, r5, r6
             shsub16 r5, r5, r6
             qadd16 r6, r8, r4
             qsub16 r8, r8, r4
             qasx r4, r2, r5
             qsax r2, r2, r5\n",
        )
    };
}

/// Adds the powers of two taps to the next two sums at r10.
macro_rules! add_powers {
    ($x:literal, $y:literal) => {
        concat!(
            "ldmia r10, {{r6, r7, r11, r12}}\n",
            "smlald r6, r7, ",
            $x,
            ", ",
            $x,
            "\n",
            "smlald r11, r12, ",
            $y,
            ", ",
            $y,
            "\n",
            "stmia r10!, {{r6, r7, r11, r12}}\n",
        )
    };
}

/// Stores two taps at byte offsets from a register and adds their powers.
macro_rules! put_taps {
    ($x:literal, $y:literal, $base:literal, $at:literal, $and:literal) => {
        concat!(
            word!("str", $x, $base, $at),
            word!("str", $y, $base, $and),
            add_powers!($x, $y),
        )
    };
}

/// The eight taps of one position, tap l stored at the l-th byte offset from the pointer in s4, and their powers. The pointer
/// in r9 waits in s3.
macro_rules! taps_step {
    ($l0:literal, $l1:literal, $l2:literal, $l3:literal, $l4:literal, $l5:literal, $l6:literal, $l7:literal) => {
        concat!(
            final_sums!(),
            "vmov s3, r9
             vmov r9, s4
             qadd16 r5, r6, r3
             qsub16 r3, r6, r3\n",
            put_taps!("r5", "r3", "r9", $l0, $l4),
            "qadd16 r5, r4, r1
             qsub16 r1, r4, r1\n",
            put_taps!("r5", "r1", "r9", $l1, $l5),
            "qasx r5, r8, lr
             qsax lr, r8, lr\n",
            put_taps!("r5", "lr", "r9", $l2, $l6),
            "qasx r5, r2, r0
             qsax r0, r2, r0\n",
            put_taps!("r5", "r0", "r9", $l3, $l7),
            "vmov r9, s3
             vmov r11, r12, s0, s1\n"
        )
    };
}

/// The four taps of one position, tap l stored at the l-th byte offset from r8, and their powers.
macro_rules! taps_folded_step {
    ($l0:literal, $l1:literal, $l2:literal, $l3:literal) => {
        concat!(
            "ldr r1, [r9, #512]
             ldr r2, [r9, #256]
             ldr r3, [r9, #768]
             ldr r0, [r9], #4
             shadd16 r4, r0, r1
             shsub16 r0, r0, r1
             shadd16 r1, r2, r3
             shsub16 r2, r2, r3
             qadd16 r3, r4, r1
             qsub16 r4, r4, r1
             qasx r1, r0, r2
             qsax r0, r0, r2\n",
            put_taps!("r3", "r4", "r8", $l0, $l2),
            put_taps!("r1", "r0", "r8", $l1, $l3)
        )
    };
}

/// Energy of eight words.
macro_rules! energy_step {
    () => {
        concat!(
            "ldmia r9!, {{r0, r1, r2, r3, r4, r5, r6, r8}}
             smlald r11, r12, r0, r0
             smlald r11, r12, r1, r1
             smlald r11, r12, r2, r2
             smlald r11, r12, r3, r3
             smlald r11, r12, r4, r4
             smlald r11, r12, r5, r5
             smlald r11, r12, r6, r6
             smlald r11, r12, r8, r8\n"
        )
    };
}
