//! The words between GMT and UAV on their way through the air: which beacons arrive, and what two-way timing makes of the paths.
//!
//! A beacon goes out in one transmit beam, the best one of the last beacon that was answered; when [`SCAN_AFTER`] in a row were not, it
//! goes out in all beams, one after the other. It arrives when its strongest path there leaves enough over the noise. An exchange of
//! two-way timing goes through the same beam. Each end stamps the first path that it sees over its threshold; half the difference of
//! what the two see beyond the length that they share is the error of the clock offset.

use core::f64::consts::TAU;

use cslam_core::constants::{BOLTZMANN_J_PER_K, NOISE_TEMPERATURE_K, SPEED_OF_LIGHT_M_PER_S};

use crate::seeded::{Seeded, Source};

/// Unanswered beacons after which the GMT tries all its beams.
const SCAN_AFTER: u32 = 3;
/// Bandwidth of the words, Hz: QPSK of rate 1/2.
const WORD_BANDWIDTH_HZ: f64 = 1e6;
/// What they need over the noise, dB.
const WORD_SNR_DB: f64 = 3.0;
/// Standard deviation of what is not known about that, dB.
const MARGIN_SIGMA_DB: f64 = 4.0;
/// What one array of eight elements adds to an isotropic antenna, dB.
const ARRAY_GAIN_DB: f64 = 9.0;
/// Bandwidth of the stamped symbols, Hz, and what correlation over their 416 subcarriers adds, dB.
const STAMP_BANDWIDTH_HZ: f64 = 199.68e6;
const CORRELATION_GAIN_DB: f64 = 26.2;
/// An end sees paths down to so much under the strongest, dB, give or take its own noise.
const STAMP_RANGE_DB: f64 = 34.0;
const STAMP_RANGE_SIGMA_DB: f64 = 1.0;
/// Paths closer than this pull on each other, m; a path as strong as the stamped one by this much (standard deviation).
const RESOLUTION_M: f64 = 1.2;
const PULL_M: f64 = 0.3;

/// A path as words meet it.
#[derive(Clone, Debug, PartialEq)]
pub struct WordPath {
    /// Delay, s.
    pub delay_s: f64,
    /// Power gain from the input of each transmit beam to an isotropic antenna at the UAV.
    pub beam_gain: Vec<f64>,
}

/// The paths at one instant.
pub type WordLink = Vec<WordPath>;

/// What both ends send and hear with.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WordRadio {
    /// Power less all losses, dBm.
    pub transmit_dbm: f64,
    /// Over thermal noise, dB.
    pub noise_figure_db: f64,
}

impl WordRadio {
    /// Signal over noise of a power gain in a bandwidth, dB.
    fn snr_db(&self, gain: f64, bandwidth_hz: f64) -> f64 {
        let noise_dbm = 30.0 + decibels(BOLTZMANN_J_PER_K * NOISE_TEMPERATURE_K * bandwidth_hz);
        self.transmit_dbm + decibels(gain) + ARRAY_GAIN_DB - noise_dbm - self.noise_figure_db
    }
}

/// What became of the words of a flight.
#[derive(Clone, Debug, PartialEq)]
pub struct OverAir {
    /// Whether the beacon after each sweep arrives.
    pub(super) beacons: Vec<bool>,
    /// What the air adds to the clock offset of each exchange, s; `None` when it fails.
    pub(super) exchanges: Vec<Option<f64>>,
}

impl OverAir {
    /// The words of a flight of `seed`: links at its beacons and at its exchanges, with the time of each, both in order.
    pub fn new(
        radio: &WordRadio,
        beacons: &[(f64, WordLink)],
        exchanges: &[(f64, WordLink)],
        seed: u64,
    ) -> Self {
        let mut draws = [Source::BeaconAir, Source::TimingAir].map(|source| Seeded::new(seed, source));
        let mut gmt = Beams::default();
        let mut arrived = Vec::with_capacity(beacons.len());
        let mut stamped = Vec::with_capacity(exchanges.len());
        for (time_s, link) in beacons {
            while let Some((_, link)) = exchanges.get(stamped.len()).filter(|(at_s, _)| at_s < time_s) {
                stamped.push(exchange(radio, &gmt, link, &mut draws[1]));
            }
            arrived.push(gmt.beacon(radio, link, &mut draws[0]));
        }
        for (_, link) in &exchanges[stamped.len()..] {
            stamped.push(exchange(radio, &gmt, link, &mut draws[1]));
        }
        Self {
            beacons: arrived,
            exchanges: stamped,
        }
    }
}

/// Which beam the GMT's words go out in.
#[derive(Clone, Debug, Default)]
struct Beams {
    answered: Option<usize>,
    unanswered: u32,
}

impl Beams {
    /// The beam for a link: the one that was answered last, or when that is long ago the best.
    fn of(&self, link: &WordLink) -> Option<usize> {
        match self.answered {
            Some(beam) if self.unanswered < SCAN_AFTER => Some(beam),
            _ => best_beam(link),
        }
    }

