//! Path estimation: samples of the transmit beams in, paths of the sweep out.

use core::ffi::{CStr, c_char, c_void};

use cslam_core::block::BeamBlock;
use cslam_core::geometry::{Gmt, Rotation, World};
use cslam_core::ltd::{EstimatedPath, EstimatorConfigError, PathEstimator, WorkLimit};
use cslam_core::profile::quad_4x8_gmt_72::{BEAMS, CHANNELS, PATHS};
use cslam_core::profile::{FlightConfig, FlightEstimator, Samples};
use cslam_core::waveform::{SAMPLES, WaveformError};
use heapless::Vec;

use crate::pointer::{self, Sized32};
use crate::slot::Slot;
use crate::status::CslamStatus;
use crate::values::flag;

/// `int16_t` of a block: 32 channels x 512 samples x (I, Q).
const BLOCK: usize = CHANNELS * SAMPLES * 2;
/// No front end has a scale beyond this: amplitudes would leave single precision.
const MOST_EXPONENT: i32 = 100;

/// An estimator in the caller's memory.
pub struct CslamEstimator {
    _private: [u8; 0],
}

type EstimatorSlot = Slot<FlightEstimator>;

/// What the estimator may be told. `cslam_estimator_config_default` fills it in.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct CslamEstimatorConfig {
    /// `sizeof(cslam_estimator_config)`.
    pub size: u32,
    /// 1: beams and candidates are passed over that hold no path but known ones. 0: everything is looked at.
    pub screening: u8,
    /// 1: what one sweep shows of the noise helps the next, for sweeps that follow each other. 0: sweeps of no one flight.
    pub gating: u8,
    /// 0.
    pub reserved: [u8; 2],
    /// Attitude of the transmitter: quaternion w, x, y, z from its axes to the world's. 1, 0, 0, 0: first face to the east.
    pub gmt_attitude_wxyz: [f32; 4],
    /// False alarms a sweep on noise alone, above 0 and at most 1.
    pub false_alarms_per_sweep: f32,
    /// Paths weaker than the strongest one by more than this are not reported, dB, 0 to 120.
    pub dynamic_range_db: f32,
    /// Standard deviation of the phase error that calibration leaves on a receive element, rad, 0 to a quarter turn.
    pub element_phase_sigma_rad: f32,
    /// Standard deviation of a transmit beam's gain, dB, 0 to 20.
    pub beam_gain_sigma_db: f32,
    /// Thousands of instructions of a Cortex-M7 that the search of a sweep may take; UINT32_MAX for no limit.
    pub work_limit_thousands: u32,
}

/// What one beam gave.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default)]
pub struct CslamBeamReport {
    /// `sizeof(cslam_beam_report)`.
    pub size: u32,
    /// Paths found in it.
    pub paths: u32,
    /// Mean power of a sample, all channels added, amplitude units squared.
    pub power: f32,
    /// Values that clipped in the transform: paths may be too weak where this is not 0.
    pub clips: u32,
    /// 1 when the beam was not searched, for it holds no path worth reporting.
    pub weak: u8,
    /// 1 when the beam was not searched because the sweep's work was spent.
    pub left_out: u8,
    /// 0.
    pub reserved: [u8; 2],
}

/// An estimated path.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default)]
pub struct CslamPath {
    /// `sizeof(cslam_path)`.
    pub size: u32,
    /// Transmit beam in which the path was strongest.
    pub beam: u16,
    /// 1 when the beams showed the direction of departure, else 0 and zeros there.
    pub has_departure: u8,
    /// 0.
    pub reserved: u8,
    /// Speed of light times the delay, clock offset included, m, cyclic with 625 m.
    pub c_tau_m: f32,
    /// Unit vector from the UAV towards where the wave came from, body axes: forward, left, up.
    pub aoa_body: [f32; 3],
    /// Unit vector from the transmitter towards where the wave went, world axes.
    pub aod_world: [f32; 3],
    /// Standard deviation of that along any tangent, rad.
    pub aod_sigma_rad: f32,
    /// SNR per element and active subcarrier in that beam, mean over the elements, dB.
    pub snr_db: f32,
    /// Power per active subcarrier in that beam, summed over the elements, amplitude units squared.
    pub energy: f32,
    /// Covariance by noise of (c tau, angles along the tangents e1, e2 of the arrival), m^2, m rad, rad^2, row by row.
    pub covariance: [f32; 9],
}

