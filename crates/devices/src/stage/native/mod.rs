//! The driver for epirig's own firmware.

mod conversation;
mod decode;
mod driver;
mod protocol;
mod texts;

use std::time::Duration;

use firmware_protocol::message::{
    Fault, Identity, Outcome, PROTOCOL_VERSION, Refusal, Reply, Request, Settings, Status,
};

use super::{
    Axis, CheckedStage, Homed, Kinematics, Motion, PositionSettings, StageError, StageIdentity, StageState,
    StopSwitch, Urgency,
};
use crate::link::Link;
use conversation::Conversation;
pub use driver::Native;
pub use protocol::BAUD;
use protocol::{NAME, NM_PER_MM};
use texts::{fault_text, refusal_text};

/// Number of heartbeats of the host within the watchdog's time: with repetitions, half a dozen requests can
/// be lost in the default half second.
const HEARTBEATS: u32 = 5;

/// Longest homing: one and a half times the travel, then off the switch, onto it and off it again.
const HOMING_SEARCH: f64 = 1.5;
const HOMING_PULL_OFFS: f64 = 6.0;

/// Options of a native stage.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct NativeOptions {
    /// Settings sent after each connection and boot; `None` keeps those of the stage.
    pub settings: Option<Settings>,
}

/// A stage with epirig's own firmware, checked.
pub type NativeStage = CheckedStage<NativeAxis>;

impl NativeStage {
    /// Connects to the stage on `link`.
    ///
    /// # Errors
    /// As [`NativeAxis::connect`].
    pub fn connect(link: Box<dyn Link>, options: NativeOptions) -> Result<Self, StageError> {
        Ok(Self::over(Box::new(NativeAxis::connect(link, options)?)))
    }
}

/// The axis of a stage with epirig's own firmware.
///
/// A move has an id and runs once, even if its request is received several times. So requests without an
/// answer are sent again. A move is done when the stage reports its end, has the same boot id as when it was
/// homed, and reports the right position.
pub struct NativeAxis {
    conversation: Conversation,
    options: NativeOptions,
    identity: Identity,
    settings: Settings,
    /// Whether the stage moved without its host, so that it must be homed.
    was_left_alone: bool,
    is_homed: bool,
    stop: StopSwitch,
}

impl NativeAxis {
    /// Connects to the stage on `link`.
    ///
    /// # Errors
    /// [`StageError`] if nothing answers, something else answers, the firmware has another protocol version,
    /// or it refuses the settings.
    pub fn connect(link: Box<dyn Link>, options: NativeOptions) -> Result<Self, StageError> {
        let mut conversation = Conversation::new(link);
        let identity = conversation.hello()?;
        let mut stage = Self {
            conversation,
            options,
            identity,
            settings: Settings::default(),
            was_left_alone: false,
            is_homed: false,
            stop: StopSwitch::default(),
        };
        stage.meet(identity)?;
        // After a fault before this connection (a disconnected cable, another program's fault), or a motion
        // without a host, the position is not used.
        let status = stage.status()?;
        let is_trusted = !matches!(status.outcome, Outcome::Failed | Outcome::Running);
        stage.is_homed = status.homed && is_trusted && !stage.was_left_alone;
        Ok(stage)
    }

    /// Checks the version and sets the settings, for which the stage must be at rest.
    fn meet(&mut self, identity: Identity) -> Result<(), StageError> {
        self.identity = identity;
        if identity.version != PROTOCOL_VERSION {
            let heard = format!("its firmware speaks version {} of the protocol", identity.version);
            let hint = format!("this epirig speaks version {PROTOCOL_VERSION}: update the older of the two");
            return Err(StageError::foreign(self.conversation.port(), NAME, heard, hint));
        }
        let request = self.options.settings.map_or(Request::ReadSettings, Request::WriteSettings);
        let mut reply = self.conversation.ask(request)?;
        if matches!(reply, Reply::Refused(Refusal::Busy)) {
            self.take_over()?;
            reply = self.conversation.ask(request)?;
        }
        match reply {
            Reply::Settings(settings) => {
                self.settings = settings;
                Ok(())
            }
            other => Err(self.unexpected(request, other)),
        }
    }

    /// Stops a motion that still runs. The port is locked, so its host is gone: a killed program, or a
    /// disconnected cable.
    fn take_over(&mut self) -> Result<(), StageError> {
        self.was_left_alone = true;
        match self.stop() {
            // Then it was stopped at once.
            Err(StageError::TooSlow { .. }) => Ok(()),
            stopped => stopped,
        }
    }

