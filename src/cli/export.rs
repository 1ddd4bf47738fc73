//! `epirig export`.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use serde::Serialize;

use super::files::write_new;
use super::scan_end::tell_results;
use super::{CliError, Talk};
use crate::results::{ResultsError, read_map, read_summary};
use epirig_data::formats::MapFormat;

#[derive(Debug, Clone, Copy, ValueEnum)]
enum MapName {
    Disparity,
    Sigma,
    Cost,
    Confidence,
    Height,
    HeightSigma,
}

impl MapName {
    fn file(self) -> &'static str {
        match self {
            Self::Disparity => "disparity.tiff",
            Self::Sigma => "sigma.tiff",
            Self::Cost => "cost.tiff",
            Self::Confidence => "confidence.tiff",
            Self::Height => "height_mm.tiff",
            Self::HeightSigma => "height_sigma_mm.tiff",
        }
    }
}

/// Export a map of the results to the format of another program
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  epirig export seq --out disparity.csv
  epirig export seq --map height --out height.npy

The extension chooses the format: .pfm, .tiff, .npy or .csv.")]
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
        let extension = self.out.extension().unwrap_or_default().to_string_lossy();
        let format = MapFormat::from_extension(&extension).ok_or_else(|| {
            CliError::Usage(format!(
                "{} has an unknown extension; give .pfm, .tiff, .npy or .csv",
                self.out.display()
            ))
        })?;
        if self.out.exists() {
            return Err(CliError::Usage(format!("{} exists already; give another name", self.out.display())));
        }
        let folder = self.results.unwrap_or_else(|| self.seq.join("results"));
        tell_results(&read_summary(&folder)?, talk);
        let map = read_map(&folder.join(self.map.file()))?;
        let bytes =
            format.encode(&map).map_err(|source| ResultsError::Format { path: self.out.clone(), source })?;
        write_new(&self.out, &bytes)?;
        let exported =
            Exported { file: self.out.display().to_string(), rows: map.rows(), columns: map.columns() };
        talk.result(&exported, || format!("{}: {} x {}\n", exported.file, exported.columns, exported.rows))
    }
}
