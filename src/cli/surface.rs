//! `epirig surface`.

use std::path::{Path, PathBuf};

use clap::Args;

use super::choice::choice;
use super::need::{check, close_others};
use super::numbers::mm;
use super::region::{RegionArguments, four};
use super::scan_end::AnywayArgument;
use super::verdict::{VerdictArguments, answer};
use super::{CliError, Talk};
use crate::number::{ascii, fixed, plain, share, sigma, with_interval};
use crate::pipeline::{
    MeasuredSurface, OpenedResults, PipelineError, SurfaceQuestions, half_frames, half_heights, halves_need,
    inspect_surface, open_results, pack_if_large, steps_options, surface_need,
};
use crate::profile::{Override, Profile, ReportProfile};
use crate::results::{ResultsFolder, ResultsKind, SurfaceSummary, names};
use epirig_core::fault::{Blame, Fault as _};
use epirig_core::progress::Progress;
use epirig_core::shell::quoted;
use epirig_data::sequence::Sequence;
use epirig_surface::{
    Combined, Contribution, DepthOnPlateaus, Evaluation, Filters, HalfHeights, Heights, Roughness, TrendKind,
};

/// Measure the depth of hollows in a surface, and its roughness
///
/// Reads the results of `epirig match`, removes the form, finds two levels and reports their distance with
/// its 95 % interval. The form is a quadric by default: no tile is flat, and no lens free of distortion, to a
/// tenth of a millimetre. Depth and form are fitted together, so that the form does not absorb any depth.
#[derive(Debug, Args)]
#[command(
    allow_negative_numbers = true,
    after_help = "Examples:
  epirig surface seq
  epirig surface seq --profile 100,512,900,512 --profile-width 9
  epirig surface seq --region 240,330,715,665
  epirig surface seq --mask object.png            white where the object is
  epirig surface seq --trend plane --overwrite
  epirig surface seq --tolerance \"0.2 +- 0.01 mm, sa ..5 um\"      ends with the verdict
  epirig surface seq --s-filter-mm 1 --l-filter-mm 8 --overwrite

All values belong to the largest connected region (of --region or --mask, if given), without
outliers, very uncertain heights and its rim. Outliers are left out, too: fewer connected pixels than a hollow needs, more than eight
standard deviations above the upper or below the lower level. The folder results/surface holds
report.html (the whole measurement on one page, which prints and needs no network), height_mm.tiff
(the region after removal of the form), hollows.csv, profile.csv, surface.json, and pictures. With
a filter it also holds filtered_mm.tiff (the heights between the cut-offs). In used.png, white
pixels were used, light grey ones are walls and outliers, and dark grey ones were left out;
pixels.png has a legend. `epirig export` makes PLY, GSF, X3P and other formats of the heights."
)]
pub(super) struct Surface {
    /// Folder of the sequence
    seq: PathBuf,
    /// Folder of the matcher's results [default: SEQ/results]
    #[arg(long, value_name = "DIR")]
    results: Option<PathBuf>,
    /// Folder to write [default: surface in the folder of the results]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Replace existing results of the surface
    #[arg(long)]
    overwrite: bool,
    /// Form that is removed from the heights
    #[arg(long, value_parser = choice::<TrendKind>(), default_value_t = TrendKind::Quadric)]
    trend: TrendKind,
    #[command(flatten)]
    region: RegionArguments,
    /// Measure the chess-boards of the calibration's target, too, which are no part of the surface
    #[arg(long, hide_short_help = true)]
    with_target: bool,
    /// Ends of a profile, in px [default: the middle row of the field]
    #[arg(long, value_name = "X0,Y0,X1,Y1", value_parser = four::<f64>)]
    profile: Option<[f64; 4]>,
    /// Width over which the profile is averaged, across its line, in px
    #[arg(long, value_name = "PX", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=1000))]
    profile_width: u32,
    /// Cut-off of the S-filter, in mm: shorter waves do not count as roughness [default: no filter]
    #[arg(long, value_name = "MM", value_parser = mm)]
    s_filter_mm: Option<f64>,
    /// Cut-off of the L-filter, in mm: longer waves do not count as roughness [default: no filter]
    #[arg(long, value_name = "MM", value_parser = mm)]
    l_filter_mm: Option<f64>,
    #[command(flatten)]
    verdict: VerdictArguments,
    /// What the report says beside the results: a key of `[report]` in a profile, such as customer or object; may be given
    /// several times [default: as recorded with the frames]
    #[arg(long, value_name = "KEY=TEXT", hide_short_help = true)]
    report: Vec<String>,
    #[command(flatten)]
    anyway: AnywayArgument,
}

