//! Points of an option, as they are typed or listed.

use std::path::Path;

use crate::input::limits::{POINT_COUNT, POINTS};
use crate::input::{InputError, lines, read_text};
use crate::scene::MAX_COORDINATE_M;

/// Points of an option: one as x,y,z, or a file with one a line. Empty lines and lines that start with # are skipped.
pub(super) fn points(option: &str, value: Option<&str>) -> Result<Vec<[f64; 3]>, InputError> {
    let value = value.ok_or_else(|| InputError::new(format!("{option}: expected a point or a file")))?;
    if let Some(point) = point(value) {
        return Ok(vec![point]);
    }
    let file = Path::new(value);
    if !file.exists() {
        return Err(InputError::new(format!(
            "{option} {value}: expected x,y,z in metres, or a file that has one such point a line"
        )));
    }
    let text = read_text(file, &POINTS)?;
    let mut points = Vec::new();
    for line in lines(file, &text, &POINTS) {
        let (number, line) = line?;
        let line = line.trim();
        if line.is_empty() || line.starts_with('#') {
            continue;
        }
        points.push(point(line).ok_or_else(|| {
            InputError::at_line(
                file,
                number,
                format!("expected x,y,z in metres, found \"{line}\""),
            )
        })?);
        if points.len() > POINT_COUNT {
            let message = format!("expected at most {POINT_COUNT} points");
            return Err(InputError::at_line(file, number, message));
        }
    }
    if points.is_empty() {
        return Err(InputError::in_file(file, "has no point: expected x,y,z a line"));
    }
    Ok(points)
}

/// A point as x,y,z, m.
pub(super) fn point(text: &str) -> Option<[f64; 3]> {
    let numbers: Option<Vec<f64>> = text
        .split(',')
        .map(|word| {
            word.trim()
                .parse()
                .ok()
                .filter(|x: &f64| x.abs() <= MAX_COORDINATE_M)
        })
        .collect();
    numbers?.try_into().ok()
}
