//! PLY meshes, ascii and binary little-endian: `x`, `y`, `z` of the vertices and the index list of the faces. Everything
//! else in the file is read over.

use std::path::Path;

use super::{Scene, weld};
use crate::input::limits::{FACE_VERTICES, SCENE, SCENE_FACES, SCENE_VERTICES};
use crate::input::{InputError, read_bytes};

/// Scalar types of the format, by size and kind.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Scalar {
    Signed(usize),
    Unsigned(usize),
    Float(usize),
}

impl Scalar {
    fn parse(word: &str) -> Option<Self> {
        Some(match word {
            "char" | "int8" => Self::Signed(1),
            "short" | "int16" => Self::Signed(2),
            "int" | "int32" => Self::Signed(4),
            "uchar" | "uint8" => Self::Unsigned(1),
            "ushort" | "uint16" => Self::Unsigned(2),
            "uint" | "uint32" => Self::Unsigned(4),
            "float" | "float32" => Self::Float(4),
            "double" | "float64" => Self::Float(8),
            _ => return None,
        })
    }

    fn size(self) -> usize {
        match self {
            Self::Signed(n) | Self::Unsigned(n) | Self::Float(n) => n,
        }
    }

    /// Value of little-endian bytes. All these types fit a double exactly.
    fn decode(self, bytes: &[u8]) -> f64 {
        let mut wide = [0_u8; 8];
        wide[..bytes.len()].copy_from_slice(bytes);
        let raw = u64::from_le_bytes(wide);
        let unused = 64 - 8 * bytes.len() as u32;
        match self {
            Self::Unsigned(_) => raw as f64,
            Self::Signed(_) => (((raw << unused) as i64) >> unused) as f64,
            Self::Float(4) => f64::from(f32::from_bits(raw as u32)),
            Self::Float(_) => f64::from_bits(raw),
        }
    }
}

#[derive(Debug)]
struct Property {
    name: String,
    value: Scalar,
    /// Type of the count, for a list.
    count: Option<Scalar>,
}

impl Property {
    /// Reads its value or list: a coordinate into `vertex`, the indices of a face as the result.
    fn read(&self, body: &mut Body<'_>, vertex: &mut [Option<f64>; 3]) -> Result<Option<Vec<usize>>, String> {
        let Some(kind) = self.count else {
            let value = body.next(self.value)?;
            if let Some(axis) = ["x", "y", "z"].iter().position(|name| *name == self.name) {
                vertex[axis] = Some(value);
            }
            return Ok(None);
        };
        let length = whole(body.next(kind)?)?;
        if !matches!(self.name.as_str(), "vertex_indices" | "vertex_index") {
            return (0..length)
                .try_for_each(|_| body.next(self.value).map(drop))
                .map(|()| None);
        }
        if length > FACE_VERTICES {
            return Err(format!(
                "a face has {length} vertices, at most {FACE_VERTICES} are read"
            ));
        }
        (0..length)
            .map(|_| whole(body.next(self.value)?))
            .collect::<Result<_, _>>()
            .map(Some)
    }
}

#[derive(Debug)]
struct Element {
    name: String,
    count: usize,
    properties: Vec<Property>,
}

/// Where the values come from.
enum Body<'a> {
    Ascii(std::str::SplitAsciiWhitespace<'a>),
    Binary(&'a [u8]),
}

impl Body<'_> {
    fn next(&mut self, kind: Scalar) -> Result<f64, String> {
        match self {
            Self::Ascii(words) => {
                let word = words.next().ok_or("ends before its last element")?;
                word.parse()
                    .map_err(|_| format!("expected a number, found \"{word}\""))
            }
            Self::Binary(bytes) => {
                let (value, rest) = bytes
                    .split_at_checked(kind.size())
                    .ok_or("ends before its last element")?;
                *bytes = rest;
                Ok(kind.decode(value))
            }
        }
    }
}

/// Reads a PLY mesh. Units are metres, z points up, faces wind counter-clockwise seen from free space.
pub(super) fn read(file: &Path) -> Result<Scene, InputError> {
    let bytes = read_bytes(file, &SCENE)?;
    let polygons = parse(&bytes).map_err(|e| InputError::in_file(file, format!("not a PLY mesh: {e}")))?;
    weld::mesh_scene(file, polygons)
}

