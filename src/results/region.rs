//! The part of a picture that a question is about: a rectangle, a mask drawn as a picture, or both.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use thiserror::Error;

use epirig_core::fault::{Blame, Fault};
use epirig_core::frame::Samples;
use epirig_core::grid::Grid;
use epirig_data::sequence::{ImageFault, LARGEST_IMAGE, decode_grey, header};
use epirig_data::storage::{ReadError, hash, read_named};
use epirig_surface::Rectangle;

/// The part of a picture that a question is about; all of it by default.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Region {
    /// Only pixels of this rectangle.
    pub rectangle: Option<Rectangle>,
    /// Only pixels inside of this mask.
    pub mask: Option<Mask>,
}

impl Region {
    /// The region, if any pixel of a picture of `rows` x `columns` belongs to it.
    ///
    /// # Errors
    /// [`MaskError::Apart`] if rectangle and mask have no pixel in common.
    pub fn checked(self, rows: usize, columns: usize) -> Result<Self, MaskError> {
        let is_empty = |inside: Grid<bool>| !inside.values().contains(&true);
        match &self.mask {
            Some(mask) if self.inside(rows, columns).is_some_and(is_empty) => {
                Err(MaskError::Apart(PathBuf::from(&mask.facts.file)))
            }
            _ => Ok(self),
        }
    }

    /// Whether each pixel of a picture of `rows` x `columns` belongs to it; `None` if all do.
    pub fn inside(&self, rows: usize, columns: usize) -> Option<Grid<bool>> {
        if self.rectangle.is_none() && self.mask.is_none() {
            return None;
        }
        let mut inside = match &self.mask {
            Some(mask) => mask.inside.clone(),
            None => Grid::filled(rows, columns, true),
        };
        if let Some(rectangle) = self.rectangle {
            for y in 0..inside.rows() {
                let row = inside.row_mut(y).iter_mut().enumerate();
                row.for_each(|(x, inside)| *inside = *inside && rectangle.holds(x, y));
            }
        }
        Some(inside)
    }
}

/// A mask that was read from a picture.
#[derive(Debug, Clone, PartialEq)]
pub struct Mask {
    /// Whether each pixel is inside; rows x columns of the frames.
    pub inside: Grid<bool>,
    /// Where it came from.
    pub facts: MaskFacts,
    /// What was lost when the picture became grey, in words, such as transparency.
    pub conversion: Option<&'static str>,
}

/// Which mask was used, for the records.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct MaskFacts {
    /// Name of the file, without its folder.
    pub file: String,
    /// BLAKE3 of the file.
    pub blake3: String,
    /// Pixels inside.
    pub inside_px: usize,
}

/// Why a picture is no mask.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum MaskError {
    /// The file cannot be read.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// The file is no picture, or a damaged one.
    #[error(
        "{}: {source}; give a picture that is white inside and black outside, such as a PNG", path.display()
    )]
    Picture {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        source: ImageFault,
    },
    /// The picture is not as large as the frames.
    #[error(
        "{} has {} rows x {} columns, but the frames have {} rows x {} columns; draw the mask over a frame or over \
         mask.png of the results, and do not scale or crop it", path.display(), found.0, found.1, frames.0, frames.1
    )]
    Size {
        /// The file.
        path: PathBuf,
        /// Its rows and columns.
        found: (usize, usize),
        /// Rows and columns of the frames.
        frames: (usize, usize),
    },
    /// Rectangle and mask have no pixel in common.
    #[error("no pixel of the region lies inside the mask {}; both apply, so omit one of them", .0.display())]
    Apart(PathBuf),
    /// No pixel is inside.
    #[error(
        "{} has no pixel above half of full white, so nothing is inside; paint white what is to be used", .0.display()
    )]
    Empty(PathBuf),
}

impl Fault for MaskError {
    fn blame(&self) -> Blame {
        match self {
            Self::Size { .. } | Self::Empty(_) | Self::Apart(_) => Blame::Request,
            Self::Picture { .. } => Blame::Data,
            Self::Read(error) => error.blame(),
        }
    }
}

/// Reads a mask for frames of `rows` x `columns`: any image file that `import` reads. Pixels above half of full
/// white are inside; colours count by their luma.
///
/// # Errors
/// [`MaskError`].
pub fn read_mask(path: &Path, rows: usize, columns: usize) -> Result<Mask, MaskError> {
    parse_mask(&read_named(path, LARGEST_IMAGE)?, path, rows, columns)
}

