//! Writing the folder of results.

use std::fs;
use std::path::{Path, PathBuf};

use image::{GrayImage, RgbImage};

use super::{MatchSummary, ResultsError};
use crate::epi::Answer;
use crate::formats::MapFormat;
use crate::plane::Plane;

/// Grey value of `mask.png` for an answer: 255 found, 0 leaves the image, 80 no texture, 160 ambiguous.
pub fn mask_value(answer: Answer) -> u8 {
    match answer {
        Answer::Found => 255,
        Answer::LeavesImage => 0,
        Answer::NoTexture => 80,
        Answer::Ambiguous => 160,
    }
}

/// A folder of results in the making, beside its final place; [`ResultsFolder::commit`] puts it there whole. Dropped
/// without that, it leaves nothing.
#[derive(Debug)]
pub struct ResultsFolder {
    target: PathBuf,
    scratch: tempfile::TempDir,
}

impl ResultsFolder {
    /// Prepares to write `target`. Whether it may be written is found out here, before any work is done.
    ///
    /// # Errors
    /// [`ResultsError`] if `target` holds something and `overwrite` is not set (or it is no folder of results), or its
    /// parent cannot be written.
    pub fn create(target: &Path, overwrite: bool) -> Result<Self, ResultsError> {
        let occupied = fs::read_dir(target).is_ok_and(|mut entries| entries.next().is_some());
        if occupied && !target.join("match.json").exists() {
            return Err(ResultsError::Foreign { path: target.to_owned() });
        }
        if occupied && !overwrite {
            return Err(ResultsError::Exists { path: target.to_owned() });
        }
        let parent =
            target.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new("."));
        let io = |action, path: &Path| {
            let path = path.to_owned();
            move |source| ResultsError::Io { action, path, source }
        };
        fs::create_dir_all(parent).map_err(io("make the folder", parent))?;
        let scratch = tempfile::Builder::new().prefix(".epirig-results-").tempdir_in(parent);
        let scratch = scratch.map_err(io("make a folder in", parent))?;
        let building = scratch.path().join("results");
        fs::create_dir(&building).map_err(io("make the folder", &building))?;
        Ok(Self { target: target.to_owned(), scratch })
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
        let values = answers.values().iter().map(|&answer| mask_value(answer)).collect();
        let size = (answers.columns() as u32, answers.rows() as u32);
        let mask = GrayImage::from_raw(size.0, size.1, values).unwrap_or_default();
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
        let path = self.target.join("match.json");
        let text = serde_json::to_string_pretty(summary)
            .map_err(|error| ResultsError::BadSummary { path, reason: error.to_string() })?;
        self.write("match.json", (text + "\n").as_bytes())
    }

    /// Puts the folder in its final place, instead of what was there.
    ///
    /// # Errors
    /// [`ResultsError::Io`]; what was there before stays if the new folder cannot take its place.
    pub fn commit(self) -> Result<(), ResultsError> {
        let target = self.target.clone();
        let io = |source| ResultsError::Io { action: "put in place", path: target.clone(), source };
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
