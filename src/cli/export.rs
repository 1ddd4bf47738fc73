//! `epirig export`.

use std::fs;
use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use serde::Serialize;

use super::files::write_new;
use super::need::{check, close_others};
use super::scan_end::tell_results;
use super::surface::known_heights;
use super::{CliError, Talk};
use crate::pipeline::{
    OpenedResults, answer_classes, matched_frame, open_results, surface_need, surface_points,
};
use crate::report::{MapPicture, Millimetres, ValueRange, Window, class_picture};
use crate::results::{ResultFiles, ResultsError, ResultsKind, encoded_picture};
use epirig_core::grid::Grid;
use epirig_data::formats::{MapFacts, MapFormat, Quantity};
use epirig_data::sequence::Sequence;
use epirig_data::storage::parent;

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum MapName {
    Disparity,
    Sigma,
    Cost,
    Confidence,
    /// Why a pixel has an answer or none, with the values of mask.png
    Mask,
    /// Height as measured
    Height,
    HeightSigma,
    /// Height as measured, where `epirig surface` used it
    HeightUsed,
    /// Height after removal of the form, as `epirig surface` found it
    HeightWithoutForm,
    /// The same between the cut-offs of the filters of `epirig surface`
    HeightFiltered,
    /// Difference of height that `epirig compare` found
    Difference,
    DifferenceSigma,
}

/// What is known of a map by its name.
struct About {
    title: &'static str,
    unit: &'static str,
    quantity: Quantity,
    /// Colours of a picture span at least this much.
    least_span: f32,
}

impl MapName {
    fn about(self) -> About {
        let (title, unit, quantity, least_span) = match self {
            Self::Disparity => ("Disparity", "px", Quantity::ImagePx, 0.05),
            Self::Sigma => ("Standard uncertainty of the disparity", "px", Quantity::ImagePx, 0.001),
            Self::Cost => ("Cost", "of the chosen line", Quantity::Number, 0.001),
            Self::Confidence => ("Confidence", "0 to 1", Quantity::Number, 0.001),
            Self::Mask => ("Answers of the matcher", "values of mask.png", Quantity::Number, 1.0),
            Self::Height => ("Height", "mm", Quantity::LengthMm, 0.01),
            Self::HeightSigma => ("Standard uncertainty of the height", "mm", Quantity::LengthMm, 0.001),
            Self::HeightUsed => ("Height of the surface, with the form", "mm", Quantity::LengthMm, 0.01),
            Self::HeightWithoutForm => ("Height after removal of the form", "mm", Quantity::LengthMm, 0.01),
            Self::HeightFiltered => ("Height between the cut-offs", "mm", Quantity::LengthMm, 0.01),
            Self::Difference => ("Second less first height", "mm", Quantity::LengthMm, 0.01),
            Self::DifferenceSigma => {
                ("Standard uncertainty of the difference", "mm", Quantity::LengthMm, 0.001)
            }
        };
        About { title, unit, quantity, least_span }
    }

    /// Whether its values are heights of a surface, which has points and a relief.
    fn is_height(self) -> bool {
        matches!(self, Self::Height | Self::HeightUsed | Self::HeightWithoutForm | Self::HeightFiltered)
    }

    fn is_difference(self) -> bool {
        matches!(self, Self::Difference | Self::DifferenceSigma)
    }
}

/// A map with what it is a map of.
struct Found {
    map: Grid<f32>,
    /// What it was made of, for a title.
    source: String,
    millimetres: Option<Millimetres>,
    /// The sequence with its results; `None` for a comparison of two.
    of: Option<(Sequence, OpenedResults)>,
}

/// What the ending of a file asks for.
enum Output {
    Map(MapFormat),
    Points,
    Picture,
}

const POINTS: &str = "ply";
const PICTURE: &str = "png";

impl Output {
    fn from_path(path: &Path) -> Option<Self> {
        let extension = path.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase();
        match &extension[..] {
            POINTS => Some(Self::Points),
            PICTURE => Some(Self::Picture),
            other => MapFormat::from_extension(other).map(Self::Map),
        }
    }

    /// All endings, as in `.pfm, .tiff or .npy`.
    fn extensions() -> String {
        let formats = MapFormat::ALL.iter().map(|format| format.extension());
        let all: Vec<String> = formats.chain([POINTS]).map(|extension| format!(".{extension}")).collect();
        format!("{} or .{PICTURE}", all.join(", "))
    }
}