    fn unexpected(&self, request: Request, reply: Reply) -> StageError {
        match reply {
            Reply::Refused(refusal) => StageError::Refused { reason: refusal_text(refusal).to_owned() },
            other => {
                let heard = format!("{other:?} to {request:?}");
                let hint = "its firmware violates the protocol: update it";
                StageError::foreign(self.conversation.port(), NAME, heard, hint)
            }
        }
    }

    fn status(&mut self) -> Result<Status, StageError> {
        match self.conversation.ask(Request::Status)? {
            Reply::Status(status) => Ok(status),
            other => Err(self.unexpected(Request::Status, other)),
        }
    }

    /// The status; an error if the stage has booted since it was connected.
    fn status_of_this_boot(&mut self, during: &str) -> Result<Status, StageError> {
        let status = self.status()?;
        self.same_boot(status.boot_id, during)?;
        Ok(status)
    }

    fn same_boot(&self, boot_id: u32, during: &str) -> Result<(), StageError> {
        if boot_id == self.identity.boot_id {
            Ok(())
        } else {
            Err(StageError::Restarted { during: during.to_owned() })
        }
    }

    fn homing_patience(&self) -> Duration {
        let mm_s = |velocity_nm_s: u32| f64::from(velocity_nm_s.max(1)) / NM_PER_MM;
        let seconds = HOMING_SEARCH * self.travel_mm() / mm_s(self.settings.seek_velocity_nm_s)
            + HOMING_PULL_OFFS * f64::from(self.settings.pull_off_nm)
                / NM_PER_MM
                / mm_s(self.settings.touch_velocity_nm_s);
        Duration::try_from_secs_f64(2.0 * seconds)
            .unwrap_or(Duration::MAX)
            .saturating_add(Duration::from_secs(5))
    }

    /// Starts an operation, and waits for its end. Returns the status at the end.
    fn operate(
        &mut self,
        during: &str,
        target_nm: i64,
        patience: Duration,
        request: impl FnOnce(u32) -> Request,
    ) -> Result<Status, StageError> {
        let id = self.identity.last_operation.saturating_add(1);
        self.conversation.forget_finished();
        let request = request(id);
        match self.conversation.ask(request)? {
            Reply::Accepted { id: accepted, target_nm: understood } if accepted == id => {
                self.identity.last_operation = id;
                // A damaged request with a valid CRC: one in 65536 of the damaged ones.
                if understood != target_nm {
                    self.stop()?;
                    return Err(StageError::Refused {
                        reason: format!(
                            "it received {understood} nm instead of {target_nm} nm and was stopped; try again"
                        ),
                    });
                }
            }
            // An earlier error may be the consequence of a restart, which is then reported.
            Reply::Refused(refusal) => {
                self.status_of_this_boot(during)?;
                return Err(match refusal {
                    Refusal::NotHomed => StageError::NotHomed,
                    _ => self.unexpected(request, Reply::Refused(refusal)),
                });
            }
            other => return Err(self.unexpected(request, other)),
        }
        self.wait(during, id, patience)?;
        let status = self.status_of_this_boot(during)?;
        match status.outcome {
            _ if status.operation != id => {
                let fault = "another program sends commands; end that program and home it";
                Err(StageError::fault(during, fault))
            }
            Outcome::Done if self.stop.pressed().is_none() => Ok(status),
            _ if status.fault == Fault::EmergencyStop && self.stop.pressed().is_some() => {
                Err(StageError::Stopped { position_mm: None })
            }
            Outcome::Done | Outcome::Stopped => {
                Err(StageError::Stopped { position_mm: position_mm(&status) })
            }
            _ => Err(StageError::fault(during, fault_text(status.fault))),
        }
    }

    fn heartbeat(&self) -> Duration {
        Duration::from_millis(self.settings.watchdog_ms.into()) / HEARTBEATS
    }

    /// Waits until the stage is at rest, sends heartbeats, and obeys the stop switch.
    fn wait(&mut self, during: &str, id: u32, patience: Duration) -> Result<(), StageError> {
        let since = self.conversation.now();
        let heartbeat = self.heartbeat();
        while self.conversation.now() - since < patience {
            // Repeated until the stage is at rest, because a request may be lost.
            match self.stop.pressed() {
                Some(Urgency::AtOnce) => {
                    self.conversation.emergency_stop()?;
                    self.stop.sent(Urgency::AtOnce);
                }
                Some(Urgency::Soon) => {
                    self.conversation.ask(Request::Stop)?;
                    self.stop.sent(Urgency::Soon);
                }
                None => {}
            }
            if self.conversation.finished(id, heartbeat)? {
                return Ok(());
            }
            match self.conversation.ask(Request::Heartbeat)? {
                Reply::Alive { boot_id, moving } => {
                    self.same_boot(boot_id, during)?;
                    if !moving {
                        return Ok(());
                    }
                }
                other => return Err(self.unexpected(Request::Heartbeat, other)),
            }
        }
        self.stop()?;
        Err(StageError::too_slow(during, patience))
    }
}

