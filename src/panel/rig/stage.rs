//! The stage of the panel: opened, moved, and opened again when it was lost.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::Builder;
use std::time::{Duration, Instant};

use crate::panel::shared::SharedState;
use crate::panel::state::{Presence, StageState, TaskKind};
use crate::profile::Profile;
use crate::rig::RigStage;
use epirig_devices::stage::{Kinematics, Remedy, Stage, StageError, StagePosition, StageSource, Urgency};

/// Pause between two attempts to open a stage.
const RETRY: Duration = Duration::from_secs(3);
/// A held button moves the stage in parts of this length: what the stage still does if this program dies.
const JOG_PARTS: [Duration; 2] = [Duration::from_millis(200), Duration::from_secs(1)];
/// The same for a stage whose velocity is not known, in mm.
const JOG_PARTS_MM: [f64; 2] = [0.1, 1.0];
/// How often it is checked whether the button is still held.
const CHECK: Duration = Duration::from_millis(20);

/// Connects the stage of a profile, and makes its stop switch the one that the panel presses.
pub(super) struct Connector<'a> {
    source: RigStage<'a>,
    shared: &'a Arc<SharedState>,
}

impl<'a> Connector<'a> {
    pub(super) fn new(source: RigStage<'a>, shared: &'a Arc<SharedState>) -> Self {
        Self { source, shared }
    }

    pub(super) fn watch(&self) -> StagePosition {
        self.source.watch()
    }
}

impl StageSource for Connector<'_> {
    fn connect(&mut self) -> Result<Box<dyn Stage>, StageError> {
        let stage = self.source.connect()?;
        self.shared.connected(stage.stop_switch());
        stage.notes().iter().for_each(|note| self.shared.note(format!("stage: {note}")));
        Ok(stage)
    }
}

/// The stage.
pub(super) struct StageSide<'a> {
    shared: &'a Arc<SharedState>,
    profile: &'a Profile,
    pub(super) connector: Connector<'a>,
    stage: Option<Box<dyn Stage>>,
    next_try: Instant,
}

impl<'a> StageSide<'a> {
    pub(super) fn new(shared: &'a Arc<SharedState>, profile: &'a Profile, connector: Connector<'a>) -> Self {
        Self { shared, profile, connector, stage: None, next_try: Instant::now() }
    }

    /// Opens the stage if it is not open and it is time for it.
    pub(super) fn open(&mut self) {
        if self.stage.is_some() || Instant::now() < self.next_try {
            return;
        }
        match self.connector.connect() {
            Ok(stage) => {
                let described = described(&*stage, self.profile);
                let kinematics = kinematics(&*stage);
                self.stage = Some(stage);
                self.shared.change(|state| (state.rig.stage, state.kinematics) = (described, kinematics));
                self.refresh();
            }
            Err(error) => self.lost(&error),
        }
    }

    fn lost(&mut self, error: &StageError) {
        let why = error.to_string();
        self.stage = None;
        self.next_try = Instant::now() + RETRY;
        let is_new = self.shared.look(|state| state.rig.stage.error.as_deref() != Some(why.as_str()));
        if is_new {
            self.shared.fail(format!("stage: {why}"));
        }
        self.shared.change(|state| {
            let stage = &mut state.rig.stage;
            (stage.state, stage.error) = (Presence::Lost, Some(why));
            (stage.position_mm, stage.homed, stage.moving) = (None, false, false);
        });
    }

    /// Asks the stage where it is.
    fn refresh(&mut self) {
        let Some(stage) = &mut self.stage else { return };
        match stage.state() {
            Ok(found) => self.shared.change(|state| {
                let stage = &mut state.rig.stage;
                (stage.position_mm, stage.homed) = (found.position_mm, found.position_mm.is_some());
                (stage.moving, stage.at_limit) = (found.moving, found.at_limit);
            }),
            Err(error) => self.lost(&error),
        }
    }

    /// Gives up the connection, for a scan that makes its own.
    pub(super) fn give_up(&mut self) {
        self.stage = None;
        self.next_try = Instant::now();
    }

    /// Lends the stage for an examination.
    ///
    /// # Errors
    /// Why there is none.
    pub(super) fn lend(&mut self) -> Result<&mut Box<dyn Stage>, String> {
        self.next_try = Instant::now();
        self.open();
        let why = self.shared.look(|state| state.rig.stage.error.clone()).unwrap_or_default();
        self.stage.as_mut().ok_or(format!("there is no stage: {why}"))
    }

