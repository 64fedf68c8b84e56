//! The whole receiver: sensors and samples in, pose, map and packets for the ground out. The application that flies on a board.
//!
//! Long: it is every call that a receiver is fed by, each a few lines of checks under what its caller must promise.

use core::ffi::c_void;

use cslam_core::geometry::{Gmt, Rotation, Vector3, World};
use cslam_core::inertial::{ImuSample, MagneticField};
use cslam_core::profile::Block;
use cslam_core::profile::quad_4x8_gmt_72::BEAMS;
use cslam_core::receiver::Beacon;
use cslam_firmware::app::{Capture, Symbol};

use crate::estimator::{beam_block, block};
use crate::pointer;
use crate::receiver_parts::{App, Parts, build};
use crate::receiver_values::{CslamBeacon, CslamReceiverConfig};
use crate::slot::Slot;
use crate::status::CslamStatus;
use crate::values::flag;

/// Squint symbols of a sweep: 11 a face.
const SQUINT_SYMBOLS: u16 = 33;
/// Pilots of a sweep: every beam twice again.
const PILOTS: u16 = 2 * BEAMS as u16;
/// An attitude, position or rate beyond this is no measurement.
const MOST: f64 = 1e7;

/// A receiver in the caller's memory.
pub struct CslamReceiver {
    _private: [u8; 0],
}

type ReceiverSlot = Slot<Parts>;

const _: () = assert!(align_of::<ReceiverSlot>() <= 16);

/// Bytes that a receiver takes: 272 KiB. Its memory must be zeroed, or have held one that was ended.
#[unsafe(no_mangle)]
pub extern "C" fn cslam_receiver_size() -> usize {
    size_of::<ReceiverSlot>()
}

/// Alignment of these bytes: 16 at most, that of `malloc`.
#[unsafe(no_mangle)]
pub extern "C" fn cslam_receiver_align() -> usize {
    align_of::<ReceiverSlot>()
}

/// Builds a receiver at rest that knows nothing yet, in `length` bytes at `memory`. Takes 132 KiB of stack on a 64-bit host (measured).
///
/// # Safety
/// `memory`: `length` bytes, zeroed or of a receiver that was ended, that stay where they are until `cslam_receiver_end`. `config` filled
/// in; `out` as its type says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cslam_receiver_init(
    memory: *mut c_void,
    length: usize,
    config: *const CslamReceiverConfig,
    out: *mut *mut CslamReceiver,
) -> CslamStatus {
    let init = || {
        // SAFETY: the caller's promise.
        let out = unsafe { pointer::place(out)? };
        out.write(core::ptr::null_mut());
        // SAFETY: the caller's promise.
        let config = unsafe { pointer::read(config)? };
        let ground_z_m = flag(config.has_ground)?.then_some(config.ground_z_m);
        if ground_z_m.is_some_and(|z| !z.is_finite()) {
            return Err(CslamStatus::NotFinite);
        }
        if config.key == [0; 32] {
            return Err(CslamStatus::Config);
        }
        let field = Vector3::from(config.earth_field_ut);
        let magnetic_field = flag(config.has_earth_field)?.then_some(MagneticField {
            earth_ut: field,
            ..MagneticField::new(0.0, 0.0, 0.0)
        });
        // The earth's field is 22 to 67 uT.
        if magnetic_field.is_some() && !(10.0..=100.0).contains(&field.norm()) {
            return Err(CslamStatus::OutOfRange);
        }
        let place = (ground_z_m, magnetic_field);
        // SAFETY: the caller's promise; `build` writes all parts when it gives no error.
        let slot = unsafe { ReceiverSlot::init(memory, length, |parts| build(parts, &config, place))? };
        out.write(slot.cast());
        Ok(())
    };
    CslamStatus::of(init())
}