impl Surface {
    pub(super) fn run(self, talk: &Talk) -> Result<(), CliError> {
        self.verdict.check()?;
        self.stated()?;
        let sequence = self.anyway.open(&self.seq, talk)?;
        let results = self.results.clone().unwrap_or_else(|| self.seq.join("results"));
        let out = self.out.clone().unwrap_or_else(|| results.join("surface"));
        let ask = |opened: &OpenedResults, heights: &Heights| self.questions(opened, heights, talk);
        let summary = measured(&sequence, &results, (&out, self.overwrite), ask, talk)?;
        talk.result(&summary, || {
            format!("{}look at {}\n", describe(&summary), quoted(&out.join(names::REPORT)))
        })?;
        self.verdict.end(Some(&summary), &sequence, talk)
    }

    fn questions(
        &self,
        opened: &OpenedResults,
        heights: &Heights,
        talk: &Talk,
    ) -> Result<SurfaceQuestions, CliError> {
        let (rows, columns) = (opened.disparity.rows(), opened.disparity.columns());
        let region = self.region.region(rows, columns, talk)?;
        let filters = Filters { s_filter_mm: self.s_filter_mm, l_filter_mm: self.l_filter_mm };
        filters.check(heights.pixel_mm()).map_err(CliError::usage)?;
        Ok(SurfaceQuestions {
            steps: steps_options(&opened.matched.settings, self.trend),
            region,
            with_target: self.with_target,
            line: self.profile.map(|[x0, y0, x1, y1]| ((x0, y0), (x1, y1))),
            profile_width_px: self.profile_width as usize,
            filters,
            specification: self.verdict.over(&opened.specification)?,
            report: opened.report.clone().replaced_by(self.stated()?),
        })
    }

    /// What the report is to say, by the options.
    fn stated(&self) -> Result<ReportProfile, CliError> {
        let settings = self.report.iter().map(|text| Override::parse(&format!("report.{text}"), "--report"));
        let settings: Vec<Override> = settings.collect::<Result<_, _>>()?;
        Ok(Profile::of(&settings)?.report.clone())
    }
}

/// Measures what `ask` asks of the surface of `results`, into a folder that is replaced with `overwrite`.
fn measured(
    sequence: &Sequence,
    results: &Path,
    (out, overwrite): (&Path, bool),
    ask: impl FnOnce(&OpenedResults, &Heights) -> Result<SurfaceQuestions, CliError>,
    talk: &Talk,
) -> Result<SurfaceSummary, CliError> {
    let opened = &open_results(sequence, results)?;
    let need = surface_need(opened.disparity.rows(), opened.disparity.columns());
    check("analysing the surface", need, talk, close_others)?;
    let heights = known_heights(opened, sequence, results)?;
    let questions = ask(opened, heights)?;
    let folder = ResultsFolder::create(out, ResultsKind::Surface, overwrite)?;
    let halves = halves(sequence, opened, talk)?;
    let measured = MeasuredSurface { sequence, opened, heights, halves: halves.as_ref() };
    let summary = inspect_surface(measured, &questions, &folder)?;
    (talk as &dyn Progress).unless_cancelled()?;
    folder.commit()?;
    Ok(summary)
}

