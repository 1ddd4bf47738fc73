//! The kernel's calls for video devices: the only unsafe code of the program.
//!
//! Everything that leaves this file is safe: plain values, and slices of buffers that the driver does not own at the moment. The
//! structures and most call numbers are those of crate `v4l`, generated from the kernel's own header.

#![allow(
    unsafe_code,
    reason = "calls of the kernel and memory that it maps; each block says why it is sound"
)]

use std::fs::{File, OpenOptions};
use std::io;
use std::mem::size_of;
use std::os::fd::{AsFd, AsRawFd};
use std::os::unix::fs::OpenOptionsExt;
use std::ptr::NonNull;
use std::time::Duration;

use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::fs::OFlags;
use rustix::io::Errno;
use v4l::v4l_sys as sys;
use v4l::v4l2::{self, vidioc};

use super::failure::is;

/// A call number: direction, size of the argument, `V`, number.
type Request = vidioc::_IOC_TYPE;

/// Where a call number holds the size of its argument.
const SIZE_SHIFT: u32 = 16;
const SIZE_MASK: Request = 0x3fff;
const READ: Request = 2;
const DIRECTION_SHIFT: u32 = 30;

/// `VIDIOC_G_DV_TIMINGS` and `VIDIOC_QUERY_DV_TIMINGS`, which the crate leaves out.
const GET_DV_TIMINGS: Request = request(READ | 1, 88, size_of::<sys::v4l2_dv_timings>());
const QUERY_DV_TIMINGS: Request = request(READ, 99, size_of::<sys::v4l2_dv_timings>());

/// Present values, of controls of any class.
const CURRENT_VALUES: u32 = 0;
const MEMORY_MAPPED: u32 = 1;
const NEXT_CONTROL: u32 = 0x8000_0000 | 0x4000_0000;

const fn request(direction: Request, number: Request, size: usize) -> Request {
    direction << DIRECTION_SHIFT | (size as Request) << SIZE_SHIFT | (b'V' as Request) << 8 | number
}

/// What buffers are for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u32)]
pub(super) enum Direction {
    Capture = 1,
    Output = 2,
}

/// `struct v4l2_capability`.
#[derive(Debug, Clone)]
pub(super) struct Capabilities {
    pub(super) driver: String,
    pub(super) card: String,
    pub(super) bus: String,
    /// Of this node, not of the whole device.
    pub(super) flags: u32,
}

/// `struct v4l2_pix_format`.
#[derive(Debug, Clone, Copy)]
pub(super) struct PixFormat {
    pub(super) four_cc: u32,
    pub(super) columns: u32,
    pub(super) rows: u32,
    pub(super) stride: u32,
    pub(super) image_bytes: u32,
    pub(super) field: u32,
}

/// An answer of `VIDIOC_ENUM_FRAMESIZES`: columns and rows.
#[derive(Debug, Clone, Copy)]
pub(super) enum FrameSize {
    Discrete((u32, u32)),
    Range { least: (u32, u32), greatest: (u32, u32), step: (u32, u32) },
}

/// `struct v4l2_query_ext_ctrl`.
#[derive(Debug, Clone)]
pub(super) struct ControlQuery {
    pub(super) id: u32,
    pub(super) kind: u32,
    pub(super) name: String,
    pub(super) minimum: i64,
    pub(super) maximum: i64,
    pub(super) step: u64,
    pub(super) default: i64,
    pub(super) flags: u32,
    pub(super) elements: u32,
}

/// `struct v4l2_input`.
#[derive(Debug, Clone, Copy)]
pub(super) struct InputState {
    pub(super) status: u32,
    pub(super) capabilities: u32,
}

/// What counts of `struct v4l2_bt_timings`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct DvTimings {
    pub(super) columns: u32,
    pub(super) rows: u32,
    pub(super) interlaced: u32,
    pub(super) pixel_clock_hz: u64,
}

/// What counts of `struct v4l2_buffer`.
#[derive(Debug, Clone, Copy)]
pub(super) struct Dequeued {
    pub(super) index: usize,
    pub(super) bytes_used: usize,
    pub(super) flags: u32,
    pub(super) stamp_ns: u64,
    pub(super) sequence: u32,
}

/// A video device, open until it is closed; calls do not block.
#[derive(Debug)]
pub(super) struct Node(Option<File>);