/// Calls `work` with the application of a receiver.
///
/// # Safety
/// `receiver` is null or comes from `cslam_receiver_init`, and its memory is still there.
pub(crate) unsafe fn with<R>(
    receiver: *mut CslamReceiver,
    work: impl FnOnce(&mut App) -> Result<R, CslamStatus>,
) -> Result<R, CslamStatus> {
    // SAFETY: the caller's promise; `with` gives parts that nobody else uses, and of these only the application is touched.
    unsafe { ReceiverSlot::with(receiver.cast(), |parts| work(&mut (*parts).application)) }
}

/// The same of work that cannot fail.
///
/// # Safety
/// As [`with`].
unsafe fn tell(receiver: *mut CslamReceiver, work: impl FnOnce(&mut App)) -> Result<(), CslamStatus> {
    let done = |app: &mut App| {
        work(app);
        Ok(())
    };
    // SAFETY: the caller's promise.
    unsafe { with(receiver, done) }
}

/// Three numbers that are some.
///
/// # Safety
/// Unless null or misaligned, `pointer` points to three numbers.
unsafe fn three(pointer: *const f32) -> Result<Vector3<f32>, CslamStatus> {
    // SAFETY: the caller's promise.
    let v = unsafe { pointer::array(pointer, 3)? };
    let v = Vector3::from_iterator(v.iter().copied());
    if v.iter().all(|c| c.is_finite() && f64::from(c.abs()) < MOST) {
        Ok(v)
    } else {
        Err(CslamStatus::NotFinite)
    }
}

/// Gives the memory back.
///
/// # Safety
/// `receiver` is null or comes from `cslam_receiver_init`, and its memory is still there.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cslam_receiver_end(receiver: *mut CslamReceiver) -> CslamStatus {
    // SAFETY: the caller's promise.
    CslamStatus::of(unsafe { ReceiverSlot::end(receiver.cast()) })
}

/// A sample of the inertial sensor: UAV clock at the end of its interval; angular rate (rad/s) and specific force (m/s^2, +9.8 along z at
/// rest) in body axes, three of each.
///
/// # Safety
/// `receiver` from `cslam_receiver_init`; arrays of three.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cslam_receiver_imu(
    receiver: *mut CslamReceiver,
    time_ns: u64,
    rate_rad_per_s: *const f32,
    specific_force_m_per_s2: *const f32,
) -> CslamStatus {
    let imu = || {
        // SAFETY: the caller's promise.
        let sample = unsafe {
            ImuSample {
                time_ns,
                rate_rad_per_s: three(rate_rad_per_s)?,
                specific_force_m_per_s2: three(specific_force_m_per_s2)?,
            }
        };
        // SAFETY: the caller's promise.
        unsafe { tell(receiver, |app| app.imu(&sample, &mut ())) }
    };
    CslamStatus::of(imu())
}

/// A sample of the magnetometer, body axes, uT, three numbers.
///
/// # Safety
/// `receiver` from `cslam_receiver_init`; an array of three.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cslam_receiver_magnetometer(
    receiver: *mut CslamReceiver,
    time_ns: u64,
    field_ut: *const f32,
) -> CslamStatus {
    let sample = || {
        // SAFETY: the caller's promise.
        let field_ut = unsafe { three(field_ut)? };
        // SAFETY: the caller's promise.
        unsafe { tell(receiver, |app| app.magnetometer(time_ns, &field_ut, &mut ())) }
    };
    CslamStatus::of(sample())
}

/// Begins a sweep with the powers of its beams (`cslam_block_power`), 72 of them, 0 where one is lost: so the receiver counts what is
/// missing. A front end that does not know them leaves this call out.
///
/// # Safety
/// `receiver` from `cslam_receiver_init`; an array of 72.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cslam_receiver_powers(
    receiver: *mut CslamReceiver,
    sweep: u32,
    sweep_ns: u64,
    powers: *const f32,
) -> CslamStatus {
    let begin = || {
        // SAFETY: the caller's promise.
        let told = unsafe { pointer::array(powers, BEAMS)? };
        if told.iter().any(|power| !power.is_finite()) {
            return Err(CslamStatus::NotFinite);
        }
        let mut powers = [0.0; BEAMS];
        powers.copy_from_slice(told);
        // SAFETY: the caller's promise.
        unsafe { tell(receiver, |app| app.powers(sweep, sweep_ns, &powers, &mut ())) }
    };
    CslamStatus::of(begin())
}

