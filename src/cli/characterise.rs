//! `epirig characterise`.

use std::path::{Path, PathBuf};

use clap::Args;
use serde::Serialize;

use super::{CliError, Talk};
use crate::number::{ascii, plain, share, sigma, significant, with_interval};
use crate::series::{ChangedQuantity, Characteristics, RepeatedQuantity, Series, Standard};
use epirig_surface::{MeasurementNoise, Response, StepResponse};

/// What is so improbable by chance is not chance: scans that scatter more than they claim, a known depth that is missed,
/// and a change of any quantity.
const BY_CHANCE: f64 = 0.05;

/// Tell what the rig can do, from repeated scans of one object
///
/// Compares the measured sequences below a folder: the noise of their heights, how the depth and the rig repeat, and
/// whether both agree with what each scan claims of itself. Between the scans the object stays where it is.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  epirig characterise repeats
  epirig characterise repeats --json
  epirig characterise repeats --standard \"0.2 +- 0.001 mm\"
  epirig characterise . --standard \"low=0.1 mm\" --standard \"high=0.5 mm\"
  epirig characterise december --earlier june

`epirig repeat` takes the scans.

The measurement noise N_M (ISO 25178-700) is the root mean square of the difference of successive
heights, without its plane, over the root of 2. s_r is the repeatability standard deviation with its
interval of 95 % coverage, and r the repeatability limit: two values differ by less than r with a
probability of 95 % (ISO 5725). With standards: the amplification coefficient is the slope of measured over
known depths, and the linearity deviation the largest distance of a mean from that line (ISO 25178-700).")]
pub(super) struct Characterise {
    /// Folder to look below
    #[arg(default_value = ".")]
    folder: PathBuf,
    /// The object's depth is known: `0.2 +- 0.001 mm`, with 95 % coverage; may be given for each of several folders
    /// inside FOLDER, as `NAME=0.2 mm`
    #[arg(long, value_name = "[NAME=]DEPTH")]
    standard: Vec<Standard>,
    /// Tell what has changed since earlier scans of the same object, which lie below this folder
    #[arg(long, value_name = "FOLDER")]
    earlier: Option<PathBuf>,
}

#[derive(Serialize)]
struct CharacteriseOutput {
    #[serde(flatten)]
    found: Characteristics,
    /// What differs from earlier scans; only with --earlier.
    #[serde(skip_serializing_if = "Option::is_none")]
    changes: Option<Vec<ChangedQuantity>>,
}

impl Characterise {
    pub(super) fn run(self, talk: &Talk) -> Result<(), CliError> {
        let earlier =
            self.earlier.map(|folder| characteristics(&folder, &self.standard, talk)).transpose()?;
        let found = characteristics(&self.folder, &self.standard, talk)?;
        if !self.standard.is_empty() && found.response.is_none() {
            return Err(CliError::usage(format!(
                "no depth was measured below {} of what --standard names; `epirig list` tells the names of the sequences",
                self.folder.display()
            )));
        }
        let changes = earlier.map(|earlier| found.compared_with(&earlier));
        let output = CharacteriseOutput { found, changes };
        talk.result(&output, || described(&output))
    }
}

/// Prints what the measured sequences below a folder tell of the rig.
pub(super) fn characterise(folder: &Path, talk: &Talk) -> Result<(), CliError> {
    let output = CharacteriseOutput { found: characteristics(folder, &[], talk)?, changes: None };
    talk.result(&output, || described(&output))
}

fn characteristics(folder: &Path, standards: &[Standard], talk: &Talk) -> Result<Characteristics, CliError> {
    let series = Series::below(folder)?;
    let found = Characteristics::of(folder, &series, standards, talk)?;
    for problem in &found.problems {
        talk.say(&format!("note: {problem}"));
    }
    if found.sequences.len() < 2 {
        return Err(CliError::usage(format!(
            "{} of {} sequences below {} are measured; repeats need two at least: scan the object again, and measure each \
             scan",
            found.sequences.len(),
            series.entries.len(),
            folder.display()
        )));
    }
    Ok(found)
}

fn described(CharacteriseOutput { found, changes }: &CharacteriseOutput) -> String {
    let mut text = format!("sequences          {} that are measured\n", found.sequences.len());
    text.push_str(&match &found.noise {
        Some(noise) => noise_lines(noise),
        None => "heights            N_M unknown: successive maps of heights have too few pixels in common\n"
            .to_owned(),
    });
    text.extend(found.response.iter().map(response_lines));
    found.quantities.iter().for_each(|quantity| text.push_str(&quantity_lines(quantity)));
    text.extend(changes.iter().map(|changes| change_lines(changes)));
    text
}

