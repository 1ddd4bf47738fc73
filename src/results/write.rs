//! Writing the folder of results.

use std::fs;
use std::path::{Path, PathBuf};

use image::{GrayImage, RgbImage};
use serde::Serialize;

use super::{MatchSummary, ResultsError};
use crate::epi::Answer;
use crate::formats::MapFormat;
use crate::plane::Plane;
use crate::scratch::Scratch;

/// Grey value of `mask.png` for an answer: 255 found, 0 leaves the image, 40 beyond the range, 80 no texture, 120 hidden,
/// 160 ambiguous.
pub fn mask_value(answer: Answer) -> u8 {
    match answer {
        Answer::Found => 255,
        Answer::LeavesImage => 0,
        Answer::BeyondRange => 40,
        Answer::NoTexture => 80,
        Answer::Hidden => 120,
        Answer::Ambiguous => 160,
    }
}

/// Files and folders that results consist of; a folder that holds anything else is never replaced.
const OWN_NAMES: [&str; 26] = [
    "match.json",
    "disparity.pfm",
    "disparity.tiff",
    "disparity.npy",
    "disparity.png",
    "disparity-detail.png",
    "sigma.tiff",
    "sigma.png",
    "cost.tiff",
    "confidence.tiff",
    "mask.png",
    "height.png",
    "height_mm.tiff",
    "height_sigma_mm.tiff",
    "figures",
    "measured-and-truth.png",
    "height-along-row.png",
    "height-along-row.csv",
    "surface",
    "surface.json",
    "surface.ply",
    "height.gsf",
    "hollows.csv",
    "profile.csv",
    "profile.png",
    "used.png",
];

/// Whether results may be put at `target`: nothing is there, or an empty folder, or results that may be replaced.
fn check_target(target: &Path, overwrite: bool) -> Result<(), ResultsError> {
    let foreign = || ResultsError::Foreign { path: target.to_owned() };
    let io = |source| ResultsError::Io { action: "look into", path: target.to_owned(), source };
    match fs::symlink_metadata(target) {
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(()),
        // Below a file there is no folder: making it will say so, with the path of that file.
        Err(error) if error.kind() == std::io::ErrorKind::NotADirectory => return Ok(()),
        Err(error) => return Err(io(error)),
        Ok(metadata) if !metadata.is_dir() => return Err(foreign()),
        Ok(_) => {}
    }
    let mut occupied = false;
    for entry in fs::read_dir(target).map_err(io)? {
        occupied = true;
        let name = entry.map_err(io)?.file_name();
        if !OWN_NAMES.iter().any(|own| name == *own) {
            return Err(foreign());
        }
    }
    match occupied && !overwrite {
        true => Err(ResultsError::Exists { path: target.to_owned() }),
        false => Ok(()),
    }
}

/// A folder of results in the making, beside its final place; [`ResultsFolder::commit`] puts it there whole. Dropped
/// without that, it leaves nothing.
#[derive(Debug)]
pub struct ResultsFolder {
    target: PathBuf,
    overwrite: bool,
    scratch: Scratch,
}

impl ResultsFolder {
    /// Prepares to write `target`. Whether it may be written is found out here, before any work is done.
    ///
    /// # Errors
    /// [`ResultsError`] if `target` holds something and `overwrite` is not set (or it is no folder of results), or its
    /// parent cannot be written.
    pub fn create(target: &Path, overwrite: bool) -> Result<Self, ResultsError> {
        check_target(target, overwrite)?;
        let io = |(path, source)| ResultsError::Io { action: "make a folder in", path, source };
        let scratch = Scratch::beside(target).map_err(io)?;
        let building = scratch.path().join("results");
        fs::create_dir(&building).map_err(|source| io((building, source)))?;
        Ok(Self { target: target.to_owned(), overwrite, scratch })
    }

    fn building(&self) -> PathBuf {
        self.scratch.path().join("results")
    }

    /// Writes `bytes` as file `name`, which may lie in a folder of its own.
    ///
    /// # Errors
    /// [`ResultsError::Io`].
    pub fn write(&self, name: &str, bytes: &[u8]) -> Result<(), ResultsError> {
        let path = self.building().join(name);
        let write = || {
            if let Some(parent) = path.parent() {
                fs::create_dir_all(parent)?;
            }
            let mut file = fs::File::create(&path)?;
            std::io::Write::write_all(&mut file, bytes)?;
            file.sync_all()
        };
        // The person knows the final place, not the one beside it.
        write().map_err(|source| ResultsError::Io { action: "write", path: self.target.join(name), source })
    }

