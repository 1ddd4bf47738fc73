//! What the camera sees of the stage.

use std::collections::HashMap;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::Duration;

use super::in_step::{Between, InStep};
use crate::camera::{CameraError, Size, VideoOutput};
use crate::frame::{Frame, Samples};
use crate::stage::simulator::{NativeDevice, Plant};
use crate::twin::Twin;

/// Between two looks at the stage.
const LOOK: Duration = Duration::from_millis(1);
/// How long a picture may take until it is shown.
const PATIENCE: Duration = Duration::from_secs(1);
/// How long an output that has gone is left alone before it is tried again.
const PAUSE: Duration = Duration::from_millis(50);
/// Pictures that are remembered, so that a scan need not be rendered twice.
const REMEMBERED: usize = 256;
/// How far a moving picture is smeared, in px. Two values, so that no two of them in a row are alike.
const SMEARS: [usize; 2] = [9, 15];

/// The world in front of the camera, shown on a video output until it is dropped.
pub struct World {
    quit: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl World {
    /// Shows what `twin` looks like from where `stage` stands, and returns the stage as it must be played: in step with the
    /// pictures. Exposures are free of noise of their own: every picture is the twin's exposure number 0.
    ///
    /// # Errors
    /// [`CameraError`] if the output cannot be had now; one that goes later is waited for.
    pub fn show(twin: Arc<Twin>, stage: NativeDevice, output: &str) -> Result<(Self, InStep), CameraError> {
        let optics = &twin.config().optics;
        let size = Size { columns: optics.columns, rows: optics.rows };
        let open = VideoOutput::open(output, size)?;
        let between = Between::new();
        let quit = Arc::new(AtomicBool::new(false));
        let mut pictures = Pictures {
            twin,
            plant: stage.plant(),
            between: between.clone(),
            remembered: HashMap::new(),
            latest: None,
            smears: 0,
        };
        let (path, stop) = (output.to_owned(), Arc::clone(&quit));
        let thread = std::thread::spawn(move || {
            let mut output = Some(open);
            while !stop.load(Ordering::Relaxed) {
                output = match output.take() {
                    Some(mut there) => pictures.refresh(&mut there).is_ok().then_some(there),
                    None => {
                        pictures.between.show(None);
                        std::thread::sleep(PAUSE);
                        VideoOutput::open(&path, size).ok()
                    }
                };
            }
        });
        Ok((Self { quit, thread: Some(thread) }, InStep::new(stage, between)))
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

struct Pictures {
    twin: Arc<Twin>,
    plant: Plant,
    between: Between,
    remembered: HashMap<i64, Frame>,
    latest: Option<Frame>,
    smears: usize,
}

impl Pictures {
    /// Shows what has changed, if anything has.
    fn refresh(&mut self, output: &mut VideoOutput) -> Result<(), CameraError> {
        let moving = self.between.moving();
        let steps = self.plant.carriage_steps();
        if moving {
            self.between.show(None);
            if let Some(smeared) = self.smeared() {
                output.show(&smeared, PATIENCE)?;
            }
        } else if self.between.shown() != Some(steps) {
            let picture = self.at(steps);
            if output.show(&picture, PATIENCE)? && !self.between.moving() {
                self.latest = Some(picture);
                self.between.show(Some(steps));
            }
        } else {
            std::thread::sleep(LOOK);
        }
        Ok(())
    }

    fn at(&mut self, steps: i64) -> Frame {
        if self.remembered.len() >= REMEMBERED {
            self.remembered.clear();
        }
        let twin = &self.twin;
        let render = || twin.expose(NativeDevice::mm_from_home(steps), 0);
        self.remembered.entry(steps).or_insert_with(render).clone()
    }

    /// What a camera sees of a moving object.
    fn smeared(&mut self) -> Option<Frame> {
        let latest = self.latest.as_ref()?;
        self.smears += 1;
        let reach = SMEARS[self.smears % SMEARS.len()];
        let Samples::U8(samples) = latest.samples() else { return None };
        let mut smeared = Vec::with_capacity(samples.len());
        for row in samples.chunks_exact(latest.columns()) {
            let mut sum: u32 = row[..reach.min(row.len())].iter().map(|&sample| u32::from(sample)).sum();
            for x in 0..row.len() {
                smeared.push((sum / reach as u32).min(255) as u8);
                sum += row.get(x + reach).map_or(0, |&sample| u32::from(sample));
                sum -= u32::from(row[x]);
            }
        }
        Frame::new(latest.rows(), latest.columns(), latest.bit_depth(), Samples::U8(smeared)).ok()
    }
}
