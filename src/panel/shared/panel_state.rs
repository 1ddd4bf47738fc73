//! The state of the panel: one, behind one lock.

use std::collections::VecDeque;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use super::control::Controller;
use super::coverage::Coverage;
use super::jog::Jog;
use super::orders::Order;
use super::pictures::Pictures;
use crate::capture::PauseSwitch;
use crate::panel::live_map::LiveMap;
use crate::panel::state::{LogKind, RigState, ScanState, Task, TaskKind};
use crate::profile::Draft;
use epirig_core::frame::Frame;
use epirig_devices::camera::{Control, Onlooker};
use epirig_devices::stage::{Kinematics, StopSwitch, Urgency};
use epirig_server::Bell;

/// What the program that shows a panel does beside it.
pub trait PanelHooks: Send + Sync {
    /// A stage was connected; its stop switch.
    fn stage_connected(&self, _switch: StopSwitch) {}

    /// A scan into this folder begins now, or is resumed.
    fn scan_begins(&self, _folder: &Path, _resumed: bool) {}
}

/// What a panel is made of.
pub struct PanelOptions {
    /// The profile of the rig.
    pub draft: Draft,
    /// What a person calls the rig.
    pub source: String,
    /// The file that the profile is saved to.
    pub file: PathBuf,
    /// The folder of the sequences.
    pub folder: PathBuf,
    /// What the program does beside it.
    pub hooks: Box<dyn PanelHooks>,
}

/// All that changes while a panel runs, but for the pictures.
#[derive(Default)]
pub(in crate::panel) struct PanelState {
    /// What the pages are told.
    pub(in crate::panel) rig: RigState,
    /// What the owner of the rig is to do, in this sequence.
    orders: VecDeque<Order>,
    /// The profile in use. Only the owner of the rig changes it, so that its devices are always those of this one.
    pub(in crate::panel) draft: Draft,
    /// The controls of the camera.
    pub(in crate::panel) controls: Vec<Control>,
    /// How fast the stage is, if it tells.
    pub(in crate::panel) kinematics: Option<Kinematics>,
    /// The page that has control.
    controller: Controller,
    /// The button that is held.
    pub(in crate::panel) jog: Jog,
    /// Whether a chess-board is looked for in pictures.
    pub(in crate::panel) finds_target: bool,
    /// Where corners of a board were seen.
    pub(in crate::panel) coverage: Coverage,
    /// The latest live map of the scan.
    pub(in crate::panel) live_map: Option<Arc<LiveMap>>,
    /// What a person answered to the request of a scan.
    pub(in crate::panel) answer: Option<bool>,
    /// Stops the stage that is connected now.
    pub(in crate::panel) stage_stop: StopSwitch,
    /// Pauses the scan that was ordered last.
    pub(in crate::panel) pause: PauseSwitch,
    /// Whether the threads are to end.
    ending: bool,
}

impl PanelState {
    fn pause(&mut self) {
        self.pause.press();
        self.rig.scan.as_mut().map(ScanState::pausing);
    }
}

/// What the threads of the panel share.
///
/// STOP takes the lock of the state. So whoever holds it only moves values in memory: no device, no file, no JSON
/// and no other lock is waited for meanwhile. The pictures have a lock of their own: they come 30 times a second,
/// and looking at them takes long.
pub(in crate::panel) struct SharedState {
    state: Mutex<PanelState>,
    /// Tells the owner of the rig that an order has come.
    ordered: Condvar,
    /// Rings when the state has changed.
    pub(in crate::panel) bell: Bell,
    pub(in crate::panel) pictures: Pictures,
    /// Where the profile was read, and the file that it is saved to.
    pub(in crate::panel) source: String,
    pub(in crate::panel) file: PathBuf,
    /// The folder of the sequences.
    pub(in crate::panel) folder: PathBuf,
    pub(in crate::panel) hooks: Box<dyn PanelHooks>,
}

impl SharedState {
    pub(in crate::panel) fn new(options: PanelOptions) -> Self {
        let PanelOptions { draft, source, file, folder, hooks } = options;
        let state = PanelState {
            rig: RigState { rig: source.clone(), ..RigState::default() },
            draft,
            ..PanelState::default()
        };
        Self {
            state: Mutex::new(state),
            ordered: Condvar::new(),
            bell: Bell::default(),
            pictures: Pictures::default(),
            source,
            file,
            folder,
            hooks,
        }
    }

    fn lock(&self) -> MutexGuard<'_, PanelState> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Changes the state, and tells everybody. `change` must not wait for anything.
    pub(in crate::panel) fn change<T>(&self, change: impl FnOnce(&mut PanelState) -> T) -> T {
        let done = change(&mut self.lock());
        self.bell.ring();
        done
    }

