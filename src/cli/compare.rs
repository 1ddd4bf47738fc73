//! `epirig compare`.

use std::path::{Path, PathBuf};

use clap::Args;

use super::choice::choice;
use super::need::{check, close_others};
use super::region::RegionArguments;
use super::scan_end::AnywayArgument;
use super::surface::known_heights;
use super::{CliError, Talk};
use crate::pipeline::{
    CompareSummary, MeasuredScan, OpenedResults, compare_scans, open_results, surface_need,
};
use crate::results::{ResultsFolder, ResultsKind, names, scale_in_words};
use epirig_core::shell::quoted;
use epirig_data::sequence::Sequence;
use epirig_surface::{ScaleSigma, TrendKind};

/// Places that are printed; places.csv has all.
const PRINTED_PLACES: usize = 5;

/// Compare the heights of two scans of one object
///
/// Registers the second scan to the first by their reference frames: shift, turn and scale. Subtracts the
/// heights, and removes a plane from the difference, because the zero of heights and the tilt of the object
/// differ from scan to scan. The sigma of the difference follows from those of both maps.
#[derive(Debug, Args)]
#[command(
    allow_negative_numbers = true,
    after_help = "Examples:
  epirig compare before after --out change
  epirig compare before after --out change --mask object.png
  epirig compare tile tile/results-quick --out change      two matches of one scan

A and B are folders of sequences, or of their results. DIR holds difference_mm.tiff (height
in B less height in A, at the pixels of A), difference_sigma_mm.tiff, difference.png,
significance.png (difference over sigma), places.csv (where the difference is significant) and
compare.json. If nothing changed, 68 % of the pixels lie within one sigma, and 95 % within two."
)]
pub(super) struct Compare {
    /// Folder of the first sequence, or of results in it
    #[arg(value_name = "A")]
    first: PathBuf,
    /// Folder of the second sequence, or of results in it
    #[arg(value_name = "B")]
    second: PathBuf,
    /// Folder to write
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Replace an existing comparison
    #[arg(long)]
    overwrite: bool,
    /// Form that is removed from the difference
    #[arg(long, value_parser = choice::<TrendKind>(), default_value_t = TrendKind::Plane)]
    trend: TrendKind,
    #[command(flatten)]
    region: RegionArguments,
    #[command(flatten)]
    anyway: AnywayArgument,
}

/// A scan with its results.
struct Opened {
    sequence: Sequence,
    results: PathBuf,
    opened: OpenedResults,
}

impl Compare {
    pub(super) fn run(self, talk: &Talk) -> Result<(), CliError> {
        let first = self.open(&self.first, talk)?;
        let second = self.open(&self.second, talk)?;
        let (rows, columns) = (first.opened.disparity.rows(), first.opened.disparity.columns());
        check("comparing the heights", 2 * surface_need(rows, columns), talk, close_others)?;
        let region = self.region.region(rows, columns, talk)?;
        let folder = ResultsFolder::create(&self.out, ResultsKind::Compare, self.overwrite)?;
        let scans = [first.measured()?, second.measured()?];
        let summary = compare_scans(scans, self.trend, &region, &folder)?;
        folder.commit()?;
        let picture = self.out.join(names::DIFFERENCE);
        talk.result(&summary, || format!("{}look at {}\n", describe(&summary), quoted(&picture)))
    }

    /// Opens a sequence with its usual results, or the results in a folder of a sequence.
    fn open(&self, path: &Path, talk: &Talk) -> Result<Opened, CliError> {
        let summary = ResultsKind::Match.summary();
        let is_results = path.join(summary).is_file();
        let (folder, results) = match path.parent().filter(|_| is_results) {
            // A bare name has an empty parent: this folder.
            Some(parent) if parent.as_os_str().is_empty() => (PathBuf::from("."), path.to_owned()),
            Some(parent) => (parent.to_owned(), path.to_owned()),
            None => (path.to_owned(), path.join("results")),
        };
        let sequence = self.anyway.open(&folder, talk)?;
        let opened = open_results(&sequence, &results)?;
        Ok(Opened { sequence, results, opened })
    }
}

impl Opened {
    fn measured(&self) -> Result<MeasuredScan<'_>, CliError> {
        let Self { sequence, results, opened } = self;
        Ok(MeasuredScan { sequence, opened, heights: known_heights(opened, sequence, results)? })
    }
}

fn describe(summary: &CompareSummary) -> String {
    let CompareSummary { motion, difference, places, .. } = summary;
    let form = if motion.parts > 0 {
        format!("turned by {:.4} deg, scale {:.5}", motion.turn_deg, motion.scale)
    } else {
        "the pictures are too small, or have too little texture, for a turn".to_owned()
    };
    let mut text = format!(
        "moved              {:.3}, {:.3} px ({:.3}, {:.3} mm), sigma {:.4} px; {form}\n\
         removed            {}: offset {:.4} mm, tilt {:.4} deg along x, {:.4} deg along y\n\
         compared           {} px\n\
         difference         mean {:.4} mm, median {:.4} mm, scatter {:.4} mm (expected {:.4} mm)\n\
         within 1 sigma     {:.1} % (68 % if nothing changed)\n\
         within 2 sigma     {:.1} % (95 %)\n",
        motion.shift_px.0,
        motion.shift_px.1,
        motion.shift_mm.0,
        motion.shift_mm.1,
        motion.sigma_px,
        summary.trend,
        summary.offset_mm,
        summary.tilt_deg.0,
        summary.tilt_deg.1,
        difference.pixels,
        difference.mean_mm,
        difference.median_mm,
        difference.scatter_mm,
        difference.median_sigma_mm,
        100.0 * difference.within_1_sigma,
        100.0 * difference.within_2_sigma,
    );
    text.push_str(&format!("scale              {}\n", scale(summary.scale_sigma)));
    if places.is_empty() {
        text.push_str("significant        nowhere\n");
    }
    for (index, place) in places.iter().take(PRINTED_PLACES).enumerate() {
        let name = if index == 0 { format!("{} place(s)", places.len()) } else { String::new() };
        text.push_str(&format!(
            "{name:<19}at {:.0}, {:.0} px: {:.4} mm on average, {:.4} mm at most, {:.2} mm^2\n",
            place.centre_px.0, place.centre_px.1, place.mean_mm, place.largest_mm, place.area_mm2
        ));
    }
    if places.len() > PRINTED_PLACES {
        text.push_str(&format!(
            "{:<19}and {} more in {}\n",
            "",
            places.len() - PRINTED_PLACES,
            names::PLACES
        ));
    }
    text
}

/// What an error of the scales does to the difference.
fn scale(sigmas: [ScaleSigma; 2]) -> String {
    let [first, second] = sigmas.map(scale_in_words);
    let known = if first == second { first } else { format!("{first} in A; {second} in B") };
    format!("{known}; not in sigma: an error that A and B share changes all differences by the same share")
}
