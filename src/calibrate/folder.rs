//! `calibration.json` and its maps and pictures, in the folder of a sequence.

use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};

use atomic_write_file::AtomicWriteFile;

use super::{CalibrateError, Calibration, FORMAT_VERSION, InputHashes};
use crate::formats::MapFormat;
use crate::photometry::Maps;
use crate::plane::Plane;
use crate::sequence::Sequence;

/// Name of the record.
pub const CALIBRATION: &str = "calibration.json";
/// Folder of maps and pictures.
const FOLDER: &str = "calibration";
const DARK_MAP: &str = "dark.tiff";
const FLAT_MAP: &str = "flat-field.tiff";

/// Where a calibration is written. The record comes last, so that it names nothing that is not there.
#[derive(Debug)]
pub struct CalibrationFolder {
    sequence: PathBuf,
}

impl CalibrationFolder {
    /// Of a sequence.
    ///
    /// # Errors
    /// [`CalibrateError::Exists`] if it has a calibration and `overwrite` is not set; [`CalibrateError::Io`] if nothing can be written there.
    pub fn of(sequence: &Path, overwrite: bool) -> Result<Self, CalibrateError> {
        let path = sequence.join(CALIBRATION);
        if path.exists() && !overwrite {
            return Err(CalibrateError::Exists { path });
        }
        // A folder that cannot be written is better known before the work than after it.
        AtomicWriteFile::open(&path).and_then(AtomicWriteFile::discard).map_err(io("write", &path))?;
        Ok(Self { sequence: sequence.to_owned() })
    }

    /// The folder of maps and pictures.
    pub fn pictures(&self) -> PathBuf {
        self.sequence.join(FOLDER)
    }

    /// Writes a file among maps and pictures.
    ///
    /// # Errors
    /// [`CalibrateError::Io`].
    pub fn write(&self, name: &str, bytes: &[u8]) -> Result<(), CalibrateError> {
        let folder = self.pictures();
        fs::create_dir_all(&folder).map_err(io("make", &folder))?;
        write_whole(&folder.join(name), bytes)
    }

    /// Writes maps and record.
    ///
    /// # Errors
    /// [`CalibrateError`] naming the file that cannot be written.
    pub fn commit(self, calibration: &Calibration, maps: &Maps) -> Result<(), CalibrateError> {
        let path = self.sequence.join(CALIBRATION);
        if maps.dark.is_some() || maps.flat_field.is_some() {
            let folder = self.pictures();
            fs::create_dir_all(&folder).map_err(io("make", &folder))?;
        }
        // Whoever ends the program between two files is not to leave an older record with newer maps.
        remove(&path)?;
        for (name, map) in [(DARK_MAP, &maps.dark), (FLAT_MAP, &maps.flat_field)] {
            let place = self.pictures().join(name);
            match map {
                Some(map) => {
                    let bytes = MapFormat::Tiff.encode(map);
                    self.write(name, &bytes.map_err(|source| CalibrateError::Map { path: place, source })?)?;
                }
                None => remove(&place)?,
            }
        }
        let mut text = serde_json::to_vec_pretty(calibration)
            .map_err(|error| CalibrateError::BadRecord { path: path.clone(), reason: error.to_string() })?;
        text.push(b'\n');
        write_whole(&path, &text)
    }
}

/// The calibration of a sequence with its maps; `None` if it has none.
///
/// # Errors
/// [`CalibrateError`] if it cannot be read, or is [stale](CalibrateError::Stale): made of other frames than are there now.
pub fn read_calibration(sequence: &Sequence) -> Result<Option<(Calibration, Maps)>, CalibrateError> {
    let path = sequence.folder().join(CALIBRATION);
    if !path.exists() {
        return Ok(None);
    }
    let calibration = read_calibration_file(&path)?;
    let now = InputHashes::of(sequence);
    let other = calibration.sequence_uid != sequence.record().uid;
    let what = match calibration.inputs.difference(&now) {
        _ if other => Some("it was made for another sequence".to_owned()),
        stale => stale.map(|stale| stale.to_string()),
    };
    if let Some(what) = what {
        return Err(CalibrateError::Stale { path, what });
    }
    let record = sequence.record();
    if let Some(reason) = calibration.contradiction(sequence.frames().len(), record.rows, record.columns) {
        return Err(CalibrateError::BadRecord { path, reason });
    }
    let folder = sequence.folder().join(FOLDER);
    let needs = calibration.photometry.needs_maps();
    let maps = Maps {
        dark: needs.0.then(|| read_map(&folder.join(DARK_MAP))).transpose()?,
        flat_field: needs.1.then(|| read_map(&folder.join(FLAT_MAP))).transpose()?,
    };
    Ok(Some((calibration, maps)))
}

/// The record at `path`, whatever sequence it belongs to.
///
/// # Errors
/// [`CalibrateError::Io`] or [`CalibrateError::BadRecord`].
pub fn read_calibration_file(path: &Path) -> Result<Calibration, CalibrateError> {
    let bad = |reason: String| CalibrateError::BadRecord { path: path.to_owned(), reason };
    let text = fs::read_to_string(path).map_err(io("read", path))?;
    let value: serde_json::Value = serde_json::from_str(&text).map_err(|error| bad(error.to_string()))?;
    let found = value.get("format").and_then(serde_json::Value::as_u64).unwrap_or(0);
    if found != u64::from(FORMAT_VERSION) {
        return Err(bad(format!("it has version {found}, this program reads version {FORMAT_VERSION}")));
    }
    serde_json::from_value(value).map_err(|error| bad(error.to_string()))
}

fn read_map(path: &Path) -> Result<Plane<f32>, CalibrateError> {
    let bytes = fs::read(path).map_err(|error| match error.kind() {
        std::io::ErrorKind::NotFound => {
            CalibrateError::BadRecord { path: path.to_owned(), reason: "it is missing".to_owned() }
        }
        _ => io("read", path)(error),
    })?;
    MapFormat::Tiff.decode(&bytes).map_err(|source| CalibrateError::Map { path: path.to_owned(), source })
}

fn remove(path: &Path) -> Result<(), CalibrateError> {
    match fs::remove_file(path) {
        Err(error) if error.kind() != std::io::ErrorKind::NotFound => Err(io("remove", path)(error)),
        _ => Ok(()),
    }
}

fn io(action: &'static str, path: &Path) -> impl FnOnce(std::io::Error) -> CalibrateError {
    let path = path.to_owned();
    move |source| CalibrateError::Io { action, path, source }
}

fn write_whole(path: &Path, bytes: &[u8]) -> Result<(), CalibrateError> {
    let write = || {
        let mut file = AtomicWriteFile::open(path)?;
        file.write_all(bytes)?;
        file.commit()
    };
    write().map_err(io("write", path))
}
