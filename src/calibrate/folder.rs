//! `calibration.json` with its maps and pictures, in the folder of a sequence.

use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};

use super::{CalibrateError, Calibration, FORMAT_VERSION, InputHashes, MapHashes};
use epirig_calibration::photometry::Maps;
use epirig_core::grid::{Grid, MOST_PIXELS};
use epirig_data::formats::MapFormat;
use epirig_data::sequence::{Sequence, lock};
use epirig_data::storage::{
    Disk, ReadError, RealDisk, RecordError, Scratch, Step, hash, is_in_the_making, is_own_folder, is_there,
    read_inside, read_record, write_whole,
};

/// Name of the record.
pub const CALIBRATION: &str = "calibration.json";
/// Folder of maps and pictures.
const FOLDER: &str = "calibration";

/// Whether the folder of a sequence has a calibration, of which nothing is read.
pub fn has_calibration(sequence: &Path) -> bool {
    is_there(&sequence.join(CALIBRATION)).unwrap_or(false)
}

/// Names of the maps.
const DARK_MAP: &str = "dark";
const FLAT_MAP: &str = "flat-field";
/// Size of the largest map without compression, with room for tags, in bytes.
const LARGEST_MAP: u64 = 4 * MOST_PIXELS as u64 + (1 << 20);

/// Writes a calibration, all at the end, so that a failure leaves the former one unchanged.
///
/// The record holds the hashes of its maps. First, new maps are written beside the former ones, under names
/// that contain their hashes. Then the new record replaces the former one in one step. Then the maps get
/// their usual names. So at any moment the record has its own maps.
pub struct CalibrationFolder {
    sequence: PathBuf,
    /// Held for the lifetime of this value: of two calibrations at once, one would remove the other's maps.
    _lock: File,
    scratch: Scratch,
    pictures: Vec<String>,
    disk: Box<dyn Disk>,
}

impl CalibrationFolder {
    /// Opens the folder of a sequence.
    ///
    /// # Errors
    /// [`CalibrateError::Exists`] if there is a calibration and `overwrite` is not set; an error if another
    /// program scans or calibrates there; [`CalibrateError::Io`] if nothing can be written there.
    pub fn of(sequence: &Path, overwrite: bool) -> Result<Self, CalibrateError> {
        Self::on(Box::new(RealDisk), sequence, overwrite)
    }

    /// The same on a given disk.
    ///
    /// # Errors
    /// As [`of`](Self::of).
    pub fn on(disk: Box<dyn Disk>, sequence: &Path, overwrite: bool) -> Result<Self, CalibrateError> {
        let path = sequence.join(CALIBRATION);
        if !overwrite && is_there(&path).map_err(io("look at", &path))? {
            return Err(CalibrateError::Exists { path });
        }
        let lock = lock(sequence)?;
        // A folder that cannot be written is reported before the work.
        let scratch =
            Scratch::beside(&path).map_err(|(path, source)| io("make a folder in", &path)(source))?;
        Ok(Self { sequence: sequence.to_owned(), _lock: lock, scratch, pictures: Vec::new(), disk })
    }

    /// The folder of maps and pictures.
    pub fn pictures(&self) -> PathBuf {
        self.sequence.join(FOLDER)
    }

    /// Adds a picture, or the table of a picture, that is put in place with the record.
    ///
    /// # Errors
    /// [`CalibrateError::Io`].
    pub fn write(&mut self, name: &str, bytes: &[u8]) -> Result<(), CalibrateError> {
        let path = self.scratch.path().join(name);
        let written = self.disk.write(&path, bytes).and_then(|()| self.disk.sync(&path));
        written.map_err(io("write", &self.pictures().join(name)))?;
        self.pictures.push(name.to_owned());
        Ok(())
    }