/// A structure of the kernel's with all bytes zero.
fn zeroed<T: KernelStruct>() -> T {
    // SAFETY: `KernelStruct` is implemented for structures of integers, raw pointers and unions of these only; zero is a value of
    // each of them.
    unsafe { std::mem::zeroed() }
}

/// Structures that the kernel's calls take.
///
/// # Safety
/// They consist of integers, raw pointers and unions of these.
unsafe trait KernelStruct {}

macro_rules! kernel_structs {
    ($($name:ident),*) => { $(
        // SAFETY: a C structure of the kernel's header, in which there are only numbers, raw pointers and unions of them.
        unsafe impl KernelStruct for sys::$name {}
    )* };
}
kernel_structs!(
    v4l2_capability,
    v4l2_fmtdesc,
    v4l2_frmsizeenum,
    v4l2_frmivalenum,
    v4l2_format,
    v4l2_streamparm,
    v4l2_input,
    v4l2_dv_timings,
    v4l2_query_ext_ctrl,
    v4l2_querymenu,
    v4l2_ext_control,
    v4l2_ext_controls,
    v4l2_requestbuffers,
    v4l2_buffer
);
// SAFETY: a number.
unsafe impl KernelStruct for std::os::raw::c_int {}

fn text(bytes: &[u8]) -> String {
    let end = bytes.iter().position(|&byte| byte == 0).unwrap_or(bytes.len());
    String::from_utf8_lossy(&bytes[..end]).trim().to_owned()
}

impl Node {
    /// Opens a device file.
    pub(super) fn open(path: &str) -> io::Result<Self> {
        let flags = (OFlags::NONBLOCK | OFlags::CLOEXEC).bits() as i32;
        OpenOptions::new().read(true).write(true).custom_flags(flags).open(path).map(|file| Self(Some(file)))
    }

    /// Closes the device: every call fails from now on, as if it had gone.
    pub(super) fn close(&mut self) {
        self.0 = None;
    }

    fn file(&self) -> io::Result<&File> {
        self.0.as_ref().ok_or_else(|| Errno::NODEV.into())
    }

    fn call<T: KernelStruct>(&self, request: Request, argument: &mut T) -> io::Result<()> {
        if (request >> SIZE_SHIFT & SIZE_MASK) as usize != size_of::<T>() {
            return Err(io::Error::other("a call of the kernel with an argument of another size"));
        }
        let file = self.file()?.as_raw_fd();
        loop {
            // SAFETY: the call number holds the size of the argument, which is that of `T` as just checked, so the kernel stays within
            // `argument`, which is borrowed exclusively. Where `T` holds a pointer (extended controls, string controls), the
            // caller in this file points it at what it borrows for longer than the call, or leaves it zero.
            let done = unsafe { v4l2::ioctl(file, request, std::ptr::from_mut(argument).cast()) };
            match done {
                Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                done => return done,
            }
        }
    }

    /// Waits until buffers can be exchanged or something has happened; whether it has.
    pub(super) fn wait(&self, direction: Direction, patience: Duration) -> io::Result<bool> {
        let events = match direction {
            Direction::Capture => PollFlags::IN,
            Direction::Output => PollFlags::OUT,
        };
        let mut files = [PollFd::from_borrowed_fd(self.file()?.as_fd(), events)];
        let patience = Timespec::try_from(patience).map_err(io::Error::other)?;
        match poll(&mut files, Some(&patience)) {
            // Interrupted: the caller looks at its own clock.
            Err(Errno::INTR) => Ok(false),
            Err(error) => Err(error.into()),
            Ok(count) => Ok(count > 0),
        }
    }

    pub(super) fn capabilities(&self) -> io::Result<Capabilities> {
        let mut found: sys::v4l2_capability = zeroed();
        self.call(vidioc::VIDIOC_QUERYCAP, &mut found)?;
        let flags = if found.capabilities & sys::V4L2_CAP_DEVICE_CAPS != 0 {
            found.device_caps
        } else {
            found.capabilities
        };
        Ok(Capabilities {
            driver: text(&found.driver),
            card: text(&found.card),
            bus: text(&found.bus_info),
            flags,
        })
    }

