//! The log of a run: on the terminal, in a file, and beside the journal of a scan.
//!
//! The libraries emit events of `tracing`, with fields. Only this module subscribes to them. Without an
//! option only scans are logged, beside their journal.

mod file;
mod scan;
mod terminal;

use std::io::{self, Write};
use std::path::PathBuf;
use std::sync::Mutex;
use std::time::Instant;

use clap::{ArgAction, Args};
use tracing_subscriber::fmt::MakeWriter;
use tracing_subscriber::layer::SubscriberExt as _;
use tracing_subscriber::util::SubscriberInitExt as _;
use tracing_subscriber::{EnvFilter, Layer, Registry, fmt};

use super::CliError;
use file::LogFile;
pub(super) use scan::beside;

/// Chooses what is logged, in the syntax of `tracing-subscriber`'s `EnvFilter`.
const VARIABLE: &str = "EPIRIG_LOG";

/// What is logged beside the journal of a scan.
const OF_A_SCAN: &str = "info,epirig::capture=debug,epirig_data::sequence=debug,epirig_devices=debug";

#[derive(Debug, Args)]
pub(super) struct LogArguments {
    /// Log to stderr: -v steps and frames, -vv also moves, settings and retries, -vvv also every byte and
    /// buffer [env: EPIRIG_LOG, a filter in place of the level, such as debug or info,epirig_devices=trace]
    #[arg(long, short, global = true, action = ArgAction::Count)]
    verbose: u8,
    /// Append the log to FILE as JSON lines, at the level of -vv unless -vvv or EPIRIG_LOG changes it
    #[arg(long, global = true, value_name = "FILE")]
    log_file: Option<PathBuf>,
}

/// Takes whole lines, and gives each to a function.
struct Lines<F>(F);

impl<F: FnMut(&[u8])> Write for Lines<F> {
    fn write(&mut self, line: &[u8]) -> io::Result<usize> {
        (self.0)(line);
        Ok(line.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

type Listener = Box<dyn Layer<Registry> + Send + Sync>;

/// Starts logging to the places that are wanted. `scans` tells whether the verb may take frames.
pub(super) fn listen(arguments: &LogArguments, quiet: bool, scans: bool) -> Result<(), CliError> {
    let LogArguments { verbose, log_file } = arguments;
    let wanted = wanted()?;
    let chosen = |level: u8| filter(wanted.as_deref().unwrap_or(name(level)));
    let mut listeners: Vec<Listener> = Vec::new();
    if !quiet && (*verbose > 0 || wanted.is_some()) {
        let lines = fmt::layer().with_ansi(false).event_format(terminal::Line { began: Instant::now() });
        let lines = lines.with_writer(|| Lines(terminal::put)).log_internal_errors(false);
        listeners.push(lines.with_filter(chosen(*verbose)?).boxed());
    }
    if let Some(path) = log_file {
        let mut file = LogFile::named(path)?;
        let lines = Mutex::new(Lines(move |line: &[u8]| file.put(line)));
        listeners.push(json_lines(lines, chosen((*verbose).max(2))?));
    }
    if scans {
        scan::wait_for_folder();
        listeners.push(json_lines(|| Lines(scan::put), filter(OF_A_SCAN)?));
    }
    // Without a subscriber, events cost next to nothing.
    if !listeners.is_empty() {
        // This fails only if a subscriber is set already; the function is called once.
        let _ = tracing_subscriber::registry().with(listeners).try_init();
    }
    Ok(())
}

/// The level for this number of -v.
fn name(verbose: u8) -> &'static str {
    match verbose {
        0 | 1 => "info",
        2 => "debug",
        _ => "trace",
    }
}

/// The filter of the environment variable, if it is set.
fn wanted() -> Result<Option<String>, CliError> {
    let Some(text) = std::env::var_os(VARIABLE).filter(|text| !text.is_empty()) else { return Ok(None) };
    let text =
        text.into_string().map_err(|text| unusable(&text.to_string_lossy(), "it is not valid UTF-8"))?;
    // A wrong filter is reported even if nothing is logged.
    filter(&text)?;
    Ok(Some(text))
}

fn filter(text: &str) -> Result<EnvFilter, CliError> {
    EnvFilter::builder().parse(text).map_err(|error| unusable(text, &error.to_string()))
}

fn unusable(text: &str, reason: &str) -> CliError {
    CliError::usage(format!(
        "{VARIABLE}: \"{text}\" is not a filter ({reason}); write a level such as debug, or levels of modules such as info,epirig_devices=trace"
    ))
}

fn json_lines<W>(writer: W, filter: EnvFilter) -> Listener
where
    W: for<'a> MakeWriter<'a> + Send + Sync + 'static,
{
    let lines = fmt::layer().json().flatten_event(true).with_current_span(false).with_span_list(true);
    lines.with_writer(writer).log_internal_errors(false).with_filter(filter).boxed()
}