// SAFETY: `repr(C)`, `u32` first, numbers only.
unsafe impl Sized32 for CslamEstimatorConfig {}
// SAFETY: `repr(C)`, `u32` first, numbers only.
unsafe impl Sized32 for CslamBeamReport {}
// SAFETY: `repr(C)`, `u32` first, numbers only.
unsafe impl Sized32 for CslamPath {}

const _: () = assert!(align_of::<EstimatorSlot>() <= 16);
const _: () = assert!(size_of::<CslamEstimatorConfig>() == 44 && size_of::<CslamBeamReport>() == 20);
const _: () = assert!(size_of::<CslamPath>() == 84 && core::mem::offset_of!(CslamPath, covariance) == 48);
const _: () = assert!(size_of::<Samples>() == 2 * BLOCK);

impl From<&FlightConfig> for CslamEstimatorConfig {
    fn from(config: &FlightConfig) -> Self {
        Self {
            size: size_of::<Self>() as u32,
            screening: config.screening.into(),
            gating: config.gating.into(),
            reserved: [0; 2],
            gmt_attitude_wxyz: [1.0, 0.0, 0.0, 0.0],
            false_alarms_per_sweep: config.false_alarms_per_sweep as f32,
            dynamic_range_db: config.dynamic_range_db,
            element_phase_sigma_rad: config.element_phase_sigma_rad,
            beam_gain_sigma_db: config.beam_gain_sigma_db,
            work_limit_thousands: config.work_limit.0,
        }
    }
}

impl CslamEstimatorConfig {
    /// The configuration, or the name of the field that is wrong.
    fn checked(&self) -> Result<FlightConfig, &'static CStr> {
        let default = FlightConfig::default();
        // The default is a decimal that single precision does not hold; left as it was, it shall be the default's.
        let false_alarms_per_sweep = if self.false_alarms_per_sweep == default.false_alarms_per_sweep as f32 {
            default.false_alarms_per_sweep
        } else {
            f64::from(self.false_alarms_per_sweep)
        };
        let [w, x, y, z] = self.gmt_attitude_wxyz;
        // The identity stays exactly that.
        let gmt_attitude = if [x, y, z] == [0.0; 3] && w > 0.0 && w.is_finite() {
            Rotation::identity()
        } else {
            Rotation::<Gmt, World>::from_quaternion([w, x, y, z]).map_err(|_| c"gmt_attitude_wxyz")?
        };
        let config = FlightConfig {
            gmt_attitude,
            false_alarms_per_sweep,
            dynamic_range_db: self.dynamic_range_db,
            screening: flag(self.screening).map_err(|_| c"screening")?,
            gating: flag(self.gating).map_err(|_| c"gating")?,
            element_phase_sigma_rad: self.element_phase_sigma_rad,
            beam_gain_sigma_db: self.beam_gain_sigma_db,
            work_limit: WorkLimit(self.work_limit_thousands),
            ..default
        };
        match config.check(BEAMS) {
            Ok(()) => Ok(config),
            Err(error) => Err(name(error)),
        }
    }
}

/// The name of a field with a closing zero.
fn name(error: EstimatorConfigError) -> &'static CStr {
    use EstimatorConfigError as Error;
    match error {
        Error::FalseAlarms => c"false_alarms_per_sweep",
        Error::DynamicRange => c"dynamic_range_db",
        Error::ElementPhase => c"element_phase_sigma_rad",
        Error::BeamGain => c"beam_gain_sigma_db",
        Error::Waveform(WaveformError::Active) => c"waveform.active",
        Error::Waveform(_) => c"waveform",
        Error::Arrays | Error::Aliasing => c"arrays",
        _ => c"codebook",
    }
}

impl From<&EstimatedPath> for CslamPath {
    fn from(found: &EstimatedPath) -> Self {
        let c = &found.path.covariance;
        let aod = found.path.aod;
        Self {
            size: size_of::<Self>() as u32,
            beam: found.beam,
            has_departure: aod.is_some().into(),
            reserved: 0,
            c_tau_m: found.path.c_tau_m,
            aoa_body: (*found.path.aoa.vector()).into(),
            aod_world: aod.map_or([0.0; 3], |aod| (*aod.direction.vector()).into()),
            aod_sigma_rad: aod.map_or(0.0, |aod| aod.sigma_rad),
            snr_db: found.snr_db,
            energy: found.energy,
            covariance: [c.m11, c.m12, c.m13, c.m21, c.m22, c.m23, c.m31, c.m32, c.m33],
        }
    }
}

