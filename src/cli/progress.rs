//! Output while the program works: messages to stderr, data to stdout.

use std::io::{IsTerminal, Write};
use std::os::fd::AsFd;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError};
use std::thread::Builder;
use std::time::{Duration, Instant};

use anstream::stream::RawStream;
use indicatif::{HumanDuration, ProgressBar, ProgressDrawTarget, ProgressState, ProgressStyle};
use serde::Serialize;
use serde_json::Value;
use terminal_size::terminal_size_of;

use super::caller::Caller;
use super::failure::Failure;
use super::interrupt::{SWITCHES, Switches};
use super::lines::wrapped;
use super::{CliError, colours};
use crate::capture::ScanWatcher;
use epirig_core::frame::Frame;
use epirig_core::progress::Progress;
use epirig_data::sequence::{FrameFacts, FrameKind};

/// The progress bar on the screen. All lines, log lines too, are printed by [`tell`], which hides the bar
/// meanwhile.
static BAR: Mutex<Option<ProgressBar>> = Mutex::new(None);

/// Whether stdout is to hold JSON, and whether it already holds its one object.
static JSON: AtomicBool = AtomicBool::new(false);
static ANSWERED: AtomicBool = AtomicBool::new(false);

fn bar() -> MutexGuard<'static, Option<ProgressBar>> {
    BAR.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Prints a line to stderr, above the progress bar. Errors are ignored: a closed stderr does not stop the
/// work.
pub(super) fn tell(line: &str) {
    let write = || {
        let _ = writeln!(std::io::stderr().lock(), "{}", fitted(line, &std::io::stderr()));
    };
    // The lock is held only while the bar is read, so that other lines do not wait for this one.
    let shown = bar().clone().filter(|bar| !bar.is_hidden());
    match shown {
        Some(bar) => bar.suspend(write),
        None => write(),
    }
}

/// Prints a failure to stderr, unless it is a verdict, which the result tells; and as the JSON object on stdout, if JSON is wanted and none was printed yet.
pub(super) fn tell_failure(error: &CliError) {
    if error.is_verdict() {
        return;
    }
    tell(&format!("error: {}", error.message));
    if JSON.load(Ordering::SeqCst)
        && !ANSWERED.swap(true, Ordering::SeqCst)
        && let Ok(line) = serde_json::to_string(&Failure::of(error))
    {
        // If stdout is closed, the exit code and stderr still report the failure.
        let _ = print(&(line + "\n"));
    }
}

/// Text as `stream` shows it: in the width and with the colours of a terminal.
fn fitted(text: &str, stream: &(impl AsFd + RawStream)) -> String {
    let text = harmless(text);
    let Some((width, _)) = terminal_size_of(stream) else { return text };
    let text = wrapped(&text, usize::from(width.0));
    if colours::shown_by(stream) { colours::coloured(&text) } else { text }
}

/// Text to stdout as it is.
fn print(text: &str) -> std::io::Result<()> {
    let mut stdout = std::io::stdout().lock();
    stdout.write_all(text.as_bytes()).and_then(|()| stdout.flush())
}

/// A line without control characters, which file or device names may contain.
fn harmless(line: &str) -> String {
    let obeyed = |letter: char| letter.is_control() && !matches!(letter, '\n' | '\t');
    shortened(&line.replace(obeyed, "\u{fffd}"))
}

/// Shortens numbers that would fill lines: 1e308 has 309 digits.
fn shortened(text: &str) -> String {
    /// More digits than a 64 bit integer or a measured number has.
    const MOST_DIGITS: usize = 24;
    let is_part = |letter: char| letter.is_ascii_digit() || letter == '.';
    let mut short = String::with_capacity(text.len());
    let mut rest = text;
    while let Some(start) = rest.find(is_part) {
        let (before, from_here) = rest.split_at(start);
        let end = from_here.find(|letter| !is_part(letter)).unwrap_or(from_here.len());
        let (run, after) = from_here.split_at(end);
        let number = run.trim_end_matches('.');
        // Digits next to letters belong to a hash or a name.
        let in_word = before.ends_with(char::is_alphanumeric) || after.starts_with(char::is_alphanumeric);
        short.push_str(before);
        match number.parse::<f64>().ok().filter(|_| number.len() > MOST_DIGITS && !in_word) {
            Some(value) => {
                short.push_str(&format!("{value:e}"));
                short.push_str(&run[number.len()..]);
            }
            None => short.push_str(run),
        }
        rest = after;
    }
    short + rest
}

/// Output of one verb.
pub(super) struct Talk {
    quiet: bool,
    /// Time of the latest progress line, for output that is not a terminal.
    told: Mutex<Instant>,
    pace: Mutex<Arc<Pace>>,
    /// Who hears all of it in place of stderr and stdout.
    caller: Option<Heard>,
}

/// What a caller hears, and the result for it.
struct Heard {
    caller: Caller,
    result: Mutex<Option<Value>>,
}