    /// Formats that the device offers: code and description.
    pub(super) fn formats(&self) -> io::Result<Vec<(u32, String)>> {
        enumerate(|index| {
            let mut found = sys::v4l2_fmtdesc { index, type_: Direction::Capture as u32, ..zeroed() };
            self.call(vidioc::VIDIOC_ENUM_FMT, &mut found)?;
            Ok((found.pixelformat, text(&found.description)))
        })
    }

    pub(super) fn frame_sizes(&self, four_cc: u32) -> io::Result<Vec<FrameSize>> {
        enumerate(|index| {
            let mut found = sys::v4l2_frmsizeenum { index, pixel_format: four_cc, ..zeroed() };
            self.call(vidioc::VIDIOC_ENUM_FRAMESIZES, &mut found)?;
            let sizes = found.__bindgen_anon_1;
            // SAFETY: all members of the union are structures of u32, valid whatever was written.
            let (discrete, range) = unsafe { (sizes.discrete, sizes.stepwise) };
            Ok(if found.type_ == sys::v4l2_frmsizetypes_V4L2_FRMSIZE_TYPE_DISCRETE {
                FrameSize::Discrete((discrete.width, discrete.height))
            } else {
                FrameSize::Range {
                    least: (range.min_width, range.min_height),
                    greatest: (range.max_width, range.max_height),
                    step: (range.step_width, range.step_height),
                }
            })
        })
    }

    /// Intervals of a discrete size, as fractions of a second; of a range of intervals the shortest and the longest.
    pub(super) fn intervals(&self, four_cc: u32, columns: u32, rows: u32) -> io::Result<Vec<(u32, u32)>> {
        let found = enumerate(|index| {
            let mut found = sys::v4l2_frmivalenum {
                index,
                pixel_format: four_cc,
                width: columns,
                height: rows,
                ..zeroed()
            };
            self.call(vidioc::VIDIOC_ENUM_FRAMEINTERVALS, &mut found)?;
            let intervals = found.__bindgen_anon_1;
            // SAFETY: all members of the union are structures of u32, valid whatever was written.
            let (discrete, range) = unsafe { (intervals.discrete, intervals.stepwise) };
            let both =
                [(range.min.numerator, range.min.denominator), (range.max.numerator, range.max.denominator)];
            Ok(if found.type_ == sys::v4l2_frmivaltypes_V4L2_FRMIVAL_TYPE_DISCRETE {
                vec![(discrete.numerator, discrete.denominator)]
            } else {
                both.to_vec()
            })
        })?;
        Ok(found.concat())
    }

    pub(super) fn format(&self, direction: Direction) -> io::Result<PixFormat> {
        let mut format = sys::v4l2_format { type_: direction as u32, ..zeroed() };
        self.call(vidioc::VIDIOC_G_FMT, &mut format)?;
        Ok(pix_format(&format))
    }

    /// Asks for a progressive format, and returns what the driver took.
    pub(super) fn set_format(
        &self,
        direction: Direction,
        four_cc: u32,
        columns: u32,
        rows: u32,
    ) -> io::Result<PixFormat> {
        let mut format = sys::v4l2_format { type_: direction as u32, ..zeroed() };
        format.fmt.pix = sys::v4l2_pix_format {
            width: columns,
            height: rows,
            pixelformat: four_cc,
            field: sys::v4l2_field_V4L2_FIELD_NONE,
            ..pixels_of(&zeroed())
        };
        self.call(vidioc::VIDIOC_S_FMT, &mut format)?;
        Ok(pix_format(&format))
    }

    /// Time per frame, as a fraction of a second.
    pub(super) fn interval(&self) -> io::Result<(u32, u32)> {
        let mut parameters = sys::v4l2_streamparm { type_: Direction::Capture as u32, ..zeroed() };
        self.call(vidioc::VIDIOC_G_PARM, &mut parameters)?;
        // SAFETY: the members of the union are structures of u32 and bytes, valid whatever was written.
        let interval = unsafe { parameters.parm.capture.timeperframe };
        Ok((interval.numerator, interval.denominator))
    }

    pub(super) fn set_interval(&self, numerator: u32, denominator: u32) -> io::Result<()> {
        let mut parameters = sys::v4l2_streamparm { type_: Direction::Capture as u32, ..zeroed() };
        parameters.parm.capture.timeperframe = sys::v4l2_fract { numerator, denominator };
        self.call(vidioc::VIDIOC_S_PARM, &mut parameters)
    }

