//! Lenses in the YAML of other programs.

use std::borrow::Cow;

use saphyr::{LoadableYamlNode, MarkedYaml, ScanError, YamlData};
use saphyr_parser::{Event, Parser};
use thiserror::Error;

use super::Lens;

/// A lens as another program's file gives it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LensFile {
    /// Rows of the frames it was found for, if the file tells.
    pub rows: Option<usize>,
    /// Columns of the frames, if the file tells.
    pub columns: Option<usize>,
    /// The lens.
    pub lens: Lens,
}

/// Why a file gives no lens. Lines are counted from 1.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum LensFileError {
    /// Another of OpenCV's formats.
    #[error("this is {0}: write it as YAML, with a name that ends in .yml")]
    OtherFormat(&'static str),
    /// No YAML.
    #[error(
        "line {line} is no YAML ({problem}): check that the file is whole, and a calibration of OpenCV or ROS"
    )]
    NotYaml {
        /// The line.
        line: usize,
        /// The parser's message.
        problem: String,
    },
    /// Something is not there.
    #[error(
        "there is no {what} (a key named {names}): check that the file is a calibration of OpenCV or ROS"
    )]
    Missing {
        /// The missing entry.
        what: &'static str,
        /// Names that it may have.
        names: String,
    },
    /// Something is not as it should be.
    #[error("line {line}: {name} is not {expected}")]
    Wrong {
        /// The line.
        line: usize,
        /// Name of the key.
        name: String,
        /// The expected value.
        expected: &'static str,
    },
    /// Another model of a lens.
    #[error(
        "line {line}: {name} {problem}; calibrate again with the model of five terms (k1, k2, p1, p2, k3; plumb_bob in ROS)"
    )]
    OtherModel {
        /// The line.
        line: usize,
        /// Name of the key.
        name: String,
        /// The sign of the other model.
        problem: String,
    },
}

/// Names under which programs write the matrix of the camera: OpenCV's samples for one camera (two), for a
/// pair.
const MATRIX: &[&str] = &["camera_matrix", "cameraMatrix", "M1"];
const DISTORTION: &[&str] = &["distortion_coefficients", "dist_coeffs", "distCoeffs", "D1"];
const ROWS: &[&str] = &["image_height"];
const COLUMNS: &[&str] = &["image_width"];
/// OpenCV's sample writes 0 or 1.
const FISHEYE: &[&str] = &["fisheye_model"];
/// ROS writes the name of a model.
const MODEL: &[&str] = &["distortion_model"];

/// A key with its value.
struct Entry<'a> {
    name: &'a str,
    value: &'a MarkedYaml<'a>,
}

impl<'a> Entry<'a> {
    fn line(&self) -> usize {
        self.value.span.start.line()
    }

    fn wrong(&self, expected: &'static str) -> LensFileError {
        LensFileError::Wrong { line: self.line(), name: self.name.to_owned(), expected }
    }

    fn other_model(&self, problem: String) -> LensFileError {
        LensFileError::OtherModel { line: self.line(), name: self.name.to_owned(), problem }
    }

    fn count(&self) -> Result<usize, LensFileError> {
        /// More than an image has rows, or a matrix.
        const MOST: i64 = 1 << 28;
        let count = self.value.data.as_integer().filter(|count| (1..=MOST).contains(count));
        count.map(|count| count as usize).ok_or_else(|| self.wrong("a whole number above 0"))
    }

    fn number(&self) -> Result<f64, LensFileError> {
        let data = &self.value.data;
        let number = data.as_floating_point().or_else(|| Some(data.as_integer()? as f64));
        number.filter(|number| number.is_finite()).ok_or_else(|| self.wrong("a number"))
    }

