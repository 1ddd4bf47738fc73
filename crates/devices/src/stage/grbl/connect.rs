//! Connecting to GRBL, and its answers to single commands.

use std::time::Duration;

use super::lines::Lines;
use super::protocol::{
    BOOT_PATIENCE, EXCHANGES, FEED_HOLD, POLL, REPLY_PATIENCE, SOFT_RESET, STATUS_PATIENCE, STATUS_QUERY,
    TRIES,
};
use super::response::{Response, State, Status};
use super::settings::{ALWAYS_POWERED, IDLE_DELAY, Readings, Settings};
use super::texts::error_text;
use crate::stage::StageError;

/// After a reset in motion it is silent for half a second before it restarts.
const RESET_PATIENCE: Duration = Duration::from_millis(1500);
/// Any deceleration ends within this time.
const HOLD_PATIENCE: Duration = Duration::from_secs(10);
/// A motion in which nothing changes for this time has ended, or never ends by itself.
const STANDSTILL: Duration = Duration::from_secs(5);

/// The error that it reports by itself after losing its settings.
const SETTINGS_LOST: u8 = 7;

/// Whether a line is a status with fields between commas, as GRBL had them until 0.9.
fn is_old_status(line: &str) -> bool {
    let inside = line.strip_prefix('<').and_then(|rest| rest.strip_suffix('>'));
    let state = inside.and_then(|inside| inside.split(',').next());
    state.is_some_and(|state| State::parse(state).is_some() || state == "Queue")
}

pub(super) fn no_answer(lines: &Lines, asked: &str, patience: Duration) -> StageError {
    let hint = "whether its firmware is GRBL 1.1 (else choose another --driver)";
    StageError::no_answer(lines.port(), asked, patience, hint)
}

pub(super) fn refused(code: u8) -> StageError {
    StageError::Refused { reason: format!("{} (error:{code})", error_text(code)) }
}

/// Waits for the controller, which may be booting, idle, or locked and silent after an alarm.
pub(super) fn greet(lines: &mut Lines) -> Result<Status, StageError> {
    for round in 0..TRIES {
        if round == 1 {
            // After an alarm it accepts only a reset, which also stops a motion of a former host.
            lines.send_byte(SOFT_RESET)?;
        }
        let until = lines.now() + BOOT_PATIENCE;
        while lines.now() < until {
            // Asked often, because an answer may be lost, and a reset costs the mark.
            lines.send_byte(STATUS_QUERY)?;
            let asked_until = lines.now() + STATUS_PATIENCE;
            while let Some(response) = lines.next(asked_until)? {
                if let Some(status) = greeted(lines, response)? {
                    return Ok(status);
                }
            }
        }
    }
    Err(lines.foreign().unwrap_or_else(|| no_answer(lines, "?", BOOT_PATIENCE * TRIES)))
}

/// The status, if that is what was heard; an error if it comes from a controller that cannot be used.
fn greeted(lines: &mut Lines, response: Response) -> Result<Option<Status>, StageError> {
    match response {
        Response::Status(status) => Ok(Some(status)),
        Response::Banner { version } if version.starts_with("0.") => {
            Err(too_old(lines, format!("its version is {version}")))
        }
        Response::Banner { .. } => {
            lines.send_byte(STATUS_QUERY)?;
            Ok(None)
        }
        Response::Unknown(line) if is_old_status(&line) => {
            Err(too_old(lines, format!("it says \"{line}\", as GRBL until 0.9 did")))
        }
        Response::Error(SETTINGS_LOST) => Err(StageError::unsuitable(
            lines.port(),
            format!("it lost its settings and is back at the defaults (error:{SETTINGS_LOST})"),
            "set them again with `epirig stage console`",
        )),
        _ => Ok(None),
    }
}

fn too_old(lines: &Lines, heard: String) -> StageError {
    lines.foreign_for(heard, "GRBL 1.1 is needed: update its firmware")
}

