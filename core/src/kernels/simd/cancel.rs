//! Instruction text of `cancel`: one turn is one tap of one channel.
//!
//! r9 amplitudes, r10 taps, r11 powers; r12 and lr the first phase `w` and `j w`, r6 and r7 the second one's; r8 half an LSB,
//! r0 turns left; r1, r2 amplitude, r3, r4 model, r5 old tap.

/// r3, r4 = half + amplitude times the first phase.
macro_rules! one_model {
    () => {
        "ldrd r1, r2, [r9], #8
         smlawb r3, r1, r12, r8
         smlawt r4, r1, r12, r8
         smlawb r3, r2, lr, r3
         smlawt r4, r2, lr, r4"
    };
}

/// The same for two models.
macro_rules! two_models {
    () => {
        concat!(
            one_model!(),
            "
             ldrd r1, r2, [r9], #8
             smlawb r3, r1, r6, r3
             smlawt r4, r1, r6, r4
             smlawb r3, r2, r7, r3
             smlawt r4, r2, r7, r4"
        )
    };
}

/// The whole loop. `$operation` combines tap and model. SSAT shifts by [`FRACTION_BITS`](crate::kernels::stages) - 1 bits.
macro_rules! cancel_loop {
    ($model:expr, $operation:literal, $count:expr, $taps:expr, $powers:expr, $columns:expr, $first:expr, $second:expr) => {{
        let count = $count;
        if count > 0 {
            let phases = [$first.word(), turned($first).word(), $second.word(), turned($second).word()];
            // SAFETY: each of `count` turns reads and writes one word of the taps and one double word of the powers, and reads
            // as many amplitudes as there are models, in order: `count` is no more than each slice holds. Four words are
            // read from `phases`. Registers are declared or restored, the stack pointer is back at the end.
            unsafe {
                asm!(
                    "push {{r6, r7}}
                     ldm r8, {{r12, lr}}
                     ldrd r6, r7, [r8, #8]
                     mov r8, #64
                     2:",
                    $model,
                    "ssat r3, #16, r3, asr #7
                     ssat r4, #16, r4, asr #7
                     ldr r5, [r10]
                     pkhbt r3, r3, r4, lsl #16",
                    concat!($operation, " r4, r5, r3"),
                    "ldrd r1, r2, [r11]
                     smuad r5, r5, r5
                     str r4, [r10], #4
                     smlald r1, r2, r4, r4
                     subs r1, r1, r5
                     sbc r2, r2, #0
                     subs r0, r0, #1
                     strd r1, r2, [r11], #8
                     bne 2b
                     pop {{r6, r7}}",
                    inout("r0") count => _,
                    inout("r8") phases.as_ptr() => _,
                    inout("r9") $columns.as_ptr() => _,
                    inout("r10") $taps.as_mut_ptr() => _,
                    inout("r11") $powers.as_mut_ptr() => _,
                    out("r1") _, out("r2") _, out("r3") _, out("r4") _, out("r5") _, out("r12") _, out("lr") _,
                );
            }
        }
    }};
}
