//! An object in the caller's memory, behind a word that says what is there.
//!
//! The word is checked on every call: an object that was never built, has ended, is being used by another thread, or was copied to
//! another place gives a status instead of undefined behaviour. So the memory must hold something before `_init` too: zeros.

use core::ffi::c_void;
use core::mem::MaybeUninit;
use core::sync::atomic::{AtomicU32, AtomicUsize, Ordering};

use crate::pointer;
use crate::status::CslamStatus;

/// "CSLM": somebody's object.
const READY: u32 = 0x4d4c_5343;
/// The same while a call is in it.
const IN_USE: u32 = 0x4d4c_5344;
/// Nothing.
const EMPTY: u32 = 0;

/// Memory of a `T`.
#[repr(C)]
pub(crate) struct Slot<T> {
    state: AtomicU32,
    /// Address at which it was built.
    at: AtomicUsize,
    value: MaybeUninit<T>,
}

impl<T> Slot<T> {
    /// Builds a `T` with `build`, which gets the address where it shall lie.
    ///
    /// # Safety
    /// Unless null, `memory` points to `length` initialised bytes that the object has for itself until it ends. `build` writes a
    /// whole `T` when it gives no error.
    pub(crate) unsafe fn init(
        memory: *mut c_void,
        length: usize,
        build: impl FnOnce(*mut T) -> Result<(), CslamStatus>,
    ) -> Result<*mut Self, CslamStatus> {
        let slot = memory.cast::<Self>();
        pointer::check(slot.cast_const())?;
        if length < size_of::<Self>() {
            return Err(CslamStatus::TooShort);
        }
        // SAFETY: not null, aligned, long enough, initialised by the caller's promise; atomics take every pattern of bits.
        let (state, at) = unsafe { (&(*slot).state, &(*slot).at) };
        let found = state.load(Ordering::Acquire);
        if matches!(found, READY | IN_USE) && at.load(Ordering::Relaxed) == slot as usize {
            return Err(CslamStatus::AlreadyReady);
        }
        // Of two threads that come at once, one builds.
        state
            .compare_exchange(found, IN_USE, Ordering::AcqRel, Ordering::Acquire)
            .map_err(|_| CslamStatus::Busy)?;
        at.store(slot as usize, Ordering::Relaxed);
        // SAFETY: within the memory that was just taken.
        let built = build(unsafe { &raw mut (*slot).value }.cast::<T>());
        state.store(if built.is_ok() { READY } else { EMPTY }, Ordering::Release);
        built.map(|()| slot)
    }

    /// Calls `work` with the address of the object, which nobody else uses meanwhile.
    ///
    /// # Safety
    /// Unless null or misaligned, `slot` points to the memory of a slot, initialised (but for the object).
    pub(crate) unsafe fn with<R>(
        slot: *mut Self,
        work: impl FnOnce(*mut T) -> Result<R, CslamStatus>,
    ) -> Result<R, CslamStatus> {
        // SAFETY: the caller's promise.
        let state = unsafe { Self::taken(slot)? };
        // SAFETY: `taken` found a slot there.
        let result = work(unsafe { &raw mut (*slot).value }.cast::<T>());
        state.store(READY, Ordering::Release);
        result
    }

    /// Ends the object: the memory is the caller's again.
    ///
    /// # Safety
    /// As [`Self::with`].
    pub(crate) unsafe fn end(slot: *mut Self) -> Result<(), CslamStatus> {
        // SAFETY: the caller's promise.
        let state = unsafe { Self::taken(slot)? };
        // SAFETY: `taken` found an object there and made it ours; it is not used again.
        unsafe { (&raw mut (*slot).value).cast::<T>().drop_in_place() };
        state.store(EMPTY, Ordering::Release);
        Ok(())
    }

    /// Takes the object for one call.
    ///
    /// # Safety
    /// As [`Self::with`].
    unsafe fn taken<'a>(slot: *mut Self) -> Result<&'a AtomicU32, CslamStatus> {
        pointer::check(slot.cast_const())?;
        // SAFETY: not null, aligned, initialised by the caller's promise; atomics take every pattern of bits.
        let (state, at) = unsafe { (&(*slot).state, &(*slot).at) };
        if at.load(Ordering::Relaxed) != slot as usize {
            return Err(CslamStatus::NotReady);
        }
        match state.compare_exchange(READY, IN_USE, Ordering::AcqRel, Ordering::Acquire) {
            Ok(_) => Ok(state),
            Err(IN_USE) => Err(CslamStatus::Busy),
            Err(_) => Err(CslamStatus::NotReady),
        }
    }
}
