//! Columns as NumPy files (`.npy`, format 1.0, little-endian, C order): `numpy.load` reads them as they are.

use std::path::Path;

use crate::input::limits::DATASET_COLUMN;
use crate::input::{InputError, read_bytes};

/// A number type that a column may have.
pub trait Element: Copy + PartialEq {
    /// NumPy's name of the type.
    const DESCRIPTOR: &'static str;
    /// Bytes of an element.
    const BYTES: usize;
    /// Appends the little-endian bytes.
    fn push(self, bytes: &mut Vec<u8>);
    /// From exactly [`Self::BYTES`] little-endian bytes.
    fn from_slice(bytes: &[u8]) -> Self;
}

macro_rules! element {
    ($t:ty, $descriptor:literal) => {
        impl Element for $t {
            const DESCRIPTOR: &'static str = $descriptor;
            const BYTES: usize = size_of::<$t>();
            fn push(self, bytes: &mut Vec<u8>) {
                bytes.extend_from_slice(&self.to_le_bytes());
            }
            fn from_slice(bytes: &[u8]) -> Self {
                let mut word = [0; size_of::<$t>()];
                word.iter_mut().zip(bytes).for_each(|(w, b)| *w = *b);
                Self::from_le_bytes(word)
            }
        }
    };
}

element!(f32, "<f4");
element!(f64, "<f8");
element!(i32, "<i4");
element!(u8, "|u1");
element!(u32, "<u4");
element!(u64, "<u8");

const MAGIC: &[u8] = b"\x93NUMPY\x01\x00";
/// The header ends at a multiple of this.
const ALIGNMENT: usize = 64;

/// The bytes of a column: rows of `width` elements, or a plain vector when `width` is `None`.
pub fn encode<T: Element>(values: &[T], width: Option<usize>) -> Vec<u8> {
    let shape = match width {
        Some(width) => format!("({}, {width})", values.len() / width.max(1)),
        None => format!("({},)", values.len()),
    };
    let mut bytes = head(T::DESCRIPTOR, &shape);
    values.iter().for_each(|value| value.push(&mut bytes));
    bytes
}

/// The bytes of a column of texts, each as long as the longest.
pub fn encode_texts(values: &[&str]) -> Vec<u8> {
    // NumPy has no text of length zero.
    let longest = values
        .iter()
        .map(|text| text.chars().count())
        .max()
        .unwrap_or(0)
        .max(1);
    let mut bytes = head(&format!("<U{longest}"), &format!("({},)", values.len()));
    for text in values {
        let letters = text.chars().chain(std::iter::repeat('\0')).take(longest);
        letters.for_each(|letter| u32::from(letter).push(&mut bytes));
    }
    bytes
}

/// What comes before the elements.
fn head(descriptor: &str, shape: &str) -> Vec<u8> {
    let mut header = format!("{{'descr': '{descriptor}', 'fortran_order': False, 'shape': {shape}, }}");
    let unpadded = MAGIC.len() + 2 + header.len() + 1;
    header.extend(std::iter::repeat_n(
        ' ',
        unpadded.next_multiple_of(ALIGNMENT) - unpadded,
    ));
    header.push('\n');
    let mut bytes = MAGIC.to_vec();
    bytes.extend_from_slice(&(header.len() as u16).to_le_bytes());
    bytes.extend_from_slice(header.as_bytes());
    bytes
}

/// Reads a column of rows of `width` elements, or a plain vector.
///
/// # Errors
/// [`InputError`] naming the file and what was expected.
pub fn read<T: Element>(file: &Path, width: Option<usize>) -> Result<Vec<T>, InputError> {
    let bytes = read_bytes(file, &DATASET_COLUMN)?;
    decode(&bytes, width).map_err(|message| InputError::in_file(file, message))
}

fn decode<T: Element>(bytes: &[u8], width: Option<usize>) -> Result<Vec<T>, String> {
    let rest = bytes
        .strip_prefix(MAGIC)
        .ok_or("expected a NumPy file of format 1.0")?;
    let (length, rest) = rest.split_first_chunk::<2>().ok_or("cut short in its header")?;
    let length = usize::from(u16::from_le_bytes(*length));
    let (header, data) = rest.split_at_checked(length).ok_or("cut short in its header")?;
    let header = std::str::from_utf8(header).map_err(|_| "header is not text")?;
    if !header.contains(&format!("'descr': '{}'", T::DESCRIPTOR)) {
        return Err(format!(
            "expected elements {}, found {}",
            T::DESCRIPTOR,
            header.trim()
        ));
    }
    if !header.contains("'fortran_order': False") {
        return Err("expected rows one after the other (fortran_order False)".into());
    }
    let shape = header
        .split_once("'shape': (")
        .and_then(|(_, s)| s.split_once(')'));
    let shape: Option<Vec<usize>> = shape.map(|(s, _)| {
        let words = s.split(',').map(str::trim).filter(|w| !w.is_empty());
        words.map_while(|w| w.parse().ok()).collect()
    });
    let elements = match (shape.as_deref(), width) {
        (Some(&[rows]), None) => Some(rows),
        (Some(&[rows, found]), Some(width)) if found == width => rows.checked_mul(width),
        _ => None,
    };
    let elements = elements.ok_or_else(|| match width {
        Some(width) => format!("expected rows of {width}, found {}", header.trim()),
        None => format!("expected a plain vector, found {}", header.trim()),
    })?;
    if elements.checked_mul(T::BYTES) != Some(data.len()) {
        return Err(format!(
            "expected {elements} elements of {} bytes, found {} bytes",
            T::BYTES,
            data.len()
        ));
    }
    Ok(data.chunks_exact(T::BYTES).map(T::from_slice).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_survive_the_file() {
        let values = [1.5_f32, -0.0, f32::MAX, 3e-39];
        assert_eq!(
            decode::<f32>(&encode(&values, Some(2)), Some(2)).expect("sound"),
            values
        );
        assert_eq!(
            decode::<u8>(&encode(&[7_u8, 255], None), None).expect("sound"),
            [7, 255]
        );
        assert_eq!(
            decode::<u64>(&encode(&[u64::MAX], None), None).expect("sound"),
            [u64::MAX]
        );
        assert!(
            decode::<f32>(&encode::<f32>(&[], Some(3)), Some(3))
                .expect("sound")
                .is_empty()
        );
    }

    #[test]
    fn the_header_is_as_numpy_writes_it() {
        let bytes = encode(&[1.0_f32, 2.0, 3.0], Some(3));
        assert_eq!(bytes.len(), 128 + 12);
        let header = String::from_utf8_lossy(&bytes[10..128]).into_owned();
        assert!(header.starts_with("{'descr': '<f4', 'fortran_order': False, 'shape': (1, 3), }"));
        assert!(header.ends_with(" \n"));
    }

    #[test]
    fn what_is_wrong_is_said() {
        let good = encode(&[1.0_f32, 2.0], None);
        let error = |bytes: &[u8], width| decode::<f32>(bytes, width).expect_err("wrong");
        assert!(error(&good[..good.len() - 1], None).contains("expected 2 elements"));
        assert!(error(&good, Some(2)).contains("rows of 2"));
        assert!(error(&encode(&[1_u8], None), None).contains("expected elements <f4"));
        assert!(error(b"PK", None).contains("NumPy"));
        assert!(error(&good[..20], None).contains("cut short"));
    }
}
