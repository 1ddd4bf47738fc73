//! Ctrl-C, hang-up and termination.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::Builder;
use std::time::{Duration, Instant};

use super::CliError;
use super::failure::INTERRUPTED;
use super::progress::{tell, tell_failure};
use crate::capture::PauseSwitch;
use epirig_core::fault::Blame;
use epirig_data::storage::abandon;
use epirig_devices::stage::{StopSwitch, Urgency};

/// The scan that an interruption ends after the frame in hand, before it stops anything.
static TO_PAUSE: Mutex<Option<PauseSwitch>> = Mutex::new(None);

/// The stage that an interruption stops; if there is none, the program ends at once.
static TO_STOP: Mutex<Option<StopSwitch>> = Mutex::new(None);

/// What an interruption calls instead of ending the program.
static TO_CALL: Mutex<Option<Box<dyn Fn() + Send>>> = Mutex::new(None);

/// Longest wait for a write to the disk to end.
const DISK_PATIENCE: Duration = Duration::from_secs(10);

fn to_stop() -> MutexGuard<'static, Option<StopSwitch>> {
    TO_STOP.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Longest wait for a stop to be sent to the stage. Drivers look at the switch several times a second.
const STOP_PATIENCE: Duration = Duration::from_secs(2);

/// From now on an interruption presses this switch: the first slows the stage down, the second stops it at
/// once, the third ends the program, once the stop has been sent.
pub(super) fn stops(switch: StopSwitch) {
    *to_stop() = Some(switch);
}

/// From now on the first interruption presses this switch, and only the next one stops the stage.
pub(super) fn pauses(switch: PauseSwitch) {
    *TO_PAUSE.lock().unwrap_or_else(PoisonError::into_inner) = Some(switch);
}

/// From now on an interruption calls `act`, which lets the program come to its end.
pub(super) fn calls(act: impl Fn() + Send + 'static) {
    *TO_CALL.lock().unwrap_or_else(PoisonError::into_inner) = Some(Box::new(act));
}

/// From now on an interruption ends the program.
pub(super) fn stops_nothing() {
    *TO_PAUSE.lock().unwrap_or_else(PoisonError::into_inner) = None;
    *to_stop() = None;
}

pub(super) fn install() -> Result<(), std::io::Error> {
    ctrlc::set_handler(interrupted).map_err(std::io::Error::other)?;
    heed_signals()
}

#[cfg(unix)]
fn heed_signals() -> Result<(), std::io::Error> {
    use signal_hook::consts::{SIGUSR1, SIGXFSZ};
    use signal_hook::iterator::Signals;

    // Writing beyond the limit of file sizes (`ulimit -f`) is an error then, like writing to a full disk.
    // Else its signal would end the program. Who writes is told by the error; nobody looks at the flag.
    signal_hook::flag::register(SIGXFSZ, Arc::default())?;
    // Asked by `epirig stage stop` in another terminal: it stops the stage, not the scan.
    let mut signals = Signals::new([SIGUSR1])?;
    Builder::new().spawn(move || {
        for _ in signals.forever() {
            if let Some(switch) = to_stop().clone() {
                stop(&switch);
            }
        }
    })?;
    Ok(())
}

#[cfg(not(unix))]
fn heed_signals() -> Result<(), std::io::Error> {
    Ok(())
}

/// What Ctrl-C does to a verb that another program has called: a scan ends after the frame in hand, so that it
/// can be resumed; the next time its stage slows down, and then stops at once. Work without a stage is cancelled
/// by its caller.
pub fn interrupt() {
    if let Some(act) = &*TO_CALL.lock().unwrap_or_else(PoisonError::into_inner) {
        return act();
    }
    let pause = TO_PAUSE.lock().unwrap_or_else(PoisonError::into_inner).clone();
    if let Some(pause) = pause.filter(|pause| !pause.pressed()) {
        return pause.press();
    }
    if let Some(switch) = to_stop().clone() {
        let urgency = if switch.pressed().is_none() { Urgency::Soon } else { Urgency::AtOnce };
        switch.press(urgency);
    }
}

fn interrupted() {
    if let Some(act) = &*TO_CALL.lock().unwrap_or_else(PoisonError::into_inner) {
        return act();
    }
    let pause = TO_PAUSE.lock().unwrap_or_else(PoisonError::into_inner).clone();
    if let Some(pause) = pause.filter(|pause| !pause.pressed()) {
        // The scan must be asked before the message is written, which may fail.
        pause.press();
        tell("stopping after this frame; press Ctrl-C again to stop the stage now");
        return;
    }
    let switch = to_stop().clone();
    if let Some(switch) = &switch
        && switch.pressed() == Some(Urgency::AtOnce)
    {
        await_sending(switch);
    }
    match switch.filter(|switch| switch.pressed() != Some(Urgency::AtOnce)) {
        Some(switch) => stop(&switch),
        None => {
            let words = match abandon(DISK_PATIENCE) {
                true => "interrupted; a scan keeps its frames, and no other output was written",
                false => {
                    "interrupted while the disk did not answer; folders .epirig-* may remain; the next command there removes them"
                }
            };
            tell_failure(&CliError::new(Blame::Interruption, words));
            std::process::exit(i32::from(INTERRUPTED));
        }
    }
}

/// Waits until the stop has been sent: who presses Ctrl-C three times at once must not leave before. A driver
/// that waits for nothing sends nothing.
fn await_sending(switch: &StopSwitch) {
    let since = Instant::now();
    while !switch.is_sent() && since.elapsed() < STOP_PATIENCE {
        std::thread::sleep(Duration::from_millis(5));
    }
}

/// Slows the stage down; if it was slowed down before, stops it at once.
fn stop(switch: &StopSwitch) {
    if switch.pressed().is_none() {
        switch.press(Urgency::Soon);
        tell("stopping; press Ctrl-C again to stop at once");
    } else {
        switch.press(Urgency::AtOnce);
        tell("stopping at once; press Ctrl-C again to leave without waiting for the stage");
    }
}
