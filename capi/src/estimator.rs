//! Path estimation: samples of the transmit beams in, paths of the sweep out.

use core::ffi::{CStr, c_char, c_void};
use core::mem::MaybeUninit;

use cslam_core::geometry::{Gmt, Rotation, World};
use cslam_core::paths::PathEstimator;
use cslam_core::profile::quad_4x8_gmt_72::{BEAMS, CHANNELS, PATHS};
use cslam_core::profile::{FlightConfig, FlightEstimator, Samples};
use cslam_core::signal::{BeamBlock, SAMPLES};
use heapless::Vec;

use crate::estimator_values::{CslamBeamReport, CslamEstimatorConfig, CslamPath};
use crate::pointer;
use crate::slot::Slot;
use crate::status::CslamStatus;

/// `int16_t` of a block: 32 channels x 512 samples x (I, Q).
const BLOCK: usize = CHANNELS * SAMPLES * 2;
/// No front end has a scale beyond this: amplitudes would leave single precision.
const MOST_EXPONENT: i32 = 100;

/// An estimator in the caller's memory.
pub struct CslamEstimator {
    _private: [u8; 0],
}

/// What lies in that memory.
struct Estimating {
    estimator: FlightEstimator,
    /// Departures come in the axes of the GMT, and go out in those of the world.
    gmt_attitude: Rotation<Gmt, World>,
}

type EstimatorSlot = Slot<Estimating>;

const _: () = assert!(align_of::<EstimatorSlot>() <= 16);
const _: () = assert!(size_of::<Samples>() == 2 * BLOCK);

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

/// Builds an estimator in `length` bytes at `memory`. `config` may be null: that which flies. Computes all tables where they lie, and takes
/// 8 KiB of stack on the way (measured); a push of a beam takes 18 KiB and more.
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
        let (config, gmt_attitude) = if config.is_null() {
            (FlightConfig::default(), Rotation::identity())
        } else {
            // SAFETY: the caller's promise.
            unsafe { pointer::read(config)? }
                .checked()
                .map_err(|_| CslamStatus::Config)?
        };
        // SAFETY: the caller's promise; the whole estimator is written at the address that is given.
        let slot = unsafe {
            EstimatorSlot::init(memory, length, |place| {
                let estimator = (&raw mut (*place).estimator).cast::<MaybeUninit<_>>();
                FlightEstimator::init(&mut *estimator, &config, ());
                (&raw mut (*place).gmt_attitude).write(gmt_attitude);
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
        let found =
            unsafe { EstimatorSlot::with(estimator.cast(), |e| Ok((*e).estimator.push_beam(block)))? };
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
        let (sweep, gmt_attitude) = unsafe {
            EstimatorSlot::with(estimator.cast(), |e| {
                Ok(((*e).estimator.finish(), (*e).gmt_attitude))
            })?
        };
        for (index, path) in sweep.iter().enumerate() {
            let path = path.with_departure_in_world(&gmt_attitude);
            // SAFETY: within the `capacity` structs, which the caller says are there.
            unsafe { paths.add(index).write((&path).into()) };
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
                let e = &mut (*e).estimator;
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
    use cslam_core::signal::Iq;

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
}
