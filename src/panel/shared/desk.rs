//! What the threads of the panel share.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use super::control::Controller;
use super::coverage::Coverage;
use super::jog::Jog;
use super::mailbox::{Mailbox, Order};
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

/// What the threads of the panel share.
pub(in crate::panel) struct Shared {
    state: Mutex<RigState>,
    /// Rings when the state has changed.
    pub(in crate::panel) bell: Bell,
    pub(in crate::panel) pictures: Pictures,
    pub(in crate::panel) mailbox: Mailbox,
    pub(in crate::panel) jog: Jog,
    /// The profile that is in use.
    draft: Mutex<Draft>,
    /// Where the profile was read, and the file that it is saved to.
    pub(in crate::panel) source: String,
    pub(in crate::panel) file: PathBuf,
    /// The folder of the sequences.
    pub(in crate::panel) folder: PathBuf,
    /// Whether a chess-board is looked for in pictures.
    pub(in crate::panel) finds_target: AtomicBool,
    pub(in crate::panel) resets_peak: AtomicBool,
    /// Whether the threads are to end.
    ending: AtomicBool,
    /// The controls of the camera.
    controls: Mutex<Vec<Control>>,
    /// Where corners of a board were seen.
    coverage: Mutex<Coverage>,
    /// The page that has control.
    controller: Mutex<Controller>,
    /// How fast the stage is, if it tells.
    kinematics: Mutex<Option<Kinematics>>,
    /// The latest live map of the scan.
    live_map: Mutex<Option<Arc<LiveMap>>>,
    /// What a person answered to the request of a scan.
    answer: Mutex<Option<bool>>,
    stage_stop: Mutex<StopSwitch>,
    pause: Mutex<PauseSwitch>,
    pub(in crate::panel) hooks: Box<dyn PanelHooks>,
}

