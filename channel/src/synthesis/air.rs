//! What arrives at the antennas, slot by slot: rays, array phases, clock and jammer, before noise.

use std::borrow::Cow;

use cslam_core::signal::{SAMPLES, Waveform};

use super::C64;
use super::antenna::{phasor, phasor_of_turns};
use super::body::{Body, TurningRotors};
use super::effects::{phase_noise, phase_walk};
use super::impairments::Jammer;
use super::jamming::{HeardNeighbour, jammer, neighbour};
use super::mix::{Gain, mix};
use super::noise::Gaussian;
use super::pieces::{Pieces, Slot};
use super::rays::{Instant, Ray};
use super::reception::Reception;
use super::simulator::{Block, Simulator};
use super::streams::{PER_BEAM, PHASE_NOISE, PHASE_WALK, stream};
use super::transmit::BeamField;
use super::waves::{Plane, Shape, Wave};
use crate::random::Stream;

/// A clock that has drifted this far since the waves were made gets new ones, s; in between, their slope serves
/// (second order: -60 dB at the band edge).
const REMAKE_AFTER_S: f64 = 50e-12;

/// What a sweep keeps between its beams.
pub(super) struct SweepState<'a, const ARRAYS: usize, const ELEMENTS: usize, const CHANNELS: usize> {
    pub(super) simulator: &'a Simulator<ARRAYS, ELEMENTS, CHANNELS>,
    instant: &'a Instant,
    pub(super) index: u32,
    /// The rays of the link, then what the UAV's own body makes of them.
    pub(super) rays: Cow<'a, [Ray]>,
    /// For each ray, the one of the link that it is made of: they leave the GMT together.
    pub(super) origin: Vec<usize>,
    pub(super) receptions: Vec<Reception<ARRAYS, ELEMENTS>>,
    /// Frequency shift of each ray at each array by the body's turn about its centre, Hz.
    turning_hz: Vec<[f64; ARRAYS]>,
    pub(super) fields: Vec<Vec<BeamField>>,
    /// Per array, a wave for each ray, one for the jammer and one for the neighbour.
    pub(super) waves: [Vec<Wave>; ARRAYS],
    steering: [Vec<[C64; ELEMENTS]>; ARRAYS],
    /// Delays of the elements in their arrays for the rays of the link, s; none where an array counts as one place.
    element_delay_s: Option<[Vec<[f64; ELEMENTS]>; ARRAYS]>,
    /// Clock offset the waves were made with, s.
    pub(super) made_at_s: f64,
    /// Offset of the carrier, Hz.
    pub(super) cfo_hz: f64,
    /// Phase of the carrier in the pilots of each beam, rad: of the first ones, and of the second ones.
    walked_rad: [Vec<f64>; 2],
    /// Rate of the clock's offset, s/s.
    clock_drift: f64,
    rotors: Option<TurningRotors<'a, ARRAYS>>,
    pieces: Option<Pieces<'a, ARRAYS, ELEMENTS>>,
    pub(super) jammer: Option<(Jammer, Reception<ARRAYS, ELEMENTS>)>,
    pub(super) neighbour: Option<HeardNeighbour<ARRAYS, ELEMENTS>>,
    planes: Vec<Plane>,
    pub(super) gaussian: Gaussian,
}