/// Export a map of the results to the format of another program
#[derive(Debug, Args)]
#[command(
    after_help = format!("Examples:
  epirig export seq --out disparity.csv
  epirig export seq --map height --out height.npy
  epirig export seq --map height-without-form --out for/gwyddion.gsf
  epirig export change --map difference --out difference.npy

The extension chooses the format: {}. PLY (points) and X3P are for
heights only. A folder that is missing is made.", Output::extensions())
)]
pub(super) struct Export {
    /// Folder of the sequence; for a difference, that of `epirig compare`
    #[arg(value_name = "SEQ")]
    folder: PathBuf,
    /// The map
    #[arg(long, value_enum, default_value = "disparity")]
    map: MapName,
    /// The file to write; an existing file is refused
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// Folder of the results [default: SEQ/results]
    #[arg(long, value_name = "DIR")]
    results: Option<PathBuf>,
}

#[derive(Serialize)]
struct Exported {
    file: String,
    rows: usize,
    columns: usize,
}

impl Export {
    pub(super) fn run(self, talk: &Talk) -> Result<(), CliError> {
        let output = Output::from_path(&self.out).ok_or_else(|| {
            CliError::usage(format!(
                "{} has an unknown extension; give {}",
                self.out.display(),
                Output::extensions()
            ))
        })?;
        if self.out.exists() {
            return Err(CliError::usage(format!("{} exists already; give another name", self.out.display())));
        }
        let found = if self.map.is_difference() { self.difference()? } else { self.of_sequence(talk)? };
        let bytes = match output {
            Output::Map(format) => {
                let encoded = format.encode_with(&found.map, &self.facts(&found));
                encoded.map_err(|source| ResultsError::Format { path: self.out.clone(), source })?
            }
            Output::Points => self.points(&found)?,
            Output::Picture => self.picture(&found)?,
        };
        let place = parent(&self.out);
        fs::create_dir_all(place).map_err(CliError::file("make", place))?;
        write_new(&self.out, &bytes)?;
        let (rows, columns) = (found.map.rows(), found.map.columns());
        let exported = Exported { file: self.out.display().to_string(), rows, columns };
        talk.result(&exported, || format!("{}: {columns} x {rows}\n", exported.file))
    }

    /// A map of a sequence, if the results belong to it.
    fn of_sequence(&self, talk: &Talk) -> Result<Found, CliError> {
        let folder = self.results.clone().unwrap_or_else(|| self.folder.join("results"));
        let sequence = Sequence::open(&self.folder)?;
        let opened = open_results(&sequence, &folder)?;
        tell_results(&opened.matched, talk);
        let map = self.map_of(&sequence, &opened, &folder)?;
        check("exporting a map", surface_need(map.rows(), map.columns()), talk, close_others)?;
        let millimetres = opened.heights.as_ref().map(Millimetres::of);
        let source = format!("sequence {}", opened.matched.sequence_uid);
        Ok(Found { map, source, millimetres, of: Some((sequence, opened)) })
    }

    fn map_of(
        &self,
        sequence: &Sequence,
        opened: &OpenedResults,
        folder: &Path,
    ) -> Result<Grid<f32>, CliError> {
        let heights = || known_heights(opened, sequence, folder);
        let of_surface = |name: &str| -> Result<Option<Grid<f32>>, CliError> {
            let map = opened.files.surface()?.map(|surface| surface.map(name)).transpose()?.flatten();
            let size = (opened.disparity.rows(), opened.disparity.columns());
            match map {
                Some(map) if (map.rows(), map.columns()) != size => Err(CliError::data(format!(
                    "{}: its maps do not fit the sequence; run `epirig surface --overwrite` again",
                    folder.join("surface").display()
                ))),
                map => Ok(map),
            }
        };
        let there = |map: Option<Grid<f32>>, verb: &str| {
            map.ok_or_else(|| {
                let folder = folder.display();
                CliError::usage(format!("{folder} holds no such map; run {verb} first"))
            })
        };
        let without_form = || there(of_surface("height_mm.tiff")?, "`epirig surface --overwrite`");
        Ok(match self.map {
            MapName::Disparity => opened.disparity.clone(),
            MapName::Sigma => opened.sigma.clone(),
            MapName::Cost => opened.files.needed_map("cost.tiff")?,
            MapName::Confidence => opened.files.needed_map("confidence.tiff")?,
            MapName::Mask => {
                let mask = opened.files.grey("mask.png")?.map(|mask| mask.map(f32::from));
                there(mask, "`epirig match --overwrite`")?
            }
            MapName::Height => heights()?.height_mm.clone(),
            MapName::HeightSigma => heights()?.sigma_mm.clone(),
            MapName::HeightUsed => {
                let (mut used, rest) = (heights()?.height_mm.clone(), without_form()?);
                let pairs = used.values_mut().iter_mut().zip(rest.values());
                pairs.filter(|(_, rest)| rest.is_nan()).for_each(|(height, _)| *height = f32::NAN);
                used
            }
            MapName::HeightWithoutForm => without_form()?,
            MapName::HeightFiltered => there(
                of_surface("filtered_mm.tiff")?,
                "`epirig surface --overwrite` with --s-filter-mm or --l-filter-mm",
            )?,
            MapName::Difference | MapName::DifferenceSigma => there(None, "`epirig compare`")?,
        })
    }

