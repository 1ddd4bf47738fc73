//! Flat images at several exposures, listed in a table.

use std::path::Path;

use super::CliError;
use epirig_calibration::photometry::ExposureLevel;
use epirig_data::sequence::{LARGEST_IMAGE, SequenceRecord, decode_grey, header};
use epirig_data::storage::{read_file, read_text};

/// More than any such table needs, in bytes.
const LARGEST_TABLE: u64 = 1 << 20;

/// Reads a CSV table with the columns file and exposure, in any order, and the images that it names, relative
/// to its folder. They must have the size and the bit depth of `record`.
pub(super) fn read_exposures(path: &Path, record: &SequenceRecord) -> Result<Vec<ExposureLevel>, CliError> {
    let name = path.display();
    let text = read_text(path, LARGEST_TABLE)
        .map_err(|error| CliError::usage(format!("cannot read the table of exposures: {error}")))?;
    let mut reader =
        csv::ReaderBuilder::new().comment(Some(b'#')).trim(csv::Trim::All).from_reader(text.as_bytes());
    let bad = |line: u64, reason: String| {
        CliError::data(format!(
            "{name}, line {line}: {reason}; write a line \"file,exposure\" and below it a line for each flat image, such as \"flat-1.png,2000\""
        ))
    };
    let headers = reader.headers().map_err(|error| bad(1, error.to_string()))?.clone();
    let column = |wanted: &str| {
        let found = headers.iter().position(|header| header == wanted);
        found.ok_or_else(|| bad(1, format!("the column {wanted} is missing")))
    };
    let (file, exposure) = (column("file")?, column("exposure")?);
    let mut levels = Vec::new();
    for row in reader.records() {
        let row =
            row.map_err(|error| bad(error.position().map_or(1, csv::Position::line), error.to_string()))?;
        let line = row.position().map_or(1, csv::Position::line);
        let exposure: f64 = row[exposure]
            .parse()
            .ok()
            .filter(|value: &f64| value.is_finite() && *value >= 0.0)
            .ok_or_else(|| bad(line, format!("\"{}\" is not an exposure", &row[exposure])))?;
        let image = path.parent().unwrap_or(Path::new("")).join(&row[file]);
        let bytes = read_file(&image, LARGEST_IMAGE).map_err(|error| bad(line, error.to_string()))?;
        let no_image = |fault| bad(line, format!("{} is damaged or not an image: {fault}", image.display()));
        let head = header(&bytes).map_err(no_image)?;
        if (head.rows, head.columns, head.bits <= 8) != (record.rows, record.columns, record.bit_depth <= 8) {
            return Err(bad(
                line,
                format!(
                    "{} is {} x {} of {} bit, the frames are {} x {} of {} bit: take it with the same camera settings",
                    image.display(),
                    head.columns,
                    head.rows,
                    head.bits,
                    record.columns,
                    record.rows,
                    record.bit_depth
                ),
            ));
        }
        levels.push(ExposureLevel::of(exposure, &decode_grey(&bytes).map_err(no_image)?.frame));
    }
    if levels.is_empty() {
        return Err(bad(1, "it lists no image".to_owned()));
    }
    Ok(levels)
}