    /// Writes a map in the format that its name tells.
    ///
    /// # Errors
    /// [`ResultsError`] if the name tells none or the file cannot be written.
    pub fn write_map(&self, name: &str, map: &Plane<f32>) -> Result<(), ResultsError> {
        let path = self.target.join(name);
        let extension = Path::new(name).extension().unwrap_or_default().to_string_lossy();
        let format = MapFormat::from_extension(&extension)
            .ok_or(ResultsError::UnknownFormat { path: path.clone() })?;
        let bytes = format.encode(map).map_err(|source| ResultsError::Format { path, source })?;
        self.write(name, &bytes)
    }

    /// Writes a colour picture as PNG.
    ///
    /// # Errors
    /// [`ResultsError`] if it cannot be encoded or written.
    pub fn write_picture(&self, name: &str, picture: &RgbImage) -> Result<(), ResultsError> {
        self.write_image(name, |bytes| picture.write_to(bytes, image::ImageFormat::Png))
    }

    /// Writes the mask as a grey PNG, with the values of [`mask_value`].
    ///
    /// # Errors
    /// [`ResultsError`] if it cannot be encoded or written.
    pub fn write_mask(&self, name: &str, answers: &Plane<Answer>) -> Result<(), ResultsError> {
        self.write_grey(name, &answers.map(mask_value))
    }

    /// Writes grey values as PNG.
    ///
    /// # Errors
    /// [`ResultsError`] if it cannot be encoded or written.
    pub fn write_grey(&self, name: &str, values: &Plane<u8>) -> Result<(), ResultsError> {
        let size = (values.columns() as u32, values.rows() as u32);
        let mask = GrayImage::from_raw(size.0, size.1, values.values().to_vec()).unwrap_or_default();
        self.write_image(name, |bytes| mask.write_to(bytes, image::ImageFormat::Png))
    }

    fn write_image(
        &self,
        name: &str,
        encode: impl FnOnce(&mut std::io::Cursor<Vec<u8>>) -> image::ImageResult<()>,
    ) -> Result<(), ResultsError> {
        let mut bytes = std::io::Cursor::new(Vec::new());
        let path = self.target.join(name);
        encode(&mut bytes).map_err(|error| ResultsError::Picture { path, reason: error.to_string() })?;
        self.write(name, bytes.get_ref())
    }

    /// Writes `match.json`.
    ///
    /// # Errors
    /// [`ResultsError::Io`].
    pub fn write_summary(&self, summary: &MatchSummary) -> Result<(), ResultsError> {
        self.write_json("match.json", summary)
    }

    /// Writes a record as JSON.
    ///
    /// # Errors
    /// [`ResultsError`] if it cannot be encoded or written.
    pub fn write_json(&self, name: &str, record: &impl Serialize) -> Result<(), ResultsError> {
        let path = self.target.join(name);
        let text = serde_json::to_string_pretty(record)
            .map_err(|error| ResultsError::BadSummary { path, reason: error.to_string() })?;
        self.write(name, (text + "\n").as_bytes())
    }

    /// Puts the folder in its final place, instead of what was there.
    ///
    /// # Errors
    /// [`ResultsError`]; what was there before stays if the new folder cannot take its place.
    pub fn commit(self) -> Result<(), ResultsError> {
        let target = self.target.clone();
        let io = |source| ResultsError::Io { action: "put in place", path: target.clone(), source };
        // Something may have come there since the work began.
        check_target(&self.target, self.overwrite)?;
        let previous = self.scratch.path().join("previous");
        let replaced = self.target.exists();
        if replaced {
            fs::rename(&self.target, &previous).map_err(io)?;
        }
        if let Err(source) = fs::rename(self.building(), &self.target) {
            if replaced {
                // The rename before this one has just worked, and nothing else knows the name.
                let _ = fs::rename(&previous, &self.target);
            }
            return Err(io(source));
        }
        if let Some(parent) = self.target.parent().filter(|parent| !parent.as_os_str().is_empty()) {
            fs::File::open(parent).and_then(|folder| folder.sync_all()).map_err(io)?;
        }
        Ok(())
    }
}
