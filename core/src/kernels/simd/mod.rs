//! Hot loops in assembly for Thumb targets with the DSP instructions and a floating-point unit (`build.rs` finds out): the one
//! file of this crate with `unsafe`. Each has a portable twin that defines its result, and gives the same bits; it is safe to
//! call with any argument.
//!
//! The stages of `stages`: each kernel is one `asm!` block that runs a whole stage, so that registers, loops and the
//! sticky Q flag are its own.
//! What makes them short: a complex product with its rounding is three instructions (SMLSD or SMLAD, SMLADX or SMLSDX,
//! PKHTB); a factor of +-j costs nothing (QASX, QSAX); four neighbouring words move in one LDM or STM, which is why the
//! stages keep their data in the order of the next reader.
//!
//! Long: what is unsafe stands in one file.
//!
//! Strain (`stages::Pass`) is noticed by a probe on every sum that can clip: SSAT16 #15 sets the Q flag when a lane exceeds
//! half the range.
//!
//! The instruction text that kernels share is in `instructions.rs` and `columns.rs`, with the use of the registers. r6 and
//! r7 cannot be operands of `asm!`: each block saves them on the stack.
//!
//! Given: the instruction set.
#![allow(unsafe_code)]

use core::arch::asm;

use super::Iq;
use super::stages::{self, Channel, EIGHTH, FoldedChannel, FoldedPowers, MINUS_EIGHTH, Powers};
use crate::kernels::dense::{self, Quad, record_length};
use crate::kernels::stages::{Tail, Twiddles};

#[macro_use]
mod instructions;
#[macro_use]
mod columns;
#[macro_use]
mod layer;
#[macro_use]
mod cancel;

/// Half an LSB at bit 16.
const ROUND_16: u32 = 1 << 15;
/// Half an LSB at bit 15.
const ROUND_15: u32 = 1 << 14;
/// One in both lanes.
const ONES: u32 = 0x0001_0001;
/// Q, the sticky saturation flag of APSR.
const Q_FLAG: u32 = 1 << 27;

/// Runs a radix-4 stage: `count` turns of the loop in the template; r9 from, r10 to, r11 table. Gives the flags.
macro_rules! stage {
    ($count:expr, $input:expr, $out:expr, $table:expr, $($template:expr),+ $(,)?) => {{
        let flags: u32;
        asm!(
            enter!(),
            $($template,)+
            leave!(),
            inout("r0") $count => flags,
            inout("r9") $input => _,
            inout("r10") $out => _,
            inout("r11") $table => _,
            inout("r12") ROUND_16 => _,
            inout("lr") ONES => _,
            out("r1") _, out("r2") _, out("r3") _, out("r4") _, out("r5") _, out("r8") _,
        );
        flags
    }};
}

/// See `stages::second`.
#[inline(never)]
pub(crate) fn second(input: &Channel, out: &mut Channel, twiddles: &[Twiddles]) -> bool {
    let blocks = twiddles.len().min(8);
    if blocks == 0 {
        return false;
    }
    // SAFETY: each of at most 8 turns reads 64 words of `input`, writes 64 words of `out` and reads 3 of `twiddles`, in
    // order: at most 512 words of each channel and one entry of the slice per turn. Registers are declared or restored,
    // the stack pointer is back at the end.
    let flags = unsafe {
        stage!(
            blocks,
            input.as_ptr(),
            out.as_mut_ptr(),
            twiddles.as_ptr(),
            "2: ldmia r11!, {{r4, r5, r6}}",
            rows_to_columns!(),
            "add r10, r10, #256
             subs r7, r7, #1
             bne 2b",
        )
    };
    flags & Q_FLAG != 0
}

/// See `stages::third`.
#[inline(never)]
pub(crate) fn third(input: &Channel, out: &mut Channel, twiddles: &[Twiddles]) -> bool {
    let blocks = twiddles.len().min(32);
    if blocks == 0 {
        return false;
    }
    // SAFETY: as in `second`, with at most 32 turns of 16 words.
    let flags = unsafe {
        stage!(
            blocks,
            input.as_ptr(),
            out.as_mut_ptr(),
            twiddles.as_ptr(),
            "2: ldmia r11!, {{r4, r5, r6}}",
            row_to_column!("0", "16", "32", "48"),
            row_to_column!("4", "20", "36", "52"),
            row_to_column!("8", "24", "40", "56"),
            row_to_column!("12", "28", "44", "60"),
            "add r10, r10, #64
             subs r7, r7, #1
             bne 2b",
        )
    };
    flags & Q_FLAG != 0
}

