//! `epirig export`.

use std::fs;
use std::path::{Path, PathBuf};

use clap::Args;
use serde::Serialize;

use super::choice::choice;
use super::files::{refuse_taken, write_new};
use super::need::{check, close_others};
use super::scan_end::tell_results;
use super::surface::known_heights;
use super::{CliError, Talk};
use crate::pipeline::{OpenedResults, frame_in_dn, matched_frame, open_results, surface_mesh, surface_need};
use crate::report::{MapPicture, Millimetres, ValueRange, Window, class_picture};
use crate::results::{Look, MapRow, ResultFiles, ResultMap, ResultsError, ResultsKind, encoded_picture};
use epirig_core::grid::Grid;
use epirig_data::formats::{MapFacts, MapFormat, MeshFormat, Quantity};
use epirig_data::sequence::Sequence;
use epirig_data::storage::parent;

/// What `epirig surface` needs for a map between cut-offs.
const FILTERED: &str = " with --s-filter-mm or --l-filter-mm";

/// A map with what it is a map of.
struct Found {
    map: Grid<f32>,
    /// What it was made of, for a title.
    source: String,
    millimetres: Option<Millimetres>,
    /// The file of the frame whose pixels these are, with `--original`.
    frame: Option<String>,
    /// The sequence with its results; `None` for a comparison of two.
    of: Option<(Sequence, OpenedResults)>,
}

/// What the ending of a file asks for.
enum Output {
    Map(MapFormat),
    Mesh(MeshFormat),
    Picture,
}

const PICTURE: &str = "png";

impl Output {
    fn from_path(path: &Path) -> Option<Self> {
        let extension = path.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase();
        match &extension[..] {
            PICTURE => Some(Self::Picture),
            other => MapFormat::from_extension(other)
                .map(Self::Map)
                .or_else(|| MeshFormat::from_extension(other).map(Self::Mesh)),
        }
    }

    /// All endings, as in `.pfm, .tiff or .npy`.
    fn extensions() -> String {
        let maps = MapFormat::ALL.iter().map(|format| format.extension());
        let meshes = MeshFormat::ALL.iter().map(|format| format.extension());
        let all: Vec<String> = maps.chain(meshes).map(|extension| format!(".{extension}")).collect();
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
  epirig export seq --original --out on-photograph.tiff
  epirig export change --map difference --out difference.npy

The extension chooses the format:
{}.
X3P, SDF, SUR and the surfaces of triangles (PLY, STL, OBJ) are for heights only. A folder that is
missing is made.", Output::extensions())
)]
pub(super) struct Export {
    /// Folder of the sequence; for a difference, that of `epirig compare`
    #[arg(value_name = "SEQ")]
    folder: PathBuf,
    /// The map
    #[arg(long, value_parser = choice::<ResultMap>(), default_value_t = ResultMap::Disparity)]
    map: ResultMap,
    /// The file to write; an existing file is refused
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// Folder of the results [default: SEQ/results]
    #[arg(long, value_name = "DIR")]
    results: Option<PathBuf>,
    /// Write the map in the pixels of the original image of the reference frame, not of the rectified one. Each takes
    /// the value of the nearest rectified pixel; values stay as measured
    #[arg(long)]
    original: bool,
}