impl<'a, const ARRAYS: usize, const ELEMENTS: usize, const CHANNELS: usize>
    SweepState<'a, ARRAYS, ELEMENTS, CHANNELS>
{
    pub(super) fn new(
        simulator: &'a Simulator<ARRAYS, ELEMENTS, CHANNELS>,
        rays: &'a [Ray],
        instant: &'a Instant,
        index: u32,
    ) -> Self {
        let impairments = &simulator.config.impairments;
        let Body {
            rays: all,
            origin,
            rotors,
        } = Body::of(simulator, rays);
        let errors = simulator.arrays.errors_at(instant.time_s);
        let jammer = jammer(simulator, instant, &errors);
        let neighbour = neighbour(simulator, instant, &errors, index);
        let receptions: Vec<_> = all
            .iter()
            .map(|ray| {
                simulator
                    .arrays
                    .reception(&ray.arrival, ray.delay_s, ray.across, &errors)
            })
            .collect();
        let heard = || {
            let jammer = jammer.as_ref().map(|(_, r)| r);
            receptions
                .iter()
                .chain(jammer)
                .chain(neighbour.as_ref().map(|n| &n.reception))
        };
        let turning = |ray: &Ray| simulator.arrays.turning_hz(&ray.arrival, &instant.turn_rad_per_s);
        let turning_hz = all.iter().map(turning).collect();
        let steering = std::array::from_fn(|j| heard().map(|r| r.steering[j]).collect());
        // What the body scatters, 22 dB down and more, and what others send has its delay at the array's centre.
        let of_link = &receptions[..rays.len()];
        let delays = || std::array::from_fn(|j| of_link.iter().map(|r| r.element_delay_s[j]).collect());
        let element_delay_s = simulator.arrays.squints().then(delays);
        let fields = rays
            .iter()
            .map(|r| simulator.transmitter.fields(&r.departure, &simulator.device));
        let offset_hz = simulator
            .carrier_offset
            .as_ref()
            .map_or(0.0, |offset| offset.at(instant.time_s));
        // A carrier that seems high is a clock that runs slow.
        let tied = -offset_hz / simulator.maker.waveform().carrier_hz;
        let mut state = Self {
            fields: fields.collect(),
            cfo_hz: impairments.cfo_hz + offset_hz,
            walked_rad: phase_walk::pilots(
                impairments.oscillators.phase_walk_rad_per_root_s,
                simulator.beams(),
                simulator.maker.waveform().beam_period_s(),
                &mut Stream::new(simulator.seed, stream(index, 0, PHASE_WALK)),
            ),
            clock_drift: impairments.clock_drift + instant.clock_drift + tied,
            simulator,
            instant,
            index,
            rays: all,
            origin,
            turning_hz,
            receptions,
            waves: std::array::from_fn(|_| Vec::new()),
            steering,
            element_delay_s,
            made_at_s: 0.0,
            rotors,
            pieces: None,
            jammer,
            neighbour,
            planes: vec![Plane::new(); CHANNELS],
            gaussian: simulator.gaussian.clone(),
        };
        state.make_waves(state.clock_s(0));
        state
    }

    /// The same with the pieces of diffusely scattered waves.
    pub(super) fn with_pieces(mut self, rays: &[Ray]) -> Self {
        if !rays.is_empty() {
            let errors = self.simulator.arrays.errors_at(self.instant.time_s);
            self.pieces = Some(Pieces::new(
                self.simulator,
                rays,
                &errors,
                &self.instant.turn_rad_per_s,
            ));
        }
        self
    }

    /// Clock offset in a slot, s.
    pub(super) fn clock_s(&self, slot: usize) -> f64 {
        let i = &self.simulator.config.impairments;
        i.clock_offset_s + self.instant.clock_offset_s + self.clock_drift * self.time_s(slot)
    }

    /// Time of a slot's block since the first one, s.
    pub(super) fn time_s(&self, slot: usize) -> f64 {
        let period_s = self.simulator.maker.waveform().beam_period_s();
        match self.simulator.pilot_of(slot) {
            Some((beam, again)) => {
                let later_s = Waveform::PILOT_INTERVAL_S * again as f64;
                Waveform::PILOT_DELAY_S + later_s + period_s * beam as f64
            }
            None => period_s * slot as f64,
        }
    }

    fn make_waves(&mut self, clock_s: f64) {
        let maker = &self.simulator.maker;
        let cfo_hz = self.cfo_hz;
        for waves in &mut self.waves {
            waves.truncate(self.rays.len());
            waves.resize(self.rays.len(), Wave::silent());
        }
        for (l, (ray, r)) in self.rays.iter().zip(&self.receptions).enumerate() {
            let turns = maker.turns(ray.doppler_hz + cfo_hz);
            let delays_s = r.delay_s.map(|delay_s| delay_s + clock_s);
            let out = self.waves.each_mut().map(|waves| &mut waves[l]);
            maker.make(delays_s, &turns, &Shape::WHOLE, out);
        }
        for waves in &mut self.waves {
            // Any but a tone is made anew in every slot, and so are the neighbour's bursts.
            waves.extend(
                self.jammer
                    .iter()
                    .map(|(jammer, _)| maker.tone(jammer.offset_hz + cfo_hz)),
            );
            waves.extend(self.neighbour.iter().map(|_| Wave::silent()));
        }
        self.made_at_s = clock_s;
    }

    /// The field that arrives in a slot (of a beam period) of a transmitter whose field towards each ray of the link is
    /// given, into `planes`, without noise. False when the block is lost: by chance, or because the caller says so.
    pub(super) fn air(&mut self, slot: usize, lost: bool, field: impl Fn(&Self, usize) -> BeamField) -> bool {
        let simulator = self.simulator;
        let impairments = &simulator.config.impairments;
        let mut draws = Stream::new(simulator.seed, stream(self.index, slot, PER_BEAM));
        // A pilot's oscillators are those of its beam, milliseconds later.
        let pilot = simulator.pilot_of(slot);
        let beam = pilot.map_or(slot, |(beam, _)| beam);
        let walked = pilot.and_then(|(beam, again)| self.walked_rad.get(again)?.get(beam).copied());
        // Drawn whether used or not, so that one setting does not move another's.
        let lost = (draws.uniform() < impairments.dropped_beam_probability) || lost;
        if beam != slot {
            draws = Stream::new(simulator.seed, stream(self.index, beam, PER_BEAM));
            let _of_the_beam = draws.uniform();
        }
        let mut array_phase: [C64; ARRAYS] =
            std::array::from_fn(|_| phasor(std::f64::consts::TAU * draws.uniform()));
        if simulator.radio.is_one_board() {
            array_phase = [array_phase[0]; ARRAYS];
        }
        let jammer_phase = phasor(std::f64::consts::TAU * draws.uniform());
        if lost {
            return false;
        }
        let time_s = self.time_s(slot);
        let clock_s = self.clock_s(slot);
        if (clock_s - self.made_at_s).abs() > REMAKE_AFTER_S {
            self.make_waves(clock_s);
        }
        self.jam(slot);
        self.interfere(slot);
        let late_s = clock_s - self.made_at_s;
        let turn = |shift_hz: f64| phasor_of_turns(shift_hz * time_s);
        let amplitude = simulator.signal_amplitude();
        let flight_s = self.instant.time_s + time_s;
        let carrier_hz = simulator.maker.waveform().carrier_hz;
        let tips = self.rotors.as_ref().map(|r| r.tips(carrier_hz, flight_s));
        for (j, waves) in self.waves.iter().enumerate() {
            let lo = if impairments.free_array_phase {
                array_phase[j]
            } else {
                C64::new(1.0, 0.0)
            };
            let lo = lo * phasor(walked.unwrap_or(0.0));
            let of_rays = self
                .rays
                .iter()
                .zip(&self.receptions)
                .enumerate()
                .map(|(index, (ray, r))| {
                    let shift_hz = ray.doppler_hz + self.turning_hz[index][j] + self.cfo_hz;
                    let mut common = ray.amplitude * turn(shift_hz) * r.carrier[j] * lo * amplitude;
                    if let Some(rotors) = &self.rotors {
                        common *= rotors.factor(tips.as_deref().unwrap_or_default(), index, j, flight_s);
                    }
                    let BeamField { field, slope_s } = field(self, self.origin[index]);
                    Gain {
                        value: common * field,
                        slope: -common * (field * late_s + slope_s),
                    }
                });
            let without_slope = |value| Gain {
                value,
                slope: C64::new(0.0, 0.0),
            };
            let of_jammer = self.jammer.iter().map(|(jammer, r)| {
                without_slope(
                    jammer_phase
                        * turn(jammer.offset_hz + self.cfo_hz)
                        * r.carrier[j]
                        * lo
                        * libm::exp10((jammer.power_dbm - 30.0) / 20.0),
                )
            });
            let of_neighbour = self
                .neighbour
                .iter()
                .map(|n| without_slope(n.reception.carrier[j] * lo * n.amplitude));
            let gains: Vec<Gain> = of_rays.chain(of_jammer).chain(of_neighbour).collect();
            let planes = &mut self.planes[j * ELEMENTS..(j + 1) * ELEMENTS];
            let delays = self
                .element_delay_s
                .as_ref()
                .map(|of_arrays| of_arrays[j].as_slice());
            mix(waves, &gains, &self.steering[j], delays, planes);
            if let Some(pieces) = &self.pieces {
                let slot = Slot {
                    beam,
                    clock_s,
                    common: lo * amplitude,
                    turn: |doppler_hz| turn(doppler_hz + self.cfo_hz),
                };
                pieces.add(j, &slot, planes);
            }
        }
        if impairments.oscillators.phase_noise {
            self.add_phase_noise(slot);
        }
        true
    }

    /// Turns the samples by the phases of the GMT's oscillator and of each array's, or of the one of a planar array. Delays, under a microsecond, count as
    /// none: it is noise of a megahertz and more that the rays would not share.
    fn add_phase_noise(&mut self, slot: usize) {
        let Self {
            planes,
            gaussian,
            simulator,
            index,
            ..
        } = self;
        let mut phase_rad = |oscillator: usize| {
            let stream = stream(*index, slot | oscillator << 12, PHASE_NOISE);
            phase_noise::block(gaussian, simulator.seed, stream)
        };
        let of_gmt = phase_rad(ARRAYS);
        let channels = if simulator.radio.is_one_board() {
            CHANNELS
        } else {
            ELEMENTS
        };
        for (j, planes) in planes.chunks_exact_mut(channels).enumerate() {
            let own = phase_rad(j);
            let turns: [[f32; 2]; SAMPLES] = std::array::from_fn(|n| {
                let turn = phasor(own[n] + of_gmt[n]);
                [turn.re as f32, turn.im as f32]
            });
            for plane in planes {
                for ((re, im), [c, s]) in plane.re.iter_mut().zip(&mut plane.im).zip(turns) {
                    (*re, *im) = (*re * c - *im * s, *re * s + *im * c);
                }
            }
        }
    }

    /// Noise and front end over `planes`.
    pub(super) fn digitise(&mut self, slot: usize, beam: u16) -> Block<CHANNELS> {
        let simulator = self.simulator;
        simulator.digitise(&mut self.planes, &mut self.gaussian, (self.index, slot), beam)
    }
}