/// Interval between progress lines if the output is not a terminal.
const LINE_EVERY: Duration = Duration::from_secs(30);

impl Talk {
    pub(super) fn new(json: bool, quiet: bool) -> Self {
        JSON.store(json, Ordering::SeqCst);
        Self { quiet, told: Mutex::new(Instant::now()), pace: Mutex::default(), caller: None }
    }

    /// Output to a program that calls the verb; nothing is printed.
    pub(super) fn to_caller(caller: Caller) -> Self {
        let heard = Heard { caller, result: Mutex::default() };
        Self { quiet: false, told: Mutex::new(Instant::now()), pace: Mutex::default(), caller: Some(heard) }
    }

    /// Whether a program has called the verb; then there is no person at a terminal.
    pub(super) fn has_caller(&self) -> bool {
        self.caller.is_some()
    }

    /// Whether the result is to be JSON.
    pub(super) fn wants_json(&self) -> bool {
        self.caller.is_none() && JSON.load(Ordering::SeqCst)
    }

    /// What an interruption presses; `None` if nothing interrupts the verb.
    pub(super) fn switches(&self) -> Option<&Switches> {
        match &self.caller {
            Some(heard) => heard.caller.switches(),
            None => Some(&SWITCHES),
        }
    }

    /// The result that the verb had for its caller.
    pub(super) fn into_result(self) -> Option<Value> {
        self.caller?.result.into_inner().unwrap_or_else(PoisonError::into_inner)
    }

    /// Prints a message, unless `--quiet` is given.
    pub(super) fn say(&self, line: &str) {
        if let Some(heard) = &self.caller {
            heard.caller.note(line);
        } else if !self.quiet {
            tell(line);
        }
    }

    /// Prints the result: as JSON if wanted, else as text.
    pub(super) fn result(
        &self,
        data: &impl Serialize,
        text: impl FnOnce() -> String,
    ) -> Result<(), CliError> {
        if let Some(heard) = &self.caller {
            let data = serde_json::to_value(data).map_err(CliError::output)?;
            heard.result.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(data);
            return Ok(());
        }
        if !self.wants_json() {
            return self.print(&fitted(&text(), &std::io::stdout()));
        }
        let line = serde_json::to_string(data).map_err(CliError::output)?;
        match ANSWERED.swap(true, Ordering::SeqCst) {
            // An interruption has printed its object already, and ends the program.
            true => Ok(()),
            false => self.print(&(line + "\n")),
        }
    }

    /// A part of the result as text, unless JSON is wanted.
    pub(super) fn text(&self, text: impl FnOnce() -> String) -> Result<(), CliError> {
        match JSON.load(Ordering::SeqCst) || self.caller.is_some() {
            true => Ok(()),
            false => self.print(&harmless(&text())),
        }
    }

    /// Text to stdout as it is.
    pub(super) fn print(&self, text: &str) -> Result<(), CliError> {
        if self.caller.is_some() {
            return self.result(&text, String::new);
        }
        match print(text) {
            // A closed pipe, such as that of `head`, is not an error.
            Err(error) if error.kind() == std::io::ErrorKind::BrokenPipe => Ok(()),
            printed => printed.map_err(CliError::output),
        }
    }

    /// Runs `act` without the progress bar on the screen. Other lines can be printed meanwhile.
    pub(super) fn aside<R>(&self, act: impl FnOnce() -> R) -> R {
        let Some(hidden) = bar().take() else { return act() };
        let done = hidden.suspend(act);
        *bar() = Some(hidden);
        done
    }

    /// Removes the progress bar from the screen.
    pub(super) fn clear(&self) {
        let shown = bar().take();
        if let Some(bar) = shown {
            bar.finish_and_clear();
        }
    }
}

impl Progress for Talk {
    fn begin(&self, what: &str, total: u64) {
        if let Some(heard) = &self.caller {
            return heard.caller.begin(what, total);
        }
        let new = ProgressBar::new(total);
        let silent = self.quiet || !std::io::stderr().is_terminal();
        new.set_draw_target(if silent { ProgressDrawTarget::hidden() } else { ProgressDrawTarget::stderr() });
        // A single step shows a spinner; several show the time left.
        let template = if total > 1 {
            "{msg:>22} [{bar:32}] {pos}/{len}  {left}"
        } else {
            "{msg:>22} {spinner} {elapsed}"
        };
        let pace = Arc::new(Pace::default());
        *self.pace.lock().unwrap_or_else(PoisonError::into_inner) = pace.clone();
        if let Ok(style) = ProgressStyle::with_template(template) {
            let left = move |state: &ProgressState, out: &mut dyn std::fmt::Write| {
                let all = state.len().unwrap_or_default();
                if let Some(left) = pace.time_left(state.elapsed(), state.pos(), all) {
                    // The bar's own text takes all that is written.
                    let _ = write!(out, "{:#} left", HumanDuration(left));
                }
            };
            new.set_style(style.progress_chars("=> ").with_key("left", left));
        }
        new.set_message(what.to_owned());
        *self.told.lock().unwrap_or_else(PoisonError::into_inner) = Instant::now();
        keep_moving(&new);
        // Drawing may block on the terminal, so no lock is held while drawing.
        let former = bar().replace(new);
        drop(former);
    }