fn held<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Shared {
    pub(in crate::panel) fn new(
        draft: Draft,
        source: String,
        file: PathBuf,
        folder: PathBuf,
        hooks: Box<dyn PanelHooks>,
    ) -> Self {
        Self {
            state: Mutex::new(RigState { rig: source.clone(), ..RigState::default() }),
            bell: Bell::default(),
            pictures: Pictures::default(),
            mailbox: Mailbox::default(),
            jog: Jog::default(),
            draft: Mutex::new(draft),
            source,
            file,
            folder,
            finds_target: AtomicBool::new(false),
            resets_peak: AtomicBool::new(false),
            ending: AtomicBool::new(false),
            controls: Mutex::default(),
            coverage: Mutex::default(),
            controller: Mutex::default(),
            kinematics: Mutex::default(),
            live_map: Mutex::default(),
            answer: Mutex::new(None),
            stage_stop: Mutex::new(StopSwitch::default()),
            pause: Mutex::new(PauseSwitch::default()),
            hooks,
        }
    }

    /// Changes the state, and tells everybody.
    pub(in crate::panel) fn change<T>(&self, change: impl FnOnce(&mut RigState) -> T) -> T {
        let done = change(&mut held(&self.state));
        self.bell.ring();
        done
    }

    /// Looks at the state.
    pub(in crate::panel) fn look<T>(&self, look: impl FnOnce(&RigState) -> T) -> T {
        look(&held(&self.state))
    }

    pub(in crate::panel) fn draft(&self) -> Draft {
        held(&self.draft).clone()
    }

    pub(in crate::panel) fn use_draft(&self, draft: Draft) {
        *held(&self.draft) = draft;
    }

    pub(in crate::panel) fn note(&self, words: impl Into<String>) {
        self.change(|state| state.log(LogKind::Note, words));
    }

    pub(in crate::panel) fn warn(&self, words: impl Into<String>) {
        self.change(|state| state.log(LogKind::Warning, words));
    }

    pub(in crate::panel) fn fail(&self, words: impl Into<String>) {
        self.change(|state| state.log(LogKind::Error, words));
    }

    /// Begins a task, with an order to the owner of the rig if it needs one, unless there is a task or a stop:
    /// returns whether it has begun.
    pub(in crate::panel) fn begin(
        &self,
        kind: TaskKind,
        words: impl Into<String>,
        order: Option<Order>,
    ) -> bool {
        self.change(|state| {
            let free = state.task.is_none() && !state.stopping;
            if free {
                state.task = Some(Task::begun(kind, words.into()));
                // The state is held, so that a stop comes before both or after both.
                order.into_iter().for_each(|order| self.mailbox.put(order));
            }
            free
        })
    }

    /// Changes the task in hand.
    pub(in crate::panel) fn task(&self, change: impl FnOnce(&mut Task)) {
        self.change(|state| state.task.as_mut().map(change));
    }

    /// Sets how many parts of the task's step are done; tells it only if `tells`.
    pub(in crate::panel) fn count(&self, done: u64, tells: bool) {
        if let Some(task) = &mut held(&self.state).task {
            task.done = Some(done);
        }
        if tells {
            self.bell.ring();
        }
    }

    pub(in crate::panel) fn end_task(&self) {
        self.change(|state| state.task = None);
    }

    /// Nothing moves: a stop is over. An order that was waiting was forgotten, and its task with it.
    pub(in crate::panel) fn stands(&self) {
        // Pressed on, it would stop the next stage, too.
        self.stage_stop().release();
        self.change(|state| {
            state.stopping = false;
            state.task.take_if(|task| task.kind != TaskKind::Measuring);
        });
    }

    /// The switch of the stage that is connected now. A stop that was asked for meanwhile holds for it, too.
    pub(in crate::panel) fn connected(&self, switch: StopSwitch) {
        let mut known = held(&self.stage_stop);
        if let Some(urgency) = known.pressed() {
            switch.press(urgency);
        }
        self.hooks.stage_connected(switch.clone());
        *known = switch;
    }

    pub(in crate::panel) fn stage_stop(&self) -> StopSwitch {
        held(&self.stage_stop).clone()
    }

    /// A new switch for a scan that is ordered now: a pause from now on is its own.
    pub(in crate::panel) fn renew_pause(&self) {
        *held(&self.pause) = PauseSwitch::default();
    }

    pub(in crate::panel) fn pause_switch(&self) -> PauseSwitch {
        held(&self.pause).clone()
    }

    /// Asks the scan to end after the frame in hand.
    pub(in crate::panel) fn pause(&self) {
        held(&self.pause).press();
        self.change(|state| state.scan.as_mut().map(ScanState::pausing));
    }

    /// Stops whatever moves: the first time softly, the second time at once. A scan is paused, a measurement
    /// ends.
    pub(in crate::panel) fn stop(&self) {
        self.jog.release_all();
        let switch = self.stage_stop();
        let urgency = if switch.pressed().is_some() { Urgency::AtOnce } else { Urgency::Soon };
        switch.press(urgency);
        self.pause();
        self.change(|state| {
            state.stopping = true;
            if let Some(task) = state.task.as_mut().filter(|task| task.kind == TaskKind::Measuring) {
                task.stops = true;
            }
            self.mailbox.clear();
            self.mailbox.put(Order::Stopped);
            state.log(LogKind::Warning, "STOP was pressed");
        });
    }

    /// A person answers what the scan asks.
    pub(in crate::panel) fn answer(&self, done: bool) {
        *held(&self.answer) = Some(done);
    }

    pub(in crate::panel) fn take_answer(&self) -> Option<bool> {
        held(&self.answer).take()
    }

    pub(in crate::panel) fn controls(&self) -> Vec<Control> {
        held(&self.controls).clone()
    }

    pub(in crate::panel) fn set_controls(&self, controls: Vec<Control>) {
        *held(&self.controls) = controls;
    }

    pub(in crate::panel) fn kinematics(&self) -> Option<Kinematics> {
        *held(&self.kinematics)
    }

    pub(in crate::panel) fn set_kinematics(&self, kinematics: Option<Kinematics>) {
        *held(&self.kinematics) = kinematics;
    }

    pub(in crate::panel) fn live_map(&self) -> Option<Arc<LiveMap>> {
        held(&self.live_map).clone()
    }

    pub(in crate::panel) fn set_live_map(&self, map: Option<LiveMap>) {
        *held(&self.live_map) = map.map(Arc::new);
    }

    /// Adds corners to the coverage, or begins it anew; returns which parts of the picture are covered.
    pub(in crate::panel) fn cover(&self, change: impl FnOnce(&mut Coverage)) -> Vec<bool> {
        let mut coverage = held(&self.coverage);
        change(&mut coverage);
        coverage.seen().to_vec()
    }

    /// Whether the page `client` has control; the first one to ask gets it.
    pub(in crate::panel) fn may(&self, client: &str) -> bool {
        self.control(|controller| controller.asks(client, Instant::now()))
    }

    /// Asks who has control, or changes it, and tells everybody of a change.
    pub(in crate::panel) fn control<T>(&self, change: impl FnOnce(&mut Controller) -> T) -> T {
        // The state is told while the controller is held: of two changes the later one is told last.
        let mut controller = held(&self.controller);
        let done = change(&mut controller);
        let holder = controller.holder().map(str::to_owned);
        if self.look(|state| state.controller != holder) {
            self.change(|state| state.controller = holder);
        }
        done
    }

    /// Asks the threads to end: a scan after its frame, the second time at once.
    pub(in crate::panel) fn end(&self) {
        if self.ending.swap(true, Ordering::SeqCst) {
            self.stop();
        }
        self.jog.release_all();
        self.pause();
        self.mailbox.put(Order::End);
    }

    pub(in crate::panel) fn is_ending(&self) -> bool {
        self.ending.load(Ordering::SeqCst)
    }

    pub(in crate::panel) fn finds_target(&self) -> bool {
        self.finds_target.load(Ordering::SeqCst)
    }
}