/// Resets the controller, and discards its output until it answers again: a stale `ok` may precede the banner,
/// and a repeated byte brings a second banner. A build with a banner of its own is known by its status.
pub(super) fn reset(lines: &mut Lines) -> Result<(), StageError> {
    let mut restarted = false;
    for _ in 0..TRIES {
        lines.send_byte(SOFT_RESET)?;
        let until = lines.now() + RESET_PATIENCE;
        while !restarted && let Some(response) = lines.next(until)? {
            restarted = matches!(response, Response::Banner { .. });
        }
        if restarted {
            break;
        }
    }
    let mut busy = None;
    for _ in 0..EXCHANGES {
        lines.send_byte(STATUS_QUERY)?;
        let until = lines.now() + STATUS_PATIENCE;
        while let Some(response) = lines.next(until)? {
            let Response::Status(status) = response else { continue };
            if restarted || matches!(status.state, State::Idle | State::Alarm) {
                return Ok(());
            }
            busy = Some(status.state);
        }
    }
    Err(match busy {
        Some(state) => lines.foreign_for(
            format!("it stays in state {state:?} and obeys no reset"),
            "switch its power off and on; if that does not help, its firmware is not GRBL 1.1",
        ),
        None => no_answer(lines, "reset", RESET_PATIENCE * TRIES),
    })
}

pub(super) fn command(lines: &mut Lines, line: &str) -> Result<(), StageError> {
    lines.send_line(line)?;
    match lines.answer(REPLY_PATIENCE)? {
        Some(Response::Ok) => Ok(()),
        Some(Response::Error(code)) => Err(refused(code)),
        _ => Err(no_answer(lines, line, REPLY_PATIENCE)),
    }
}

/// Sends a line, and passes the output to `take` until the line is answered.
pub(super) fn ask(lines: &mut Lines, line: &str, mut take: impl FnMut(Response)) -> Result<(), StageError> {
    lines.send_line(line)?;
    let until = lines.now() + REPLY_PATIENCE;
    loop {
        match lines.next(until)? {
            Some(Response::Ok) => return Ok(()),
            Some(Response::Error(code)) => return Err(refused(code)),
            Some(response) => take(response),
            None => return Err(no_answer(lines, line, REPLY_PATIENCE)),
        }
    }
}

/// Reads all settings until two readings of each agree, because a damaged setting would shift home.
pub(super) fn read_settings(lines: &mut Lines) -> Result<Settings, StageError> {
    let mut before: Option<Settings> = None;
    let mut readings = Readings::default();
    for _ in 0..EXCHANGES {
        let mut settings = Settings::default();
        let asked = ask(lines, "$$", |response| {
            if let Response::Setting { number, value } = response {
                settings.insert(number, value);
            }
        });
        let is_whole = unless_the_line_failed(asked)?;
        // Whole tables may lack settings; so may those of controllers with this dialect.
        if is_whole && before.as_ref() == Some(&settings) {
            return Ok(settings);
        }
        readings.add(&settings);
        if let Some(settings) = readings.confirmed() {
            return Ok(settings);
        }
        before = is_whole.then_some(settings);
    }
    let heard = "no two readings of its settings agree";
    Err(lines.foreign_for(heard, "the line is noisy: check cable and earth"))
}

/// The feed rate in the modes that `$G` tells.
pub(super) fn feed_in(modes: &str) -> Option<f64> {
    modes.split_whitespace().find_map(|word| word.strip_prefix('F')?.parse().ok())
}

/// Whether a question was answered; an error if the line failed. Other errors are those of noise.
fn unless_the_line_failed(answered: Result<(), StageError>) -> Result<bool, StageError> {
    match answered {
        Err(error @ StageError::Link(_)) => Err(error),
        answered => Ok(answered.is_ok()),
    }
}

/// The feed rate that G-code has set, once two answers agree.
pub(super) fn read_feed(lines: &mut Lines) -> Result<f64, StageError> {
    let mut before = None;
    for _ in 0..EXCHANGES {
        let mut feed = None;
        let asked = ask(lines, "$G", |response| {
            if let Response::Feedback { kind, text } = response
                && kind == "GC"
            {
                feed = feed_in(&text);
            }
        });
        if !unless_the_line_failed(asked)? {
            continue;
        }
        match feed {
            Some(feed) if before == Some(feed) => return Ok(feed),
            _ => before = feed,
        }
    }
    Err(no_answer(lines, "$G", REPLY_PATIENCE))
}

