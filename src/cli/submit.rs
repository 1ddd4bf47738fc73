//! `epirig submit`.

use std::path::{Path, PathBuf};

use clap::{Args, Parser};
use serde::Serialize;

use super::bands::Planned;
use super::match_arguments::MatchArguments;
use super::need::frames_of;
use super::region::RegionArguments;
use super::slurm::{Job, SlurmOption, parse_option, sent};
use super::{CliError, Talk};
use crate::bands::BandFolder;
use crate::calibrate::read_calibration;
use crate::pipeline::{held, match_need, missing_bands};
use crate::results::{ResultsFolder, ResultsKind};
use epirig_core::shell::quoted;
use epirig_data::sequence::Sequence;
use epirig_matcher::MatchOptions;

/// Send matches to a Slurm cluster
///
/// One sequence: its bands, as `epirig match SEQ --survey` has planned them, become the elements of an array of jobs, and
/// the merge a job that waits for all of them. Several sequences: each is matched as a whole by one element.
///
/// What is matched already is not sent. So after a failure the same command sends what is missing. All machines must see
/// the folders, and this program, under the same names.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  epirig submit tile --slurm partition=lab              the bands of a plan, and the merge
  epirig submit tiles/* --slurm partition=lab,cpus-per-task=4
  epirig submit tiles/* --dry-run -- --method normalised

Without --slurm cpus-per-task=N each element has one thread.")]
pub(super) struct Submit {
    /// Folders of the sequences
    #[arg(required = true, value_name = "SEQ")]
    sequences: Vec<PathBuf>,
    /// Options of sbatch, separated by commas, such as partition=lab,time=1:00:00. They replace memory and time as
    /// predicted
    #[arg(long, value_name = "NAME=VALUE", value_parser = parse_option, value_delimiter = None)]
    slurm: Vec<Vec<SlurmOption>>,
    /// Most elements that run at once [default: as many as the cluster allows]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    at_once: Option<u32>,
    /// Replace existing results
    #[arg(long)]
    overwrite: bool,
    /// Print the scripts, and send nothing
    #[arg(long)]
    dry_run: bool,
    /// Options of `epirig match` for several sequences, after `--`
    #[arg(last = true, value_name = "OPTIONS")]
    matching: Vec<String>,
}

/// What was sent.
#[derive(Debug, Default, Serialize)]
struct Sent {
    /// Number of the job with an element for each band or sequence; absent if none was missing.
    array: Option<String>,
    /// Number of the job that merges.
    merge: Option<String>,
    /// The bands or sequences that were sent.
    tasks: Vec<String>,
    /// The scripts, if they were only asked for.
    scripts: Vec<String>,
}

/// Memory that is asked for, beside what is predicted: of the system's own share in a control group.
const MARGIN: f64 = 1.25;
/// A node may be slower than the machine of the survey by this factor.
const SLOWER: f64 = 5.0;
/// The shortest time that is asked for.
const LEAST_MINUTES: u64 = 15;
/// Seconds that a sample of a frame takes on one thread, as docs/src/large.md has them.
const SAMPLE: f64 = 5e-8;
/// Most memory of a sequence that is matched as a whole; larger ones are packed.
const WHOLE: u64 = 4 << 30;

impl Submit {
    pub(super) fn run(self, talk: &Talk) -> Result<(), CliError> {
        let sequences: Result<Vec<PathBuf>, CliError> =
            self.sequences.iter().map(|path| whole(path)).collect();
        match sequences?.as_slice() {
            [one] if one.join(BandFolder::NAME).exists() => self.bands(one, talk),
            [one] => Err(CliError::usage(format!(
                "{} has no plan of bands; run `epirig match {} --survey` first",
                one.display(),
                quoted(&self.sequences[0])
            ))),
            several => self.whole_sequences(several, talk),
        }
    }

    /// Sends the bands of `sequence` that are missing, and the merge.
    fn bands(&self, sequence: &Path, talk: &Talk) -> Result<(), CliError> {
        if !self.matching.is_empty() {
            return Err(CliError::usage(
                "the options of the match are those of the plan; omit what follows --",
            ));
        }
        // An existing folder of results is refused now, not by the merge.
        drop(ResultsFolder::create(&sequence.join("results"), ResultsKind::Match, self.overwrite)?);
        let planned = Planned::open(sequence, talk)?;
        let (folder, calibration) = (planned.folder(), planned.calibration.as_ref());
        let missing = missing_bands(&planned.sequence, calibration, folder)?;
        let plan = folder.plan();
        let logs = text(folder.path())?;
        let log = |name: &str| format!("{logs}/{name}");
        // A job may have one thread, and the survey had several.
        let seconds = plan.seconds.unwrap_or_default() * SLOWER * plan.threads as f64;
        let bands = Job {
            tasks: missing.iter().map(usize::to_string).collect(),
            arguments: vec!["match".into(), text(sequence)?, "--band".into()],
            at_once: self.at_once,
            memory: plan.memory_bytes.band,
            seconds,
            log: log("slurm-%A_%a.log"),
            ..self.job("bands", sequence)
        };
        let merge = Job {
            arguments: ["match".into(), text(sequence)?, "--merge".into()]
                .into_iter()
                .chain(self.overwrite.then(|| "--overwrite".into()))
                .collect(),
            memory: plan.memory_bytes.merge,
            seconds,
            log: log("slurm-%j.log"),
            ..self.job("merge", sequence)
        };
        let mut done = Sent { tasks: bands.tasks.clone(), ..Sent::default() };
        if !missing.is_empty() {
            done.array = self.send(&bands, None, &mut done.scripts)?;
        }
        let merged = self.send(&merge, done.array.as_deref(), &mut done.scripts);
        done.merge = merged.map_err(|mut error| {
            if let Some(array) = &done.array {
                error.message =
                    format!("job {array} with the bands was sent, and the merge was not: {}", error.message);
            }
            error
        })?;
        talk.result(&done, || {
            let Sent { array, merge: Some(merge), .. } = &done else { return done.scripts.join("\n") };
            let (bands, jobs) = match array {
                Some(array) => {
                    let count = format!("{} of {} bands", missing.len(), plan.task.bands.len());
                    (
                        format!("job {array}: {count}\njob {merge}: the merge, when they are matched\n"),
                        format!("{array},{merge}"),
                    )
                }
                None => (format!("job {merge}: the merge; all bands are matched\n"), merge.clone()),
            };
            let logs = quoted(log("slurm-*.log").as_ref());
            format!("{bands}look: `squeue -j {jobs}`, {logs}\nafter a failure: run the same command again\n")
        })
    }

    /// Sends those `sequences` that have no results.
    fn whole_sequences(&self, sequences: &[PathBuf], talk: &Talk) -> Result<(), CliError> {
        let options = passed(&self.matching)?;
        let mut memory = WHOLE;
        let mut job = Job {
            at_once: self.at_once,
            log: format!("{}/epirig-%A_%a.log", text(&whole(Path::new("."))?)?),
            ..self.job("match", sequences[0].parent().unwrap_or(Path::new("epirig")))
        };
        for path in sequences {
            if path.join("results").join(ResultsKind::Match.summary()).exists() && !self.overwrite {
                continue;
            }
            let task = text(path)?;
            let sequence = Sequence::open(path)?;
            let frames = frames_of(&sequence, read_calibration(&sequence)?.as_ref());
            let held = held(|held| match_need(frames, &options, held), Some(WHOLE));
            let need = match_need(frames, &options, held);
            (job.memory, memory) = (job.memory.max(need), memory.max(need));
            let samples = (frames.rows * frames.columns * frames.count) as f64;
            job.seconds = job.seconds.max(SLOWER * SAMPLE * samples);
            job.tasks.push(task);
        }
        job.arguments = ["match".into(), "--memory".into(), format!("{}MiB", memory.div_ceil(1 << 20))]
            .into_iter()
            .chain(self.overwrite.then(|| "--overwrite".into()))
            .chain(self.matching.iter().cloned())
            .collect();
        let mut done = Sent { tasks: job.tasks.clone(), ..Sent::default() };
        if !job.tasks.is_empty() {
            done.array = self.send(&job, None, &mut done.scripts)?;
        }
        talk.result(&done, || match &done.array {
            None if done.tasks.is_empty() => "all sequences have results; nothing is sent\n".to_owned(),
            None => done.scripts.join("\n"),
            Some(array) => format!(
                "job {array}: {} of {} sequences\nlook: `squeue -j {array}`, `epirig list`; after a failure: run the same command again\n",
                done.tasks.len(),
                sequences.len()
            ),
        })
    }

    /// A job without tasks.
    fn job(&self, what: &str, of: &Path) -> Job {
        let name = of.file_name().unwrap_or_default().to_string_lossy();
        Job { name: format!("epirig-{what}-{name}"), options: self.slurm.concat(), ..Job::default() }
    }

    /// Sends a job that begins when the job `after` has succeeded, and returns its number; or keeps its script.
    fn send(
        &self,
        job: &Job,
        after: Option<&str>,
        scripts: &mut Vec<String>,
    ) -> Result<Option<String>, CliError> {
        let job = Job {
            memory: (job.memory as f64 * MARGIN) as u64,
            minutes: ((job.seconds / 60.0).ceil() as u64).max(LEAST_MINUTES),
            ..job.clone()
        };
        let script = job.script()?;
        if self.dry_run {
            scripts.push(script);
            return Ok(None);
        }
        sent(&script, after).map(Some)
    }
}

/// The whole path, as it holds on other machines.
fn whole(path: &Path) -> Result<PathBuf, CliError> {
    std::fs::canonicalize(path).map_err(CliError::file("open", path))
}

/// A path in a script.
fn text(path: &Path) -> Result<String, CliError> {
    let refused = |why: &str| {
        CliError::usage(format!("{} {why}, which a script for sbatch cannot have; rename it", path.display()))
    };
    let text = path.to_str().ok_or_else(|| refused("is no name in UTF-8"))?;
    match text.chars().any(|letter| letter.is_control() || "\\\"%".contains(letter)) {
        true => Err(refused("has a line break, a backslash, a quotation mark or a percent sign")),
        false => Ok(text.to_owned()),
    }
}

/// The options of a match as `epirig match` takes them.
#[derive(Debug, Parser)]
#[command(no_binary_name = true, disable_help_flag = true, allow_negative_numbers = true)]
struct Passed {
    #[arg(long)]
    as_captured: bool,
    #[arg(long)]
    anyway: bool,
    #[arg(long)]
    figure_row: Option<usize>,
    #[command(flatten)]
    region: RegionArguments,
    #[command(flatten)]
    matching: MatchArguments,
}

/// The options of the match that `words` are, which are the same for all sequences.
fn passed(words: &[String]) -> Result<MatchOptions, CliError> {
    let refused = |error: clap::Error| {
        let said = error.to_string();
        let first = said.lines().next().unwrap_or_default().trim_start_matches("error: ").to_owned();
        CliError::usage(format!(
            "{first}; after -- there may be options of `epirig match` that hold for each sequence"
        ))
    };
    Passed::try_parse_from(words).map(|passed| passed.matching.options()).map_err(refused)
}
