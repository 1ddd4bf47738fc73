//! Ctrl-C, hang-up, termination.

use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use super::failure::{Failure, INTERRUPTED};
use super::progress::{answer_failure, tell};
use crate::capture::PauseSwitch;
use epirig_data::storage::abandon;
use epirig_devices::stage::{StopSwitch, Urgency};

/// A scan that an interruption ends after the frame in hand, before it stops anything.
static TO_PAUSE: Mutex<Option<PauseSwitch>> = Mutex::new(None);

/// What an interruption stops; without it the program ends at once.
static TO_STOP: Mutex<Option<StopSwitch>> = Mutex::new(None);

/// How long an interruption waits for a step of the disk to end.
const DISK_PATIENCE: Duration = Duration::from_secs(10);

fn to_stop() -> MutexGuard<'static, Option<StopSwitch>> {
    TO_STOP.lock().unwrap_or_else(PoisonError::into_inner)
}

/// From now on an interruption presses this switch: the first one slows the stage down, the second stops it at once, and the
/// third ends the program.
pub(super) fn stops(switch: StopSwitch) {
    *to_stop() = Some(switch);
}

/// From now on the first interruption presses this, and only the next one stops the stage.
pub(super) fn pauses(switch: PauseSwitch) {
    *TO_PAUSE.lock().unwrap_or_else(PoisonError::into_inner) = Some(switch);
}

/// From now on an interruption ends the program.
pub(super) fn stops_nothing() {
    *TO_PAUSE.lock().unwrap_or_else(PoisonError::into_inner) = None;
    *to_stop() = None;
}

/// Installs the handlers.
pub(super) fn install() -> Result<(), std::io::Error> {
    ctrlc::set_handler(interrupted).map_err(std::io::Error::other)?;
    obey_other_epirigs()
}

/// `epirig stage stop` in another terminal means the stage, not the scan.
#[cfg(unix)]
fn obey_other_epirigs() -> Result<(), std::io::Error> {
    use signal_hook::consts::SIGUSR1;
    use signal_hook::iterator::Signals;

    let mut signals = Signals::new([SIGUSR1])?;
    std::thread::spawn(move || {
        for _ in signals.forever() {
            if let Some(switch) = to_stop().clone() {
                stop(&switch);
            }
        }
    });
    Ok(())
}

#[cfg(not(unix))]
fn obey_other_epirigs() -> Result<(), std::io::Error> {
    Ok(())
}

fn interrupted() {
    let pause = TO_PAUSE.lock().unwrap_or_else(PoisonError::into_inner).clone();
    if let Some(pause) = pause.filter(|pause| !pause.pressed()) {
        // Whatever becomes of the words, the scan must hear of it first.
        pause.press();
        tell("stopping after this frame; press Ctrl-C again to stop the stage now");
        return;
    }
    let switch = to_stop().clone();
    match switch.filter(|switch| switch.pressed() != Some(Urgency::AtOnce)) {
        Some(switch) => stop(&switch),
        None => {
            let words = match abandon(DISK_PATIENCE) {
                true => "interrupted; a scan keeps the frames it has, and nothing else was left half-written",
                false => {
                    "interrupted while the disk did not answer; hidden folders .epirig-* may be left, which the next command there removes"
                }
            };
            tell(&format!("error: {words}"));
            answer_failure(&Failure::new(words.to_owned(), INTERRUPTED));
            std::process::exit(i32::from(INTERRUPTED));
        }
    }
}

/// Slows the stage down, or stops it at once if it has been told so before.
fn stop(switch: &StopSwitch) {
    if switch.pressed().is_none() {
        switch.press(Urgency::Soon);
        tell("stopping; press Ctrl-C again to stop at once");
    } else {
        switch.press(Urgency::AtOnce);
        tell("stopping at once; press Ctrl-C again to leave without waiting for the stage");
    }
}
