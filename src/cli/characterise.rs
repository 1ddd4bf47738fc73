//! `epirig characterise`.

use std::path::{Path, PathBuf};

use clap::Args;
use serde::Serialize;

use super::{CliError, Talk};
use crate::number::{ascii, share, sigma, significant, to_place_of, with_interval};
use crate::series::{
    ChangedQuantity, Characteristics, RepeatedQuantity, SequenceState, Series, SeriesEntry, Standard,
};
use epirig_surface::{MeasurementNoise, Response, StepResponse};

/// What is so improbable by chance is not chance: scans that scatter more than they claim, and a change of any quantity.
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
probability of 95 % (ISO 5725). With standards: the amplification coefficient is the slope of
measured over known depths, by a line through zero, and the linearity deviation the largest distance
of a mean from that line (ISO 25178-700).")]
pub(super) struct Characterise {
    /// Folder to look below
    #[arg(default_value = ".")]
    folder: PathBuf,
    /// The object's depth is known: `0.2 +- 0.001 mm`, with 95 % coverage; may be given for each of several folders
    /// inside FOLDER, as `NAME=0.2 mm`
    #[arg(long, value_name = "[NAME=]DEPTH")]
    standard: Vec<Standard>,
    /// Tell what has changed since earlier scans of the same object, which lie below this folder
    #[arg(long, value_name = "FOLDER", conflicts_with = "standard")]
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
        let series = Series::below(&self.folder)?;
        let earlier =
            self.earlier.map(|folder| earlier(&folder, (&self.folder, &series), talk)).transpose()?;
        refuse_two_of_one_folder(&self.standard)?;
        let found = characteristics(&self.folder, &series, &self.standard, talk)?;
        if !self.standard.is_empty() && found.response.is_none() {
            return Err(CliError::usage(format!(
                "no depth was measured below {} of what --standard names; `epirig list` tells the names of the sequences",
                self.folder.display()
            )));
        }
        let changes = earlier.map(|earlier| {
            let pairs = found.quantities.iter().filter_map(|now| {
                let before = earlier.iter().find(|before| before.measure == now.measure)?;
                now.compared_with(before)
            });
            pairs.collect()
        });
        let output = CharacteriseOutput { found, changes };
        talk.result(&output, || described(&output))
    }
}

/// Prints what the measured sequences below a folder tell of the rig.
pub(super) fn characterise(folder: &Path, talk: &Talk) -> Result<(), CliError> {
    let found = characteristics(folder, &Series::below(folder)?, &[], talk)?;
    let output = CharacteriseOutput { found, changes: None };
    talk.result(&output, || described(&output))
}

fn refuse_two_of_one_folder(standards: &[Standard]) -> Result<(), CliError> {
    let is_second = |(place, one): &(usize, &Standard)| {
        standards[..*place].iter().any(|before| before.below == one.below)
    };
    match standards.iter().enumerate().find(is_second) {
        None => Ok(()),
        Some((_, standard)) => Err(CliError::usage(format!(
            "--standard is given twice for the same sequences (the second time {standard}); name a folder for each of \
             them: --standard \"FOLDER=0.2 mm\""
        ))),
    }
}

/// The quantities of the earlier scans below `folder`, none of which may be a scan of `now`.
fn earlier(
    folder: &Path,
    (now_folder, now): (&Path, &Series),
    talk: &Talk,
) -> Result<Vec<RepeatedQuantity>, CliError> {
    let before = Series::below(folder)?;
    let places = |folder: &Path, series: &Series| -> Vec<PathBuf> {
        let place = |entry: &SeriesEntry| folder.join(&entry.name).canonicalize();
        series.entries.iter().filter_map(|entry| place(entry).ok()).collect()
    };
    let own = places(now_folder, now);
    if let Some(both) = places(folder, &before).into_iter().find(|place| own.contains(place)) {
        return Err(CliError::usage(format!(
            "{} belongs to the earlier scans and to those that are compared with them; give folders that do not hold each \
             other",
            both.display()
        )));
    }
    let (quantities, problems) = RepeatedQuantity::of_series(folder, &before);
    for problem in problems {
        talk.say(&format!("note: {}: {problem}", folder.display()));
    }
    if quantities.is_empty() {
        return Err(too_few(folder, &before));
    }
    Ok(quantities)
}

fn too_few(folder: &Path, series: &Series) -> CliError {
    let measured = series.entries.iter().filter(|entry| entry.state == SequenceState::Measured).count();
    CliError::usage(format!(
        "{measured} of {} sequences below {} are measured; repeats need two at least: scan the object again, and measure \
         each scan",
        series.entries.len(),
        folder.display()
    ))
}

fn characteristics(
    folder: &Path,
    series: &Series,
    standards: &[Standard],
    talk: &Talk,
) -> Result<Characteristics, CliError> {
    let found = Characteristics::of(folder, series, standards, talk)?;
    for problem in &found.problems {
        talk.say(&format!("note: {problem}"));
    }
    if found.sequences.len() < 2 {
        return Err(too_few(folder, series));
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
        let claimed = match step.as_claimed {
            Some(true) => "  claimed          the interval of the scans reaches as far as that\n",
            Some(false) => "  claimed          the interval of the scans does not reach as far as that\n",
            None => "",
        };
        let off_by = with_interval(step.deviation_mm, step.half_width_95_mm, "mm");
        let known = format!("known {} mm", step.known_mm);
        format!("{known:<18} {} scan(s), off by {off_by}\n{claimed}", step.count)
    };
    let mut text: String = response.steps.iter().map(one).collect();
    let amplification = with_interval(response.amplification, response.half_width_95, "");
    let coverage = if response.half_width_95.is_some() { " (95 % coverage)" } else { "" };
    text.push_str(&format!("amplification      {amplification}{coverage}\n"));
    text.extend(response.linearity_mm.iter().map(|mm| {
        let largest = sigma(*mm, "mm");
        format!("linearity          a mean is off the line through zero by {largest} at most\n")
    }));
    ascii(&text)
}

/// Changes of any of the quantities, at a risk of [`BY_CHANCE`] for all of them together.
fn change_lines(changes: &[ChangedQuantity]) -> String {
    let least = BY_CHANCE / (2 * changes.len().max(1)) as f64;
    let lines = changes.iter().map(|change| {
        let ChangedQuantity { measure, unit, earlier_deviation, deviation, .. } = *change;
        let means = [change.earlier_mean, change.mean]
            .map(|mean| to_place_of(mean, deviation.min(earlier_deviation), unit));
        let deviations = [earlier_deviation, deviation].map(|deviation| sigma(deviation, unit));
        let words = |what: &str, [before, now]: [String; 2], by_chance: f64| {
            let chance = share(by_chance);
            (by_chance < least).then(|| {
                format!(
                    "changed            {measure}: {what} {before} before, {now} now (by chance: {chance})\n"
                )
            })
        };
        let of_mean = words("mean", means, change.mean_by_chance);
        let of_scatter = words("s_r", deviations, change.deviation_by_chance);
        of_mean.into_iter().chain(of_scatter).collect::<String>()
    });
    let text: String = lines.collect();
    if text.is_empty() {
        "changed            nothing that so few scans could show\n".to_owned()
    } else {
        ascii(&text)
    }
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
    let in_unit = |value: f64| sigma(value, unit);
    let mean = match repeatability.mean {
        Some(mean) => ascii(&to_place_of(mean, repeatability.deviation, unit)),
        None => "of several objects".to_owned(),
    };
    let mut text = format!(
        "{:<18} {mean}, s_r {} ({} to {}), r {}\n",
        measure.to_string(),
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