fn parse(bytes: &[u8]) -> Result<Vec<Vec<[f64; 3]>>, String> {
    let (elements, mut body) = header(bytes)?;
    let mut vertices: Vec<[f64; 3]> = Vec::new();
    let mut polygons = Vec::new();
    for element in &elements {
        for row in 0..element.count {
            let mut vertex = [None; 3];
            let mut polygon = None;
            for property in &element.properties {
                let indices = property
                    .read(&mut body, &mut vertex)
                    .map_err(|e| format!("{} {row}: {}: {e}", element.name, property.name))?;
                polygon = indices.or(polygon);
            }
            match element.name.as_str() {
                "vertex" => {
                    let [Some(x), Some(y), Some(z)] = vertex else {
                        return Err("element vertex: expected the properties x, y and z".into());
                    };
                    vertices.push([x, y, z]);
                }
                "face" => {
                    let indices = polygon.ok_or("element face: expected the list property vertex_indices")?;
                    let polygon: Option<Vec<[f64; 3]>> =
                        indices.iter().map(|&i| vertices.get(i).copied()).collect();
                    polygons.push(polygon.ok_or_else(|| {
                        format!(
                            "face {row}: names a vertex beyond the {} before it",
                            vertices.len()
                        )
                    })?);
                }
                _ => {}
            }
        }
    }
    Ok(polygons)
}

/// A count or an index.
fn whole(value: f64) -> Result<usize, String> {
    if value >= 0.0 && value <= f64::from(u32::MAX) && value.fract() == 0.0 {
        Ok(value as usize)
    } else {
        Err(format!("expected a count or an index, found {value}"))
    }
}

fn header(bytes: &[u8]) -> Result<(Vec<Element>, Body<'_>), String> {
    let mut rest = bytes;
    let mut line = || -> Result<(&str, &[u8]), String> {
        let end = rest
            .iter()
            .position(|&b| b == b'\n')
            .ok_or("its header has no end_header")?;
        let text = std::str::from_utf8(&rest[..end]).map_err(|_| "its header is not text")?;
        rest = &rest[end + 1..];
        Ok((text.trim(), rest))
    };
    if line()?.0 != "ply" {
        return Err("its first line is not \"ply\"".into());
    }
    let mut elements: Vec<Element> = Vec::new();
    let mut binary = None;
    loop {
        let (text, after) = line()?;
        let words: Vec<&str> = text.split_ascii_whitespace().collect();
        match words[..] {
            ["format", "ascii", "1.0"] => binary = Some(false),
            ["format", "binary_little_endian", "1.0"] => binary = Some(true),
            ["comment" | "obj_info", ..] => {}
            ["element", name, count] => elements.push(Element {
                name: name.into(),
                count: element_count(name, count)?,
                properties: Vec::new(),
            }),
            ["property", "list", count, value, name] => {
                push(&mut elements, name, value, Some(count))?;
            }
            ["property", value, name] => push(&mut elements, name, value, None)?,
            ["end_header"] => {
                if let Some(empty) = elements.iter().find(|e| e.properties.is_empty()) {
                    return Err(format!("element {}: expected at least one property", empty.name));
                }
                let body = match binary {
                    Some(true) => Body::Binary(after),
                    Some(false) => Body::Ascii(
                        std::str::from_utf8(after)
                            .map_err(|_| "its body is not text")?
                            .split_ascii_whitespace(),
                    ),
                    None => return Err("expected a line \"format\" in its header".into()),
                };
                return Ok((elements, body));
            }
            _ => {
                return Err(format!(
                    "cannot use the header line \"{text}\" (formats: ascii 1.0, binary_little_endian 1.0)"
                ));
            }
        }
    }
}

/// The count of an element, within the limits of a scene.
fn element_count(name: &str, count: &str) -> Result<usize, String> {
    let number = count
        .parse()
        .map_err(|_| format!("element {name}: expected a count, found \"{count}\""))?;
    let most = match name {
        "vertex" => SCENE_VERTICES,
        "face" => SCENE_FACES,
        _ => return Ok(number),
    };
    if number > most {
        return Err(format!("element {name}: {number} in it, at most {most} are read"));
    }
    Ok(number)
}

