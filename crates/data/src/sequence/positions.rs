//! Tables of stage positions.

use std::path::Path;

use super::SequenceError;
use crate::storage::read_text;
use epirig_core::tau::Tau;

/// More than a line for each of the frames that a sequence can have.
const LARGEST_TABLE: u64 = 64 << 20;

/// Reads a CSV of positions in mm: one number a line, or a table with a column named `position_mm`. Lines
/// that start with `#` are comments.
///
/// # Errors
/// [`SequenceError`] if the file cannot be read, a field is no number, the count is not `frames` or the
/// positions do not increase strictly.
pub fn read_positions(path: &Path, frames: usize) -> Result<Vec<f64>, SequenceError> {
    let text = read_text(path, LARGEST_TABLE)?;
    let mut reader = csv::ReaderBuilder::new()
        .has_headers(false)
        .comment(Some(b'#'))
        .trim(csv::Trim::All)
        .from_reader(text.as_bytes());
    let bad = |line, reason: String| SequenceError::BadPositions { path: path.to_owned(), line, reason };
    let mut column = None;
    let mut positions = Vec::new();
    for record in reader.records() {
        let record = record
            .map_err(|error| bad(error.position().map_or(0, csv::Position::line), error.to_string()))?;
        let line = record.position().map_or(0, csv::Position::line);
        let place = match column {
            Some(place) => place,
            None => {
                let named = record.iter().position(|field| field == "position_mm");
                let place = *column.insert(named.unwrap_or(0));
                if named.is_some() {
                    continue;
                }
                if record.len() > 1 {
                    return Err(bad(line, "several columns, none of them named position_mm".to_owned()));
                }
                place
            }
        };
        positions.push(number(&record, place).map_err(|reason| bad(line, reason))?);
    }
    if positions.len() != frames {
        return Err(SequenceError::PositionCount {
            path: path.to_owned(),
            positions: positions.len(),
            frames,
        });
    }
    match Tau::from_positions(&positions) {
        Ok(_) => Ok(positions),
        Err(source) => Err(SequenceError::Positions { path: path.to_owned(), source }),
    }
}

fn number(record: &csv::StringRecord, column: usize) -> Result<f64, String> {
    let field = record.get(column).ok_or("the column position_mm is missing")?;
    field.parse().map_err(|_| format!("\"{field}\" is no number"))
}
