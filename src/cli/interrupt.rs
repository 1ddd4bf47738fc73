//! Ctrl-C, hang-up, termination.

use std::sync::{Mutex, MutexGuard, PoisonError};

use crate::capture::PauseSwitch;
use crate::scratch::Scratch;
use crate::stage::{StopSwitch, Urgency};

/// A scan that an interruption ends after the frame in hand, before it stops anything.
static TO_PAUSE: Mutex<Option<PauseSwitch>> = Mutex::new(None);

/// What an interruption stops; without it the program ends at once.
static TO_STOP: Mutex<Option<StopSwitch>> = Mutex::new(None);

/// 128 + SIGINT, as shells have it.
pub(super) const INTERRUPTED: u8 = 130;

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

/// Installs the handler.
pub(super) fn install() -> Result<(), ctrlc::Error> {
    ctrlc::set_handler(interrupted)
}

fn interrupted() {
    let pause = TO_PAUSE.lock().unwrap_or_else(PoisonError::into_inner).clone();
    if let Some(pause) = pause.filter(|pause| !pause.pressed()) {
        eprintln!("\nstopping after this frame; press Ctrl-C again to stop the stage now");
        pause.press();
        return;
    }
    let switch = to_stop().clone();
    match switch.as_ref().map(StopSwitch::pressed) {
        Some(None) => {
            eprintln!("\nstopping; press Ctrl-C again to stop at once");
            switch.iter().for_each(|switch| switch.press(Urgency::Soon));
        }
        Some(Some(Urgency::Soon)) => {
            eprintln!("\nstopping at once; press Ctrl-C again to leave without waiting for the stage");
            switch.iter().for_each(|switch| switch.press(Urgency::AtOnce));
        }
        _ => {
            Scratch::remove_all();
            eprintln!(
                "\nerror: interrupted; a scan keeps the frames it has, and nothing else was left half-written"
            );
            std::process::exit(i32::from(INTERRUPTED));
        }
    }
}