    /// Looks at the state. `look` must not wait for anything.
    pub(in crate::panel) fn look<T>(&self, look: impl FnOnce(&PanelState) -> T) -> T {
        look(&self.lock())
    }

    /// The profile in use.
    pub(in crate::panel) fn draft(&self) -> Draft {
        self.look(|state| state.draft.clone())
    }

    pub(in crate::panel) fn note(&self, words: impl Into<String>) {
        self.change(|state| state.rig.log(LogKind::Note, words));
    }

    pub(in crate::panel) fn warn(&self, words: impl Into<String>) {
        self.change(|state| state.rig.log(LogKind::Warning, words));
    }

    pub(in crate::panel) fn fail(&self, words: impl Into<String>) {
        self.change(|state| state.rig.log(LogKind::Error, words));
    }

    /// Adds an order that needs no task.
    pub(in crate::panel) fn order(&self, order: Order) {
        self.lock().orders.push_back(order);
        self.ordered.notify_all();
    }

    /// Adds an order that needs no task, unless there is one: returns whether it was added.
    pub(in crate::panel) fn order_if_idle(&self, order: Order) -> bool {
        let mut state = self.lock();
        let idle = state.rig.task.is_none();
        if idle {
            state.orders.push_back(order);
            self.ordered.notify_all();
        }
        idle
    }

    /// The next order, if one comes within `patience`.
    pub(in crate::panel) fn next_order(&self, patience: Duration) -> Option<Order> {
        let none = |state: &mut PanelState| state.orders.is_empty();
        let waited = self.ordered.wait_timeout_while(self.lock(), patience, none);
        let (mut state, _) = waited.unwrap_or_else(PoisonError::into_inner);
        state.orders.pop_front()
    }

    /// Begins a task, with an order to the owner of the rig if it needs one.
    ///
    /// # Errors
    /// Why not, if there is a task or a stop.
    pub(in crate::panel) fn begin(
        &self,
        kind: TaskKind,
        words: impl Into<String>,
        order: Option<Order>,
    ) -> Result<(), String> {
        self.change(|state| {
            if let Some(task) = &state.rig.task {
                return Err(format!("the rig is busy ({}); stop it first", task.words));
            }
            if state.rig.stopping {
                return Err("the rig is being stopped; try again when it stands".to_owned());
            }
            state.rig.task = Some(Task::begun(kind, words.into()));
            if kind == TaskKind::Scan {
                // A pause from now on is its own.
                state.pause = PauseSwitch::default();
            }
            state.orders.extend(order);
            self.ordered.notify_all();
            Ok(())
        })
    }

    /// Changes the task in hand.
    pub(in crate::panel) fn task(&self, change: impl FnOnce(&mut Task)) {
        self.change(|state| state.rig.task.as_mut().map(change));
    }

    /// Sets how many parts of the task's step are done; tells it only if `tells`.
    pub(in crate::panel) fn count(&self, done: u64, tells: bool) {
        if let Some(task) = &mut self.lock().rig.task {
            task.done = Some(done);
        }
        if tells {
            self.bell.ring();
        }
    }

    pub(in crate::panel) fn end_task(&self) {
        self.change(|state| state.rig.task = None);
    }

    /// Nothing moves: a stop is over. An order that was waiting was forgotten, and its task with it.
    pub(in crate::panel) fn stands(&self) {
        self.change(|state| {
            // Pressed on, it would stop the next stage, too.
            state.stage_stop.release();
            state.rig.stopping = false;
            state.rig.task.take_if(|task| task.kind != TaskKind::Measuring);
        });
    }

    /// The switch of the stage that is connected now. A stop that was asked for meanwhile holds for it, too.
    pub(in crate::panel) fn connected(&self, switch: StopSwitch) {
        self.hooks.stage_connected(switch.clone());
        self.change(|state| {
            if let Some(urgency) = state.stage_stop.pressed() {
                switch.press(urgency);
            }
            state.stage_stop = switch;
        });
    }

    /// Asks the scan to end after the frame in hand.
    pub(in crate::panel) fn pause(&self) {
        self.change(PanelState::pause);
    }

    /// Stops whatever moves: the first time softly, the second time at once. A scan is paused, a measurement
    /// ends.
    pub(in crate::panel) fn stop(&self) {
        self.change(|state| {
            let again = state.stage_stop.pressed().is_some();
            state.stage_stop.press(if again { Urgency::AtOnce } else { Urgency::Soon });
            state.jog.release_all();
            state.pause();
            state.rig.stopping = true;
            if let Some(task) = state.rig.task.as_mut().filter(|task| task.kind == TaskKind::Measuring) {
                task.stops = true;
            }
            state.orders.retain(|order| matches!(order, Order::End));
            state.orders.push_back(Order::Stopped);
            state.rig.log(LogKind::Warning, "STOP was pressed");
        });
        self.ordered.notify_all();
    }