fn push(elements: &mut [Element], name: &str, value: &str, count: Option<&str>) -> Result<(), String> {
    let scalar =
        |word: &str| Scalar::parse(word).ok_or_else(|| format!("property {name}: unknown type \"{word}\""));
    let count = count.map(scalar).transpose()?;
    if matches!(count, Some(Scalar::Float(_))) {
        return Err(format!(
            "property {name}: the count of a list must be a whole number"
        ));
    }
    elements
        .last_mut()
        .ok_or("a property stands before the first element")?
        .properties
        .push(Property {
            name: name.into(),
            value: scalar(value)?,
            count,
        });
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    const HEADER: &str = "comment a roof\nelement vertex 4\nproperty float x\nproperty double y\nproperty float z\n\
        property uchar red\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n";

    fn square() -> Vec<Vec<[f64; 3]>> {
        vec![vec![
            [0.0, 0.0, 2.5],
            [1.0, 0.0, 2.5],
            [1.0, -1.0, 2.5],
            [0.0, -1.0, 2.5],
        ]]
    }

    fn binary() -> Vec<u8> {
        let mut bytes = format!("ply\nformat binary_little_endian 1.0\n{HEADER}").into_bytes();
        for [x, y, z] in &square()[0] {
            bytes.extend((*x as f32).to_le_bytes());
            bytes.extend(y.to_le_bytes());
            bytes.extend((*z as f32).to_le_bytes());
            bytes.push(200);
        }
        bytes.push(4);
        for i in 0..4_i32 {
            bytes.extend(i.to_le_bytes());
        }
        bytes
    }

    #[test]
    fn both_encodings_give_the_same_polygon() {
        let text = format!(
            "ply\nformat ascii 1.0\n{HEADER}0 0 2.5 9\n1 0 2.5 9\n1 -1 2.5 9\n0 -1 2.5 9\n4 0 1 2 3\n"
        );
        assert_eq!(parse(text.as_bytes()).unwrap(), square());
        assert_eq!(parse(&binary()).unwrap(), square());
    }

    #[test]
    fn a_cut_file_is_refused_at_every_length() {
        let bytes = binary();
        for length in 0..bytes.len() {
            assert!(parse(&bytes[..length]).is_err(), "{length} bytes were accepted");
        }
    }

    #[test]
    fn an_index_beyond_the_vertices_is_named() {
        let text = format!("ply\nformat ascii 1.0\n{HEADER}0 0 2 9\n1 0 2 9\n1 1 2 9\n0 1 2 9\n3 0 1 4\n");
        assert_eq!(
            parse(text.as_bytes()).unwrap_err(),
            "face 0: names a vertex beyond the 4 before it"
        );
    }

    #[test]
    fn an_element_without_properties_is_refused_whatever_its_count() {
        let text = "ply\nformat ascii 1.0\nelement camera 99999999999999\nend_header\n";
        assert_eq!(
            parse(text.as_bytes()).unwrap_err(),
            "element camera: expected at least one property"
        );
    }

    #[test]
    fn more_than_the_limits_is_refused_before_it_is_read() {
        let error = |from: &str, to: &str| {
            let header = HEADER.replace(from, to);
            let text =
                format!("ply\nformat ascii 1.0\n{header}0 0 2 9\n1 0 2 9\n1 1 2 9\n0 1 2 9\n9999 0 1 2\n");
            parse(text.as_bytes()).unwrap_err()
        };
        assert_eq!(
            error("vertex 4", "vertex 4000001"),
            "element vertex: 4000001 in it, at most 4000000 are read"
        );
        assert_eq!(
            error("face 1", "face 1000001"),
            "element face: 1000001 in it, at most 1000000 are read"
        );
        assert_eq!(
            error("uchar int", "uint int"),
            "face 0: vertex_indices: a face has 9999 vertices, at most 1024 are read"
        );
    }

    #[test]
    fn a_word_that_is_no_number_is_told_with_its_place() {
        let text = format!("ply\nformat ascii 1.0\n{HEADER}0 0 2 9\n1 O 2 9\n1 1 2 9\n0 1 2 9\n3 0 1 2\n");
        assert_eq!(
            parse(text.as_bytes()).unwrap_err(),
            "vertex 1: y: expected a number, found \"O\""
        );
    }

    #[test]
    fn signed_and_unsigned_bytes_differ() {
        assert_eq!(Scalar::Signed(1).decode(&[0xff]), -1.0);
        assert_eq!(Scalar::Unsigned(1).decode(&[0xff]), 255.0);
        assert_eq!(Scalar::Signed(2).decode(&[0x00, 0x80]), -32768.0);
    }
}
