//! The scene in front of the camera, synchronised with the stage.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::Duration;

use super::pictures::Pictures;
use crate::camera::{CameraError, Size, VideoOutput};
use crate::stage::simulator::{NativeDevice, Plant};
use epirig_simulator::Simulator;

/// Interval of queries of the stage.
const LOOK: Duration = Duration::from_millis(2);
/// Longest time until a picture is shown.
const PATIENCE: Duration = Duration::from_secs(1);
/// Pause before a lost output is opened again.
const PAUSE: Duration = Duration::from_millis(50);

/// The scene in front of the camera, shown on a video output for its lifetime.
pub struct World {
    quit: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl World {
    /// Shows the view of `simulator` at the position of `stage`, and keeps the stage in step with the
    /// pictures. Every picture of a stage at rest is the simulator's exposure number 0.
    ///
    /// # Errors
    /// [`CameraError`] if the output cannot be opened; an output that is lost later is opened again.
    pub fn show(
        simulator: Arc<Simulator>,
        stage: &mut NativeDevice,
        output: &str,
    ) -> Result<Self, CameraError> {
        let optics = &simulator.config().optics;
        let size = Size { columns: optics.columns, rows: optics.rows };
        let mut there = Some(VideoOutput::open(output, size)?);
        let between = Between::default();
        let gate = between.clone();
        stage.rest_when(Box::new(move |steps| gate.may_rest_at(steps)));
        let mut view =
            View { pictures: Pictures::new(simulator), plant: stage.plant(), between, steps_made: 0 };
        let quit = Arc::new(AtomicBool::new(false));
        let (path, stop) = (output.to_owned(), Arc::clone(&quit));
        let show = move || {
            while !stop.load(Ordering::Relaxed) {
                there = match there.take() {
                    Some(mut output) => view.refresh(&mut output).is_ok().then_some(output),
                    None => {
                        view.between.shown.set(None);
                        std::thread::sleep(PAUSE);
                        let output = VideoOutput::open(&path, size).ok();
                        view.between.unseen.store(output.is_none(), Ordering::SeqCst);
                        output
                    }
                };
            }
        };
        let thread = std::thread::Builder::new().spawn(show).map_err(|error| CameraError::System {
            camera: output.to_owned(),
            action: "start the scene",
            detail: error.to_string(),
        })?;
        Ok(Self { quit, thread: Some(thread) })
    }
}

impl Drop for World {
    fn drop(&mut self) {
        self.quit.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            // A failed scene ends like a finished one.
            let _ = thread.join();
        }
    }
}

/// Position of the carriage in steps, or none.
#[derive(Debug, Clone, Default)]
struct Place(Arc<Mutex<Option<i64>>>);

impl Place {
    fn get(&self) -> Option<i64> {
        *self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn set(&self, steps: Option<i64>) {
        *self.0.lock().unwrap_or_else(PoisonError::into_inner) = steps;
    }
}

/// State shared by stage and view.
#[derive(Debug, Clone, Default)]
struct Between {
    /// The position shown; none while the carriage moves.
    shown: Place,
    /// The position at which the carriage will come to rest.
    wanted: Place,
    /// Whether the output has been lost, and with it the camera. A driver may restore both only when the
    /// program that moves the stage has closed the camera. So the stage must not wait for a picture then.
    unseen: Arc<AtomicBool>,
}

impl Between {
    /// Asked by the stage before its last step.
    fn may_rest_at(&self, steps: i64) -> bool {
        let may_rest = self.shown.get() == Some(steps) || self.unseen.load(Ordering::SeqCst);
        self.wanted.set(if may_rest { None } else { Some(steps) });
        may_rest
    }
}

struct View {
    pictures: Pictures,
    plant: Plant,
    between: Between,
    /// Steps at the latest query.
    steps_made: u64,
}

impl View {
    /// Shows a new picture if anything has changed.
    fn refresh(&mut self, output: &mut VideoOutput) -> Result<(), CameraError> {
        let wanted = self.between.wanted.get();
        let steps = wanted.unwrap_or_else(|| self.plant.carriage_steps());
        let made = self.plant.steps_made();
        let moving = std::mem::replace(&mut self.steps_made, made) != made;
        if self.between.shown.get() == Some(steps) {
            // A lost output must be closed, or it cannot return.
            output.check()?;
            std::thread::sleep(LOOK);
        } else if moving && wanted.is_none() {
            self.between.shown.set(None);
            if let Some(picture) = self.pictures.moving() {
                output.show(&picture, PATIENCE)?;
            }
        } else if output.show(&self.pictures.at(steps), PATIENCE)? {
            self.between.shown.set(Some(steps));
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::link::SimulatedLink;
    use crate::stage::native::NativeOptions;
    use crate::stage::{NativeStage, Stage};

    #[test]
    fn the_stage_comes_to_rest_when_its_picture_is_shown_and_answers_meanwhile() {
        let between = Between::default();
        let mut device = NativeDevice::default();
        let plant = device.plant();
        let gate = between.clone();
        // A view that needs a second: it shows what is wanted when it has been asked for 10 000 ticks.
        let mut questions = 0;
        device.rest_when(Box::new(move |steps| {
            questions += 1;
            if questions % 10_000 == 0 {
                gate.shown.set(Some(steps));
            }
            gate.may_rest_at(steps)
        }));
        let link = Box::new(SimulatedLink::new(device));
        let mut stage = NativeStage::connect(link, NativeOptions::default()).unwrap();
        stage.home().unwrap();
        assert_eq!(NativeDevice::mm_from_home(plant.carriage_steps()), 0.0);
        stage.move_to(12.5).unwrap();
        assert_eq!(NativeDevice::mm_from_home(plant.carriage_steps()), 12.5);
        assert_eq!(between.shown.get(), Some(plant.carriage_steps()));
        assert_eq!(between.wanted.get(), None);
    }

    #[test]
    fn without_an_output_the_stage_waits_for_no_picture() {
        let between = Between::default();
        assert!(!between.may_rest_at(7));
        assert_eq!(between.wanted.get(), Some(7));
        between.unseen.store(true, Ordering::SeqCst);
        assert!(between.may_rest_at(7));
        assert_eq!(between.wanted.get(), None);
    }
}