    /// The state of the selected input.
    pub(super) fn input(&self) -> io::Result<InputState> {
        let mut index: std::os::raw::c_int = 0;
        self.call(vidioc::VIDIOC_G_INPUT, &mut index)?;
        let mut input = sys::v4l2_input { index: index as u32, ..zeroed() };
        self.call(vidioc::VIDIOC_ENUMINPUT, &mut input)?;
        Ok(InputState { status: input.status, capabilities: input.capabilities })
    }

    /// The timings that the input is set for.
    pub(super) fn dv_timings(&self) -> io::Result<DvTimings> {
        self.timings(GET_DV_TIMINGS)
    }

    /// The timings of the signal that arrives.
    pub(super) fn arriving_dv_timings(&self) -> io::Result<DvTimings> {
        self.timings(QUERY_DV_TIMINGS)
    }

    fn timings(&self, request: Request) -> io::Result<DvTimings> {
        let mut timings: sys::v4l2_dv_timings = zeroed();
        self.call(request, &mut timings)?;
        // SAFETY: the members of the union are structures of numbers, valid whatever was written. They are packed: fields are copied.
        let bt = unsafe { timings.__bindgen_anon_1.bt };
        Ok(DvTimings {
            columns: bt.width,
            rows: bt.height,
            interlaced: bt.interlaced,
            pixel_clock_hz: bt.pixelclock,
        })
    }

    /// The control after `id`, of any kind; `None` after the last.
    pub(super) fn next_control(&self, id: u32) -> io::Result<Option<ControlQuery>> {
        let mut found = sys::v4l2_query_ext_ctrl { id: id | NEXT_CONTROL, ..zeroed() };
        match self.call(vidioc::VIDIOC_QUERY_EXT_CTRL, &mut found) {
            // No more, or none at all.
            Err(error) if has_none(&error) => return Ok(None),
            done => done?,
        }
        Ok(Some(ControlQuery {
            id: found.id,
            kind: found.type_,
            name: text(&found.name.map(|character| character as u8)),
            minimum: found.minimum,
            maximum: found.maximum,
            step: found.step,
            default: found.default_value,
            flags: found.flags,
            elements: found.elems,
        }))
    }

    /// The name of a menu's item; the number, for a menu of numbers. `None` for an item that is left out.
    pub(super) fn menu_item(&self, id: u32, index: u32, of_numbers: bool) -> Option<String> {
        let mut found = sys::v4l2_querymenu { id, index, ..zeroed() };
        self.call(vidioc::VIDIOC_QUERYMENU, &mut found).ok()?;
        // SAFETY: the members of the union are bytes and a number, valid whatever was written. It is packed: they are copied.
        let (name, value) = unsafe { (found.__bindgen_anon_1.name, found.__bindgen_anon_1.value) };
        Some(if of_numbers { value.to_string() } else { text(&name) })
    }

    pub(super) fn control(&self, id: u32, wide: bool) -> io::Result<i64> {
        let mut control = sys::v4l2_ext_control { id, ..zeroed() };
        self.exchange_control(vidioc::VIDIOC_G_EXT_CTRLS, &mut control)?;
        let value = control.__bindgen_anon_1;
        // SAFETY: the union is of numbers and pointers; as a number it is valid whatever was written. It is packed: it is copied.
        Ok(unsafe { if wide { value.value64 } else { i64::from(value.value) } })
    }

    pub(super) fn set_control(&self, id: u32, value: i64, wide: bool) -> io::Result<()> {
        let mut control = sys::v4l2_ext_control { id, ..zeroed() };
        if wide {
            control.__bindgen_anon_1.value64 = value;
        } else {
            // Masks of 32 bits are signed here.
            control.__bindgen_anon_1.value = value as i32;
        }
        self.exchange_control(vidioc::VIDIOC_S_EXT_CTRLS, &mut control)
    }

    /// The control has no payload, so that the kernel follows no pointer in it.
    fn exchange_control(&self, request: Request, control: &mut sys::v4l2_ext_control) -> io::Result<()> {
        let mut controls = sys::v4l2_ext_controls { count: 1, controls: control, ..zeroed() };
        controls.__bindgen_anon_1.which = CURRENT_VALUES;
        self.call(request, &mut controls)
    }

