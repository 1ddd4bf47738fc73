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

/// What an interruption presses: the switch of the scan that ends after the frame in hand, and that of the stage.
#[derive(Debug, Default)]
pub struct Switches(Mutex<Pressable>);

#[derive(Debug)]
struct Pressable {
    pause: Option<PauseSwitch>,
    stop: Option<StopSwitch>,
    /// Interruptions by [`interrupt`](Switches::interrupt), also before there was a switch.
    asked: u8,
}

impl Default for Pressable {
    fn default() -> Self {
        Self::NONE
    }
}

impl Pressable {
    const NONE: Self = Self { pause: None, stop: None, asked: 0 };
}

impl Switches {
    fn held(&self) -> MutexGuard<'_, Pressable> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// From now on an interruption presses this switch: the first slows the stage down, the second stops it at
    /// once.
    pub(super) fn stops(&self, switch: StopSwitch) {
        let mut held = self.held();
        if held.asked > 1 {
            switch.press(Urgency::Soon);
        }
        held.stop = Some(switch);
    }

    /// From now on the first interruption presses this switch, and only the next one stops the stage.
    pub(super) fn pauses(&self, switch: PauseSwitch) {
        let mut held = self.held();
        if held.asked > 0 {
            switch.press();
        }
        held.pause = Some(switch);
    }

    /// From now on an interruption presses nothing.
    pub(super) fn clear(&self) {
        let mut held = self.held();
        (held.pause, held.stop) = (None, None);
    }

    fn stop(&self) -> Option<StopSwitch> {
        self.held().stop.clone()
    }

    /// The switch of a scan that goes on.
    fn pause(&self) -> Option<PauseSwitch> {
        self.held().pause.clone().filter(|pause| !pause.pressed())
    }

    /// What Ctrl-C does: the first ends the scan after the frame in hand, so that it can be resumed; the next
    /// slows the stage down, and the one after that stops it at once. A scan that has not begun ends at its start.
    pub fn interrupt(&self) {
        let asked = self.held().asked;
        self.held().asked = asked.saturating_add(1);
        if let Some(pause) = self.pause() {
            pause.press();
        } else if let Some(switch) = self.stop() {
            switch.press(if switch.pressed().is_none() { Urgency::Soon } else { Urgency::AtOnce });
        }
    }
}

/// What an interruption of the program presses. If there is nothing, the program ends at once.
pub(super) static SWITCHES: Switches = Switches(Mutex::new(Pressable::NONE));

/// What an interruption calls instead of ending the program.
static TO_CALL: Mutex<Option<Box<dyn Fn() + Send>>> = Mutex::new(None);

/// Longest wait for a write to the disk to end.
const DISK_PATIENCE: Duration = Duration::from_secs(10);

/// Longest wait for a stop to be sent to the stage. Drivers look at the switch several times a second.
const STOP_PATIENCE: Duration = Duration::from_secs(2);

/// From now on an interruption calls `act`, which lets the program come to its end.
pub(super) fn calls(act: impl Fn() + Send + 'static) {
    *TO_CALL.lock().unwrap_or_else(PoisonError::into_inner) = Some(Box::new(act));
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
            if let Some(switch) = SWITCHES.stop() {
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

fn interrupted() {
    if let Some(act) = &*TO_CALL.lock().unwrap_or_else(PoisonError::into_inner) {
        return act();
    }
    if let Some(pause) = SWITCHES.pause() {
        // The scan must be asked before the message is written, which may fail.
        pause.press();
        tell("stopping after this frame; press Ctrl-C again to stop the stage now");
        return;
    }
    let switch = SWITCHES.stop();
    if let Some(switch) = &switch
        && switch.pressed() == Some(Urgency::AtOnce)
    {
        await_sending(switch);
    }
    match switch.filter(|switch| switch.pressed() != Some(Urgency::AtOnce)) {
        Some(switch) => stop(&switch),
        None => {
            let words = match abandon(DISK_PATIENCE) {
                true => {
                    "interrupted; frames that were scanned or packed and bands that were matched stay, and no other output was written"
                }
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
