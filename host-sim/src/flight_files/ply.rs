//! Point clouds as PLY files, ASCII or binary little endian.

use std::io::{self, Write};

/// Values of one property, one per point.
#[derive(Clone, Debug)]
pub enum Column {
    /// `float`.
    F32(Vec<f32>),
    /// `int`: Open3D skips unsigned ones.
    I32(Vec<i32>),
}

impl Column {
    fn len(&self) -> usize {
        match self {
            Self::F32(values) => values.len(),
            Self::I32(values) => values.len(),
        }
    }

    fn type_name(&self) -> &'static str {
        match self {
            Self::F32(_) => "float",
            Self::I32(_) => "int",
        }
    }
}

/// How values are written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Encoding {
    /// Readable text; floats in the shortest form that reads back to the same value.
    Ascii,
    /// Little endian.
    Binary,
}

/// Writes vertices with the given properties (name, values). Names of the first three are `x`, `y`, `z` by convention.
///
/// # Errors
/// Those of the writer; [`io::ErrorKind::InvalidInput`] when the columns differ in length.
pub fn write(
    out: &mut impl Write,
    encoding: Encoding,
    comment: &str,
    properties: &[(&str, Column)],
) -> io::Result<()> {
    let count = properties.first().map_or(0, |(_, column)| column.len());
    if properties.iter().any(|(_, column)| column.len() != count) {
        return Err(io::Error::new(
            io::ErrorKind::InvalidInput,
            "PLY columns differ in length",
        ));
    }
    let format = match encoding {
        Encoding::Ascii => "ascii",
        Encoding::Binary => "binary_little_endian",
    };
    writeln!(
        out,
        "ply\nformat {format} 1.0\ncomment {comment}\nelement vertex {count}"
    )?;
    for (name, column) in properties {
        writeln!(out, "property {} {name}", column.type_name())?;
    }
    writeln!(out, "end_header")?;
    for row in 0..count {
        for (index, (_, column)) in properties.iter().enumerate() {
            match (encoding, column) {
                (Encoding::Binary, Column::F32(values)) => out.write_all(&values[row].to_le_bytes())?,
                (Encoding::Binary, Column::I32(values)) => out.write_all(&values[row].to_le_bytes())?,
                (Encoding::Ascii, column) => {
                    let separator = if index == 0 { "" } else { " " };
                    match column {
                        Column::F32(values) => write!(out, "{separator}{}", values[row])?,
                        Column::I32(values) => write!(out, "{separator}{}", values[row])?,
                    }
                }
            }
        }
        if encoding == Encoding::Ascii {
            writeln!(out)?;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn columns() -> Vec<(&'static str, Column)> {
        vec![
            ("x", Column::F32(vec![0.1, -2.0])),
            ("hits", Column::I32(vec![1, 70_000])),
        ]
    }

    #[test]
    fn ascii_is_readable_and_exact() {
        let mut text = Vec::new();
        write(&mut text, Encoding::Ascii, "test", &columns()).expect("a vector takes all");
        let expected = "ply\nformat ascii 1.0\ncomment test\nelement vertex 2\nproperty float x\n\
                        property int hits\nend_header\n0.1 1\n-2 70000\n";
        assert_eq!(String::from_utf8(text).expect("text"), expected);
    }

    #[test]
    fn binary_is_little_endian_without_padding() {
        let mut bytes = Vec::new();
        write(&mut bytes, Encoding::Binary, "test", &columns()).expect("a vector takes all");
        assert_eq!(
            bytes[bytes.len() - 16..bytes.len() - 8],
            [0xcd, 0xcc, 0xcc, 0x3d, 1, 0, 0, 0]
        );
        assert!(bytes.ends_with(&[0, 0, 0, 0xc0, 0x70, 0x11, 1, 0]));
    }

    #[test]
    fn uneven_columns_are_refused() {
        let uneven = [("x", Column::F32(vec![1.0])), ("y", Column::F32(vec![]))];
        assert!(write(&mut Vec::new(), Encoding::Ascii, "", &uneven).is_err());
    }
}