/// A two-way timing exchange: UAV clock less transmitter clock, s, not beyond one second.
///
/// # Safety
/// `receiver` from `cslam_receiver_init`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cslam_receiver_timing(
    receiver: *mut CslamReceiver,
    time_ns: u64,
    clock_offset_s: f64,
) -> CslamStatus {
    if !clock_offset_s.is_finite() {
        return CslamStatus::NotFinite;
    }
    if !(-1.0..=1.0).contains(&clock_offset_s) {
        return CslamStatus::OutOfRange;
    }
    // SAFETY: the caller's promise.
    CslamStatus::of(unsafe { tell(receiver, |app| app.timing(time_ns, clock_offset_s, &mut ())) })
}

/// Samples of a transmit beam of a sweep, strongest beam first, each with its own exponent; as `cslam_estimator_push_beam` takes them. The
/// first block of a new sweep begins it. `CSLAM_STATUS_OUT_OF_RANGE` also for a sweep that has ended.
///
/// # Safety
/// `receiver` from `cslam_receiver_init`; `samples`: `count` values of `int16_t`, 32 x 512 pairs, aligned to 4 bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cslam_receiver_beam(
    receiver: *mut CslamReceiver,
    sweep: u32,
    sweep_ns: u64,
    samples: *mut i16,
    count: usize,
    beam: u16,
    exponent: i32,
) -> CslamStatus {
    let beam = || {
        // SAFETY: the caller's promise.
        let symbol = Symbol::Beam(beam_block(unsafe { block(samples, count)? }, beam, exponent)?);
        // SAFETY: the caller's promise.
        unsafe { capture(receiver, sweep, sweep_ns, symbol) }
    };
    CslamStatus::of(beam())
}

/// Samples of a pilot: a beam that the transmitter has sent again after the sweep, `pilot` its number, plus 72 when it is the second time (0 to
/// 143). Between the beams and the squint symbols, of each beam the first one before the second; those of the 12 strongest beams are enough.
/// The receiver makes of them how fast paths grow while there is no line of sight. A sweep without them is whole.
///
/// # Safety
/// As `cslam_receiver_beam`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cslam_receiver_pilot(
    receiver: *mut CslamReceiver,
    sweep: u32,
    sweep_ns: u64,
    samples: *mut i16,
    count: usize,
    pilot: u16,
    exponent: i32,
) -> CslamStatus {
    let heard = || {
        if pilot >= PILOTS {
            return Err(CslamStatus::OutOfRange);
        }
        let beam = pilot % BEAMS as u16;
        // SAFETY: the caller's promise.
        let block = beam_block(unsafe { block(samples, count)? }, beam, exponent)?;
        let symbol = Symbol::Pilot(Block { beam: pilot, ..block });
        // SAFETY: the caller's promise.
        unsafe { capture(receiver, sweep, sweep_ns, symbol) }
    };
    CslamStatus::of(heard())
}

/// Samples of a beam squint symbol, 0 to 32, in this order, after all beams of the sweep and their pilots.
///
/// # Safety
/// As `cslam_receiver_beam`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cslam_receiver_squint(
    receiver: *mut CslamReceiver,
    sweep: u32,
    sweep_ns: u64,
    samples: *mut i16,
    count: usize,
    symbol: u16,
    exponent: i32,
) -> CslamStatus {
    let squint = || {
        if symbol >= SQUINT_SYMBOLS {
            return Err(CslamStatus::OutOfRange);
        }
        // SAFETY: the caller's promise.
        let symbol = Symbol::Squint(beam_block(unsafe { block(samples, count)? }, symbol, exponent)?);
        // SAFETY: the caller's promise.
        unsafe { capture(receiver, sweep, sweep_ns, symbol) }
    };
    CslamStatus::of(squint())
}

