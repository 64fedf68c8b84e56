//! Finds out whether the target runs the kernels in assembly (`src/kernels/simd`). Stable compilers tell neither `cfg` nor build
//! scripts what an ARM processor has (`target_feature` is empty for every thumb target), so what the kernels need is
//! assembled once, with the target and the flags of this build.

use std::error::Error;
use std::path::Path;
use std::process::{Command, Stdio};
use std::{env, fs};

/// The kernels: the DSP instructions, and single-precision registers that hold words.
const DSP_KERNELS: &str = "#![no_std]
#[unsafe(no_mangle)]
pub extern \"C\" fn probe() {
    unsafe { core::arch::asm!(\"smlad r0, r0, r0, r0\", \"vmov s0, s1, r0, r0\", \"vsqrt.f32 s0, s0\",
        out(\"r0\") _, out(\"s0\") _, out(\"s1\") _) }
}";
/// Floats as operands of assembly: the compiler grants them to processors with double precision only.
const FLOAT_OPERANDS: &str = "#![no_std]
#[unsafe(no_mangle)]
pub extern \"C\" fn probe(x: f32) -> f32 {
    let root;
    unsafe { core::arch::asm!(\"vsqrt.f32 {}, {}\", lateout(sreg) root, in(sreg) x) }
    root
}";

fn main() -> Result<(), Box<dyn Error>> {
    println!("cargo::rerun-if-changed=build.rs");
    println!("cargo::rustc-check-cfg=cfg(dsp_kernels)");
    println!("cargo::rustc-check-cfg=cfg(float_operands)");
    // Cortex-M, with an ABI by which the start-up code turns the floating-point unit on.
    let is_chip = env::var("TARGET")?.starts_with("thumb") && env::var("CARGO_CFG_TARGET_ABI")? == "eabihf";
    if is_chip && assembles(DSP_KERNELS)? {
        println!("cargo::rustc-cfg=dsp_kernels");
        if assembles(FLOAT_OPERANDS)? {
            println!("cargo::rustc-cfg=float_operands");
        }
    }
    Ok(())
}

/// Whether a crate compiles for the target. What the compiler has against it is of no interest.
fn assembles(source: &str) -> Result<bool, Box<dyn Error>> {
    let out = env::var("OUT_DIR")?;
    let file = Path::new(&out).join("probe.rs");
    fs::write(&file, source)?;
    let flags = env::var("CARGO_ENCODED_RUSTFLAGS")?;
    let status = Command::new(env::var("RUSTC")?)
        .args(["--edition=2024", "--crate-type=lib", "--emit=obj"])
        .args(["--target", &env::var("TARGET")?, "--out-dir", &out])
        .args(flags.split('\x1f').filter(|flag| !flag.is_empty()))
        .arg(&file)
        .stderr(Stdio::null())
        .status()?;
    Ok(status.success())
}
