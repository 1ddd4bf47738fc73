//! The record of a camera's photometry, from which its correction is made again.

use serde::{Deserialize, Serialize};

use super::{
    DarkModel, DarkRecord, FlatField, FlatMethod, FlatModel, Outlier, PhotometryError, dark_frame, flat_field,
};
use epirig_core::frame::{Frame, FrameFormat};
use epirig_core::grid::Grid;

/// The corrections wanted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PhotometryOptions {
    /// Subtract the dark level.
    pub dark: bool,
    /// Divide by the flat field, found by this method.
    pub flat_field: Option<FlatMethod>,
    /// Replace pixels that cannot be used.
    pub defective_pixels: bool,
    /// Divide each frame by its own gain, which [`frame_gains`](super::frame_gains) finds once the frames are
    /// rectified.
    pub frame_gain: bool,
}

impl Default for PhotometryOptions {
    /// Everything, with an automatic flat field.
    fn default() -> Self {
        Self { dark: true, flat_field: Some(FlatMethod::Automatic), defective_pixels: true, frame_gain: true }
    }
}

/// The outcome of a part of the correction.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Outcome<T> {
    /// It is applied.
    Applied(T),
    /// It is not, because the options say so.
    SwitchedOff,
    /// It is not, for this reason.
    NotApplied(String),
}

impl<T> Outcome<T> {
    /// The correction, if it is applied.
    pub fn applied(&self) -> Option<&T> {
        match self {
            Self::Applied(found) => Some(found),
            Self::SwitchedOff | Self::NotApplied(_) => None,
        }
    }
}

/// The photometric calibration that was found and is applied. Maps are not part of it: they are stored as
/// files beside it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Photometry {
    /// Rows of the frames.
    pub rows: usize,
    /// Columns of the frames.
    pub columns: usize,
    /// The options.
    pub options: PhotometryOptions,
    /// Dark level.
    pub dark: Outcome<DarkRecord>,
    /// Flat field.
    pub flat_field: Outcome<FlatField>,
    /// Pixels that are replaced, by column and row, from dark and from flat frames.
    pub defective_pixels: Outcome<Vec<Outlier>>,
}

/// Maps that belong to a record; each is there only if the record says so.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Maps {
    /// Mean of the dark frames, in DN, if the model is [`DarkModel::Map`].
    pub dark: Option<Grid<f32>>,
    /// Gain with mean 1, if the model is [`FlatModel::PerPixel`].
    pub flat_field: Option<Grid<f32>>,
}

/// A pixel's light is (value - subtract) * multiply; pixels in `defective` have the mean of their good
/// neighbours, corrected, instead.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Correction {
    /// Dark level, in DN. `None` for zero everywhere.
    pub subtract: Option<Grid<f32>>,
    /// 1 over the gain, positive, whose mean is near 1. `None` for one everywhere.
    pub multiply: Option<Grid<f32>>,
    /// Columns and rows of the pixels that cannot be used, sorted.
    pub defective: Vec<(usize, usize)>,
}

