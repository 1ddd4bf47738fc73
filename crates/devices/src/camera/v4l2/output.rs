//! A video output: a camera that is looped back to it sees its pictures.

use std::io;
use std::time::{Duration, Instant};

use super::failure::{broken, failed, unopened};
use super::kernel::{Buffers, Direction, Node};
use crate::camera::pixels::FourCc;
use crate::camera::{CameraError, Size};
use epirig_core::frame::{Frame, Samples};

/// One buffer is shown, one waits, one is written.
const BUFFERS: usize = 3;
/// Drivers need two pictures to start.
const TO_START: usize = 2;

/// A video output such as those of the kernel's `vivid` or `v4l2loopback` drivers. It shows 8-bit grey
/// pictures, each until the next.
#[derive(Debug)]
pub struct VideoOutput {
    path: String,
    node: Node,
    size: Size,
    stride: usize,
    image_bytes: usize,
    buffers: Option<Buffers>,
}

impl VideoOutput {
    /// Opens an output, and sets it to grey pictures of `size`.
    ///
    /// # Errors
    /// [`CameraError`] if there is no such device, it is not an output, or it takes another format.
    pub fn open(path: &str, size: Size) -> Result<Self, CameraError> {
        let node = Node::open(path).map_err(unopened(path))?;
        let grey = FourCc(*b"GREY");
        let side = |side: usize| u32::try_from(side).unwrap_or(u32::MAX);
        let format = node
            .set_format(Direction::Output, grey.to_u32(), side(size.columns), side(size.rows))
            .map_err(failed(path, "show pictures"))?;
        let got = Size { columns: format.width as usize, rows: format.height as usize };
        if (format.pixelformat, got) != (grey.to_u32(), size) {
            let got = format!("{} {got}", FourCc::from_u32(format.pixelformat));
            return Err(CameraError::substituted(path, format!("{grey} {size}"), got));
        }
        if (format.bytesperline as usize) < size.columns {
            let reason = "its driver reports rows that are shorter than the width of its pictures";
            return Err(CameraError::not_a_camera(path, reason));
        }
        Ok(Self {
            path: path.to_owned(),
            node,
            size,
            stride: format.bytesperline as usize,
            image_bytes: format.sizeimage as usize,
            buffers: None,
        })
    }

    /// Shows a picture, and returns when it is on the output: all later frames of the camera show it. `false`
    /// after the time-out `patience`.
    ///
    /// # Errors
    /// [`CameraError`] if the picture has another size, or the output is lost.
    pub fn show(&mut self, frame: &Frame, patience: Duration) -> Result<bool, CameraError> {
        let shape = Size { columns: frame.columns(), rows: frame.rows() };
        let Samples::U8(samples) = frame.samples() else {
            return Err(self.unfit("pictures of more than 8 bit"));
        };
        if shape != self.size {
            return Err(self.unfit("pictures of another size"));
        }
        let until = Instant::now() + patience;
        self.exchange(samples, until).map_err(broken(&self.path, "show a picture"))
    }

    /// Whether the output still exists.
    ///
    /// # Errors
    /// [`CameraError::Gone`] if it does not.
    pub fn check(&self) -> Result<(), CameraError> {
        self.node.capabilities().map(|_| ()).map_err(failed(&self.path, "report what it is"))
    }

    fn unfit(&self, what: &str) -> CameraError {
        let offered = format!("GREY {}", self.size);
        CameraError::not_offered(&self.path, format!("way to show {what}"), offered)
    }

    fn exchange(&mut self, samples: &[u8], until: Instant) -> io::Result<bool> {
        let started = self.buffers.is_some();
        let mut buffers = match self.buffers.take() {
            Some(buffers) => buffers,
            None => Buffers::request(&self.node, Direction::Output, BUFFERS)?,
        };
        let copies = if started { 1 } else { TO_START };
        let shown = self.write(&mut buffers, samples, copies, started, until);
        self.buffers = Some(buffers);
        shown
    }

    fn write(
        &self,
        buffers: &mut Buffers,
        samples: &[u8],
        copies: usize,
        started: bool,
        until: Instant,
    ) -> io::Result<bool> {
        for _ in 0..copies {
            while buffers.free().next().is_none() {
                if !self.take_back(buffers, until)? {
                    return Ok(false);
                }
            }
            let Some(index) = buffers.free().next() else { return Ok(false) };
            if let Some(bytes) = buffers.bytes_mut(index) {
                let rows = bytes.chunks_mut(self.stride.max(1)).zip(samples.chunks(self.size.columns));
                rows.for_each(|(row, samples)| row[..samples.len()].copy_from_slice(samples));
            }
            buffers.queue(&self.node, index, self.image_bytes)?;
        }
        if !started {
            buffers.start(&self.node)?;
        }
        // The driver keeps the shown picture until there is another: if it has only this one, it is shown.
        while buffers.count() - buffers.free().count() > 1 {
            if !self.take_back(buffers, until)? {
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// Takes back a buffer that is no longer shown; `false` after the time-out.
    fn take_back(&self, buffers: &mut Buffers, until: Instant) -> io::Result<bool> {
        loop {
            if buffers.dequeue(&self.node)?.is_some() {
                return Ok(true);
            }
            let left = until.saturating_duration_since(Instant::now());
            if left.is_zero() {
                return Ok(false);
            }
            if self.node.wait(Direction::Output, left.min(Duration::from_millis(100)))? {
                // A failing device wakes at once without a buffer; this prevents a busy loop.
                std::thread::sleep(Duration::from_micros(50));
            }
        }
    }
}

impl Drop for VideoOutput {
    fn drop(&mut self) {
        if let Some(buffers) = self.buffers.take() {
            // The error cannot be reported; the kernel frees everything when the file is closed.
            let _ = buffers.release(&self.node);
        }
    }
}
