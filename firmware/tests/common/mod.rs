//! Shared memory of a test: one vector, any number of views.

use std::cell::{Cell, RefCell};
use std::rc::Rc;

use cslam_firmware::ring::{AccessError, SharedMemory};

/// A view. Clones see the same bytes.
#[derive(Clone, Debug)]
pub(crate) struct Memory {
    bytes: Rc<RefCell<Vec<u8>>>,
    broken: Rc<Cell<bool>>,
}

impl Memory {
    /// Memory full of garbage.
    pub(crate) fn new(length: usize) -> Self {
        Self {
            bytes: Rc::new(RefCell::new(vec![0xee; length])),
            broken: Rc::default(),
        }
    }

    /// A copy of its bytes.
    #[allow(dead_code, reason = "each test binary uses its own part of this module")]
    pub(crate) fn bytes(&self) -> Vec<u8> {
        self.bytes.borrow().clone()
    }

    /// From now on every access fails.
    #[allow(dead_code, reason = "each test binary uses its own part of this module")]
    pub(crate) fn break_down(&self) {
        self.broken.set(true);
    }

    fn check(&self) -> Result<(), AccessError> {
        if self.broken.get() {
            Err(AccessError::Failed)
        } else {
            Ok(())
        }
    }
}

impl SharedMemory for Memory {
    fn size(&self) -> usize {
        self.bytes.borrow().len()
    }

    fn read(&self, offset: usize, into: &mut [u8]) -> Result<(), AccessError> {
        self.check()?;
        let bytes = self.bytes.borrow();
        let range = bytes
            .get(offset..offset + into.len())
            .ok_or(AccessError::OutOfRange)?;
        into.copy_from_slice(range);
        Ok(())
    }

    fn write(&mut self, offset: usize, from: &[u8]) -> Result<(), AccessError> {
        self.check()?;
        let mut bytes = self.bytes.borrow_mut();
        let range = bytes
            .get_mut(offset..offset + from.len())
            .ok_or(AccessError::OutOfRange)?;
        range.copy_from_slice(from);
        Ok(())
    }
}