/// The same of the `bytes` of a file that is called `path`.
///
/// # Errors
/// [`MaskError`].
pub fn parse_mask(bytes: &[u8], path: &Path, rows: usize, columns: usize) -> Result<Mask, MaskError> {
    let wrong = |source: ImageFault| MaskError::Picture { path: path.to_owned(), source };
    // The head comes first: a picture of the wrong size need not be decoded.
    let head = header(bytes).map_err(wrong)?;
    let (found, frames) = ((head.rows, head.columns), (rows, columns));
    if found != frames {
        return Err(MaskError::Size { path: path.to_owned(), found, frames });
    }
    let decoded = decode_grey(bytes).map_err(wrong)?;
    let full = (1_u32 << decoded.frame.bit_depth()) - 1;
    let above = |value: u32| 2 * value > full;
    let inside: Vec<bool> = match decoded.frame.samples() {
        Samples::U8(values) => values.iter().map(|&value| above(value.into())).collect(),
        Samples::U16(values) => values.iter().map(|&value| above(value.into())).collect(),
    };
    let inside_px = inside.iter().filter(|&&inside| inside).count();
    if inside_px == 0 {
        return Err(MaskError::Empty(path.to_owned()));
    }
    let size = || wrong(ImageFault::Damaged("its size contradicts its pixels".to_owned()));
    let inside = Grid::from_values(rows, columns, inside).ok_or_else(size)?;
    let file = path.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned();
    let facts = MaskFacts { file, blake3: hash(bytes), inside_px };
    Ok(Mask { inside, facts, conversion: decoded.conversion })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn written(folder: &Path, name: &str, image: image::DynamicImage) -> PathBuf {
        let path = folder.join(name);
        image.save(&path).unwrap();
        path
    }

    #[test]
    fn values_above_half_are_inside_at_any_depth() {
        let folder = tempfile::tempdir().unwrap();
        let grey = image::GrayImage::from_vec(3, 2, vec![0, 127, 128, 255, 1, 200]).unwrap();
        let path = written(folder.path(), "grey.png", grey.into());
        let mask = read_mask(&path, 2, 3).unwrap();
        assert_eq!(mask.inside.values(), [false, false, true, true, false, true]);
        assert_eq!((mask.facts.inside_px, mask.facts.file.as_str()), (3, "grey.png"));
        let deep =
            image::ImageBuffer::<image::Luma<u16>, _>::from_vec(3, 1, vec![32767, 32768, 65535]).unwrap();
        let path = written(folder.path(), "deep.png", deep.into());
        assert_eq!(read_mask(&path, 1, 3).unwrap().inside.values(), [false, true, true]);
        // Blue has a luma of 7 % of white, yellow of 93 % (Rec. 709).
        let colours = image::RgbImage::from_vec(2, 1, vec![0, 0, 255, 255, 255, 0]).unwrap();
        let path = written(folder.path(), "colours.png", colours.into());
        let mask = read_mask(&path, 1, 2).unwrap();
        assert_eq!(mask.inside.values(), [false, true]);
        assert!(mask.conversion.is_some_and(|words| words.contains("colour")));
    }

    #[test]
    fn rectangle_and_mask_both_apply() {
        assert_eq!(Region::default().inside(2, 3), None);
        let rectangle = Some(Rectangle::between((1, 0), (2, 0)));
        let alone = Region { rectangle, mask: None };
        assert_eq!(alone.inside(2, 3).unwrap().values(), [false, true, true, false, false, false]);
        let inside = Grid::from_values(2, 3, vec![true, true, false, true, true, true]).unwrap();
        let facts = MaskFacts { file: String::new(), blake3: String::new(), inside_px: 5 };
        let mask = Some(Mask { inside, facts, conversion: None });
        let both = Region { rectangle, mask: mask.clone() };
        assert_eq!(both.inside(2, 3).unwrap().values(), [false, true, false, false, false, false]);
        assert_eq!(both.clone().checked(2, 3).unwrap(), both);
        let apart = Region { rectangle: Some(Rectangle::between((2, 0), (2, 0))), mask };
        assert!(matches!(apart.checked(2, 3), Err(MaskError::Apart(_))));
    }

    #[test]
    fn what_is_no_mask_is_refused_with_advice() {
        let folder = tempfile::tempdir().unwrap();
        let path = written(folder.path(), "small.png", image::GrayImage::new(3, 2).into());
        let words = read_mask(&path, 3, 2).unwrap_err().to_string();
        assert!(words.contains("2 rows x 3 columns") && words.contains("3 rows x 2 columns"), "{words}");
        assert!(matches!(read_mask(&path, 2, 3), Err(MaskError::Empty(_))));
        let text = folder.path().join("mask.txt");
        std::fs::write(&text, "white").unwrap();
        assert!(matches!(read_mask(&text, 2, 3), Err(MaskError::Picture { .. })));
        let whole = std::fs::read(&path).unwrap();
        std::fs::write(&text, &whole[..whole.len() - 20]).unwrap();
        assert!(matches!(read_mask(&text, 2, 3), Err(MaskError::Picture { .. })));
        assert!(matches!(read_mask(&folder.path().join("none.png"), 2, 3), Err(MaskError::Read(_))));
    }
}
