//! `epirig characterise`.

use std::path::{Path, PathBuf};

use clap::Args;

use super::{CliError, Talk};
use crate::number::{ascii, share, sigma, significant};
use crate::series::{Characteristics, RepeatedQuantity, Series};
use epirig_surface::MeasurementNoise;

/// Scans that scatter more than they claim with a smaller probability do not agree with it.
const AGREES: f64 = 0.05;

/// Tell what the rig can do, from repeated scans of one object
///
/// Compares the measured sequences below a folder: the noise of their heights, how the depth and the rig repeat, and
/// whether both agree with what each scan claims of itself. Between the scans the object stays where it is.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  epirig characterise repeats
  epirig characterise repeats --json

`epirig repeat` takes the scans.

The measurement noise N_M (ISO 25178-700) is the root mean square of the difference of successive
heights, without its plane, over the root of 2. s_r is the repeatability standard deviation with its
interval of 95 % coverage, and r the repeatability limit: two values differ by less than r with a
probability of 95 % (ISO 5725).")]
pub(super) struct Characterise {
    /// Folder to look below
    #[arg(default_value = ".")]
    folder: PathBuf,
}

impl Characterise {
    pub(super) fn run(self, talk: &Talk) -> Result<(), CliError> {
        characterise(&self.folder, talk)
    }
}

/// Prints what the measured sequences below a folder tell of the rig.
pub(super) fn characterise(folder: &Path, talk: &Talk) -> Result<(), CliError> {
    let series = Series::below(folder)?;
    let found = Characteristics::of(folder, &series, talk)?;
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
    talk.result(&found, || described(&found))
}

fn described(found: &Characteristics) -> String {
    let mut text = format!("sequences          {} that are measured\n", found.sequences.len());
    text.push_str(&match &found.noise {
        Some(noise) => noise_lines(noise),
        None => "heights            N_M unknown: successive maps of heights have too few pixels in common\n"
            .to_owned(),
    });
    found.quantities.iter().for_each(|quantity| text.push_str(&quantity_lines(quantity)));
    text
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
        let agrees = match probability < AGREES {
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
