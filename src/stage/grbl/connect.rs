//! First words with GRBL, and its answers to single commands.

use std::time::Duration;

use super::lines::{Heard, Lines};
use super::response::{Response, Status};
use super::settings::Settings;
use super::texts::error_text;
use super::{BOOT_PATIENCE, REPLY_PATIENCE, SOFT_RESET, STATUS_QUERY, TRIES};
use crate::stage::{Dialect, StageError};

/// The error that comes of itself, when it starts with an empty memory.
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

/// Waits for the controller to be there: it may be booting, idle, or locked by an alarm and silent.
pub(super) fn greet(lines: &mut Lines) -> Result<Status, StageError> {
    for round in 0..TRIES {
        if round == 1 {
            // An alarm makes it deaf to all but this; a motion that nobody waits for is stopped by it too.
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

/// Resets the controller and discards what it says until it has started anew: a stale `ok` may come before the banner.
pub(super) fn reset(lines: &mut Lines) -> Result<(), StageError> {
    lines.send_byte(SOFT_RESET)?;
    let until = lines.now() + BOOT_PATIENCE;
    while let Heard::Line(response) = lines.next(until.saturating_sub(lines.now()))? {
        if matches!(response, Response::Banner { .. }) {
            return Ok(());
        }
    }
    Err(no_answer(lines, "reset", BOOT_PATIENCE))
}

pub(super) fn command(lines: &mut Lines, line: &str) -> Result<(), StageError> {
    lines.send_line(line)?;
    match lines.answer(REPLY_PATIENCE)? {
        Heard::Line(Response::Ok) => Ok(()),
        Heard::Line(Response::Error(code)) => Err(refused(code)),
        _ => Err(no_answer(lines, line, REPLY_PATIENCE)),
    }
}

pub(super) fn read_version(lines: &mut Lines) -> Result<String, StageError> {
    lines.send_line("$I")?;
    let mut version = None;
    while let Heard::Line(response) = lines.next(REPLY_PATIENCE)? {
        match response {
            Response::Feedback { kind, text } if kind == "VER" => version = Some(text),
            Response::Ok | Response::Error(_) => break,
            _ => {}
        }
    }
    let heard = match version {
        Some(version) if version.starts_with("1.1") => return Ok(version.trim_end_matches(':').to_owned()),
        Some(version) => format!("its version is {version}"),
        None => "it does not tell its version".to_owned(),
    };
    let (port, expected) = (lines.port().to_owned(), Dialect::Grbl.name());
    Err(StageError::Foreign {
        port,
        expected,
        heard,
        hint: "GRBL 1.1 is needed: update its firmware".to_owned(),
    })
}

pub(super) fn read_settings(lines: &mut Lines) -> Result<Settings, StageError> {
    lines.send_line("$$")?;
    let mut settings = Settings::default();
    loop {
        match lines.next(REPLY_PATIENCE)? {
            Heard::Line(Response::Setting { number, value }) => settings.insert(number, value),
            Heard::Line(Response::Ok) => return Ok(settings),
            Heard::Line(Response::Error(code)) => return Err(refused(code)),
            Heard::Line(_) => {}
            Heard::Nothing => return Err(no_answer(lines, "$$", REPLY_PATIENCE)),
        }
    }
}