    /// The value of one of its keys.
    fn get(&self, name: &'static str) -> Result<Entry<'a>, LensFileError> {
        let found = mapping(self.value).find(|(key, _)| *key == name);
        let (_, value) = found.ok_or_else(|| self.wrong("a matrix with the keys rows, cols and data"))?;
        Ok(Entry { name: self.name, value })
    }

    fn numbers(&self) -> Result<Vec<f64>, LensFileError> {
        let values = self.value.data.as_sequence();
        let values = values.ok_or_else(|| self.wrong("a matrix whose data is a list of numbers"))?;
        values.iter().map(|value| Entry { name: self.name, value }.number()).collect()
    }
}

/// The lens in a file that `cv::FileStorage`, OpenCV's samples for one camera and for a pair, or ROS have
/// written; of a pair the first. Their matrices are written alike, but for a tag. ROS's rectification is not
/// read.
///
/// # Errors
/// [`LensFileError`] with the line if it is no such file, or of another model than the one of five terms
/// (`plumb_bob` in ROS).
///
/// ```
/// use epirig_calibration::lens::{Lens, opencv_yaml};
///
/// let file = opencv_yaml::write(480, 640, &Lens::pinhole(535.5, 320.0, 240.25));
/// let found = opencv_yaml::read_lens(&file)?;
/// assert_eq!((found.rows, found.columns), (Some(480), Some(640)));
/// assert_eq!(found.lens, Lens::pinhole(535.5, 320.0, 240.25));
/// # Ok::<(), epirig_calibration::lens::LensFileError>(())
/// ```
pub fn read_lens(file: &str) -> Result<LensFile, LensFileError> {
    let file = file.trim_start_matches('\u{feff}');
    match file.trim_start().chars().next() {
        Some('<') => return Err(LensFileError::OtherFormat("XML")),
        Some('{') => return Err(LensFileError::OtherFormat("JSON")),
        _ => {}
    }
    // OpenCV begins its files with a directive in the manner of YAML 1.0, at which parsers stop; as a comment
    // it keeps its line.
    let file = file.strip_prefix("%YAML:").map_or(Cow::Borrowed(file), |rest| format!("#YAML:{rest}").into());
    check_depth(&file)?;
    let documents = MarkedYaml::load_from_str(&file).map_err(not_yaml)?;
    if let Some(entry) = find(&documents, FISHEYE).filter(|entry| entry.value.data.as_integer() != Some(0)) {
        return Err(entry.other_model("says that this is a fisheye lens".to_owned()));
    }
    if let Some(entry) = find(&documents, MODEL) {
        // The denominator of a rational polynomial may be 1, which its coefficients tell.
        match entry.value.data.as_str() {
            Some("plumb_bob" | "rational_polynomial") => {}
            other => return Err(entry.other_model(format!("is {}", other.unwrap_or("no name")))),
        }
    }
    let [fx, fy, cx, cy] = pinhole(&required(&documents, "matrix of the camera", MATRIX)?)?;
    let [k1, k2, p1, p2, k3] = terms(&required(&documents, "distortion", DISTORTION)?)?;
    let size = |names| find(&documents, names).map(|entry| entry.count()).transpose();
    Ok(LensFile {
        rows: size(ROWS)?,
        columns: size(COLUMNS)?,
        lens: Lens::from_array([fx, fy, cx, cy, k1, k2, p1, p2, k3]),
    })
}

fn not_yaml(error: ScanError) -> LensFileError {
    LensFileError::NotYaml { line: error.marker().line(), problem: error.info().to_owned() }
}

/// Refuses files that nest deeper than any calibration: trees are walked by recursion.
fn check_depth(file: &str) -> Result<(), LensFileError> {
    const DEEPEST: usize = 16;
    let mut parser = Parser::new_from_str(file);
    let mut depth = 0_usize;
    while let Some(event) = parser.next_event() {
        let (event, span) = event.map_err(not_yaml)?;
        match event {
            Event::SequenceStart(..) | Event::MappingStart(..) => depth += 1,
            Event::SequenceEnd | Event::MappingEnd => depth = depth.saturating_sub(1),
            _ => {}
        }
        if depth > DEEPEST {
            let problem = format!("it nests deeper than {DEEPEST} times");
            return Err(LensFileError::NotYaml { line: span.start.line(), problem });
        }
    }
    Ok(())
}

/// The keys of a mapping with their values; nothing for other nodes.
fn mapping<'a>(node: &'a MarkedYaml<'a>) -> impl Iterator<Item = (&'a str, &'a MarkedYaml<'a>)> {
    let node = match &node.data {
        YamlData::Tagged(_, inner) => inner,
        _ => node,
    };
    node.data.as_mapping().into_iter().flatten().filter_map(|(key, value)| Some((key.data.as_str()?, value)))
}