/// See `stages::last`.
#[inline(never)]
pub(crate) fn last(input: &Channel, out: &mut Channel, tails: &[Tail]) -> bool {
    let blocks = tails.len().min(128);
    if blocks == 0 {
        return false;
    }
    // SAFETY: each of at most 128 turns reads 4 words of `input`, writes 4 words of `out` and reads one entry of `tails`
    // (28 bytes: 16 of waveform, 12 of twiddles).
    let flags = unsafe {
        stage!(
            blocks,
            input.as_ptr(),
            out.as_mut_ptr(),
            tails.as_ptr(),
            "2: ldmia r9!, {{r0, r1, r2, r3}}
             add r11, r11, #16
             ldmia r11!, {{r4, r5, r6}}",
            butterfly!(),
            probe!(),
            "stmia r10!, {{r0, r1, r2, r3}}
             subs r7, r7, #1
             bne 2b",
        )
    };
    flags & Q_FLAG != 0
}

/// See `stages::correlate`.
#[inline(never)]
pub(crate) fn correlate(input: &Channel, out: &mut Channel, tails: &[Tail]) -> bool {
    let blocks = tails.len().min(128);
    if blocks == 0 {
        return false;
    }
    // SAFETY: as in `last`; r11 runs 16 bytes ahead, at an entry's twiddles, and reads the waveform below it. The pointer
    // one past the last entry plus 16 bytes is formed by wrapping arithmetic and never read.
    let flags = unsafe {
        stage!(
            blocks,
            input.as_ptr(),
            out.as_mut_ptr(),
            tails.as_ptr().wrapping_byte_add(16),
            "2: ldmia r9!, {{r0, r1, r2, r3}}
             ldmia r11, {{r4, r5, r6}}",
            butterfly!(),
            probe!(),
            "ldmdb r11, {{r4, r5, r6}}",
            product_conj!("r1", "r4", "r8"),
            "ldr r8, [r11, #-16]",
            product_conj!("r0", "r8", "r4"),
            product_conj!("r2", "r5", "r8"),
            product_conj!("r3", "r6", "r8"),
            inverse_sums!("qadd16", "qsub16"),
            "ldmia r11, {{r4, r5, r6}}",
            probe!(),
            inverse_twiddles!(),
            "add r11, r11, #28
             subs r7, r7, #1
             stmia r10!, {{r0, r1, r2, r3}}
             bne 2b",
        )
    };
    flags & Q_FLAG != 0
}

/// See `stages::inverse_third`.
#[inline(never)]
pub(crate) fn inverse_third(input: &Channel, out: &mut Channel, twiddles: &[Twiddles]) -> bool {
    let blocks = twiddles.len().min(32);
    if blocks == 0 {
        return false;
    }
    // SAFETY: as in `third`.
    let flags = unsafe {
        stage!(
            blocks,
            input.as_ptr(),
            out.as_mut_ptr(),
            twiddles.as_ptr(),
            "2: ldmia r11!, {{r4, r5, r6}}",
            column_to_row!("qadd16", "qsub16", "0", "16", "32", "48"),
            column_to_row!("qadd16", "qsub16", "4", "20", "36", "52"),
            column_to_row!("qadd16", "qsub16", "8", "24", "40", "56"),
            column_to_row!("qadd16", "qsub16", "12", "28", "44", "60"),
            "add r9, r9, #64
             subs r7, r7, #1
             bne 2b",
        )
    };
    flags & Q_FLAG != 0
}

/// See `stages::inverse_second`.
#[inline(never)]
pub(crate) fn inverse_second(input: &Channel, out: &mut Channel, twiddles: &[Twiddles]) -> bool {
    let blocks = twiddles.len().min(8);
    if blocks == 0 {
        return false;
    }
    // SAFETY: as in `second`.
    let flags = unsafe {
        stage!(
            blocks,
            input.as_ptr(),
            out.as_mut_ptr(),
            twiddles.as_ptr(),
            "2: ldmia r11!, {{r4, r5, r6}}",
            columns_to_rows!(),
            "add r9, r9, #256
             subs r7, r7, #1
             bne 2b",
        )
    };
    flags & Q_FLAG != 0
}