    /// The stage is the panel's again.
    pub(super) fn released(&mut self) {
        self.refresh();
    }

    /// Moves in a thread of its own, while `meanwhile` is called again and again. Errors go to the log.
    pub(super) fn during(
        &mut self,
        kind: TaskKind,
        words: String,
        act: impl FnOnce(&mut dyn Stage) -> Result<(), StageError> + Send,
        mut meanwhile: impl FnMut(),
    ) {
        let Some(stage) = &mut self.stage else {
            return self.shared.end_task();
        };
        self.shared.task(|task| (task.kind, task.words) = (kind, words));
        self.shared.change(|state| state.rig.stage.moving = true);
        let (watch, simulated) = (self.connector.watch(), self.profile.stage.is_simulated());
        let homed = self.shared.look(|state| state.rig.stage.homed);
        let mut act = Some(act);
        let moved = std::thread::scope(|scope| {
            let moving = || act.take().map_or(Ok(()), |act| act(&mut **stage));
            let moving = Builder::new().spawn_scoped(scope, moving).ok()?;
            while !moving.is_finished() {
                if simulated && homed {
                    self.shared.change(|state| state.rig.stage.position_mm = Some(watch.get_mm()));
                }
                meanwhile();
            }
            match moving.join() {
                Ok(moved) => Some(moved),
                Err(panic) => std::panic::resume_unwind(panic),
            }
        });
        // Where the system allows no thread, the page does not show the way.
        let moved = moved.unwrap_or_else(|| act.take().map_or(Ok(()), |act| act(&mut **stage)));
        self.shared.end_task();
        self.shared.change(|state| state.rig.stage.moving = false);
        match moved {
            Ok(()) => {
                self.refresh();
                self.tell_end(kind);
            }
            Err(StageError::Stopped { .. }) => {
                self.shared.note("the stage was stopped");
                self.refresh();
            }
            Err(error) if error.consequence().remedy == Remedy::WaitThenHome => self.lost(&error),
            Err(error) => {
                self.shared.fail(format!("stage: {error}"));
                self.refresh();
            }
        }
    }

    /// Writes into the log what a motion came to.
    fn tell_end(&self, kind: TaskKind) {
        let Some(at_mm) = self.shared.look(|state| state.rig.stage.position_mm) else { return };
        match kind {
            TaskKind::Homing => self.shared.note("the stage is homed"),
            TaskKind::Moving | TaskKind::Jogging => {
                self.shared.note(format!("the stage has moved to {at_mm:.4} mm"));
            }
            _ => {}
        }
    }

    /// Moves up or down for as long as the button `id` is held.
    pub(super) fn jog(&mut self, id: u64, up: bool, fast: bool, meanwhile: impl FnMut()) {
        let (travel_mm, part_mm, switch) = self.shared.look(|state| {
            let stage = &state.rig.stage;
            (stage.travel_mm, stage.runs_on_mm[usize::from(fast)], state.stage_stop.clone())
        });
        let shared = self.shared;
        let held =
            || switch.pressed().is_none() && shared.look(|state| state.jog.is_held(id, Instant::now()));
        let act = |stage: &mut dyn Stage| {
            let ended = AtomicBool::new(false);
            std::thread::scope(|scope| {
                let watch = || {
                    while !ended.load(Ordering::SeqCst) {
                        if !held() {
                            return switch.press(Urgency::Soon);
                        }
                        std::thread::sleep(CHECK);
                    }
                };
                // Nothing may move that nobody watches.
                let watching = Builder::new().spawn_scoped(scope, watch).map_err(|error| {
                    let reason = format!("the system allows no thread that watches the button: {error}");
                    StageError::Refused { reason }
                })?;
                let mut moved = Ok(());
                while moved.is_ok() && held() {
                    moved = stage.position_mm().and_then(|from_mm| {
                        let by_mm = if up { part_mm } else { -part_mm };
                        let to_mm = (from_mm + by_mm).clamp(0.0, travel_mm);
                        if to_mm == from_mm {
                            shared.change(|state| state.jog.release(id));
                            return Ok(());
                        }
                        stage.move_to(to_mm)
                    });
                }
                ended.store(true, Ordering::SeqCst);
                // It returns within one check.
                let _ = watching.join();
                moved
            })
        };
        let words = if up { "moving up while held" } else { "moving down while held" };
        self.during(TaskKind::Jogging, words.to_owned(), act, meanwhile);
        shared.change(|state| {
            state.jog.release(id);
            // Let go: the switch was pressed by the release, unless a person pressed STOP.
            if !state.rig.stopping {
                switch.release();
            }
        });
    }