/// Pictures are wanted no more often than this: more often than 25 times a second, since they come unevenly.
const INTERVAL: Duration = Duration::from_millis(20);

impl Onlooker for Shared {
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

    fn shared() -> Shared {
        let draft = Draft::read("", "rig.toml", &[]).unwrap();
        Shared::new(draft, "rig.toml".to_owned(), PathBuf::new(), PathBuf::new(), Box::new(NoHooks))
    }

    #[test]
    fn a_stop_forgets_the_orders_before_it_and_refuses_others_until_the_stage_stands() {
        let shared = shared();
        let next = || shared.mailbox.take(Duration::ZERO);
        assert!(shared.begin(TaskKind::Homing, "homing", Some(Order::Home)));
        shared.stop();
        assert!(matches!(next(), Some(Order::Stopped)), "the order before it is forgotten");
        shared.look(|state| assert!(state.stopping));
        assert!(!shared.begin(TaskKind::Homing, "homing", Some(Order::Home)));
        assert!(next().is_none(), "an order that is refused is not carried out");
        assert!(shared.stage_stop().pressed().is_some());
        shared.stands();
        let next_stage = StopSwitch::default();
        shared.connected(next_stage.clone());
        assert_eq!(next_stage.pressed(), None, "a stop that is over stops no other stage");
        assert!(shared.begin(TaskKind::Homing, "homing", Some(Order::Home)));
        assert!(matches!(next(), Some(Order::Home)));
    }

    #[test]
    fn a_stop_ends_a_measurement_and_no_other_task() {
        for (kind, stops) in [(TaskKind::Measuring, true), (TaskKind::Scan, false), (TaskKind::Doctor, false)]
        {
            let shared = shared();
            assert!(shared.begin(kind, "at work", None));
            shared.stop();
            shared.look(|state| assert_eq!(state.task.as_ref().unwrap().stops, stops, "{kind:?}"));
        }
    }
}
