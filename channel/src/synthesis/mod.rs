//! The radio channel and the receiver's front end: from propagation paths to the int16 blocks of every transmit beam.
//!
//! ```text
//! paths::Link + Instant --rays--> Ray --transmit--> gain of each beam   \
//!                              \--waves--> delayed waveform per array    > mix -> + noise -> AGC, ADC -> Block
//! ```
//! The model. A ray of complex amplitude `a`, delay `tau`, arrival `u` and departure `v` gives channel (j, i) in beam m
//!
//! `y[n] = sqrt(P/L) a F_m(v) A_j(u) exp(j pi n_i axis_j.u) s(n/fs - tau + p_j.u/c) exp(-j 2 pi fc (tau - p_j.u/c))`
//!
//! with `F_m` the codeword's field with its element pattern, `A_j` the element pattern of array j, `s` the cyclic
//! waveform of mean power one, `P` the transmit power and `L` the implementation loss. Amplitudes are in sqrt(W).
//!
//! **Antennas.** The gain of the paths format holds a vertical half-wave dipole at both ends. Both are divided out. At the
//! GMT, the element pattern (again a dipole, times its face) of the sending face takes its place. At the UAV, the wave is
//! a field along the world's zenith tangent; the body's dipole receives its projection on the body's zenith tangent, times
//! the body's pattern. A cross-polarised part, which the format does not carry, is not heard.
//!
//! **Structure.** What depends on the beam is one number per ray (two with delay errors), what depends on the element is
//! one number per ray and array, and the waveforms are the same for all beams: a beam costs one product (channels x rays) x
//! (rays x 512) and its noise. Phases are made in `f64` with libm, samples in `f32` with plain products: the same bits on
//! every machine and for every number of threads.
//!
//! **Any radio.** How many arrays, elements and channels the UAV has, types say, since the products are made for them; all else of a
//! radio is a value ([`Radio`]). The default is the default radio's.
//!
//! **Own antennas.** The arrays, beams and squint symbols are those of `antenna`, not the receiver's. What measured hardware
//! has beyond the formula above is in `effects`, each off by default: errors and coupling of the elements, squint inside an
//! array, airframe and rotors, amplifier, oscillators, mixers and converters, neighbours in the band.
//!
//! **Not modelled**: cross polarisation, jitter of the converters, squint inside an array for a jammer's signal.

mod adc;
mod air;
mod antenna;
mod bank;
pub mod bench;
mod body;
mod calibration;
mod codebook;
mod config;
mod effects;
mod gains;
mod hardware;
mod impairments;
mod interfering;
mod jamming;
mod lanes;
mod mix;
mod noise;
mod order;
mod pieces;
mod radio;
mod rays;
mod reception;
mod simulator;
pub mod spectrum;
pub mod squint;
mod squint_field;
mod streams;
mod sweep;
mod transmit;
mod waves;

#[cfg(test)]
mod converter_tests;
#[cfg(test)]
mod golden_tests;
#[cfg(test)]
mod hardware_tests;
#[cfg(test)]
mod impairment_tests;
#[cfg(test)]
mod probe;
#[cfg(test)]
mod tests;

pub use antenna::squint::SquintSymbol;
pub use calibration::Calibration;
pub use codebook::Codebook;
pub use config::{ChannelConfig, FrontEndConfig, MotionConfig};
pub use effects::amplifier::Amplifier;
pub use effects::interference::Interference;
pub use hardware::{AirframeEffects, GmtArrayErrors, Oscillators, ReceiverErrors, UavArrayErrors};
pub use impairments::{Impairments, Jammer, JammerKind};
pub use noise::Gaussian;
pub use order::strongest_first;
pub use radio::{GmtCounts, Radio};
pub use rays::{Instant, Ray, RayError};
pub use simulator::{Block, Simulator, Sweep};

pub use cslam_core::array::SquintScheme;

/// Complex number of the phase computations.
pub(crate) type C64 = nalgebra::Complex<f64>;
