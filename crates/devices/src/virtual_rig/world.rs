//! The world in front of the camera, in step with the stage.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicI64, Ordering};
use std::thread::JoinHandle;
use std::time::Duration;

use super::pictures::Pictures;
use crate::camera::{CameraError, Size, VideoOutput};
use crate::stage::simulator::{NativeDevice, Plant};
use epirig_simulator::Simulator;

/// Between two looks at the stage.
const LOOK: Duration = Duration::from_millis(2);
/// How long a picture may take until it is shown.
const PATIENCE: Duration = Duration::from_secs(1);
/// How long an output that has gone is left alone before it is tried again.
const PAUSE: Duration = Duration::from_millis(50);

/// The world in front of the camera, shown on a video output until it is dropped.
pub struct World {
    quit: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl World {
    /// Shows what `simulator` looks like from where `stage` stands, and keeps the stage in step with the pictures. Every picture of
    /// a stage at rest is the simulator's exposure number 0.
    ///
    /// # Errors
    /// [`CameraError`] if the output cannot be had now; one that goes later is waited for.
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
        let thread = std::thread::spawn(move || {
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
        });
        Ok(Self { quit, thread: Some(thread) })
    }
}

impl Drop for World {
    fn drop(&mut self) {
        self.quit.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            // A world that has broken down is as good as one that ends.
            let _ = thread.join();
        }
    }
}

/// A place of the carriage, in steps, or none.
#[derive(Debug, Clone)]
struct Place(Arc<AtomicI64>);

impl Place {
    const NONE: i64 = i64::MIN;

    fn get(&self) -> Option<i64> {
        Some(self.0.load(Ordering::SeqCst)).filter(|steps| *steps != Self::NONE)
    }

    fn set(&self, steps: Option<i64>) {
        self.0.store(steps.unwrap_or(Self::NONE), Ordering::SeqCst);
    }
}

impl Default for Place {
    fn default() -> Self {
        Self(Arc::new(AtomicI64::new(Self::NONE)))
    }
}

/// What stage and view know of each other.
#[derive(Debug, Clone, Default)]
struct Between {
    /// What is shown; none while the carriage moves.
    shown: Place,
    /// Where the carriage wants to come to rest.
    wanted: Place,
    /// Whether the output has gone, and the camera with it: a driver may give both back only when whoever moves the stage has let
    /// go of the camera, so that a stage that waited for its picture would wait for ever.
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
    /// When it was looked at last.
    steps_made: u64,
}

impl View {
    /// Shows what has changed, if anything has.
    fn refresh(&mut self, output: &mut VideoOutput) -> Result<(), CameraError> {
        let wanted = self.between.wanted.get();
        let steps = wanted.unwrap_or_else(|| self.plant.carriage_steps());
        let made = self.plant.steps_made();
        let moving = std::mem::replace(&mut self.steps_made, made) != made;
        if self.between.shown.get() == Some(steps) {
            // An output that goes must be let go, or it cannot come back.
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