    fn switch_stream(&self, direction: Direction, on: bool) -> io::Result<()> {
        let mut kind = direction as std::os::raw::c_int;
        self.call(if on { vidioc::VIDIOC_STREAMON } else { vidioc::VIDIOC_STREAMOFF }, &mut kind)
    }

    fn request_buffers(&self, direction: Direction, count: usize) -> io::Result<usize> {
        let mut wanted = sys::v4l2_requestbuffers {
            count: u32::try_from(count).unwrap_or(u32::MAX),
            type_: direction as u32,
            memory: MEMORY_MAPPED,
            ..zeroed()
        };
        self.call(vidioc::VIDIOC_REQBUFS, &mut wanted)?;
        Ok(wanted.count as usize)
    }

    fn buffer(&self, direction: Direction, index: usize) -> sys::v4l2_buffer {
        sys::v4l2_buffer { index: index as u32, type_: direction as u32, memory: MEMORY_MAPPED, ..zeroed() }
    }
}

/// Asks with rising indices until there is no more; a device that knows no such list has none.
fn enumerate<T>(mut ask: impl FnMut(u32) -> io::Result<T>) -> io::Result<Vec<T>> {
    /// No list of a driver is longer; one without end would be.
    const LONGEST: u32 = 1024;
    let mut found = Vec::new();
    for index in 0..LONGEST {
        match ask(index) {
            Ok(item) => found.push(item),
            Err(error) if has_none(&error) => break,
            Err(error) => return Err(error),
        }
    }
    Ok(found)
}

/// Whether an error says that there is no such thing, or no such call.
fn has_none(error: &io::Error) -> bool {
    is(error, Errno::INVAL) || is(error, Errno::NOTTY)
}

fn pixels_of(format: &sys::v4l2_format) -> sys::v4l2_pix_format {
    // SAFETY: the members of the union are structures of numbers and bytes (and, of overlays, raw pointers), valid whatever was
    // written; of capture and output devices it is this one.
    unsafe { format.fmt.pix }
}

fn pix_format(format: &sys::v4l2_format) -> PixFormat {
    let pixels = pixels_of(format);
    PixFormat {
        four_cc: pixels.pixelformat,
        columns: pixels.width,
        rows: pixels.height,
        stride: pixels.bytesperline,
        image_bytes: pixels.sizeimage,
        field: pixels.field,
    }
}

/// Memory of a driver's buffer in this process.
#[derive(Debug)]
struct Mapping {
    start: NonNull<u8>,
    length: usize,
}

// SAFETY: the mapping is memory like any other, owned by this value alone.
unsafe impl Send for Mapping {}

impl Mapping {
    fn of(node: &Node, buffer: &sys::v4l2_buffer) -> io::Result<Self> {
        let length = buffer.length as usize;
        // SAFETY: the members of the union are numbers and raw pointers; of mapped buffers it is the offset.
        let offset = unsafe { buffer.m.offset };
        let file = node.file()?.as_raw_fd();
        // SAFETY: a new mapping at a place of the kernel's choice touches no memory of ours; what it returns is `length` bytes long
        // until it is unmapped.
        let start = unsafe {
            v4l2::mmap(std::ptr::null_mut(), length, mmap::READ_WRITE, mmap::SHARED, file, offset.into())?
        };
        let start =
            NonNull::new(start.cast()).ok_or_else(|| io::Error::other("a buffer was mapped nowhere"))?;
        Ok(Self { start, length })
    }
}

/// Numbers of `mmap`, the same on all Linux machines.
mod mmap {
    pub(super) const READ_WRITE: i32 = 3;
    pub(super) const SHARED: i32 = 1;
}

impl Drop for Mapping {
    fn drop(&mut self) {
        // SAFETY: the mapping was made by `of`, has this start and length, and no slice of it outlives `self`. It fails for
        // mappings that are none only.
        let _ = unsafe { v4l2::munmap(self.start.as_ptr().cast(), self.length) };
    }
}

/// The buffers of a stream.
#[derive(Debug)]
pub(super) struct Buffers {
    direction: Direction,
    mappings: Vec<Mapping>,
    /// Which buffers the driver owns.
    queued: Vec<bool>,
}