impl Photometry {
    /// Finds the photometric calibration from dark and flat frames, either of which may be missing, for
    /// frames of `rows` x `columns`.
    ///
    /// # Errors
    /// [`PhotometryError`] if frames are given that will not do. Missing ones are no error: the record says
    /// what is not corrected.
    pub fn find(
        dark: &[Frame],
        flat: &[Frame],
        (rows, columns): (usize, usize),
        options: PhotometryOptions,
    ) -> Result<(Self, Maps), PhotometryError> {
        for (what, frames) in [("dark", dark), ("flat", flat)] {
            for (index, found) in frames.iter().map(Frame::format).enumerate() {
                let expected = FrameFormat { rows, columns, ..found };
                if found != expected {
                    return Err(PhotometryError::Shapes { what, index, found, expected });
                }
            }
        }
        let dark_is_wanted = (options.dark || options.defective_pixels) && !dark.is_empty();
        let found_dark = if dark_is_wanted { Some(dark_frame(dark)?) } else { None };
        let subtracted = found_dark.as_ref().filter(|_| options.dark);
        let flat_is_wanted = (options.flat_field.is_some() || options.defective_pixels) && !flat.is_empty();
        let method = options.flat_field.unwrap_or(FlatMethod::Polynomial(0));
        let found_flat = if flat_is_wanted { Some(flat_field(flat, subtracted, method)?) } else { None };
        let mut outliers: Vec<Outlier> =
            found_dark.iter().flat_map(|dark| dark.outliers.iter().copied()).collect();
        outliers.extend(found_flat.iter().flat_map(|(field, _)| field.outliers.iter().copied()));
        outliers.sort_by_key(|outlier| (outlier.x, outlier.y));
        let defective_pixels = match (options.defective_pixels, found_dark.is_some() || found_flat.is_some())
        {
            (false, _) => Outcome::SwitchedOff,
            (true, false) => Outcome::NotApplied(
                "there are neither dark nor flat frames, which show bad pixels".to_owned(),
            ),
            (true, true) => Outcome::Applied(outliers),
        };
        let mut maps = Maps::default();
        let dark = match found_dark {
            _ if !options.dark => Outcome::SwitchedOff,
            None => Outcome::NotApplied(
                "there are no dark frames; cover the lens and take eight with the settings of the scan"
                    .to_owned(),
            ),
            Some(found) => match found.record.model {
                DarkModel::CutOff(share) => Outcome::NotApplied(format!(
                    "{:.1} % of the dark samples are 0, so the dark level may be cut off there and its mean too high; raise the camera's black \
                     level, if it has one",
                    100.0 * share
                )),
                model => {
                    maps.dark = (model == DarkModel::Map).then_some(found.mean);
                    Outcome::Applied(found.record)
                }
            },
        };
        let flat_field = match found_flat {
            _ if options.flat_field.is_none() => Outcome::SwitchedOff,
            None => Outcome::NotApplied(
                "there are no flat frames; put something evenly white and evenly lit before the camera and take eight".to_owned(),
            ),
            Some((field, map)) => {
                maps.flat_field = map;
                Outcome::Applied(field)
            }
        };
        Ok((Self { rows, columns, options, dark, flat_field, defective_pixels }, maps))
    }

    /// Which maps the record needs: of the dark frame, of the flat field.
    pub fn needs_maps(&self) -> (bool, bool) {
        let dark = self.dark.applied().is_some_and(|dark| dark.model == DarkModel::Map);
        let flat_field = self.flat_field.applied().is_some_and(|field| field.model == FlatModel::PerPixel);
        (dark, flat_field)
    }

    /// The correction that the record describes, with the maps that were stored with it.
    ///
    /// # Errors
    /// [`PhotometryError::MapMissing`] if a map is missing or of another size,
    /// [`PhotometryError::NotPositive`] if a gain is not positive.
    pub fn correction(&self, maps: &Maps) -> Result<Correction, PhotometryError> {
        let (rows, columns) = (self.rows, self.columns);
        let map = |what: &'static str, map: &Option<Grid<f32>>| match map {
            Some(map) if (map.rows(), map.columns()) == (rows, columns) => Ok(map.clone()),
            _ => Err(PhotometryError::MapMissing { what, columns, rows }),
        };
        let subtract = match self.dark.applied().map(|dark| dark.model) {
            Some(DarkModel::Map) => Some(map("dark frame", &maps.dark)?),
            Some(DarkModel::LevelDn(level_dn)) => Some(Grid::filled(rows, columns, level_dn as f32)),
            Some(DarkModel::CutOff(_)) | None => None,
        };
        let gain = match self.flat_field.applied().map(|field| &field.model) {
            Some(FlatModel::PerPixel) => Some(map("flat field", &maps.flat_field)?),
            Some(FlatModel::Polynomial(polynomial)) => {
                if (polynomial.rows(), polynomial.columns()) != (rows, columns) {
                    return Err(PhotometryError::MapMissing { what: "flat field", columns, rows });
                }
                Some(polynomial.image())
            }
            None => None,
        };
        if gain.iter().flat_map(|gain| gain.values()).any(|&gain| !(gain > 0.0 && gain.is_finite())) {
            return Err(PhotometryError::NotPositive);
        }
        let outside = |outlier: &&Outlier| outlier.x < columns && outlier.y < rows;
        let outliers = self.defective_pixels.applied().into_iter().flatten().filter(outside);
        let mut defective: Vec<(usize, usize)> = outliers.map(|outlier| (outlier.x, outlier.y)).collect();
        defective.sort_unstable();
        defective.dedup();
        Ok(Correction { subtract, multiply: gain.map(|gain| gain.map(|gain| 1.0 / gain)), defective })
    }
}