/// See `stages::first`.
#[inline(never)]
pub(crate) fn first(input: &Channel, out: &mut Channel) -> bool {
    let flags: u32;
    // SAFETY: 64 steps, n = 0..64, read the words n + 64 l of `input` (offsets 256 l bytes) and write the words
    // 4 (n mod 16) + n / 16 + 64 l of `out`: to advances by 16 bytes a step and goes back 252 after 16 steps. Registers
    // are declared or restored, the stack pointer is back at the end.
    unsafe {
        asm!(
            enter!(),
            "2:",
            repeat_8!(first_step!()),
            "subs r7, r7, #1
             tst r7, #1
             bne 2b
             sub r10, r10, #252
             cmp r7, #0
             bne 2b",
            leave!(),
            inout("r0") 8 => flags,
            inout("r9") input.as_ptr() => _,
            inout("r10") out.as_mut_ptr() => _,
            inout("r11") EIGHTH.word() => _,
            inout("r12") ROUND_15 => _,
            out("r1") _, out("r2") _, out("r3") _, out("r4") _, out("r5") _, out("r8") _, out("lr") _,
        );
    }
    flags & Q_FLAG != 0
}

/// See `stages::first_folded`.
#[inline(never)]
pub(crate) fn first_folded(input: &Channel, out: &mut Channel) {
    // SAFETY: as in `first`, writing the words below 256 only.
    unsafe {
        asm!(
            "push {{r6, r7}}",
            "mov r7, #8",
            "2:",
            repeat_8!(first_folded_step!()),
            "subs r7, r7, #1
             tst r7, #1
             bne 2b
             sub r10, r10, #252
             cmp r7, #0
             bne 2b",
            "pop {{r6, r7}}",
            inout("r9") input.as_ptr() => _,
            inout("r10") out.as_mut_ptr() => _,
            out("r0") _, out("r1") _, out("r2") _, out("r3") _, out("r4") _, out("r5") _,
        );
    }
}

/// See `stages::taps`.
#[inline(never)]
pub(crate) fn taps(kept: &Channel, out: &mut Channel, powers: &mut Powers) {
    // SAFETY: 64 steps read the words position + 64 slot of `kept` and read and write the 8 sums of row `position` of
    // `powers`. Position = 16 a + 4 b + c in order goes to the words a + 4 b + 16 c + 64 l of `out`: four steps over c by
    // offset, then 16 bytes on for b, and 60 bytes back for a. The sums of at most 2^33 channels stay positive as signed
    // 64-bit numbers. Registers are declared or restored, the stack pointer is back at the end.
    unsafe {
        asm!(
            "push {{r6, r7}}",
            // The constants, the loop count and both pointers lie in s0..s4 while their registers hold data.
            "vmov s0, s1, r11, r12
             vmov s2, r0
             vmov s4, r1",
            "2:",
            taps_step!("0", "256", "512", "768", "1024", "1280", "1536", "1792"),
            taps_step!("64", "320", "576", "832", "1088", "1344", "1600", "1856"),
            taps_step!("128", "384", "640", "896", "1152", "1408", "1664", "1920"),
            taps_step!("192", "448", "704", "960", "1216", "1472", "1728", "1984"),
            "vmov r7, s4
             vmov r8, s2
             add r7, r7, #16
             subs r8, r8, #1
             tst r8, #3
             it eq
             subeq r7, r7, #60
             vmov s4, r7
             vmov s2, r8
             cmp r8, #0
             bne 2b",
            "pop {{r6, r7}}",
            inout("r0") 16 => _,
            inout("r1") out.as_mut_ptr() => _,
            inout("r9") kept.as_ptr() => _,
            inout("r10") powers.as_mut_ptr() => _,
            inout("r11") MINUS_EIGHTH.word() => _,
            inout("r12") ROUND_15 => _,
            out("r2") _, out("r3") _, out("r4") _, out("r5") _, out("r8") _, out("lr") _,
            out("s0") _, out("s1") _, out("s2") _, out("s3") _, out("s4") _,
        );
    }
}

/// See `stages::taps_folded`.
#[inline(never)]
pub(crate) fn taps_folded(kept: &Channel, out: &mut FoldedChannel, powers: &mut FoldedPowers) {
    // SAFETY: as in `taps`, with 4 slots, 4 sums a row and l below 4.
    unsafe {
        asm!(
            "push {{r6, r7}}",
            "2:",
            taps_folded_step!("0", "256", "512", "768"),
            taps_folded_step!("64", "320", "576", "832"),
            taps_folded_step!("128", "384", "640", "896"),
            taps_folded_step!("192", "448", "704", "960"),
            "add r8, r8, #16
             subs lr, lr, #1
             tst lr, #3
             it eq
             subeq r8, r8, #60
             cmp lr, #0
             bne 2b",
            "pop {{r6, r7}}",
            inout("lr") 16 => _,
            inout("r8") out.as_mut_ptr() => _,
            inout("r9") kept.as_ptr() => _,
            inout("r10") powers.as_mut_ptr() => _,
            out("r0") _, out("r1") _, out("r2") _, out("r3") _, out("r4") _, out("r11") _, out("r12") _,
        );
    }
}