    /// Puts maps, record and pictures in place. As soon as the record is in place, the calibration is, with its
    /// maps. So what fails after that is no failure: it is returned, for a person to know.
    ///
    /// # Errors
    /// [`CalibrateError`] naming the file that cannot be written.
    pub fn commit(
        mut self,
        calibration: &mut Calibration,
        maps: &Maps,
    ) -> Result<Option<CalibrateError>, CalibrateError> {
        let (path, folder) = (self.sequence.join(CALIBRATION), self.pictures());
        let encode = |name: &'static str, map: &Option<Grid<f32>>| {
            let bytes = map.as_ref().map(|map| MapFormat::Tiff.encode(map)).transpose();
            let place = folder.join(usual(name));
            bytes.map_err(|error| CalibrateError::BadRecord { path: place, reason: error.to_string() })
        };
        let maps =
            [(DARK_MAP, encode(DARK_MAP, &maps.dark)?), (FLAT_MAP, encode(FLAT_MAP, &maps.flat_field)?)];
        let hashes = maps.each_ref().map(|(_, bytes)| bytes.as_ref().map(|bytes| hash(bytes)));
        let [dark, flat_field] = hashes.clone();
        calibration.maps = MapHashes { dark, flat_field };
        calibration.blake3 = calibration.hash();
        let mut record = serde_json::to_vec_pretty(calibration)
            .map_err(|error| CalibrateError::BadRecord { path: path.clone(), reason: error.to_string() })?;
        record.push(b'\n');

        let disk = &mut *self.disk;
        // An interruption is handled before or after all of it.
        let _step = Step::begin();
        if !is_own_folder(&folder).map_err(io("write into", &folder))? {
            let made = disk.make_folder(&folder).and_then(|()| disk.sync(&self.sequence));
            made.map_err(io("make", &folder))?;
        }
        for ((name, bytes), hash) in maps.iter().zip(&hashes) {
            if let (Some(bytes), Some(hash)) = (bytes, hash) {
                let place = folder.join(of_hash(name, hash));
                write_whole(disk, &place, bytes).map_err(io("write", &place))?;
            }
        }
        write_whole(disk, &path, &record).map_err(io("write", &path))?;
        let mut finish = || -> Result<(), CalibrateError> {
            for ((name, _), hash) in maps.iter().zip(&hashes) {
                let place = folder.join(usual(name));
                let placed = match hash {
                    Some(hash) => disk.rename(&folder.join(of_hash(name, hash)), &place),
                    None => remove(disk, &place),
                };
                placed.map_err(io("put in place", &place))?;
            }
            for name in &self.pictures {
                let place = folder.join(name);
                disk.rename(&self.scratch.path().join(name), &place).map_err(io("put in place", &place))?;
            }
            tidy_up(disk, &folder).and_then(|()| disk.sync(&folder)).map_err(io("tidy up", &folder))
        };
        Ok(finish().err())
    }
}

/// Usual name of a map.
fn usual(name: &str) -> String {
    format!("{name}.tiff")
}

/// Name of a map until its record is in place. Sixteen digits distinguish maps; the record holds the whole
/// hash.
fn of_hash(name: &str, hash: &str) -> String {
    format!("{name}-{}.tiff", hash.get(..16).unwrap_or(hash))
}

/// Removes maps and partial files of unfinished calibrations.
fn tidy_up(disk: &mut dyn Disk, folder: &Path) -> io::Result<()> {
    for entry in fs::read_dir(folder)? {
        let entry = entry?;
        let name = entry.file_name();
        let name = name.to_string_lossy();
        let is_of_hash = |map: &str| {
            let rest = name.strip_prefix(map).and_then(|rest| rest.strip_prefix('-'));
            let digits = rest.and_then(|rest| rest.strip_suffix(".tiff"));
            digits.is_some_and(|digits| {
                digits.len() == 16 && digits.bytes().all(|byte| byte.is_ascii_hexdigit())
            })
        };
        if [DARK_MAP, FLAT_MAP].into_iter().any(is_of_hash) || is_in_the_making(&entry.file_name()) {
            disk.remove(&entry.path())?;
        }
    }
    Ok(())
}

fn remove(disk: &mut dyn Disk, path: &Path) -> io::Result<()> {
    match disk.remove(path) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(()),
        done => done,
    }
}

