//! A video device as presented by its driver.

mod controls;

use std::collections::HashSet;
use std::io;
use std::time::Duration;

use rustix::io::Errno;
use rustix::time::{ClockId, clock_gettime};
use v4l::v4l_sys as sys;

use super::discover::{cameras, identity, is_camera};
use super::failure::{broken, control_unread, control_unset, failed, is, unopened};
use super::kernel::{Buffers, Direction, Node, has_none, is_like};
use crate::camera::pixels::{FourCc, PixelFormat};
use crate::camera::{
    ActiveFormat, CameraError, CameraIdentity, Control, FilledBuffer, Interval, Moment, OfferedFormat, Size,
    StampSource, VideoDevice,
};

/// Longest single wait for a buffer: some drivers do not wake waiting programs when the device is lost.
const LOOK: Duration = Duration::from_millis(250);

/// Status flags of an input that mean there is no picture.
const SIGNAL_TROUBLES: &[(u32, &str)] = &[
    (sys::V4L2_IN_ST_NO_POWER, "no power"),
    (sys::V4L2_IN_ST_NO_SIGNAL, "no signal"),
    (sys::V4L2_IN_ST_NO_SYNC, "no synchronisation with its signal"),
    (sys::V4L2_IN_ST_NO_H_LOCK, "no horizontal synchronisation with its signal"),
    (sys::V4L2_IN_ST_NO_V_LOCK, "no vertical synchronisation with its signal"),
    (sys::V4L2_IN_ST_NO_STD_LOCK, "a signal of another standard than it is set for"),
];

/// A video device of this machine.
#[derive(Debug)]
pub struct V4l2Device {
    path: String,
    identity: CameraIdentity,
    /// Sockets of cameras that nothing but the socket tells apart from it.
    twins: Vec<String>,
    node: Node,
    stream: Option<Buffers>,
    /// A copy of the latest requested buffer.
    bytes: Vec<u8>,
    /// Controls with values of 64 bits.
    wide: HashSet<u32>,
}

impl V4l2Device {
    /// Opens a device by its path, which may be a symbolic link.
    ///
    /// # Errors
    /// [`CameraError`] if there is no such device, it is not a camera, or the user may not open it.
    pub fn open(path: &str) -> Result<Self, CameraError> {
        let node = Node::open(path).map_err(unopened(path))?;
        let capabilities = node.capabilities().map_err(|error| match error {
            error if has_none(&error) => CameraError::not_a_camera(path, "it is not a video device"),
            error => failed(path, "report what it is")(error),
        })?;
        if !is_camera(&capabilities) {
            let several_planes = capabilities.flags & sys::V4L2_CAP_VIDEO_CAPTURE_MPLANE != 0;
            let reason = if several_planes {
                "its driver gives images in several planes, which is not supported"
            } else {
                "it gives no images; a camera often has several nodes, so choose another one"
            };
            return Err(CameraError::not_a_camera(path, reason));
        }
        let identity = identity(path, Some(&capabilities));
        let twins = cameras()?.into_iter().filter(|other| other.is_twin_of(&identity));
        Ok(Self {
            path: path.to_owned(),
            twins: twins.map(|twin| twin.bus).collect(),
            identity,
            node,
            stream: None,
            bytes: Vec::new(),
            wide: HashSet::new(),
        })
    }

    /// The same camera, opened again. A twin that is away may come back.
    fn go_on_as(&mut self, mut device: Self) {
        device.twins.append(&mut self.twins);
        *self = device;
    }
}

fn active(format: sys::v4l2_pix_format) -> ActiveFormat {
    let four_cc = FourCc::from_u32(format.pixelformat);
    // Some drivers leave it out for rows without padding.
    let least = PixelFormat::from_four_cc(four_cc)
        .and_then(|pixels| pixels.least_stride(format.width as usize))
        .unwrap_or(0);
    let stride = if format.bytesperline == 0 { least } else { format.bytesperline as usize };
    // Some drivers ignore the request for progressive frames.
    let progressive = [sys::v4l2_field_V4L2_FIELD_NONE, sys::v4l2_field_V4L2_FIELD_ANY];
    ActiveFormat {
        four_cc,
        size: Size { columns: format.width as usize, rows: format.height as usize },
        stride,
        image_bytes: format.sizeimage as usize,
        interlaced: !progressive.contains(&format.field),
    }
}

fn stamp_source(flags: u32) -> StampSource {
    let monotonic = flags & sys::V4L2_BUF_FLAG_TIMESTAMP_MASK == sys::V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC;
    match flags & sys::V4L2_BUF_FLAG_TSTAMP_SRC_MASK {
        _ if !monotonic => StampSource::Unknown,
        sys::V4L2_BUF_FLAG_TSTAMP_SRC_SOE => StampSource::StartOfExposure,
        sys::V4L2_BUF_FLAG_TSTAMP_SRC_EOF => StampSource::EndOfFrame,
        _ => StampSource::Unknown,
    }
}