/// Bytes that an estimator takes: 78 KiB. Its memory must be zeroed, or have held one that was ended.
#[unsafe(no_mangle)]
pub extern "C" fn cslam_estimator_size() -> usize {
    size_of::<EstimatorSlot>()
}

/// Alignment of these bytes: 16 at most, that of `malloc`.
#[unsafe(no_mangle)]
pub extern "C" fn cslam_estimator_align() -> usize {
    align_of::<EstimatorSlot>()
}

/// Fills in the configuration that flies.
///
/// # Safety
/// Unless null or misaligned, `config` points to a `cslam_estimator_config`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cslam_estimator_config_default(config: *mut CslamEstimatorConfig) -> CslamStatus {
    // SAFETY: the caller's promise.
    CslamStatus::of(unsafe { pointer::place(config) }.map(|place| {
        place.write((&FlightConfig::default()).into());
    }))
}

/// Name of the first field of a configuration that cannot work, static; null when all are sound, and when there is no configuration.
///
/// # Safety
/// Unless null or misaligned, `config` points to a `cslam_estimator_config` that is filled in.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cslam_estimator_config_wrong_field(
    config: *const CslamEstimatorConfig,
) -> *const c_char {
    // SAFETY: the caller's promise.
    match unsafe { pointer::read(config) } {
        Ok(config) => config.checked().err().map_or(core::ptr::null(), CStr::as_ptr),
        Err(CslamStatus::Size) => c"size".as_ptr(),
        Err(_) => core::ptr::null(),
    }
}

/// Builds an estimator in `length` bytes at `memory`. `config` may be null: that which flies. Computes all tables, and takes up to
/// 160 KiB of stack on the way on a 64-bit host (measured); a push of a beam takes 18 KiB and more.
///
/// # Safety
/// `memory`: `length` bytes, zeroed or of an object that was ended, that stay where they are until `cslam_estimator_end`. `config`
/// and `out` as their types say.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cslam_estimator_init(
    memory: *mut c_void,
    length: usize,
    config: *const CslamEstimatorConfig,
    out: *mut *mut CslamEstimator,
) -> CslamStatus {
    let init = || {
        // SAFETY: the caller's promise.
        let out = unsafe { pointer::place(out)? };
        out.write(core::ptr::null_mut());
        let config = if config.is_null() {
            FlightConfig::default()
        } else {
            // SAFETY: the caller's promise.
            unsafe { pointer::read(config)? }
                .checked()
                .map_err(|_| CslamStatus::Config)?
        };
        // SAFETY: the caller's promise; the whole estimator is written at the address that is given.
        let slot = unsafe {
            EstimatorSlot::init(memory, length, |place| {
                place.write(FlightEstimator::new(&config));
                Ok(())
            })?
        };
        out.write(slot.cast());
        Ok(())
    };
    CslamStatus::of(init())
}

/// Gives the memory back.
///
/// # Safety
/// `estimator` is null or comes from `cslam_estimator_init`, and its memory is still there.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cslam_estimator_end(estimator: *mut CslamEstimator) -> CslamStatus {
    // SAFETY: the caller's promise.
    CslamStatus::of(unsafe { EstimatorSlot::end(estimator.cast()) })
}

/// Samples of one block, `count` values of `int16_t`, as the receiver takes them.
///
/// # Safety
/// Unless null or misaligned, `samples` points to `count` values that nobody else uses meanwhile.
pub(crate) unsafe fn block<'a>(samples: *mut i16, count: usize) -> Result<&'a mut Samples, CslamStatus> {
    pointer::check(samples.cast::<Samples>())?;
    if count < BLOCK {
        return Err(CslamStatus::TooShort);
    }
    // SAFETY: not null, aligned for pairs, long enough; an `Iq` is a `u32` in memory, a pair of `int16_t`.
    Ok(unsafe { &mut *samples.cast::<Samples>() })
}

/// Checks a beam and its exponent.
pub(crate) fn beam_block(
    samples: &mut Samples,
    beam: u16,
    exponent: i32,
) -> Result<BeamBlock<'_>, CslamStatus> {
    if usize::from(beam) >= BEAMS || !(-MOST_EXPONENT..=MOST_EXPONENT).contains(&exponent) {
        return Err(CslamStatus::OutOfRange);
    }
    Ok(BeamBlock {
        samples,
        beam,
        exponent,
    })
}

