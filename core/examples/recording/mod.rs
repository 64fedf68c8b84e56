//! Reads a sweep that `cslam synth` or a radio wrote as SigMF (docs/formats.md, "Recordings of samples").

use std::error::Error;

use cslam_core::profile::Samples;
use cslam_core::signal::Iq;

/// What was heard of one transmit beam.
pub(crate) struct Beam {
    /// Transmit beam.
    pub(crate) beam: u16,
    /// Amplitude = integer x 2^exponent, in this beam.
    pub(crate) exponent: i32,
    /// Samples by channel and sample.
    pub(crate) samples: Box<Samples>,
}

/// The beams of NAME.sigmf-meta, as they were recorded. Looks for two keys and believes the rest: a program of your own reads the JSON.
pub(crate) fn read(meta: &str) -> Result<Vec<Beam>, Box<dyn Error>> {
    let data = std::fs::read(meta.replace(".sigmf-meta", ".sigmf-data"))?;
    let text = std::fs::read_to_string(meta)?;
    let number = |text: &str| -> Result<i32, Box<dyn Error>> {
        let end = text.find([',', '}', '\n']).unwrap_or(text.len());
        Ok(text[..end].trim().parse()?)
    };
    let (beams, exponents) = (text.split("\"cslam:beam\":"), text.split("\"cslam:exponent\":"));
    let captures = beams.zip(exponents).skip(1).zip(data.chunks_exact(32 * 512 * 4));
    captures
        .map(|((beam, exponent), bytes)| {
            let mut samples = Box::new([[Iq::ZERO; 512]; 32]);
            // The file interleaves the channels sample by sample; the receiver wants one channel after the other.
            for (index, word) in bytes.as_chunks::<4>().0.iter().enumerate() {
                samples[index % 32][index / 32] = Iq::from_word(u32::from_le_bytes(*word));
            }
            Ok(Beam {
                beam: u16::try_from(number(beam)?)?,
                exponent: number(exponent)?,
                samples,
            })
        })
        .collect()
}