/// The present time on the clock of V4L2's time stamps.
fn monotonic() -> Moment {
    let time = clock_gettime(ClockId::Monotonic);
    let (seconds, nanoseconds) = (u64::try_from(time.tv_sec), u64::try_from(time.tv_nsec));
    Moment::from_ns(seconds.unwrap_or(0).saturating_mul(1_000_000_000) + nanoseconds.unwrap_or(0))
}

impl VideoDevice for V4l2Device {
    fn identity(&self) -> CameraIdentity {
        self.identity.clone()
    }

    fn now(&mut self) -> Moment {
        monotonic()
    }

    fn pause(&mut self, time: Duration) {
        std::thread::sleep(time);
    }

    fn offered(&mut self) -> Result<Vec<OfferedFormat>, CameraError> {
        let list = || -> io::Result<Vec<OfferedFormat>> {
            let mut offered = Vec::new();
            for (code, description) in self.node.formats()? {
                offered.push(OfferedFormat {
                    four_cc: FourCc::from_u32(code),
                    description,
                    sizes: self.node.sizes(code)?,
                });
            }
            Ok(offered)
        };
        list().map_err(failed(&self.path, "list its formats"))
    }

    fn active_format(&mut self) -> Result<ActiveFormat, CameraError> {
        self.node.format(Direction::Capture).map(active).map_err(failed(&self.path, "report its format"))
    }

    fn set_format(&mut self, four_cc: FourCc, size: Size) -> Result<ActiveFormat, CameraError> {
        let side = |side: usize| u32::try_from(side).unwrap_or(u32::MAX);
        self.node
            .set_format(Direction::Capture, four_cc.to_u32(), side(size.columns), side(size.rows))
            .map(active)
            .map_err(failed(&self.path, "set its format"))
    }

    fn interval(&mut self) -> Result<Option<Interval>, CameraError> {
        match self.node.interval() {
            Ok(interval) => Ok(interval.duration().map(|_| interval)),
            Err(error) if has_none(&error) || is(&error, Errno::NODATA) => Ok(None),
            Err(error) => Err(failed(&self.path, "report its rate")(error)),
        }
    }

    fn set_interval(&mut self, interval: Interval) -> Result<(), CameraError> {
        self.node.set_interval(interval).map_err(failed(&self.path, "set its rate"))
    }

    fn controls(&mut self) -> Result<Vec<Control>, CameraError> {
        self.list_controls()
    }

    fn read_control(&mut self, id: u32) -> Result<i64, CameraError> {
        let wide = self.wide.contains(&id);
        let read = self.node.control(id, wide);
        read.map_err(|error| control_unread(&self.path, self.control_name(id))(error))
    }

    fn read_controls(&mut self, ids: &[u32]) -> Result<Vec<i64>, CameraError> {
        let wanted: Vec<(u32, bool)> = ids.iter().map(|id| (*id, self.wide.contains(id))).collect();
        // Some drivers read only one at a time; reading each also finds the unreadable one.
        match self.node.several_controls(&wanted) {
            Ok(values) => Ok(values),
            Err(_) => ids.iter().map(|id| self.read_control(*id)).collect(),
        }
    }

    fn write_control(&mut self, id: u32, value: i64) -> Result<(), CameraError> {
        let wide = self.wide.contains(&id);
        let set = self.node.set_control(id, value, wide);
        set.map_err(|error| control_unset(&self.path, self.control_name(id), value)(error))
    }

    fn check_signal(&mut self) -> Result<(), CameraError> {
        let camera = self.identity.name();
        let lost = |what: String| Err(CameraError::NoSignal { camera: camera.clone(), what });
        let input = match self.node.input() {
            // A camera without inputs has no signal to lose.
            Err(error) if has_none(&error) => return Ok(()),
            input => input.map_err(failed(&self.path, "report the state of its input"))?,
        };
        if let Some((_, what)) = SIGNAL_TROUBLES.iter().find(|(flag, _)| input.status & flag != 0) {
            return lost((*what).to_owned());
        }
        if input.capabilities & sys::V4L2_IN_CAP_DV_TIMINGS == 0 {
            return Ok(());
        }
        // These structures are packed: their fields are copied, in braces where they would be borrowed.
        match (self.node.dv_timings(), self.node.arriving_dv_timings()) {
            (Ok(set), Ok(arriving)) if !is_like(&set, &arriving) => lost(format!(
                "a signal of {} x {} pixels at {:.2} MHz, but is set for {} x {} at {:.2} MHz",
                { arriving.width },
                { arriving.height },
                arriving.pixelclock as f64 * 1e-6,
                { set.width },
                { set.height },
                set.pixelclock as f64 * 1e-6
            )),
            (_, Err(error)) if is(&error, Errno::NOLINK) => lost("no signal".to_owned()),
            (_, Err(error)) if is(&error, Errno::NOLCK) => lost("an unstable signal".to_owned()),
            (_, Err(error)) if is(&error, Errno::RANGE) => {
                lost("a signal with timings that it cannot receive".to_owned())
            }
            // Drivers that do not report it, or not during streaming.
            _ => Ok(()),
        }
    }

