//! `epirig export`.

use std::fs;
use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use serde::Serialize;

use super::files::write_new;
use super::need::{check, close_others};
use super::scan_end::tell_results;
use super::surface::NO_GEOMETRY;
use super::{CliError, Talk};
use crate::pipeline::{OpenedResults, matched_frame, open_results, surface_need, surface_points};
use crate::report::{MapPicture, Millimetres, ValueRange};
use crate::results::{MatchSummary, ResultsError, encoded_picture, read_map, read_summary};
use epirig_core::grid::Grid;
use epirig_data::formats::{MapFacts, MapFormat, Quantity};
use epirig_data::sequence::Sequence;
use epirig_data::storage::parent;
use epirig_matcher::surface::Heights;

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum MapName {
    Disparity,
    Sigma,
    Cost,
    Confidence,
    Height,
    HeightSigma,
    /// Height after removal of the form, as `epirig surface` found it
    HeightWithoutForm,
}

/// What is known of a map by its name.
struct About {
    file: &'static str,
    title: &'static str,
    unit: &'static str,
    quantity: Quantity,
    /// Colours of a picture span at least this much.
    least_span: f32,
}

impl MapName {
    fn about(self) -> About {
        let (file, title, unit, quantity, least_span) = match self {
            Self::Disparity => ("disparity.tiff", "Disparity", "px", Quantity::ImagePx, 0.05),
            Self::Sigma => {
                ("sigma.tiff", "Standard uncertainty of the disparity", "px", Quantity::ImagePx, 0.001)
            }
            Self::Cost => ("cost.tiff", "Cost", "of the chosen line", Quantity::Number, 0.001),
            Self::Confidence => ("confidence.tiff", "Confidence", "0 to 1", Quantity::Number, 0.001),
            Self::Height => ("height_mm.tiff", "Height", "mm", Quantity::LengthMm, 0.01),
            Self::HeightSigma => (
                "height_sigma_mm.tiff",
                "Standard uncertainty of the height",
                "mm",
                Quantity::LengthMm,
                0.001,
            ),
            Self::HeightWithoutForm => {
                ("surface/height_mm.tiff", "Height after removal of the form", "mm", Quantity::LengthMm, 0.01)
            }
        };
        About { file, title, unit, quantity, least_span }
    }
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

The extension chooses the format: {}. PLY (points) and X3P are for
heights only. A folder that is missing is made.", Output::extensions())
)]
pub(super) struct Export {
    /// Folder of the sequence
    seq: PathBuf,
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
            CliError::Usage(format!(
                "{} has an unknown extension; give {}",
                self.out.display(),
                Output::extensions()
            ))
        })?;
        if self.out.exists() {
            return Err(CliError::Usage(format!("{} exists already; give another name", self.out.display())));
        }
        let folder = self.results.clone().unwrap_or_else(|| self.seq.join("results"));
        let summary = read_summary(&folder)?;
        tell_results(&summary, talk);
        let about = self.map.about();
        let path = folder.join(about.file);
        let missing = match self.map {
            MapName::HeightWithoutForm => "run `epirig surface` first",
            MapName::Height | MapName::HeightSigma => NO_GEOMETRY,
            _ => "run `epirig match` again",
        };
        if !path.exists() {
            return Err(CliError::Usage(format!("{} is not there: {missing}", path.display())));
        }
        let map = read_map(&path)?;
        let bytes = match output {
            Output::Map(format) => {
                let facts = self.facts(format, &folder, &summary);
                let encoded = format.encode_with(&map, &facts);
                encoded.map_err(|source| ResultsError::Format { path: self.out.clone(), source })?
            }
            Output::Points => self.points(&map, &folder, talk)?,
            Output::Picture => self.picture(&map, &folder)?,
        };
        let place = parent(&self.out);
        fs::create_dir_all(place).map_err(|source| CliError::File {
            path: place.to_owned(),
            action: "make",
            source,
        })?;
        write_new(&self.out, &bytes)?;
        let exported =
            Exported { file: self.out.display().to_string(), rows: map.rows(), columns: map.columns() };
        talk.result(&exported, || format!("{}: {} x {}\n", exported.file, exported.columns, exported.rows))
    }

    /// What `format` may say of the map. Without a sequence the size of a pixel is not known.
    fn facts(&self, format: MapFormat, folder: &Path, summary: &MatchSummary) -> MapFacts {
        let About { title, unit, quantity, .. } = self.map.about();
        let title = format!("{title} ({unit}), sequence {}", summary.sequence_uid);
        let mut facts = MapFacts { quantity, title, ..MapFacts::default() };
        if format.holds_facts()
            && let Ok((sequence, opened)) = self.opened(folder)
        {
            facts.pixel_mm = opened.heights.as_ref().map(Heights::pixel_mm);
            facts.taken = Some(sequence.record().created.clone());
        }
        facts
    }

    /// The map as a picture; without a sequence in px, and without a photograph.
    fn picture(&self, map: &Grid<f32>, folder: &Path) -> Result<Vec<u8>, CliError> {
        let About { title, unit, least_span, .. } = self.map.about();
        let opened = self.opened(folder).ok();
        let photograph = opened.as_ref().and_then(|(sequence, opened)| {
            matched_frame(sequence, opened.calibration.as_ref(), opened.matched.reference).ok()
        });
        let millimetres = opened.and_then(|(_, opened)| opened.heights.as_ref().map(Millimetres::of));
        let range = ValueRange::of(map, least_span);
        let picture = MapPicture::new(map, title, unit, range).in_mm(millimetres).beside(photograph.as_ref());
        let is_height = matches!(self.map, MapName::Height | MapName::HeightWithoutForm);
        let picture = if is_height { picture.as_relief() } else { picture };
        Ok(encoded_picture(&self.out, &picture.picture()?)?)
    }

    fn opened(&self, folder: &Path) -> Result<(Sequence, OpenedResults), CliError> {
        let sequence = Sequence::open(&self.seq)?;
        let opened = open_results(&sequence, folder)?;
        Ok((sequence, opened))
    }

    fn points(&self, map: &Grid<f32>, folder: &Path, talk: &Talk) -> Result<Vec<u8>, CliError> {
        let About { title, quantity, least_span, .. } = self.map.about();
        if quantity != Quantity::LengthMm || self.map == MapName::HeightSigma {
            return Err(CliError::Usage(
                ".ply is for points in space; give --map height or --map height-without-form".to_owned(),
            ));
        }
        let need = surface_need(map.rows(), map.columns());
        check("making points of a map", need, talk, close_others)?;
        let (sequence, opened) = self.opened(folder)?;
        let heights = opened.heights.as_ref().filter(|heights| {
            (heights.height_mm.rows(), heights.height_mm.columns()) == (map.rows(), map.columns())
        });
        let heights = heights.ok_or_else(|| {
            CliError::Integrity(format!("{}: its maps do not fit the sequence", folder.display()))
        })?;
        let about = format!(
            "{title} as z, towards the camera; x to the right, y up; sequence {}",
            sequence.record().uid
        );
        Ok(surface_points(heights, map, ValueRange::of(map, least_span), &[&about]))
    }
}