/// Why there are no heights, and what to do.
const NO_GEOMETRY: &str = "focal length or positions are unknown; import the images with --focal-length-px and --step-mm, or calibrate the \
                                      sequence";

/// The heights of `opened`, or why there are none.
pub(super) fn known_heights<'a>(
    opened: &'a OpenedResults,
    sequence: &Sequence,
    results: &Path,
) -> Result<&'a Heights, CliError> {
    opened.heights.as_ref().ok_or_else(|| match opened.has_geometry {
        false => CliError::usage(format!("{}: no heights: {NO_GEOMETRY}", sequence.folder().display())),
        true => {
            CliError::data(format!("{}: no pixel has a disparity; look at mask.png there", results.display()))
        }
    })
}

/// The heights by two halves of the frames. If these cannot be read or matched, the surface is measured all the same,
/// and that is said.
fn halves(
    sequence: &Sequence,
    opened: &OpenedResults,
    talk: &Talk,
) -> Result<Option<[HalfHeights; 2]>, CliError> {
    let options = opened.matched.options();
    let calibration = opened.calibration.as_ref();
    let held = pack_if_large(sequence, calibration, &options, (halves_need, None), talk)?;
    let need = halves_need(half_frames(sequence, opened), &options, held);
    check("matching halves of the frames", need, talk, close_others)?;
    let found = match half_heights(sequence, opened, talk) {
        Err(error @ (PipelineError::Sequence(_) | PipelineError::Halves(_)))
            if error.blame() != Blame::Interruption =>
        {
            talk.say(&format!("note: {error}"));
            None
        }
        found => found?,
    };
    if found.is_none() {
        talk.say(
            "note: the frames cannot be divided into halves; a depth is read from the heights that were divided, and is too large",
        );
    }
    Ok(found)
}

/// Measures the surface of new results of the sequence in `folder` as `epirig surface` does without options: the
/// summary, and where the report is. The results are in place, so a surface that cannot be measured is no
/// failure; a note says why.
pub(super) fn measure_surface(
    folder: &Path,
    results: &Path,
    verdict: Option<&VerdictArguments>,
    talk: &Talk,
) -> Option<(SurfaceSummary, PathBuf)> {
    let out = results.join("surface");
    let usual = |opened: &OpenedResults, _: &Heights| {
        let usual = SurfaceQuestions::usual(opened);
        let asked = verdict.map(|verdict| verdict.over(&usual.specification)).transpose()?;
        Ok(SurfaceQuestions { specification: asked.unwrap_or(usual.specification), ..usual })
    };
    let sequence = Sequence::open(folder).map_err(CliError::from);
    let summary = sequence
        .and_then(|sequence| measured(&sequence, results, (&out, false), usual, talk))
        .inspect_err(|error| talk.say(&format!("note: the surface was not measured: {}", error.message)))
        .ok()?;
    Some((summary, out.join(names::REPORT)))
}

/// Where the surface is, in a line.
pub(super) fn brief(summary: &SurfaceSummary) -> String {
    let distance = ascii(&summary.distance_in_words());
    format!("distance           {distance}; a pixel is {:.4} mm wide\n", summary.pixel_mm)
}