    /// A map of a comparison.
    fn difference(&self) -> Result<Found, CliError> {
        let (folder, kind) = (&self.folder, ResultsKind::Compare);
        if !folder.join(kind.summary()).is_file() {
            return Err(CliError::usage(format!(
                "{} holds no {}; give the folder that `epirig compare` wrote",
                folder.display(),
                kind.summary()
            )));
        }
        let (files, facts) = ResultFiles::open_compare(folder)?;
        let name = match self.map {
            MapName::DifferenceSigma => "difference_sigma_mm.tiff",
            _ => "difference_mm.tiff",
        };
        Ok(Found {
            map: files.needed_map(name)?,
            source: format!("sequence {} less {}", facts.second_uid, facts.first_uid),
            millimetres: Some(Millimetres { pixel_mm: facts.pixel_mm, origin_px: facts.origin_px }),
            of: None,
        })
    }

    /// What a file may say of the map.
    fn facts(&self, found: &Found) -> MapFacts {
        let About { title, unit, quantity, .. } = self.map.about();
        MapFacts {
            quantity,
            pixel_mm: found.millimetres.map(|millimetres| millimetres.pixel_mm),
            title: format!("{title} ({unit}), {}", found.source),
            taken: found.of.as_ref().map(|(sequence, _)| sequence.record().created.clone()),
        }
    }

    /// The map as a picture; without a photograph if the frame is no longer there.
    fn picture(&self, found: &Found) -> Result<Vec<u8>, CliError> {
        let About { title, unit, least_span, .. } = self.map.about();
        let map = &found.map;
        if self.map == MapName::Mask {
            let (classes, window) = (answer_classes(), Window::whole(map.rows(), map.columns()));
            let values = map.map(|value| value as u8);
            let picture = class_picture(&values, title, &classes, (&window, found.millimetres))?;
            return Ok(encoded_picture(&self.out, &picture)?);
        }
        let photograph = found.of.as_ref().and_then(|(sequence, opened)| {
            matched_frame(sequence, opened.calibration.as_ref(), opened.matched.reference).ok()
        });
        let range = ValueRange::of(map, least_span);
        let range = if self.map == MapName::Difference { range.around_zero() } else { range };
        let picture =
            MapPicture::new(map, title, unit, range).in_mm(found.millimetres).beside(photograph.as_ref());
        let picture = match self.map {
            MapName::Difference => picture.diverging(),
            map if map.is_height() => picture.as_relief(),
            _ => picture,
        };
        Ok(encoded_picture(&self.out, &picture.picture()?)?)
    }

    fn points(&self, found: &Found) -> Result<Vec<u8>, CliError> {
        let heights = found.of.as_ref().and_then(|(_, opened)| opened.heights.as_ref());
        let Some(heights) = heights.filter(|_| self.map.is_height()) else {
            return Err(CliError::usage(
                ".ply is for points in space; give --map height or --map height-without-form".to_owned(),
            ));
        };
        let About { title, least_span, .. } = self.map.about();
        let about = format!(
            "{title} as z from the level {} mm away, towards the camera; x to the right, y up; {}",
            heights.distance_mm, found.source
        );
        Ok(surface_points(heights, &found.map, ValueRange::of(&found.map, least_span), &[&about]))
    }
}