/// Mean power of a block, all channels added, amplitude units squared: beams are given strongest first.
///
/// # Safety
/// `samples`: `count` values of `int16_t`, channel by channel, 32 x 512 pairs I, Q, aligned to 4 bytes. `power` as its type says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cslam_block_power(
    samples: *const i16,
    count: usize,
    exponent: i32,
    power: *mut f32,
) -> CslamStatus {
    let measure = || {
        // SAFETY: the caller's promise.
        let power = unsafe { pointer::place(power)? };
        pointer::check(samples.cast::<Samples>())?;
        if count < BLOCK {
            return Err(CslamStatus::TooShort);
        }
        if !(-MOST_EXPONENT..=MOST_EXPONENT).contains(&exponent) {
            return Err(CslamStatus::OutOfRange);
        }
        // SAFETY: not null, aligned for pairs, long enough; an `Iq` is a `u32` in memory, a pair of `int16_t`.
        power.write(power_of(unsafe { &*samples.cast::<Samples>() }, exponent));
        Ok(())
    };
    CslamStatus::of(measure())
}

/// As [`BeamBlock::power`], of samples that are only looked at.
fn power_of(samples: &Samples, exponent: i32) -> f32 {
    let energy: u64 = samples.as_flattened().iter().map(|x| u64::from(x.power())).sum();
    let scale = f64::from(2 * exponent);
    // Exact: a power of two within double precision, see MOST_EXPONENT.
    (energy as f64 / SAMPLES as f64 * power_of_two(scale as i32)) as f32
}

/// `2^exponent` of -200 to 200.
fn power_of_two(exponent: i32) -> f64 {
    f64::from_bits(((1023 + i64::from(exponent)) as u64) << 52)
}

/// Takes the samples of one beam, which are worked on in place. `exponent` is that of **this** beam: amplitude = integer x
/// 2^exponent; one for a whole sweep gives paths that look right and are wrong. Strongest beam first (`cslam_block_power`).
///
/// # Safety
/// `estimator` from `cslam_estimator_init`; `samples`: `count` values of `int16_t`, channel by channel, 32 x 512 pairs I, Q, aligned to
/// 4 bytes, which nobody else uses meanwhile. `report` may be null.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cslam_estimator_push_beam(
    estimator: *mut CslamEstimator,
    samples: *mut i16,
    count: usize,
    beam: u16,
    exponent: i32,
    report: *mut CslamBeamReport,
) -> CslamStatus {
    let push = || {
        if !report.is_null() {
            // SAFETY: the caller's promise.
            unsafe { pointer::check_size(report.cast_const())? };
        }
        // SAFETY: the caller's promise.
        let block = beam_block(unsafe { block(samples, count)? }, beam, exponent)?;
        // SAFETY: the caller's promise; `with` gives an estimator that nobody else uses.
        let found = unsafe { EstimatorSlot::with(estimator.cast(), |e| Ok((*e).push_beam(block)))? };
        if !report.is_null() {
            // SAFETY: checked above.
            unsafe { pointer::place(report)? }.write(CslamBeamReport {
                size: size_of::<CslamBeamReport>() as u32,
                paths: found.paths.into(),
                power: found.power,
                clips: found.clips,
                weak: found.weak.into(),
                left_out: found.left_out.into(),
                reserved: [0; 2],
            });
        }
        Ok(())
    };
    CslamStatus::of(push())
}

/// Ends the sweep: its paths, strongest first, and how many there are. The estimator is empty afterwards, ready for the next sweep.
///
/// # Safety
/// `estimator` from `cslam_estimator_init`; `paths`: `capacity` (9 or more) structs, the first of which says its size; `found` as its
/// type says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cslam_estimator_finish(
    estimator: *mut CslamEstimator,
    paths: *mut CslamPath,
    capacity: usize,
    found: *mut usize,
) -> CslamStatus {
    let finish = || {
        // SAFETY: the caller's promise.
        let found = unsafe { pointer::place(found)? };
        if capacity < PATHS {
            return Err(CslamStatus::TooShort);
        }
        // SAFETY: the caller's promise.
        unsafe { pointer::check_size(paths.cast_const())? };
        // SAFETY: the caller's promise; `with` gives an estimator that nobody else uses.
        let sweep = unsafe { EstimatorSlot::with(estimator.cast(), |e| Ok((*e).finish()))? };
        for (index, path) in sweep.iter().enumerate() {
            // SAFETY: within the `capacity` structs, which the caller says are there.
            unsafe { paths.add(index).write(path.into()) };
        }
        found.write(sweep.len());
        Ok(())
    };
    CslamStatus::of(finish())
}