    /// After STOP: makes sure that the stage stands, and lets it move again.
    pub(super) fn stand(&mut self) {
        if let Some(stage) = &mut self.stage
            && let Err(error) = stage.stop()
        {
            self.shared.fail(format!("stage: {error}"));
        }
        self.shared.stands();
        self.refresh();
    }
}

fn described(stage: &dyn Stage, profile: &Profile) -> StageState {
    let positions = profile.plan.positions_mm();
    StageState {
        state: Presence::Ready,
        name: stage.identity().to_string(),
        simulated: profile.stage.is_simulated(),
        travel_mm: stage.travel_mm(),
        plan_mm: positions.and_then(|all| Some([*all.first()?, *all.last()?])),
        steps_mm: steps_mm(profile.plan.step_mm),
        runs_on_mm: std::array::from_fn(|index| {
            reach_mm(stage, JOG_PARTS[index]).unwrap_or(JOG_PARTS_MM[index])
        }),
        ..StageState::default()
    }
}

/// Velocity and acceleration of a stage that tells how long its moves take: two long moves differ by the time
/// at full velocity, and the rest of either is its ramps.
fn kinematics(stage: &dyn Stage) -> Option<Kinematics> {
    let half_mm = 0.5 * stage.travel_mm();
    let seconds = |mm| stage.expected_duration(mm).map(|time| time.as_secs_f64());
    let (half_s, whole_s) = (seconds(half_mm)?, seconds(2.0 * half_mm)?);
    let velocity_mm_s = half_mm / (whole_s - half_s);
    let acceleration_mm_s2 = velocity_mm_s / (half_s - half_mm / velocity_mm_s);
    let is_usual = |value: f64| value.is_finite() && value > 0.0;
    (is_usual(velocity_mm_s) && is_usual(acceleration_mm_s2)).then_some(Kinematics {
        velocity_mm_s,
        acceleration_mm_s2,
        step_mm: 0.0,
    })
}

/// How far the stage moves in `time`, starting and ending at rest; in mm.
fn reach_mm(stage: &dyn Stage, time: Duration) -> Option<f64> {
    let (mut low_mm, mut high_mm) = (0.0, stage.travel_mm());
    for _ in 0..40 {
        let middle_mm = 0.5 * (low_mm + high_mm);
        if stage.expected_duration(middle_mm)? <= time { low_mm = middle_mm } else { high_mm = middle_mm }
    }
    Some(low_mm)
}

/// Sizes of steps: decades, the nearest of them replaced by the step of the plan.
fn steps_mm(plan_mm: Option<f64>) -> Vec<f64> {
    let mut steps = vec![0.01, 0.1, 1.0, 10.0];
    if let Some(plan_mm) = plan_mm.map(f64::abs).filter(|step| *step > 0.0) {
        let decades = |step: f64| (step / plan_mm).log10().abs();
        if let Some(nearest) = steps.iter_mut().min_by(|a, b| decades(**a).total_cmp(&decades(**b))) {
            *nearest = plan_mm;
        }
    }
    steps.sort_by(f64::total_cmp);
    steps
}

#[cfg(test)]
mod tests {
    use super::*;
    use epirig_devices::stage::{SimStage, SimStageConfig};

    #[test]
    fn steps_have_that_of_the_plan_among_them() {
        assert_eq!(steps_mm(None), [0.01, 0.1, 1.0, 10.0]);
        assert_eq!(steps_mm(Some(1.5)), [0.01, 0.1, 1.5, 10.0]);
        assert_eq!(steps_mm(Some(-0.002)), [0.002, 0.1, 1.0, 10.0]);
        assert_eq!(steps_mm(Some(500.0)), [0.01, 0.1, 1.0, 500.0]);
    }

    #[test]
    fn velocity_and_reach_are_those_of_the_stage() {
        let stage = SimStage::new(SimStageConfig::ideal(200.0));
        let found = kinematics(&stage).unwrap();
        assert!((found.velocity_mm_s - 5.0).abs() < 1e-6 && (found.acceleration_mm_s2 - 20.0).abs() < 1e-3);
        // In 1 s: ramps of 0.25 s and 0.625 mm each, and 0.5 s at 5 mm/s.
        assert!((reach_mm(&stage, Duration::from_secs(1)).unwrap() - 3.75).abs() < 1e-6);
    }
}