    /// Sends a beacon; whether it arrives.
    fn beacon(&mut self, radio: &WordRadio, link: &WordLink, draw: &mut Seeded) -> bool {
        let arrives = arrives(radio, link, self.of(link), draw);
        if arrives {
            self.answered = best_beam(link);
            self.unanswered = 0;
        } else {
            self.unanswered = self.unanswered.saturating_add(1);
        }
        arrives
    }
}

/// The beam in which a path is strongest; `None` without a path.
fn best_beam(link: &WordLink) -> Option<usize> {
    let beams = link.iter().flat_map(|path| path.beam_gain.iter().enumerate());
    beams.max_by(|a, b| a.1.total_cmp(b.1)).map(|(beam, _)| beam)
}

/// Greatest gain of a path in a beam.
fn strongest(link: &WordLink, beam: usize) -> f64 {
    let gains = link.iter().filter_map(|path| path.beam_gain.get(beam));
    gains.copied().fold(0.0, f64::max)
}

/// Whether a word is understood that goes out in a beam.
fn arrives(radio: &WordRadio, link: &WordLink, beam: Option<usize>, draw: &mut Seeded) -> bool {
    let margin_db = MARGIN_SIGMA_DB * draw.normal();
    let gain = beam.map_or(0.0, |beam| strongest(link, beam));
    gain > 0.0 && radio.snr_db(gain, WORD_BANDWIDTH_HZ) + margin_db > WORD_SNR_DB
}

/// What an exchange adds to the clock offset, s; `None` when a word of it is lost.
fn exchange(radio: &WordRadio, gmt: &Beams, link: &WordLink, draw: &mut Seeded) -> Option<f64> {
    let beam = gmt.of(link);
    let arrives = arrives(radio, link, beam, draw);
    let ends = [0, 1].map(|_| stamp_s(radio, link, beam, draw));
    let [down_s, up_s] = ends;
    // The UAV's stamp is late by what its end saw later than the GMT's did.
    arrives.then_some(0.5 * (down_s? - up_s?))
}

/// Delay that one end stamps, s.
fn stamp_s(radio: &WordRadio, link: &WordLink, beam: Option<usize>, draw: &mut Seeded) -> Option<f64> {
    let beam = beam?;
    let gain = |path: &WordPath| path.beam_gain.get(beam).copied().unwrap_or(0.0);
    let least_db = decibels(strongest(link, beam)) - STAMP_RANGE_DB;
    let mut first: Option<&WordPath> = None;
    for path in link {
        let seen = decibels(gain(path)) + STAMP_RANGE_SIGMA_DB * draw.normal() > least_db;
        if seen && first.is_none_or(|first| path.delay_s < first.delay_s) {
            first = Some(path);
        }
    }
    let first = first?;
    let mut variance_s2 = bound_s2(radio.snr_db(gain(first), STAMP_BANDWIDTH_HZ) + CORRELATION_GAIN_DB);
    for path in link {
        let apart_m = (path.delay_s - first.delay_s) * SPEED_OF_LIGHT_M_PER_S;
        if apart_m > 0.0 && apart_m < RESOLUTION_M {
            let pull_s = PULL_M / SPEED_OF_LIGHT_M_PER_S;
            variance_s2 += pull_s * pull_s * gain(path) / gain(first);
        }
    }
    Some(first.delay_s + draw.normal() * variance_s2.sqrt())
}

/// Least variance of a delay that a flat spectrum allows, s^2: 1/(8 pi^2 beta^2 SNR), beta its rms width.
fn bound_s2(snr_db: f64) -> f64 {
    let beta_hz = STAMP_BANDWIDTH_HZ / 12.0_f64.sqrt();
    1.0 / (2.0 * (TAU * beta_hz) * (TAU * beta_hz) * libm::exp10(snr_db / 10.0))
}

fn decibels(ratio: f64) -> f64 {
    10.0 * libm::log10(ratio)
}

#[cfg(test)]
mod tests {
    use super::*;

    const RADIO: WordRadio = WordRadio {
        transmit_dbm: 27.0,
        noise_figure_db: 7.0,
    };
    /// Gain of a face in the middle of a beam.
    const BEAM_DB: f64 = 18.0;

    /// A path of a length and a gain between isotropic antennas, in the first of three beams; the second has it 20 dB down.
    fn path(length_m: f64, gain_db: f64) -> WordPath {
        let in_beam = libm::exp10((gain_db + BEAM_DB) / 10.0);
        WordPath {
            delay_s: length_m / SPEED_OF_LIGHT_M_PER_S,
            beam_gain: vec![in_beam, 0.01 * in_beam, 0.0],
        }
    }

    /// Links half a second apart.
    fn every_half_second(count: u32, link: &WordLink) -> Vec<(f64, WordLink)> {
        (0..count).map(|k| (0.5 * f64::from(k), link.clone())).collect()
    }