    fn advance(&self, count: u64) {
        if let Some(heard) = &self.caller {
            return heard.caller.advance(count);
        }
        let Some(bar) = bar().clone() else { return };
        bar.inc(count);
        let pace = self.pace.lock().unwrap_or_else(PoisonError::into_inner).clone();
        pace.advance(bar.elapsed(), bar.position());
        let mut told = self.told.lock().unwrap_or_else(PoisonError::into_inner);
        if bar.is_hidden() && !self.quiet && told.elapsed() >= LINE_EVERY {
            *told = Instant::now();
            let (done, all) = (bar.position(), bar.length().unwrap_or_default());
            let left = pace.time_left(bar.elapsed(), done, all);
            let left = left.map(|left| format!(", {} left", HumanDuration(left))).unwrap_or_default();
            tell(&format!("{}: {done} of {all}{left}", bar.message()));
        }
    }

    fn note(&self, words: &str) {
        self.say(words);
    }

    fn end(&self) {
        match &self.caller {
            Some(heard) => heard.caller.end(),
            None => self.clear(),
        }
    }

    fn cancelled(&self) -> bool {
        self.caller.as_ref().is_some_and(|heard| heard.caller.cancelled())
    }
}

impl ScanWatcher for Talk {
    fn frame(&self, kind: FrameKind, index: usize, frame: &Frame, facts: &FrameFacts) {
        if let Some(heard) = self.caller.as_ref().filter(|_| kind == FrameKind::Scan) {
            heard.caller.frame(index, frame, facts);
        }
    }

    fn rests(&self) {
        if let Some(heard) = &self.caller {
            heard.caller.rests();
        }
    }
}

/// When the first steps were done: what is done before them, such as homing a stage, tells nothing of the others.
#[derive(Default)]
struct Pace(OnceLock<(Duration, u64)>);

impl Pace {
    /// The first call counts.
    fn advance(&self, elapsed: Duration, done: u64) {
        self.0.get_or_init(|| (elapsed, done));
    }

    /// Time that the rest takes at the mean rate since the first steps; `None` before any others. Steps may take
    /// seconds or minutes each; an estimate from the latest ones, as that of `indicatif`, then says days.
    fn time_left(&self, elapsed: Duration, done: u64, all: u64) -> Option<Duration> {
        let &(begun, first) = self.0.get()?;
        let steps = done.checked_sub(first).filter(|&steps| steps > 0)?;
        let share = all.saturating_sub(done) as f64 / steps as f64;
        let left = elapsed.saturating_sub(begun).as_secs_f64() * share;
        Some(Duration::try_from_secs_f64(left).unwrap_or(Duration::MAX))
    }
}

/// Draws the bar again and again as long as it exists. Its own way would panic where the system allows no
/// thread; without one it moves with the work only.
fn keep_moving(bar: &ProgressBar) {
    const EVERY: Duration = Duration::from_millis(200);
    if bar.is_hidden() {
        return;
    }
    let bar = bar.downgrade();
    let draw = move || {
        while let Some(bar) = bar.upgrade().filter(|bar| !bar.is_finished()) {
            bar.tick();
            drop(bar);
            std::thread::sleep(EVERY);
        }
    };
    drop(Builder::new().name("progress".to_owned()).spawn(draw));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_time_left_follows_the_mean_rate() {
        let minutes = |count: u64| Duration::from_secs(60 * count);
        let pace = Pace::default();
        assert_eq!(pace.time_left(minutes(1), 0, 100), None);
        // Homing and the first of 100 frames take 3 minutes; then each takes 4 s.
        pace.advance(minutes(3), 1);
        assert_eq!(pace.time_left(minutes(3), 1, 100), None);
        pace.advance(minutes(4), 16);
        assert_eq!(pace.time_left(minutes(4), 16, 100), Some(Duration::from_secs(336)));
        assert_eq!(pace.time_left(minutes(4), 100, 100), Some(Duration::ZERO));
        assert_eq!(pace.time_left(Duration::MAX, 2, u64::MAX), Some(Duration::MAX));
    }

    #[test]
    fn numbers_of_hundreds_of_digits_are_shortened() {
        assert_eq!(harmless(&format!("at {} mm, {}.", 1e308, -1.5e-300)), "at 1e308 mm, -1.5e-300.");
        let hash = format!("{}a{}", "1".repeat(30), "2".repeat(33));
        let kept = format!("{hash} 18446744073709551615 0.1 2026-11-24T10:29:43.212462583Z 1..9 ...");
        assert_eq!(harmless(&kept), kept);
        assert_eq!(harmless("a\u{1b}[31m\tb\nc"), "a\u{fffd}[31m\tb\nc");
    }
}