fn response_lines(response: &Response) -> String {
    let one = |step: &StepResponse| {
        let StepResponse { known_mm, count, mean_mm, deviation_mm, half_width_95_mm, by_chance } = *step;
        let agrees = by_chance.map_or(String::new(), |by_chance| {
            let words =
                if by_chance < BY_CHANCE { "farther off than the scans claim" } else { "as the scans claim" };
            format!("\n  claimed          {words} (this far or farther by chance: {})", share(by_chance))
        });
        format!(
            "known {known_mm:<12} mean {} of {count}, off by {}{agrees}\n",
            plain(mean_mm, "mm"),
            with_interval(deviation_mm, half_width_95_mm, "mm"),
        )
    };
    let interval = response.half_width_95.map_or(", interval unknown".to_owned(), |half_width| {
        format!(" +- {} (95 % coverage)", significant(half_width, 2))
    });
    let mut text: String = response.steps.iter().map(one).collect();
    text.push_str(&format!("amplification      {:.5}{interval}\n", response.amplification));
    text.extend(
        response
            .linearity_mm
            .iter()
            .map(|mm| format!("linearity          {} off that line at most\n", sigma(*mm, "mm"))),
    );
    ascii(&text)
}

/// Changes of any of the quantities, at a risk of [`BY_CHANCE`] for all of them together.
fn change_lines(changes: &[ChangedQuantity]) -> String {
    let least = BY_CHANCE / (2 * changes.len().max(1)) as f64;
    let lines = changes.iter().map(|change| {
        let ChangedQuantity { measure, unit, earlier_mean, mean, earlier_deviation, deviation, .. } = change;
        let words = |what: &str, before: f64, now: f64, by_chance: f64| {
            (by_chance < least).then(|| {
                let [before, now] = [before, now].map(|value| plain(value, unit).trim_end().to_owned());
                format!(
                    "changed            {measure}: {what} {before} before, {now} now (by chance: {})\n",
                    share(by_chance)
                )
            })
        };
        let of_mean = words("mean", *earlier_mean, *mean, change.mean_by_chance);
        let of_scatter = words("s_r", *earlier_deviation, *deviation, change.deviation_by_chance);
        of_mean.into_iter().chain(of_scatter).collect::<String>()
    });
    let text: String = lines.collect();
    if text.is_empty() { "changed            nothing beyond chance\n".to_owned() } else { ascii(&text) }
}

fn noise_lines(noise: &MeasurementNoise) -> String {
    let interval = match noise.half_width_95_mm {
        Some(half_width) => format!("+- {}", sigma(half_width, "mm")),
        None => "from one pair".to_owned(),
    };
    format!(
        "heights            N_M {} {interval}, {} pixels of {} pairs\n  \
           claimed          the noise is {} times what the sigma of each pixel says\n",
        ascii(&sigma(noise.noise_mm, "mm")),
        noise.pixels,
        noise.pairs,
        significant(noise.over_claimed, 3),
    )
}

fn quantity_lines(quantity: &RepeatedQuantity) -> String {
    let RepeatedQuantity { measure, unit, repeatability, claimed } = quantity;
    let in_unit = |value: f64| match (*unit, value) {
        (_, 0.0) => "0".to_owned(),
        ("", value) => significant(value, 2),
        (unit, value) => sigma(value, unit),
    };
    let deviations = repeatability.mean.abs() / repeatability.deviation;
    let digits = if deviations.is_finite() { 2 + deviations.max(1.0).log10() as i32 } else { 3 };
    let mut text = format!(
        "{:<18} {}{}, s_r {} ({} to {}), r {}\n",
        measure.to_string(),
        ascii(&significant(repeatability.mean, digits)),
        if unit.is_empty() { String::new() } else { format!(" {unit}") },
        in_unit(repeatability.deviation),
        in_unit(repeatability.lower),
        in_unit(repeatability.upper),
        in_unit(repeatability.limit),
    );
    if let (Some(claimed), Some(probability)) = (claimed, quantity.probability()) {
        let agrees = match probability < BY_CHANCE {
            true => "the scans scatter more",
            false => "they agree",
        };
        text.push_str(&format!(
            "  claimed          {} by each scan for itself: {agrees} (this much or more by chance: {})\n",
            in_unit(*claimed),
            share(probability),
        ));
    }
    text
}