/// The numbers of a surface, a line each, and at last what they say.
pub(super) fn describe(summary: &SurfaceSummary) -> String {
    let field = &summary.field;
    let digits = |value: f64| ascii(&fixed(value, 4));
    let mut text = format!(
        "field              {:.1} % of {} heights; left out: {}{} uncertain, {} apart from it, {} at its rim, {} outliers (used.png)\n\
         {}trend              tilt {} deg along x, {} deg along y; bow {} mm over the field\n",
        100.0 * field.used_px as f64 / field.answered_px as f64,
        field.answered_px,
        match field.target_px {
            0 => String::new(),
            pixels => format!("{pixels} of the target, "),
        },
        field.uncertain_px,
        field.apart_px,
        field.rim_px,
        field.outlier_px,
        brief(summary),
        digits(summary.tilt_deg.0),
        digits(summary.tilt_deg.1),
        digits(summary.bow_mm),
    );
    if let Some(levels) = &summary.levels {
        let depth_mm = levels.depth.depth_mm;
        let interval = match levels.budget.combined {
            None => "; its interval is not known: too few independent parts".to_owned(),
            Some(Combined { coverage_factor, .. }) => format!(" (95 % coverage, k = {coverage_factor:.2})"),
        };
        let half_width_mm = levels.budget.combined.map(|combined| combined.half_width_95_mm);
        let what = if levels.raised { "standing on the lower level" } else { "hollow" };
        text.push_str(&format!(
            "levels             two, {} part(s) {what}\ndepth              {}{interval}\n",
            levels.parts.len(),
            depth(depth_mm, half_width_mm),
        ));
        text.extend(levels.budget.contributions.iter().map(contribution));
        for wider in levels.by_margin.iter().filter(|wider| wider.margin_px > levels.margin_px) {
            text.push_str(&format!(
                "farther from walls {} (95 % by scatter alone): {} px beside them left out, not {}\n",
                depth(wider.depth_mm, wider.half_width_95_mm),
                wider.margin_px,
                levels.margin_px
            ));
        }
        text.extend(levels.on_plateaus.iter().map(plateaus));
        text.extend(levels.wall_width_mm.iter().map(|width_mm| {
            format!(
                "walls              look {} wide in the map, from 10 % to 90 % of the depth\n",
                plain(*width_mm, "mm")
            )
        }));
        for (name, rough) in [
            ("about the levels", &levels.roughness),
            ("upper level", &levels.upper),
            ("lower level", &levels.lower),
        ] {
            text.extend(rough.iter().map(|rough| roughness_line(name, rough)));
        }
        text.extend(levels.misfit().map(|words| format!("note               {words}\n")));
    }
    text.push_str(&roughness_line("field", &summary.roughness));
    let cutoff = |cutoff_mm: Option<f64>| cutoff_mm.map_or("none".to_owned(), |mm| format!("{mm} mm"));
    let Filters { s_filter_mm, l_filter_mm } = summary.filters;
    text + &format!(
        "cut-offs           S-filter {}, L-filter {}\n{}",
        cutoff(s_filter_mm),
        cutoff(l_filter_mm),
        answer(summary)
    )
}

fn plateaus(on: &DepthOnPlateaus) -> String {
    let DepthOnPlateaus { depth, width_px, .. } = on;
    format!(
        "by ISO 5436-1      {} (95 % by scatter alone) on the plateaus of parts {width_px:.0} px wide\n",
        self::depth(depth.depth_mm, depth.half_width_95_mm)
    )
}

/// A depth, with half the width of its interval if that is known.
fn depth(depth_mm: f64, half_width_mm: Option<f64>) -> String {
    ascii(&match half_width_mm {
        Some(_) => with_interval(depth_mm, half_width_mm, "mm"),
        None => plain(depth_mm, "mm"),
    })
}

/// A line of the uncertainty budget.
fn contribution(part: &Contribution) -> String {
    let kind = match part.evaluation {
        Evaluation::A => "A",
        Evaluation::B => "B",
    };
    let sigma = part.sigma_mm.map_or("not known".to_owned(), |mm| sigma(mm, "mm"));
    let share = part.share.map_or(String::new(), |part| format!(", {}", share(part)));
    format!("  u by {:<48} {sigma} (type {kind}{share})\n", part.name)
}

fn roughness_line(name: &str, rough: &Roughness) -> String {
    let noise = rough.sq_noise_mm.map_or(String::new(), |mm| format!("; by sigma Sq {mm:.4} mm"));
    format!(
        "{name:<19}Sa {:.4} mm, Sq {:.4} mm, Sz {:.4} mm, Ssk {:.2}, Sku {:.2}{noise}\n",
        rough.sa_mm, rough.sq_mm, rough.sz_mm, rough.ssk, rough.sku
    )
}
