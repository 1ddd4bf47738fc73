//! What happens and when, for whoever looks for a fault: on the terminal, in a file, and beside the journal of a scan.
//!
//! The libraries tell it as events of `tracing`, with fields. Only here somebody listens, and without an option nobody does, except
//! to a scan: its log always lies beside its journal.

mod file;
mod scan;
mod terminal;

use std::path::PathBuf;
use std::sync::Mutex;

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
    /// Log to stderr: -v steps and frames, -vv also moves, settings and retries, -vvv also every byte and buffer [env: EPIRIG_LOG, a
    /// filter in place of the level, such as debug or info,epirig_devices=trace]
    #[arg(long, short, global = true, action = ArgAction::Count)]
    verbose: u8,
    /// Add the log to FILE as JSON lines; as much as -vv shows, unless -vvv or EPIRIG_LOG says otherwise
    #[arg(long, global = true, value_name = "FILE")]
    log_file: Option<PathBuf>,
}

type Listener = Box<dyn Layer<Registry> + Send + Sync>;

/// From here on events are written down where that is wanted. `scans` tells whether the verb may take frames.
pub(super) fn listen(arguments: &LogArguments, quiet: bool, scans: bool) -> Result<(), CliError> {
    let LogArguments { verbose, log_file } = arguments;
    let wanted = wanted()?;
    let chosen = |level: u8| filter(wanted.as_deref().unwrap_or(name(level)));
    let mut listeners: Vec<Listener> = Vec::new();
    if !quiet && (*verbose > 0 || wanted.is_some()) {
        let lines = fmt::layer().with_ansi(false).event_format(terminal::Line::since_now());
        let lines = lines.with_writer(|| terminal::Terminal).log_internal_errors(false);
        listeners.push(lines.with_filter(chosen(*verbose)?).boxed());
    }
    if let Some(path) = log_file {
        listeners.push(json_lines(Mutex::new(LogFile::named(path)?), chosen((*verbose).max(2))?));
    }
    if scans {
        scan::wait_for_folder();
        listeners.push(json_lines(|| scan::ScanLog, filter(OF_A_SCAN)?));
    }
    // Where nobody listens, events cost next to nothing.
    if !listeners.is_empty() {
        // It fails only if somebody listens already, and this is called once.
        let _ = tracing_subscriber::registry().with(listeners).try_init();
    }
    Ok(())
}

/// The level of so many -v.
fn name(verbose: u8) -> &'static str {
    match verbose {
        0 | 1 => "info",
        2 => "debug",
        _ => "trace",
    }
}

/// What the environment asks for.
fn wanted() -> Result<Option<String>, CliError> {
    let Some(text) = std::env::var_os(VARIABLE).filter(|text| !text.is_empty()) else { return Ok(None) };
    let text = text.into_string().map_err(|text| unusable(&text.to_string_lossy(), "it is no text"))?;
    // Told also where nothing comes of it.
    filter(&text)?;
    Ok(Some(text))
}

fn filter(text: &str) -> Result<EnvFilter, CliError> {
    EnvFilter::builder().parse(text).map_err(|error| unusable(text, &error.to_string()))
}

fn unusable(text: &str, reason: &str) -> CliError {
    CliError::Usage(format!(
        "{VARIABLE}: \"{text}\" is no filter ({reason}); write a level such as debug, or levels of parts such as info,epirig_devices=trace"
    ))
}

fn json_lines<W>(writer: W, filter: EnvFilter) -> Listener
where
    W: for<'a> MakeWriter<'a> + Send + Sync + 'static,
{
    let lines = fmt::layer().json().flatten_event(true).with_current_span(false).with_span_list(true);
    lines.with_writer(writer).log_internal_errors(false).with_filter(filter).boxed()
}
