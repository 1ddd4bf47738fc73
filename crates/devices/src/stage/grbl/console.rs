//! What precedes lines that a person sends to GRBL.

use super::connect::{ask, feed_in};
use super::lines::Lines;
use super::mark::NOT_HOMED;
use super::protocol::{SOFT_RESET, TRIES};
use super::response::Response;
use crate::link::Link;
use crate::stage::StageError;

/// GRBL refuses G-code with this number while it is locked. Each lock follows a reset, which removes the mark.
const LOCKED: &str = "(error:9)";

/// Removes the mark of a homed controller, whatever its settings are. One that does not answer is reset.
pub(super) fn unmark(link: Box<dyn Link>) -> Result<Box<dyn Link>, StageError> {
    let mut lines = Lines::new(link);
    lines.drain()?;
    for _ in 0..TRIES {
        // An incomplete line would spoil the next one.
        lines.send_line("")?;
        lines.drain()?;
        let mut feed = None;
        let set = ask(&mut lines, &format!("G21G94F{NOT_HOMED}"), |_| ());
        let read = ask(&mut lines, "$G", |response| {
            if let Response::Feedback { text, .. } = response {
                feed = feed_in(&text);
            }
        });
        match (set, read) {
            (Err(error @ StageError::Link(_)), _) | (_, Err(error @ StageError::Link(_))) => {
                return Err(error);
            }
            (Err(StageError::Refused { reason }), Ok(())) if reason.ends_with(LOCKED) => {
                return Ok(lines.into_link());
            }
            (_, Ok(())) if feed == Some(f64::from(NOT_HOMED)) => return Ok(lines.into_link()),
            _ => {}
        }
    }
    lines.send_byte(SOFT_RESET)?;
    Ok(lines.into_link())
}