#[derive(Serialize)]
struct Exported {
    file: String,
    rows: usize,
    columns: usize,
    /// The file of the frame whose pixels these are, with `--original`.
    #[serde(skip_serializing_if = "Option::is_none")]
    frame: Option<String>,
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
        if self.original {
            self.refuse_other_grids(&output)?;
        }
        refuse_taken(&self.out)?;
        let found = if self.map.row().kind == ResultsKind::Compare {
            self.difference()?
        } else {
            self.of_sequence(talk)?
        };
        let bytes = match output {
            Output::Map(format) => {
                let encoded = format.encode_with(&found.map, &self.facts(&found));
                encoded.map_err(|source| ResultsError::Format { path: self.out.clone(), source })?
            }
            Output::Mesh(format) => self.mesh(&found, format)?,
            Output::Picture => self.picture(&found)?,
        };
        let place = parent(&self.out);
        fs::create_dir_all(place).map_err(CliError::file("make", place))?;
        write_new(&self.out, &bytes)?;
        let (rows, columns) = (found.map.rows(), found.map.columns());
        let Found { frame, .. } = found;
        let exported = Exported { file: self.out.display().to_string(), rows, columns, frame };
        talk.result(&exported, || {
            let of =
                exported.frame.as_ref().map_or_else(String::new, |frame| format!(", the pixels of {frame}"));
            format!("{}: {columns} x {rows}{of}\n", exported.file)
        })
    }

    /// Refuses with `--original` what needs pixels of one size in mm, and what compares two sequences.
    fn refuse_other_grids(&self, output: &Output) -> Result<(), CliError> {
        if self.map.row().kind == ResultsKind::Compare {
            return Err(CliError::usage(format!(
                "--original is for maps of one sequence; --map {} compares two, so leave out --original",
                self.map
            )));
        }
        let needs_mm = match output {
            Output::Map(format) => format.is_for_lengths_only(),
            Output::Mesh(_) => true,
            Output::Picture => false,
        };
        if needs_mm {
            return Err(CliError::usage(format!(
                "{} cannot be written with --original, because its pixels have no common size in mm; leave out \
                 --original, or choose another format",
                self.out.display()
            )));
        }
        Ok(())
    }

    /// A map of a sequence, if the results belong to it.
    fn of_sequence(&self, talk: &Talk) -> Result<Found, CliError> {
        let folder = self.results.clone().unwrap_or_else(|| self.folder.join("results"));
        let sequence = Sequence::open(&self.folder)?;
        let opened = open_results(&sequence, &folder)?;
        tell_results(&opened.matched, talk);
        let map = self.map_of(&sequence, &opened, &folder)?;
        let need = surface_need(map.rows(), map.columns());
        let source = format!("sequence {}", opened.matched.sequence_uid);
        if !self.original {
            check("exporting a map", need, talk, close_others)?;
            let millimetres = opened.heights.as_ref().map(Millimetres::of);
            return Ok(Found { map, source, millimetres, frame: None, of: Some((sequence, opened)) });
        }
        let taken = sequence.record();
        check("exporting a map", need.max(surface_need(taken.rows, taken.columns)), talk, close_others)?;
        let file = &opened.reference_record(&sequence)?.file;
        Ok(Found {
            map: opened.in_original_frame(self.map, map),
            source: format!("{source}, in the pixels of {file}"),
            // Pixels of a turned camera differ in size on the object.
            millimetres: None,
            frame: Some(sequence.folder().join(file).display().to_string()),
            of: Some((sequence, opened)),
        })
    }

    fn map_of(
        &self,
        sequence: &Sequence,
        opened: &OpenedResults,
        folder: &Path,
    ) -> Result<Grid<f32>, CliError> {
        let row = self.map.row();
        if row.quantity == Quantity::LengthMm {
            known_heights(opened, sequence, folder)?;
        }
        let surface = if row.kind == ResultsKind::Surface { opened.files.surface()? } else { None };
        match opened.map(self.map, surface.as_ref())? {
            Some(map) => Ok(map),
            None if row.kind == ResultsKind::Match => Ok(opened.files.needed_map(self.map)?),
            None => {
                let filtered = if self.map == ResultMap::HeightFiltered { FILTERED } else { "" };
                let folder = folder.display();
                Err(CliError::usage(format!(
                    "{folder} holds no such map; run `epirig surface --overwrite`{filtered} first"
                )))
            }
        }
    }

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
        Ok(Found {
            map: files.needed_map(self.map)?,
            source: format!("sequence {} less {}", facts.second_uid, facts.first_uid),
            millimetres: Some(Millimetres { pixel_mm: facts.pixel_mm, origin_px: facts.origin_px }),
            frame: None,
            of: None,
        })
    }

    /// What a file may say of the map.
    fn facts(&self, found: &Found) -> MapFacts {
        let pixel_mm = found.millimetres.map(|millimetres| millimetres.pixel_mm);
        let taken = found.of.as_ref().map(|(sequence, _)| sequence.record().created.clone());
        MapFacts { taken, ..self.map.row().facts(pixel_mm, Some(&found.source)) }
    }

    /// The map as a picture; without a photograph if the frame is no longer there.
    fn picture(&self, found: &Found) -> Result<Vec<u8>, CliError> {
        let map = &found.map;
        let picture = if self.map.row().classes().is_empty() {
            let photograph = found.of.as_ref().and_then(|(sequence, opened)| match self.original {
                true => frame_in_dn(sequence, &[opened.reference_record(sequence).ok()?], 0, None).ok(),
                false => matched_frame(sequence, opened.calibration.as_ref(), opened.matched.reference).ok(),
            });
            let picture = MapPicture::of(self.map, map).in_mm(found.millimetres);
            picture.beside(photograph.as_ref()).picture()?
        } else {
            let window = Window::whole(map.rows(), map.columns());
            class_picture(self.map, &map.map(|value| value as u8), (&window, found.millimetres))?
        };
        Ok(encoded_picture(&self.out, &picture)?)
    }

    fn mesh(&self, found: &Found, format: MeshFormat) -> Result<Vec<u8>, CliError> {
        let heights = found.of.as_ref().and_then(|(_, opened)| opened.heights.as_ref());
        let Some(heights) = heights.filter(|_| self.map.row().look == Look::Relief) else {
            return Err(CliError::usage(format!(
                ".{} is for points in space; give --map height or --map height-without-form",
                format.extension()
            )));
        };
        let MapRow { title, least_span, .. } = self.map.row();
        let about = format!(
            "{title} as z from the level {} mm away, towards the camera; x to the right, y up; {}",
            heights.distance_mm, found.source
        );
        let range = ValueRange::of(&found.map, least_span);
        Ok(format.encode(&surface_mesh(heights, &found.map, range, about)))
    }
}