/// The calibration of a sequence with its maps; `None` if there is none.
///
/// # Errors
/// [`CalibrateError`] if it cannot be read, or is [stale](CalibrateError::Stale): the frames have changed
/// since.
pub fn read_calibration(sequence: &Sequence) -> Result<Option<(Calibration, Maps)>, CalibrateError> {
    let path = sequence.folder().join(CALIBRATION);
    if !is_there(&path).map_err(io("look at", &path))? {
        return Ok(None);
    }
    let calibration = read_calibration_file(&path)?;
    let now = InputHashes::of(sequence);
    let other = calibration.sequence_uid != sequence.record().uid;
    let another = other.then(|| "it was made for another sequence".to_owned());
    let what = another.or_else(|| calibration.inputs.difference(&now));
    if let Some(what) = what {
        return Err(CalibrateError::Stale { path, what });
    }
    if let Some(reason) = calibration.contradiction_with(sequence) {
        return Err(CalibrateError::BadRecord { path, reason });
    }
    let (needs_dark, needs_flat_field) = calibration.photometry.needs_maps();
    let MapHashes { dark, flat_field } = &calibration.maps;
    let map = |needed: bool, name: &str, hash: &Option<String>| match (needed, hash) {
        (false, _) => Ok(None),
        (true, Some(hash)) => read_map(sequence.folder(), name, hash).map(Some),
        (true, None) => {
            let reason = format!("it needs the map {name} but holds no hash of it");
            Err(CalibrateError::BadRecord { path: path.clone(), reason })
        }
    };
    let maps = Maps {
        dark: map(needs_dark, DARK_MAP, dark)?,
        flat_field: map(needs_flat_field, FLAT_MAP, flat_field)?,
    };
    Ok(Some((calibration, maps)))
}

/// Names of the pictures of the calibration of the sequence in `folder`, without `.png`, sorted; none if there
/// is no calibration.
pub fn calibration_pictures(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder.join(FOLDER)).into_iter().flatten().flatten();
    let names = entries.filter_map(|entry| entry.file_name().to_str().map(str::to_owned));
    let mut pictures: Vec<String> =
        names.filter_map(|name| name.strip_suffix(".png").map(str::to_owned)).collect();
    pictures.sort();
    pictures
}

/// The picture of this name of a calibration, as PNG.
///
/// # Errors
/// [`CalibrateError::Read`] if there is none.
pub fn read_calibration_picture(folder: &Path, name: &str) -> Result<Vec<u8>, CalibrateError> {
    Ok(read_inside(folder, &format!("{FOLDER}/{name}.png"), LARGEST_MAP)?)
}

/// The record at `path`, for any sequence.
///
/// # Errors
/// [`CalibrateError::Read`] or [`CalibrateError::BadRecord`].
pub fn read_calibration_file(path: &Path) -> Result<Calibration, CalibrateError> {
    let bad = |reason: String| CalibrateError::BadRecord { path: path.to_owned(), reason };
    let calibration: Calibration = read_record(path, FORMAT_VERSION).map_err(|error| match error {
        RecordError::Read(error) => error.into(),
        RecordError::Version { found, expected, .. } => {
            bad(format!("it has format version {found}, this program reads version {expected}"))
        }
        RecordError::Content { fault, .. } => bad(format!("line {}: {fault}", fault.line)),
    })?;
    match calibration.hash() == calibration.blake3 {
        true => Ok(calibration),
        false => Err(bad("it was changed after it was made".to_owned())),
    }
}

/// The map with this hash: under its usual name, or under its name while a calibration is unfinished.
fn read_map(sequence: &Path, name: &str, wanted: &str) -> Result<Grid<f32>, CalibrateError> {
    let path = sequence.join(FOLDER).join(usual(name));
    let mut found = Err(CalibrateError::BadRecord { path: path.clone(), reason: "it is missing".to_owned() });
    for file in [usual(name), of_hash(name, wanted)] {
        match read_inside(sequence, &format!("{FOLDER}/{file}"), LARGEST_MAP) {
            Ok(bytes) if hash(&bytes) == wanted => {
                let map = MapFormat::Tiff.decode(&bytes);
                return map.map_err(|error| CalibrateError::BadRecord { path, reason: error.to_string() });
            }
            Ok(_) => {
                let reason = format!("it is not the map that belongs to {CALIBRATION}");
                found = Err(CalibrateError::BadRecord { path: path.clone(), reason });
            }
            Err(error) if error.is_missing() => {}
            Err(error) => found = Err(ReadError::into(error)),
        }
    }
    found
}

fn io(action: &'static str, path: &Path) -> impl FnOnce(io::Error) -> CalibrateError {
    let path = path.to_owned();
    move |source| CalibrateError::Io { action, path, source }
}