    fn share(arrived: &[bool]) -> f64 {
        arrived.iter().filter(|arrives| **arrives).count() as f64 / arrived.len() as f64
    }

    #[test]
    fn half_of_the_beacons_arrive_where_the_budget_is_met_and_few_or_all_beside() {
        // 27 dBm + 18 + 9 + 114 - 7 dB - 3 dB: gain -158 dB.
        for (gain_db, low, high) in [(-158.0, 0.45, 0.55), (-166.0, 0.0, 0.05), (-150.0, 0.95, 1.0)] {
            let links = every_half_second(2000, &vec![path(50.0, gain_db)]);
            let arrived = share(&OverAir::new(&RADIO, &links, &[], 3).beacons);
            assert!((low..=high).contains(&arrived), "{gain_db} dB: {arrived}");
        }
        let silence = OverAir::new(&RADIO, &every_half_second(9, &Vec::new()), &[], 3);
        assert_eq!(silence.beacons, [false; 9]);
    }

    #[test]
    fn a_stale_beam_costs_beacons_until_the_gmt_tries_all() {
        let swapped = |gain_db| {
            let mut path = path(50.0, gain_db);
            path.beam_gain.swap(0, 1);
            path
        };
        // In its own beam 15 dB more than needed, in the old one 5 dB less.
        let mut links = every_half_second(4, &vec![path(50.0, -143.0)]);
        links.extend(
            every_half_second(400, &vec![swapped(-143.0)])
                .into_iter()
                .map(|(t, l)| (t + 2.0, l)),
        );
        let lost = |seed| {
            let arrived = OverAir::new(&RADIO, &links, &[], seed).beacons;
            arrived.iter().skip(4).take_while(|arrives| !**arrives).count()
        };
        let lost: Vec<usize> = (0..200).map(lost).collect();
        assert!(lost.iter().all(|lost| *lost <= SCAN_AFTER as usize));
        // Each of the three gets through with a chance of 11 %.
        let all_lost = lost.iter().filter(|lost| **lost == SCAN_AFTER as usize).count();
        assert!((110..180).contains(&all_lost), "{all_lost}");
    }

    /// Errors of many exchanges over a link, ns; those that fail are left out.
    fn errors_ns(link: &WordLink) -> Vec<f64> {
        let exchanges = every_half_second(4000, link);
        let words = OverAir::new(&RADIO, &[], &exchanges, 5);
        words.exchanges.iter().flatten().map(|s| s * 1e9).collect()
    }

    fn mean_and_rms(values: &[f64]) -> (f64, f64) {
        let count = values.len() as f64;
        (
            values.iter().sum::<f64>() / count,
            (values.iter().map(|v| v * v).sum::<f64>() / count).sqrt(),
        )
    }

    #[test]
    fn a_single_path_leaves_the_bound_and_no_bias() {
        let errors = errors_ns(&vec![path(80.0, -110.0)]);
        assert_eq!(errors.len(), 4000);
        let (mean, rms) = mean_and_rms(&errors);
        let snr_db = RADIO.snr_db(libm::exp10(-9.2), STAMP_BANDWIDTH_HZ) + CORRELATION_GAIN_DB;
        // Two ends, half of the difference.
        let expected = (0.5 * bound_s2(snr_db)).sqrt() * 1e9;
        assert!((rms / expected - 1.0).abs() < 0.05, "{rms} {expected}");
        assert!(mean.abs() < 4.0 * rms / 63.0, "{mean} {rms}");
    }

    #[test]
    fn neighbours_pull_and_a_first_path_at_the_threshold_is_skipped_by_one_end_at_times() {
        let alone = mean_and_rms(&errors_ns(&vec![path(80.0, -110.0)])).1;
        let pulled = mean_and_rms(&errors_ns(&vec![path(80.0, -110.0), path(80.8, -116.0)])).1;
        // .3 m at half the amplitude, of two ends, halved: .35 ns.
        assert!((pulled - 0.354).abs() < 0.03 && alone < 0.05, "{pulled} {alone}");
        let far = mean_and_rms(&errors_ns(&vec![path(80.0, -110.0), path(90.0, -116.0)])).1;
        assert!((far - alone).abs() < 0.01, "{far} {alone}");
        // The first one at the edge of the range: each end sees it half of the time. Half of 30 m, or none.
        let errors = errors_ns(&vec![path(80.0, -134.0), path(110.0, -100.0)]);
        let outliers = errors.iter().filter(|e| (e.abs() - 50.03).abs() < 5.0).count();
        let share = outliers as f64 / errors.len() as f64;
        assert!((share - 0.5).abs() < 0.03, "{share}");
        let (mean, _) = mean_and_rms(&errors);
        assert!(mean.abs() < 3.0, "{mean}");
    }

    #[test]
    fn an_exchange_fails_where_no_word_arrives() {
        assert!(errors_ns(&vec![path(80.0, -175.0)]).len() < 20);
        assert!(errors_ns(&Vec::new()).is_empty());
    }
}
