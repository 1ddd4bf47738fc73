//! Connecting to GRBL, and its answers to single commands.

use std::time::Duration;

use super::lines::{Heard, Lines};
use super::protocol::{
    BOOT_PATIENCE, FEED_HOLD, NAME, REPLY_PATIENCE, SOFT_RESET, STATUS_PATIENCE, STATUS_QUERY, TRIES,
};
use super::response::{Response, State, Status};
use super::settings::Settings;
use super::texts::error_text;
use crate::stage::StageError;

/// After a reset in motion it is silent for half a second before it restarts.
const RESET_PATIENCE: Duration = Duration::from_millis(1500);
/// Any deceleration ends within this time.
const HOLD_PATIENCE: Duration = Duration::from_secs(10);
const SETTINGS_TRIES: u32 = 6;

/// The error that it reports by itself after losing its settings.
const SETTINGS_LOST: u8 = 7;

pub(super) fn no_answer(lines: &Lines, asked: &str, patience: Duration) -> StageError {
    StageError::NoAnswer {
        port: lines.port().to_owned(),
        asked: asked.to_owned(),
        patience_s: patience.as_secs_f64(),
        hint: "whether its firmware is GRBL 1.1 (else choose another --driver)",
    }
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
        lines.send_byte(STATUS_QUERY)?;
        let until = lines.now() + BOOT_PATIENCE;
        while let Heard::Line(response) = lines.next(until.saturating_sub(lines.now()))? {
            match response {
                Response::Status(status) => return Ok(status),
                Response::Banner { .. } => lines.send_byte(STATUS_QUERY)?,
                Response::Error(SETTINGS_LOST) => {
                    return Err(StageError::Unsuitable {
                        port: lines.port().to_owned(),
                        what: format!(
                            "it lost its settings and is back at the defaults (error:{SETTINGS_LOST})"
                        ),
                        remedy: "set them again".to_owned(),
                    });
                }
                _ => {}
            }
        }
    }
    Err(lines.foreign().unwrap_or_else(|| no_answer(lines, "?", BOOT_PATIENCE * TRIES)))
}

/// Resets the controller, and discards its output until it has restarted: a stale `ok` may precede the
/// banner. The byte is repeated if nothing happens.
pub(super) fn reset(lines: &mut Lines) -> Result<(), StageError> {
    for _ in 0..TRIES {
        lines.send_byte(SOFT_RESET)?;
        let until = lines.now() + RESET_PATIENCE;
        while let Heard::Line(response) = lines.next(until.saturating_sub(lines.now()))? {
            if matches!(response, Response::Banner { .. }) {
                return Ok(());
            }
        }
    }
    Err(no_answer(lines, "reset", RESET_PATIENCE * TRIES))
}

pub(super) fn command(lines: &mut Lines, line: &str) -> Result<(), StageError> {
    lines.send_line(line)?;
    match lines.answer(REPLY_PATIENCE)? {
        Heard::Line(Response::Ok) => Ok(()),
        Heard::Line(Response::Error(code)) => Err(refused(code)),
        _ => Err(no_answer(lines, line, REPLY_PATIENCE)),
    }
}

/// Sends a line, and passes the output to `take` until the line is answered.
pub(super) fn ask(lines: &mut Lines, line: &str, mut take: impl FnMut(Response)) -> Result<(), StageError> {
    lines.send_line(line)?;
    let until = lines.now() + REPLY_PATIENCE;
    loop {
        match lines.next(until.saturating_sub(lines.now()))? {
            Heard::Line(Response::Ok) => return Ok(()),
            Heard::Line(Response::Error(code)) => return Err(refused(code)),
            Heard::Line(response) => take(response),
            Heard::Nothing => return Err(no_answer(lines, line, REPLY_PATIENCE)),
        }
    }
}

/// The answer to `$I`.
pub(super) struct BuildInfo {
    pub(super) version: String,
    /// Homing ends at machine coordinate 0 (`HOMING_FORCE_SET_ORIGIN`).
    pub(super) home_is_origin: bool,
}

pub(super) fn read_build(lines: &mut Lines) -> Result<BuildInfo, StageError> {
    let (mut version, mut options) = (None, String::new());
    let asked = ask(lines, "$I", |response| {
        if let Response::Feedback { kind, text } = response {
            match kind.as_str() {
                "VER" => version = Some(text.trim_end_matches(':').to_owned()),
                "OPT" => options = text.split(',').next().unwrap_or_default().to_owned(),
                _ => {}
            }
        }
    });
    let heard = match (version, asked) {
        (Some(version), Ok(())) if version.starts_with("1.1") => {
            return Ok(BuildInfo { version, home_is_origin: options.contains('Z') });
        }
        (_, Err(error @ StageError::Link(_))) => return Err(error),
        (Some(version), _) => format!("its version is {version}"),
        (None, _) => "it does not report its version".to_owned(),
    };
    let (port, expected) = (lines.port().to_owned(), NAME);
    Err(StageError::Foreign {
        port,
        expected,
        heard,
        hint: "GRBL 1.1 is needed: update its firmware".to_owned(),
    })
}

/// Reads all settings until two readings agree, because a damaged setting would shift home.
pub(super) fn read_settings(lines: &mut Lines) -> Result<Settings, StageError> {
    let mut before: Option<Settings> = None;
    for _ in 0..SETTINGS_TRIES {
        let mut settings = Settings::default();
        let asked = ask(lines, "$$", |response| {
            if let Response::Setting { number, value } = response {
                settings.insert(number, value);
            }
        });
        match asked {
            Ok(()) if before.as_ref() == Some(&settings) => return Ok(settings),
            Ok(()) => before = Some(settings),
            Err(error @ StageError::Link(_)) => return Err(error),
            Err(_) => {}
        }
    }
    Err(StageError::Foreign {
        port: lines.port().to_owned(),
        expected: NAME,
        heard: "no two readings of its settings agree".to_owned(),
        hint: "the line is noisy: check cable and earth".to_owned(),
    })
}

/// Decelerates any motion, and waits until the axis is at rest. Returns whether it is.
pub(super) fn hold(lines: &mut Lines, give_up: impl Fn() -> bool) -> Result<bool, StageError> {
    let until = lines.now() + HOLD_PATIENCE;
    while lines.now() < until && !give_up() {
        // Repeated until it works. During homing the controller does not answer and cannot be held.
        lines.send_byte(FEED_HOLD)?;
        lines.send_byte(STATUS_QUERY)?;
        let status_until = lines.now() + STATUS_PATIENCE;
        loop {
            match lines.next(status_until.saturating_sub(lines.now()))? {
                Heard::Line(Response::Status(status)) => match status.state {
                    State::Hold { complete: true } | State::Idle => return Ok(true),
                    State::Alarm => return Ok(false),
                    _ => break,
                },
                Heard::Line(Response::Alarm(_)) => return Ok(false),
                Heard::Line(_) => {}
                Heard::Nothing => return Ok(false),
            }
        }
    }
    Ok(false)
}
