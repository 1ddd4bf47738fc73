//! What the camera sees: the simulator's picture at the place of the stage.
//!
//! A picture takes time to render, but light does not. So the stage makes the last step of a move only when
//! the picture of its final position is there.

use std::collections::HashMap;
use std::sync::{Arc, Condvar, LazyLock, Mutex};
use std::thread::JoinHandle;

use epirig_core::frame::Samples;
use epirig_devices::camera::Size;
use epirig_devices::stage::simulator::{NativeDevice, Plant};
use epirig_simulator::{Simulator, SimulatorConfig};

use super::picture::blurred;

/// Motion blur in px, in turn, so that pictures of a moving stage differ.
const SMEARS: [usize; 2] = [9, 15];

type Levels = Arc<Vec<u8>>;

/// Columns, rows and steps.
type Key = (usize, usize, i64);

/// What was rendered: an emulated processor renders slowly, and the tests of this process
/// go to the same places.
static RENDERED: LazyLock<Mutex<HashMap<Key, Levels>>> = LazyLock::new(Mutex::default);

#[derive(Default)]
struct State {
    /// Where the carriage wants to come to rest.
    wanted: Option<i64>,
    latest: Levels,
    /// Steps at the latest look.
    steps_made: u64,
    smears: usize,
    over: bool,
}

/// The object before the camera; clones share it.
#[derive(Clone)]
pub struct Scene {
    simulator: Arc<Simulator>,
    plant: Plant,
    size: Size,
    state: Arc<(Mutex<State>, Condvar)>,
}

/// Renders what the stage waits for, for its lifetime.
pub struct Renderer {
    scene: Scene,
    thread: Option<JoinHandle<()>>,
}

impl Scene {
    /// The simulator's textured plane, moved by `stage`.
    pub fn before(stage: &mut NativeDevice, size: Size) -> (Self, Renderer) {
        let config = SimulatorConfig::textured_plane(size.columns, size.rows, 2);
        let scene = Self {
            simulator: Arc::new(Simulator::new(config).unwrap()),
            plant: stage.plant(),
            size,
            state: Arc::default(),
        };
        let gate = scene.clone();
        stage.rest_when(Box::new(move |steps| gate.may_rest_at(steps)));
        let renders = scene.clone();
        let thread = std::thread::spawn(move || renders.render_what_is_wanted());
        (scene.clone(), Renderer { scene, thread: Some(thread) })
    }

    pub fn size(&self) -> Size {
        self.size
    }

    /// Grey levels with the carriage at rest at `steps`.
    pub fn at(&self, steps: i64) -> Levels {
        if let Some(levels) = RENDERED.lock().unwrap().get(&self.key(steps)) {
            return Arc::clone(levels);
        }
        let frame = self.simulator.expose(NativeDevice::mm_from_home(steps), 0);
        let Samples::U8(levels) = frame.samples() else { panic!("the simulator has 8 bit") };
        let levels = Arc::new(levels.clone());
        RENDERED.lock().unwrap().insert(self.key(steps), Arc::clone(&levels));
        levels
    }

    fn key(&self, steps: i64) -> Key {
        (self.size.columns, self.size.rows, steps)
    }

    fn is_rendered(&self, steps: i64) -> bool {
        RENDERED.lock().unwrap().contains_key(&self.key(steps))
    }

    /// What there is to see now, and where the carriage stands; `None` while it moves.
    pub fn now(&self) -> (Option<i64>, Levels) {
        let (made, steps) = (self.plant.steps_made(), self.plant.carriage_steps());
        let still = made == self.plant.steps_made();
        let mut state = self.state.0.lock().unwrap();
        let moved = std::mem::replace(&mut state.steps_made, made) != made;
        if moved || !still || state.wanted.is_some() {
            state.smears += 1;
            let reach = SMEARS[state.smears % SMEARS.len()];
            let rows = state.latest.chunks_exact(self.size.columns);
            let smeared: Vec<u8> = rows.flat_map(|row| blurred(row, reach)).collect();
            if !smeared.is_empty() {
                return (None, Arc::new(smeared));
            }
        }
        drop(state);
        let levels = self.at(steps);
        self.state.0.lock().unwrap().latest = Arc::clone(&levels);
        (Some(steps), levels)
    }

    fn may_rest_at(&self, steps: i64) -> bool {
        let mut state = self.state.0.lock().unwrap();
        let may_rest = self.is_rendered(steps);
        state.wanted = if may_rest { None } else { Some(steps) };
        self.state.1.notify_all();
        may_rest
    }

    fn render_what_is_wanted(&self) {
        let (state, changed) = &*self.state;
        let mut now = state.lock().unwrap();
        while !now.over {
            match now.wanted.filter(|steps| !self.is_rendered(*steps)) {
                None => now = changed.wait(now).unwrap(),
                Some(steps) => {
                    drop(now);
                    self.at(steps);
                    now = state.lock().unwrap();
                }
            }
        }
    }
}

impl Drop for Renderer {
    fn drop(&mut self) {
        self.scene.state.0.lock().unwrap().over = true;
        self.scene.state.1.notify_all();
        if let Some(thread) = self.thread.take() {
            thread.join().unwrap();
        }
    }
}
