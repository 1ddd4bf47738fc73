//! `epirig target print`.

use std::path::PathBuf;

use clap::{Args, Subcommand};
use serde::Serialize;

use super::choice::choice;
use super::files::{refuse_taken, write_new};
use super::numbers::mm;
use super::{CliError, Talk};
use epirig_calibration::target::print::{Page, Sheet};
use epirig_calibration::target::{ChessBoard, Target};

/// Print chess-board targets for calibration
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  epirig target print --out target.pdf                         two bands for a tile of 15 cm
  epirig target print --out board.svg --bands 1 --columns 9 --rows 6 --square-mm 20")]
pub(super) struct TargetVerb {
    #[command(subcommand)]
    what: What,
}

#[derive(Debug, Subcommand)]
enum What {
    Print(Print),
}

/// Write a target as SVG or PDF, in true mm
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  epirig target print --out target.pdf                         two bands for a tile of 15 cm
  epirig target print --out target.svg --page letter
  epirig target print --out board.pdf --bands 1 --columns 9 --rows 6 --square-mm 20
  epirig target print --out long.pdf --columns 30 --page fit   on a page as large as it needs

Columns and rows count inner corners, at which four squares meet: 18 x 2 of them are 19 x 3 squares.
Print at 100 % (\"actual size\"), and check the ruler on the sheet with a true one. The extension
chooses the format: .svg or .pdf.")]
struct Print {
    /// The file to write; an existing file is refused
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// Inner corners along a row
    #[arg(long, default_value_t = 18)]
    columns: usize,
    /// Inner corners along a column, in each band
    #[arg(long, default_value_t = 2)]
    rows: usize,
    /// Side of a square, in mm
    #[arg(long, value_name = "MM", value_parser = mm, default_value_t = 7.5)]
    square_mm: f64,
    /// Number of boards on the sheet: 1, or 2 with the measured area between them
    #[arg(long, default_value_t = 2)]
    bands: usize,
    /// Distance from the first row of corners of the first band to that of the second, in mm
    #[arg(long, value_name = "MM", value_parser = mm, default_value_t = 127.5)]
    band_distance_mm: f64,
    /// Paper size, upright or turned; `fit` is as large as the target needs
    #[arg(long, value_parser = choice::<Page>(), default_value_t = Page::A4)]
    page: Page,
}

#[derive(Serialize)]
struct Printed {
    file: String,
    page: Page,
    width_mm: f64,
    height_mm: f64,
}

impl TargetVerb {
    pub(super) fn run(self, talk: &Talk) -> Result<(), CliError> {
        match self.what {
            What::Print(verb) => verb.run(talk),
        }
    }
}

impl Print {
    fn run(self, talk: &Talk) -> Result<(), CliError> {
        let extension = self.out.extension().unwrap_or_default().to_string_lossy().to_lowercase();
        let format: fn(&Sheet) -> Vec<u8> = match extension.as_str() {
            "svg" => |sheet| sheet.to_svg().into_bytes(),
            "pdf" => Sheet::to_pdf,
            _ => {
                let message = format!("{} has an unknown extension; give .svg or .pdf", self.out.display());
                return Err(CliError::usage(message));
            }
        };
        refuse_taken(&self.out)?;
        let board = ChessBoard { columns: self.columns, rows: self.rows, square_mm: self.square_mm };
        let target = Target { board, bands: self.bands, band_distance_mm: self.band_distance_mm };
        let page = self.page;
        let sheet = Sheet::new(&target, page)?;
        write_new(&self.out, &format(&sheet))?;
        let (width_mm, height_mm) = sheet.size_mm();
        let printed = Printed { file: self.out.display().to_string(), page, width_mm, height_mm };
        talk.result(&printed, || {
            format!("{}: {width_mm:.1} mm x {height_mm:.1} mm; print it at 100 %\n", printed.file)
        })
    }
}