    fn start(&mut self, buffers: usize) -> Result<usize, CameraError> {
        // The remains of a failed stream are dropped; the start shows whether the device works.
        let _ = self.stop();
        let get = "get buffers";
        let mut stream =
            Buffers::request(&self.node, Direction::Capture, buffers).map_err(broken(&self.path, get))?;
        let queued = (0..stream.count()).try_for_each(|index| stream.queue(&self.node, index, 0));
        if let Err(error) = queued.and_then(|()| stream.start(&self.node)) {
            // The first error is reported.
            let _ = stream.release(&self.node);
            return Err(broken(&self.path, "start its stream")(error));
        }
        let made = stream.count();
        self.stream = Some(stream);
        Ok(made)
    }

    fn stop(&mut self) -> Result<(), CameraError> {
        let Some(stream) = self.stream.take() else { return Ok(()) };
        stream.release(&self.node).map_err(broken(&self.path, "stop its stream"))
    }

    fn dequeue(&mut self, patience: Duration) -> Result<Option<FilledBuffer>, CameraError> {
        let until = monotonic().after(patience);
        let Some(stream) = &mut self.stream else {
            return Err(CameraError::NotStarted(self.path.clone()));
        };
        loop {
            let taken = stream.dequeue(&self.node).map_err(broken(&self.path, "take a buffer"))?;
            let now = monotonic();
            if let Some(taken) = taken {
                let seconds = u64::try_from(taken.timestamp.tv_sec).unwrap_or(0);
                let microseconds = u64::try_from(taken.timestamp.tv_usec).unwrap_or(0);
                let ns =
                    seconds.saturating_mul(1_000_000_000).saturating_add(microseconds.saturating_mul(1000));
                return Ok(Some(FilledBuffer {
                    index: taken.index as usize,
                    bytes_used: taken.bytesused as usize,
                    stamp: Moment::from_ns(ns),
                    stamp_source: stamp_source(taken.flags),
                    sequence: taken.sequence,
                    flags: taken.flags,
                    damaged: taken.flags & sys::V4L2_BUF_FLAG_ERROR != 0,
                    received: now,
                }));
            }
            if now >= until {
                return Ok(None);
            }
            let wait = LOOK.min(until.since(now));
            let woken = self.node.wait(Direction::Capture, wait).map_err(broken(&self.path, "wait"))?;
            if woken {
                // A failing device wakes at once without a buffer; this prevents a busy loop.
                std::thread::sleep(Duration::from_micros(50));
            }
        }
    }

    fn bytes(&mut self, buffer: &FilledBuffer) -> Result<&[u8], CameraError> {
        let stream = self.stream.as_ref();
        let copied =
            stream.is_some_and(|stream| stream.copy(buffer.index, buffer.bytes_used, &mut self.bytes));
        if copied {
            return Ok(&self.bytes);
        }
        let (camera, detail) = (self.path.clone(), "it no longer exists".to_owned());
        Err(CameraError::Stream { camera, action: "read a buffer", detail })
    }

    fn requeue(&mut self, buffer: FilledBuffer) -> Result<(), CameraError> {
        match &mut self.stream {
            None => Err(CameraError::NotStarted(self.path.clone())),
            Some(stream) => {
                stream.queue(&self.node, buffer.index, 0).map_err(broken(&self.path, "give a buffer back"))
            }
        }
    }

    fn let_go(&mut self) {
        // The device is lost, so a failing stop is no new error.
        let _ = self.stop();
        self.node.close();
    }

    fn reopen(&mut self) -> Result<(), CameraError> {
        self.let_go();
        let connected = cameras()?;
        let Some(found) = self.identity.returned(&self.twins, &connected)? else {
            return match Self::open(&self.path) {
                Ok(other) if !other.identity.is_same_as(&self.identity) => Err(CameraError::AnotherCamera {
                    path: self.path.clone(),
                    expected: self.identity.to_string(),
                    found: other.identity.to_string(),
                }),
                Ok(same) => {
                    self.go_on_as(same);
                    Ok(())
                }
                Err(_) => Err(CameraError::Gone(self.path.clone())),
            };
        };
        // Links point to it as before; a bare number may have changed.
        let path = found.path.as_ref().unwrap_or(&self.path);
        let still = Self::open(&self.path).ok().filter(|here| here.identity.is_same_as(found));
        let device = match still {
            Some(here) => here,
            None => Self::open(path)?,
        };
        self.go_on_as(device);
        Ok(())
    }
}

impl Drop for V4l2Device {
    fn drop(&mut self) {
        // The error cannot be reported; the kernel frees everything when the file is closed.
        let _ = self.stop();
    }
}