/// The first of `names` that the file has.
fn find<'a>(documents: &'a [MarkedYaml<'a>], names: &[&str]) -> Option<Entry<'a>> {
    names.iter().find_map(|wanted| {
        let (name, value) = documents.iter().flat_map(mapping).find(|(name, _)| name == wanted)?;
        Some(Entry { name, value })
    })
}

fn required<'a>(
    documents: &'a [MarkedYaml<'a>],
    what: &'static str,
    names: &[&str],
) -> Result<Entry<'a>, LensFileError> {
    find(documents, names).ok_or_else(|| LensFileError::Missing { what, names: names.join(", ") })
}

/// Rows, columns and numbers of a matrix.
fn matrix(entry: &Entry<'_>) -> Result<(usize, usize, Vec<f64>), LensFileError> {
    let (rows, columns) = (entry.get("rows")?.count()?, entry.get("cols")?.count()?);
    let numbers = entry.get("data")?.numbers()?;
    if rows.checked_mul(columns) != Some(numbers.len()) {
        return Err(entry.wrong("a matrix with as many numbers as rows and cols say"));
    }
    Ok((rows, columns, numbers))
}

/// fx, fy, cx, cy.
fn pinhole(entry: &Entry<'_>) -> Result<[f64; 4], LensFileError> {
    match (matrix(entry)?.2)[..] {
        [fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0] if fx > 0.0 && fy > 0.0 => Ok([fx, fy, cx, cy]),
        _ => Err(entry.wrong("a matrix fx 0 cx, 0 fy cy, 0 0 1 with fx and fy above 0 (no skew)")),
    }
}

/// k1, k2, p1, p2, k3.
fn terms(entry: &Entry<'_>) -> Result<[f64; 5], LensFileError> {
    let (rows, columns, numbers) = matrix(entry)?;
    if rows.min(columns) != 1 || !matches!(numbers.len(), 4 | 5 | 8 | 12 | 14) {
        return Err(entry.wrong("a row or column of 4, 5, 8, 12 or 14 numbers"));
    }
    if let Some(index) = numbers.iter().skip(5).position(|number| *number != 0.0) {
        return Err(entry.other_model(format!(
            "has {} terms, of which number {} is not 0",
            numbers.len(),
            index + 6
        )));
    }
    Ok(std::array::from_fn(|index| numbers.get(index).copied().unwrap_or(0.0)))
}

/// A number that is read back to the last bit, in a form that YAML 1.0 and 1.1 accept: with a point and a
/// signed exponent.
pub(super) fn number(value: f64) -> String {
    let text = format!("{value:?}");
    match text.split_once('e') {
        Some((digits, exponent)) => {
            let point = if digits.contains('.') { "" } else { ".0" };
            let sign = if exponent.starts_with('-') { "" } else { "+" };
            format!("{digits}{point}e{sign}{exponent}")
        }
        None => text,
    }
}

/// Numbers as a list in brackets.
pub(super) fn list(values: &[f64]) -> String {
    let numbers: Vec<String> = values.iter().map(|value| number(*value)).collect();
    format!("[ {} ]", numbers.join(", "))
}

/// The matrix of the camera, row by row.
pub(super) fn camera_matrix(lens: &Lens) -> [f64; 9] {
    let [fx, fy, cx, cy, ..] = lens.to_array();
    [fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0]
}

/// k1, k2, p1, p2, k3.
pub(super) fn distortion(lens: &Lens) -> [f64; 5] {
    let [_, _, _, _, terms @ ..] = lens.to_array();
    terms
}