    /// Whether the page `client` has control; the first one to ask gets it.
    pub(in crate::panel) fn may(&self, client: &str) -> bool {
        self.control(|controller| controller.asks(client, Instant::now()))
    }

    /// Asks who has control, or changes it, and tells everybody of a change.
    pub(in crate::panel) fn control<T>(&self, change: impl FnOnce(&mut Controller) -> T) -> T {
        let mut state = self.lock();
        let done = change(&mut state.controller);
        let holder = state.controller.holder().map(str::to_owned);
        if state.rig.controller != holder {
            state.rig.controller = holder;
            drop(state);
            self.bell.ring();
        }
        done
    }

    /// Asks the threads to end: a scan after its frame, the second time at once.
    pub(in crate::panel) fn end(&self) {
        if self.change(|state| std::mem::replace(&mut state.ending, true)) {
            self.stop();
        }
        self.change(|state| {
            state.jog.release_all();
            state.pause();
            state.orders.push_back(Order::End);
        });
        self.ordered.notify_all();
    }

    pub(in crate::panel) fn is_ending(&self) -> bool {
        self.look(|state| state.ending)
    }
}

/// Pictures are wanted no more often than this: more often than 25 times a second, since they come unevenly.
const INTERVAL: Duration = Duration::from_millis(20);

impl Onlooker for SharedState {
    fn wants(&self) -> bool {
        self.pictures.are_watched()
            && self.pictures.latest().is_none_or(|latest| latest.at.elapsed() >= INTERVAL)
    }

    fn see(&self, frame: &Frame) {
        self.pictures.put(frame.clone());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    struct NoHooks;

    impl PanelHooks for NoHooks {}

    fn shared() -> SharedState {
        let draft = Draft::read("", "rig.toml", &[]).unwrap();
        let (source, file, folder) = ("rig.toml".to_owned(), PathBuf::new(), PathBuf::new());
        SharedState::new(PanelOptions { draft, source, file, folder, hooks: Box::new(NoHooks) })
    }

    #[test]
    fn a_stop_forgets_the_orders_before_it_and_refuses_others_until_the_stage_stands() {
        let shared = shared();
        let next = || shared.next_order(Duration::ZERO);
        shared.begin(TaskKind::Homing, "homing", Some(Order::Home)).unwrap();
        shared.stop();
        assert!(matches!(next(), Some(Order::Stopped)), "the order before it is forgotten");
        shared.look(|state| assert!(state.rig.stopping));
        shared.begin(TaskKind::Homing, "homing", Some(Order::Home)).expect_err("it stops");
        assert!(next().is_none(), "an order that is refused is not carried out");
        shared.look(|state| assert!(state.stage_stop.pressed().is_some()));
        shared.stands();
        let next_stage = StopSwitch::default();
        shared.connected(next_stage.clone());
        assert_eq!(next_stage.pressed(), None, "a stop that is over stops no other stage");
        shared.begin(TaskKind::Homing, "homing", Some(Order::Home)).unwrap();
        assert!(matches!(next(), Some(Order::Home)));
    }

    #[test]
    fn a_stop_ends_a_measurement_and_no_other_task() {
        for (kind, stops) in [(TaskKind::Measuring, true), (TaskKind::Scan, false), (TaskKind::Doctor, false)]
        {
            let shared = shared();
            shared.begin(kind, "at work", None).unwrap();
            shared.stop();
            shared.look(|state| assert_eq!(state.rig.task.as_ref().unwrap().stops, stops, "{kind:?}"));
        }
    }

    #[test]
    fn orders_come_in_their_sequence_and_the_end_is_not_forgotten() {
        let shared = shared();
        let next = || shared.next_order(Duration::ZERO);
        assert!(next().is_none());
        for order in [Order::Home, Order::Go { mm: 3.0 }] {
            shared.order(order);
        }
        shared.end();
        assert!(matches!(next(), Some(Order::Home)));
        shared.stop();
        assert!(matches!(next(), Some(Order::End)));
        assert!(matches!(next(), Some(Order::Stopped)));
    }

    #[test]
    fn an_order_without_a_task_waits_for_none() {
        let shared = shared();
        assert!(shared.order_if_idle(Order::Home));
        shared.begin(TaskKind::Homing, "homing", None).unwrap();
        assert!(!shared.order_if_idle(Order::Home));
    }
}
