//! Instruction text of a dense layer (`dense`), as macros that give string literals.
//!
//! Registers: r0..r3 sums of four rows, r4..r6 and r8 weights, r9 and r12 a quad of inputs, r10 inputs, r11 records,
//! r7 quads left, lr outputs.

/// A quad of inputs into four rows: 16 products, 8 instructions for them and 3 loads.
macro_rules! quad_step {
    () => {
        "ldmia r10!, {{r9, r12}}
         ldmia r11!, {{r4, r5, r6, r8}}
         smlad r0, r9, r4, r0
         smlad r1, r9, r6, r1
         smlad r0, r12, r5, r0
         smlad r1, r12, r8, r1
         ldmia r11!, {{r4, r5, r6, r8}}
         smlad r2, r9, r4, r2
         smlad r3, r9, r6, r3
         smlad r2, r12, r5, r2
         smlad r3, r12, r8, r3\n"
    };
}

/// Sums of four rows: the loop has two steps, and starts at the second where the number of quads is odd.
macro_rules! four_rows {
    () => {
        concat!(
            "ldmia r11!, {{r0, r1, r2, r3}}
             vmov r10, r7, s0, s1
             tst r7, #1
             bne 4f
             3:\n",
            quad_step!(),
            "4:\n",
            quad_step!(),
            "subs r7, r7, #2
             bgt 3b\n"
        )
    };
}

/// Requantises four sums, rectifies and stores them; the sums stay.
macro_rules! requantise_rows {
    () => {
        "ldmia r11!, {{r4, r5, r6, r8}}
         smmulr r4, r0, r4
         smmulr r5, r1, r5
         smmulr r6, r2, r6
         smmulr r8, r3, r8
         usat r4, #7, r4
         usat r5, #7, r5
         usat r6, #7, r6
         usat r8, #7, r8
         pkhbt r4, r4, r5, lsl #16
         pkhbt r5, r6, r8, lsl #16
         stmia lr!, {{r4, r5}}\n"
    };
}