/// Sets the feed rate that serves as a mark, and reads it back. A damaged line cannot move anything: it has
/// no axis.
pub(super) fn set_feed(lines: &mut Lines, feed: u32) -> Result<(), StageError> {
    for _ in 0..TRIES {
        // The reading tells whether it was received.
        unless_the_line_failed(command(lines, &format!("G21G94F{feed}")))?;
        if read_feed(lines)? == f64::from(feed) {
            return Ok(());
        }
    }
    Err(no_answer(lines, "F", REPLY_PATIENCE))
}

/// Keeps the motors energised at rest. Returns whether that was so already.
pub(super) fn power_always(lines: &mut Lines, settings: &Settings) -> Result<bool, StageError> {
    if settings.get(IDLE_DELAY) == Some(ALWAYS_POWERED) {
        return Ok(true);
    }
    for _ in 0..TRIES {
        // The reading tells whether it was received.
        unless_the_line_failed(command(lines, &format!("${IDLE_DELAY}={ALWAYS_POWERED}")))?;
        let now = read_settings(lines)?;
        let changes = now.changes(settings, IDLE_DELAY);
        if !changes.is_empty() {
            let what = format!("a setting changed while ${IDLE_DELAY} was set: {}", changes.join(", "));
            let remedy = "the line is noisy: check cable and earth, then set it back with \
                          `epirig stage console`";
            return Err(StageError::unsuitable(lines.port(), what, remedy));
        }
        if now.get(IDLE_DELAY) == Some(ALWAYS_POWERED) {
            return Ok(false);
        }
    }
    let what = format!("it switches the motor off between moves and refuses ${IDLE_DELAY}=255");
    let remedy = format!("send ${IDLE_DELAY}=255 with `epirig stage console`");
    Err(StageError::unsuitable(lines.port(), what, remedy))
}

/// Decelerates any motion, and waits until the axis is at rest. Returns whether it is.
pub(super) fn hold(lines: &mut Lines, give_up: impl Fn() -> bool) -> Result<bool, StageError> {
    let until = lines.now() + HOLD_PATIENCE;
    let mut unanswered = 0;
    while lines.now() < until && !give_up() && unanswered < TRIES {
        // Repeated until it works. During homing the controller does not answer and cannot be held.
        lines.send_byte(FEED_HOLD)?;
        lines.send_byte(STATUS_QUERY)?;
        let status_until = lines.now() + STATUS_PATIENCE;
        loop {
            match lines.next(status_until)? {
                Some(Response::Status(status)) => match status.state {
                    State::Hold { complete: true } | State::Door { complete: true } | State::Idle => {
                        return Ok(true);
                    }
                    State::Alarm => return Ok(false),
                    _ => break,
                },
                Some(Response::Alarm(_)) => return Ok(false),
                Some(_) => {}
                None => {
                    unanswered += 1;
                    break;
                }
            }
        }
    }
    Ok(false)
}

/// Waits until a motion that was found at connecting has ended, as long as it goes on. Returns whether it has.
pub(super) fn outlast(lines: &mut Lines) -> Result<bool, StageError> {
    let mut last: Option<Status> = None;
    let mut changed = lines.now();
    while lines.now() - changed < STANDSTILL {
        lines.send_byte(STATUS_QUERY)?;
        let status_until = lines.now() + POLL;
        while let Some(response) = lines.next(status_until)? {
            let Response::Status(status) = response else { continue };
            let is_same = last
                .as_ref()
                .is_some_and(|last| (last.state, &last.position_mm) == (status.state, &status.position_mm));
            if is_same && !status.state.moving() {
                return Ok(true);
            }
            if !is_same {
                changed = lines.now();
            }
            last = Some(status);
        }
    }
    Ok(false)
}