impl Buffers {
    /// Asks the driver for buffers and maps them; it may make more or fewer.
    pub(super) fn request(node: &Node, direction: Direction, count: usize) -> io::Result<Self> {
        let made = node.request_buffers(direction, count)?;
        let mut mappings = Vec::with_capacity(made);
        for index in 0..made {
            let mut buffer = node.buffer(direction, index);
            let mapped =
                node.call(vidioc::VIDIOC_QUERYBUF, &mut buffer).and_then(|()| Mapping::of(node, &buffer));
            match mapped {
                Ok(mapping) => mappings.push(mapping),
                Err(error) => {
                    drop(mappings);
                    // What was wrong is told already.
                    let _ = node.request_buffers(direction, 0);
                    return Err(error);
                }
            }
        }
        Ok(Self { direction, queued: vec![false; made], mappings })
    }

    pub(super) fn count(&self) -> usize {
        self.mappings.len()
    }

    /// Indices of buffers that are ours.
    pub(super) fn free(&self) -> impl Iterator<Item = usize> + '_ {
        (0..self.count()).filter(|&index| !self.queued[index])
    }

    /// Gives a buffer to the driver. `bytes_used` counts for output only.
    pub(super) fn queue(&mut self, node: &Node, index: usize, bytes_used: usize) -> io::Result<()> {
        let Some(queued) = self.queued.get_mut(index).filter(|queued| !**queued) else {
            return Err(io::Error::other("the buffer is the driver's already"));
        };
        let mut buffer = node.buffer(self.direction, index);
        buffer.bytesused = u32::try_from(bytes_used).unwrap_or(u32::MAX);
        buffer.field = sys::v4l2_field_V4L2_FIELD_NONE;
        // Before the call: if it fails half-way, the memory must not be read as ours.
        *queued = true;
        let done = node.call(vidioc::VIDIOC_QBUF, &mut buffer);
        if done.is_err() {
            *queued = false;
        }
        done
    }

    /// Takes a buffer that the driver is done with; `None` if there is none now.
    pub(super) fn dequeue(&mut self, node: &Node) -> io::Result<Option<Dequeued>> {
        let mut buffer = node.buffer(self.direction, 0);
        match node.call(vidioc::VIDIOC_DQBUF, &mut buffer) {
            Err(error) if error.kind() == io::ErrorKind::WouldBlock => return Ok(None),
            done => done?,
        }
        let index = buffer.index as usize;
        let (Some(queued), Some(mapping)) = (self.queued.get_mut(index), self.mappings.get(index)) else {
            return Err(io::Error::other("the driver returned a buffer that there is not"));
        };
        *queued = false;
        let seconds = u64::try_from(buffer.timestamp.tv_sec).unwrap_or(0);
        let microseconds = u64::try_from(buffer.timestamp.tv_usec).unwrap_or(0);
        Ok(Some(Dequeued {
            index,
            bytes_used: (buffer.bytesused as usize).min(mapping.length),
            flags: buffer.flags,
            stamp_ns: seconds.saturating_mul(1_000_000_000).saturating_add(microseconds.saturating_mul(1000)),
            sequence: buffer.sequence,
        }))
    }

    /// The bytes of a buffer that is ours.
    pub(super) fn bytes(&self, index: usize) -> Option<&[u8]> {
        let mapping = self.mappings.get(index).filter(|_| !self.queued[index])?;
        // SAFETY: the mapping is that long and lives as long as `self`. The driver does not write to a buffer that it has handed over,
        // and handing it back needs `&mut self`, so that this slice is gone by then.
        Some(unsafe { std::slice::from_raw_parts(mapping.start.as_ptr(), mapping.length) })
    }

    /// The bytes of a buffer that is ours, to be written.
    pub(super) fn bytes_mut(&mut self, index: usize) -> Option<&mut [u8]> {
        let mapping = self.mappings.get(index).filter(|_| !self.queued[index])?;
        // SAFETY: as for `bytes`; and `&mut self` makes this the only slice.
        Some(unsafe { std::slice::from_raw_parts_mut(mapping.start.as_ptr(), mapping.length) })
    }

    pub(super) fn start(&self, node: &Node) -> io::Result<()> {
        node.switch_stream(self.direction, true)
    }

    /// Stops the stream and gives the memory back.
    pub(super) fn release(self, node: &Node) -> io::Result<()> {
        let stopped = node.switch_stream(self.direction, false);
        let direction = self.direction;
        drop(self);
        stopped.and(node.request_buffers(direction, 0).map(|_| ()))
    }
}