/// See `stages::energy`.
#[inline(never)]
pub(crate) fn energy(input: &Channel) -> u64 {
    let (low, high): (u32, u32);
    // SAFETY: 32 turns of 16 words read all of `input`, which nothing writes. Registers are declared or restored, the
    // stack pointer is back at the end.
    unsafe {
        asm!(
            "push {{r6, r7}}",
            "mov r7, #32",
            "2:",
            energy_step!(),
            energy_step!(),
            "subs r7, r7, #1
             bne 2b",
            "pop {{r6, r7}}",
            inout("r9") input.as_ptr() => _,
            inout("r11") 0_u32 => low,
            inout("r12") 0_u32 => high,
            out("r0") _, out("r1") _, out("r2") _, out("r3") _, out("r4") _, out("r5") _, out("r8") _,
        );
    }
    (u64::from(high) << 32) | u64::from(low)
}

/// See `stages::cancel`. Sums of one or two models; more are rare and left to the portable form.
#[inline(never)]
pub(crate) fn cancel(taps: &mut [Iq], powers: &mut [u64], columns: &[[i32; 2]], phases: &[Iq], add: bool) {
    let count = taps.len().min(powers.len());
    match (phases, add) {
        ([w], false) => cancel_loop!(
            one_model!(),
            "qsub16",
            count.min(columns.len()),
            taps,
            powers,
            columns,
            w,
            w
        ),
        ([w], true) => cancel_loop!(
            one_model!(),
            "qadd16",
            count.min(columns.len()),
            taps,
            powers,
            columns,
            w,
            w
        ),
        ([w, v], false) => {
            cancel_loop!(
                two_models!(),
                "qsub16",
                count.min(columns.len() / 2),
                taps,
                powers,
                columns,
                w,
                v
            );
        }
        ([w, v], true) => {
            cancel_loop!(
                two_models!(),
                "qadd16",
                count.min(columns.len() / 2),
                taps,
                powers,
                columns,
                w,
                v
            );
        }
        _ => stages::cancel(taps, powers, columns, phases, add),
    }
}

/// `j w`. Parts within +-32 767.
fn turned(w: &Iq) -> Iq {
    Iq::new(-w.im(), w.re())
}

/// Square root, correctly rounded.
#[cfg(float_operands)]
#[inline(always)]
pub(crate) fn sqrt(x: f32) -> f32 {
    let root;
    // SAFETY: one instruction on registers.
    unsafe { asm!("vsqrt.f32 {}, {}", lateout(sreg) root, in(sreg) x, options(pure, nomem, nostack)) };
    root
}

/// Square root, correctly rounded, where `asm!` takes no float: by way of a core register.
#[cfg(not(float_operands))]
#[inline(always)]
pub(crate) fn sqrt(x: f32) -> f32 {
    let mut word = x.to_bits();
    // SAFETY: three instructions on registers; s0 is declared.
    unsafe {
        asm!(
            "vmov s0, {0}
             vsqrt.f32 s0, s0
             vmov {0}, s0",
            inout(reg) word,
            out("s0") _,
            options(pure, nomem, nostack)
        );
    }
    f32::from_bits(word)
}

/// See `dense::dense`.
#[inline(never)]
pub(crate) fn dense(records: &[u8], input: &[Quad], output: &mut [Quad]) -> [i32; 4] {
    let groups = output.len().min(records.len() / record_length(input.len()));
    if groups == 0 || input.is_empty() || !records.as_ptr().addr().is_multiple_of(4) {
        return dense::dense(records, input, output);
    }
    let mut sums = [0; 4];
    let [r0, r1, r2, r3] = &mut sums;
    // SAFETY: each of `groups` turns reads one record (16 bytes, 32 for each quad of `input`, 16 bytes) at a multiple of
    // four bytes, all of `input` and writes one quad of `output`. Registers are declared or restored, the stack pointer is
    // back at the end.
    unsafe {
        asm!(
            "push {{r6, r7}}
             vmov s0, s1, r10, r0
             vmov s2, r1
             2:",
            four_rows!(),
            requantise_rows!(),
            "vmov r4, s2
             cmp lr, r4
             bne 2b
             pop {{r6, r7}}",
            inout("r0") input.len() => *r0,
            inout("r1") output.as_ptr().wrapping_add(groups) => *r1,
            out("r2") *r2,
            out("r3") *r3,
            inout("r10") input.as_ptr() => _,
            inout("r11") records.as_ptr() => _,
            inout("lr") output.as_mut_ptr() => _,
            out("r4") _, out("r5") _, out("r8") _, out("r9") _, out("r12") _,
            out("s0") _, out("s1") _, out("s2") _,
        );
    }
    sums
}
