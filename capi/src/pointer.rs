//! Pointers of the caller's, checked before they are used.

use core::mem::MaybeUninit;

use crate::status::CslamStatus;

/// Whether a pointer may be used for a `T`.
pub(crate) fn check<T>(pointer: *const T) -> Result<(), CslamStatus> {
    if pointer.is_null() {
        Err(CslamStatus::Null)
    } else if !pointer.is_aligned() {
        Err(CslamStatus::Misaligned)
    } else {
        Ok(())
    }
}

/// A struct that begins with its own size, a `uint32_t`.
///
/// # Safety
/// `repr(C)`, its first field a `u32`, and every pattern of bits a value.
pub(crate) unsafe trait Sized32: Copy {}

/// Checks a pointer to a struct, and the size that the struct says it has.
///
/// # Safety
/// Unless null or misaligned, `pointer` points to at least four initialised bytes.
pub(crate) unsafe fn check_size<T: Sized32>(pointer: *const T) -> Result<(), CslamStatus> {
    check(pointer)?;
    // SAFETY: not null and aligned; by `Sized32` the struct begins with a `u32`, which the caller says is there.
    let size = unsafe { pointer.cast::<u32>().read() };
    if size as usize == size_of::<T>() {
        Ok(())
    } else {
        Err(CslamStatus::Size)
    }
}

/// A copy of a struct that the caller filled in.
///
/// # Safety
/// Unless null or misaligned, `pointer` points to as many initialised bytes as the struct's `size` says, and to four at least.
pub(crate) unsafe fn read<T: Sized32>(pointer: *const T) -> Result<T, CslamStatus> {
    // SAFETY: the caller's promise is that of `check_size`.
    unsafe { check_size(pointer)? };
    // SAFETY: not null, aligned, and as long as a `T` by what it says; every pattern of bits is a `T`.
    Ok(unsafe { pointer.read() })
}

/// Place for one value.
///
/// # Safety
/// Unless null or misaligned, `pointer` points to memory of a `T`, which nobody else uses meanwhile.
pub(crate) unsafe fn place<'a, T>(pointer: *mut T) -> Result<&'a mut MaybeUninit<T>, CslamStatus> {
    check(pointer)?;
    // SAFETY: not null and aligned; the caller says that the memory is there and its own. `MaybeUninit` reads nothing.
    Ok(unsafe { &mut *pointer.cast::<MaybeUninit<T>>() })
}

/// An array that the caller filled in.
///
/// # Safety
/// Unless null or misaligned, `pointer` points to `count` initialised values, which nobody changes meanwhile. Every pattern of bits
/// is a `T`.
pub(crate) unsafe fn array<'a, T: Copy>(pointer: *const T, count: usize) -> Result<&'a [T], CslamStatus> {
    if count == 0 {
        return Ok(&[]);
    }
    check(pointer)?;
    if count > isize::MAX as usize / size_of::<T>() {
        return Err(CslamStatus::OutOfRange);
    }
    // SAFETY: not null, aligned, not longer than memory can be; the rest is the caller's promise.
    Ok(unsafe { core::slice::from_raw_parts(pointer, count) })
}

/// An array that the caller filled in and lends to be worked on.
///
/// # Safety
/// As [`array`], and nobody else uses it meanwhile.
pub(crate) unsafe fn array_mut<'a, T: Copy>(
    pointer: *mut T,
    count: usize,
) -> Result<&'a mut [T], CslamStatus> {
    if count == 0 {
        return Ok(&mut []);
    }
    check(pointer)?;
    if count > isize::MAX as usize / size_of::<T>() {
        return Err(CslamStatus::OutOfRange);
    }
    // SAFETY: not null, aligned, not longer than memory can be; the rest is the caller's promise.
    Ok(unsafe { core::slice::from_raw_parts_mut(pointer, count) })
}
