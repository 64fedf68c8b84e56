//! Model files of the flight code on the host: bytes at an address that the flight code takes.

use std::path::Path;

use cslam_core::link_state::format::{ALIGNMENT, length};
use cslam_core::link_state::{Description, Model, ModelError, WriteError, write};

use crate::input::limits::MODEL;
use crate::input::{InputError, read_bytes};

/// The bytes of a model file, suitably aligned.
#[derive(Clone, Debug)]
pub struct ModelFile {
    bytes: Vec<u8>,
    start: usize,
}

impl ModelFile {
    /// A copy of bytes, whatever they are.
    pub fn from_bytes(bytes: &[u8]) -> Self {
        let mut file = Self::zeroed(bytes.len());
        file.content_mut().copy_from_slice(bytes);
        file
    }

    /// The file of a network.
    ///
    /// # Errors
    /// [`WriteError`] for a description that does not fit itself.
    pub fn of(description: &Description<'_>) -> Result<Self, WriteError> {
        let mut file = Self::zeroed(length(&description.shape, description.names.len()));
        write(description, file.content_mut())?;
        Ok(file)
    }

    /// Reads and checks a model file.
    ///
    /// # Errors
    /// [`InputError`] naming the file, and why it is no model.
    pub fn read(file: &Path) -> Result<Self, InputError> {
        let read = Self::from_bytes(&read_bytes(file, &MODEL)?);
        match read.model() {
            Ok(_) => Ok(read),
            Err(error) => Err(InputError::in_file(file, error.to_string())),
        }
    }

    /// The model in it.
    ///
    /// # Errors
    /// [`ModelError`], never for a file that was written or read here.
    pub fn model(&self) -> Result<Model<'_>, ModelError> {
        Model::parse(self.bytes())
    }

    /// Its bytes.
    pub fn bytes(&self) -> &[u8] {
        &self.bytes[self.start..]
    }

    fn content_mut(&mut self) -> &mut [u8] {
        &mut self.bytes[self.start..]
    }

    fn zeroed(length: usize) -> Self {
        let mut bytes = vec![0; length + ALIGNMENT - 1];
        let start = (0..ALIGNMENT)
            .find(|&start| bytes[start..].as_ptr().addr().is_multiple_of(ALIGNMENT))
            .unwrap_or(0);
        bytes.truncate(start + length);
        Self { bytes, start }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_are_aligned_and_kept() {
        for length in 0..64 {
            let bytes: Vec<u8> = (0..length).collect();
            let file = ModelFile::from_bytes(&bytes);
            assert_eq!(file.bytes(), bytes);
            assert!(file.bytes().as_ptr().addr().is_multiple_of(ALIGNMENT));
        }
        assert_eq!(
            ModelFile::from_bytes(b"LSCN").model().err(),
            Some(ModelError::TooShort)
        );
    }
}