/// Hands a block over.
///
/// # Safety
/// As [`with`].
unsafe fn capture(
    receiver: *mut CslamReceiver,
    sweep: u32,
    sweep_ns: u64,
    symbol: Symbol<Block<'_>>,
) -> Result<(), CslamStatus> {
    let capture = Capture {
        sweep,
        sweep_ns,
        symbol,
    };
    // SAFETY: the caller's promise.
    let used = unsafe { with(receiver, |app| Ok(app.capture(capture, &mut ())))? };
    if used {
        Ok(())
    } else {
        Err(CslamStatus::OutOfRange)
    }
}

/// What the transmitter says of the sweep in hand. One that comes as a signed packet goes through `cslam_receiver_uplink` instead.
///
/// # Safety
/// `receiver` from `cslam_receiver_init`; `beacon` filled in.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cslam_receiver_beacon(
    receiver: *mut CslamReceiver,
    time_ns: u64,
    beacon: *const CslamBeacon,
) -> CslamStatus {
    let heard = || {
        // SAFETY: the caller's promise.
        let told = unsafe { pointer::read(beacon)? };
        if told.position_m.iter().any(|c| !c.is_finite()) || !told.sigma_m.is_finite() {
            return Err(CslamStatus::NotFinite);
        }
        let placed = told.position_m.iter().all(|c| c.abs() < MOST);
        if !placed || told.sigma_m < 0.0 || told.sweeps_per_stop == 0 {
            return Err(CslamStatus::OutOfRange);
        }
        let said = Beacon {
            sweep: told.sweep,
            position_m: told.position_m.into(),
            sigma_m: f64::from(told.sigma_m),
            attitude: Rotation::<Gmt, World>::from_quaternion(told.attitude_wxyz)?,
            sweeps_per_stop: told.sweeps_per_stop,
        };
        // SAFETY: the caller's promise.
        unsafe { tell(receiver, |app| app.beacon(time_ns, &said, &mut ())) }
    };
    CslamStatus::of(heard())
}

/// Bytes that the radio has received: packets of the ground, signed with the key. What is not signed so is counted and not used.
///
/// # Safety
/// `receiver` from `cslam_receiver_init`; `bytes`: `count` of them.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cslam_receiver_uplink(
    receiver: *mut CslamReceiver,
    time_ns: u64,
    bytes: *const u8,
    count: usize,
) -> CslamStatus {
    let uplink = || {
        // SAFETY: the caller's promise.
        let bytes = unsafe { pointer::array(bytes, count)? };
        // SAFETY: the caller's promise.
        unsafe { tell(receiver, |app| app.uplink(time_ns, bytes, |_| None, &mut ())) }
    };
    CslamStatus::of(uplink())
}

/// Tells the time: a sweep that will not be whole any more ends, 21 ms after its last block without a beacon, 450 ms without its blocks.
///
/// # Safety
/// `receiver` from `cslam_receiver_init`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cslam_receiver_elapse(receiver: *mut CslamReceiver, time_ns: u64) -> CslamStatus {
    // SAFETY: the caller's promise.
    CslamStatus::of(unsafe { tell(receiver, |app| app.elapse(time_ns, &mut ())) })
}

/// Ends the flight: the sweep in hand, and what waited for more to be sent with it.
///
/// # Safety
/// `receiver` from `cslam_receiver_init`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cslam_receiver_close(receiver: *mut CslamReceiver) -> CslamStatus {
    let close = |app: &mut App| {
        app.end(&mut ());
        app.close();
        Ok(())
    };
    // SAFETY: the caller's promise.
    CslamStatus::of(unsafe { with(receiver, close) })
}