/// A whole sweep that lies in memory: the beams in order of their power, then its paths. What was in the estimator is forgotten.
///
/// # Safety
/// `estimator` from `cslam_estimator_init`; `samples`: `count` values of `int16_t`, block by block as for `cslam_estimator_push_beam`,
/// worked on in place; `beams` and `exponents`: one of each a block, `blocks` of them (at most 72, no beam twice); `paths`, `capacity`
/// and `found` as for `cslam_estimator_finish`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cslam_estimator_sweep(
    estimator: *mut CslamEstimator,
    samples: *mut i16,
    count: usize,
    beams: *const u16,
    exponents: *const i32,
    blocks: usize,
    paths: *mut CslamPath,
    capacity: usize,
    found: *mut usize,
) -> CslamStatus {
    let sweep = || {
        if blocks == 0 || blocks > BEAMS {
            return Err(CslamStatus::OutOfRange);
        }
        if count < blocks * BLOCK || capacity < PATHS {
            return Err(CslamStatus::TooShort);
        }
        // SAFETY: the caller's promise.
        unsafe { pointer::check_size(paths.cast_const())? };
        pointer::check(found.cast_const())?;
        pointer::check(samples.cast::<Samples>())?;
        // SAFETY: the caller's promise, and aligned as just checked; `count` holds this many.
        let all = unsafe { pointer::array_mut(samples.cast::<Samples>(), blocks)? };
        // SAFETY: the caller's promise.
        let (beams, exponents) =
            unsafe { (pointer::array(beams, blocks)?, pointer::array(exponents, blocks)?) };
        let mut order: Vec<(f32, usize), BEAMS> = Vec::new();
        let told = || beams.iter().copied().zip(exponents.iter().copied());
        for (index, (block, (beam, exponent))) in all.iter_mut().zip(told()).enumerate() {
            if beams.iter().take(index).any(|other| *other == beam) {
                return Err(CslamStatus::OutOfRange);
            }
            let power = beam_block(block, beam, exponent)?.power();
            order.push((power, index)).map_err(|_| CslamStatus::OutOfRange)?;
        }
        // Strongest first, of equal ones the first.
        order.sort_unstable_by(|(a, i), (b, j)| b.total_cmp(a).then(i.cmp(j)));
        // SAFETY: the caller's promise; `with` gives an estimator that nobody else uses.
        unsafe {
            EstimatorSlot::with(estimator.cast(), |e| {
                let e = &mut *e;
                let _forgotten = e.finish();
                for (_, index) in &order {
                    if let (Some(block), Some((beam, exponent))) = (all.get_mut(*index), told().nth(*index)) {
                        let _report = e.push_beam(beam_block(block, beam, exponent)?);
                    }
                }
                Ok(())
            })?;
        }
        Ok(())
    };
    match sweep() {
        // SAFETY: the caller's promise.
        Ok(()) => unsafe { cslam_estimator_finish(estimator, paths, capacity, found) },
        Err(status) => status,
    }
}

#[cfg(test)]
mod tests {
    use cslam_core::ltd::Iq;

    use super::*;

    #[test]
    fn power_is_that_of_the_core() {
        let mut samples = [[Iq::ZERO; SAMPLES]; CHANNELS];
        for (index, x) in samples.as_flattened_mut().iter_mut().enumerate() {
            *x = Iq::new((index * 7) as i16, (index * 13) as i16);
        }
        for exponent in [-100, -38, 0, 9, 100] {
            let power = power_of(&samples, exponent);
            let block = beam_block(&mut samples, 0, exponent).expect("within range");
            assert_eq!(power.to_bits(), block.power().to_bits(), "{exponent}");
        }
    }

    #[test]
    fn the_default_is_that_of_the_core() {
        let told = CslamEstimatorConfig::from(&FlightConfig::default());
        let config = told.checked().expect("sound");
        assert_eq!(
            config.false_alarms_per_sweep.to_bits(),
            FlightConfig::default().false_alarms_per_sweep.to_bits()
        );
    }
}