fn position_mm(status: &Status) -> Option<f64> {
    status.homed.then_some(status.position_nm as f64 / NM_PER_MM)
}

impl Axis for NativeAxis {
    fn identity(&self) -> StageIdentity {
        let Identity { version, build, steps_per_mm, travel_nm, .. } = self.identity;
        let travel_mm = travel_nm as f64 / NM_PER_MM;
        StageIdentity {
            driver: NAME,
            description: format!(
                "epirig stage, protocol {version}, build {build}, {steps_per_mm} steps/mm, {travel_mm} mm"
            ),
            port: Some(self.conversation.port().to_owned()),
        }
    }

    fn travel_mm(&self) -> f64 {
        self.identity.travel_nm as f64 / NM_PER_MM
    }

    fn kinematics(&self) -> Kinematics {
        Kinematics {
            velocity_mm_s: f64::from(self.settings.velocity_nm_s) / NM_PER_MM,
            acceleration_mm_s2: f64::from(self.settings.acceleration_nm_s2) / NM_PER_MM,
            step_mm: 1.0 / f64::from(self.identity.steps_per_mm.max(1)),
        }
    }

    fn is_homed(&self) -> bool {
        self.is_homed
    }

    fn position_settings(&mut self) -> Result<PositionSettings, StageError> {
        // From here on the present boot is the valid one.
        let identity = self.conversation.hello()?;
        self.meet(identity)?;
        let Identity { steps_per_mm, travel_nm, .. } = self.identity;
        Ok(PositionSettings::from([
            ("steps_per_mm".to_owned(), f64::from(steps_per_mm)),
            ("travel_mm".to_owned(), travel_nm as f64 / NM_PER_MM),
            ("pull_off_mm".to_owned(), f64::from(self.settings.pull_off_nm) / NM_PER_MM),
        ]))
    }

    fn home(&mut self) -> Result<Homed, StageError> {
        let patience = self.homing_patience();
        let before = self.status()?;
        if before.moving {
            self.take_over()?;
        }
        let status = self.operate("while homing", 0, patience, |id| Request::Home { id })?;
        self.was_left_alone = false;
        Ok(Homed {
            position_mm: position_mm(&status).ok_or_else(|| {
                StageError::fault(
                    "while homing",
                    "it reports the end of homing without a position; home it again",
                )
            })?,
            shift_mm: before.homed.then_some(status.home_shift_nm as f64 / NM_PER_MM),
        })
    }

    fn position_at_rest_mm(&mut self, during: &str) -> Result<Option<f64>, StageError> {
        Ok(position_mm(&self.status_of_this_boot(during)?))
    }

    fn go_to(&mut self, motion: &Motion) -> Result<Option<f64>, StageError> {
        let target_nm = (motion.target_mm * NM_PER_MM).round() as i64;
        let request = |id| Request::Move { id, position_nm: target_nm };
        let status = self.operate(&motion.during, target_nm, motion.patience, request)?;
        Ok(position_mm(&status))
    }

    fn state(&mut self) -> Result<StageState, StageError> {
        let status = self.status()?;
        let is_this_boot = status.boot_id == self.identity.boot_id;
        Ok(StageState {
            position_mm: position_mm(&status).filter(|_| is_this_boot && !self.was_left_alone),
            moving: status.moving,
            at_limit: status.limits != 0,
        })
    }

    fn stop(&mut self) -> Result<(), StageError> {
        let ramp = Duration::from_secs_f64(
            f64::from(self.settings.velocity_nm_s) / f64::from(self.settings.acceleration_nm_s2.max(1)),
        );
        let patience = ramp.saturating_mul(2).saturating_add(Duration::from_secs(2));
        let since = self.conversation.now();
        if let Err(error) = self.conversation.ask(Request::Stop) {
            // It may receive commands even if its answers are lost.
            self.conversation.emergency_stop()?;
            return Err(error);
        }
        while self.conversation.now() - since < patience {
            if !self.status()?.moving {
                return Ok(());
            }
            // The stage reports the end, if the report is not lost.
            self.conversation.finished(self.identity.last_operation, self.heartbeat())?;
        }
        self.conversation.emergency_stop()?;
        Err(StageError::too_slow("stopping", patience))
    }

    fn stop_switch(&self) -> StopSwitch {
        self.stop.clone()
    }

    fn now(&self) -> Duration {
        self.conversation.now()
    }

    // Required by the protocol.
    fn holds_at_rest(&self) -> Option<bool> {
        Some(true)
    }
}
