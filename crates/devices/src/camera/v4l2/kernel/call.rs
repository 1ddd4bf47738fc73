//! Safe wrappers of single kernel calls.

use std::fs::{File, OpenOptions};
use std::io;
use std::marker::PhantomData;
use std::mem::size_of;
use std::os::fd::{AsFd, AsRawFd};
use std::os::raw::c_int;
use std::os::unix::fs::OpenOptionsExt;
use std::time::Duration;

use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::fs::OFlags;
use rustix::io::Errno;
use v4l::v4l_sys as sys;
use v4l::v4l2::{self, vidioc};

use crate::camera::v4l2::failure::is;

/// A call number: direction, size of the argument, `V`, number.
pub(super) type Request = vidioc::_IOC_TYPE;

/// Position of the argument's size in a call number.
const SIZE_SHIFT: u32 = 16;
const SIZE_MASK: Request = 0x3fff;
const READ: Request = 2;
const DIRECTION_SHIFT: u32 = 30;

/// The number of a call.
const fn request(direction: Request, number: Request, size: usize) -> Request {
    direction << DIRECTION_SHIFT | (size as Request) << SIZE_SHIFT | (b'V' as Request) << 8 | number
}

/// Direction of buffers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u32)]
pub(crate) enum Direction {
    Capture = 1,
    Output = 2,
}

/// `struct v4l2_capability`.
#[derive(Debug, Clone)]
pub(crate) struct Capabilities {
    pub(crate) driver: String,
    pub(crate) card: String,
    pub(crate) bus: String,
    /// Of this node, not of the whole device.
    pub(crate) flags: u32,
}

/// An open video device; calls do not block.
#[derive(Debug)]
pub(crate) struct Node(Option<File>);

/// A structure of the kernel's with all bytes zero.
pub(super) fn zeroed<T: KernelStruct>() -> T {
    // SAFETY: `KernelStruct` is implemented for structures of integers, raw pointers and unions of these
    // only; zero is a value of each of them.
    unsafe { std::mem::zeroed() }
}

/// Structures that the kernel's calls take.
///
/// # Safety
/// They consist of integers, raw pointers and unions of these.
pub(super) unsafe trait KernelStruct {}

macro_rules! kernel_structs {
    ($($name:ident),*) => { $(
        // SAFETY: a C structure of the kernel's header, in which there are only numbers, raw pointers and
        // unions of them.
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
unsafe impl KernelStruct for c_int {}

/// The number of a call whose argument, a `T`, holds nothing that the kernel takes for a pointer.
#[derive(Debug)]
pub(super) struct Call<T> {
    number: Request,
    argument: PhantomData<fn(T)>,
}

impl<T> Call<T> {
    /// # Safety
    /// The number is that of a call that takes a `T`, and the kernel follows no pointer in it.
    pub(super) const unsafe fn new(number: Request) -> Self {
        Self { number, argument: PhantomData }
    }
}

macro_rules! calls {
    ($($name:ident($argument:ty) = $number:expr),* $(,)?) => { $(
        // SAFETY: number and argument belong together in the kernel's header (videodev2.h), and the argument
        // consists of numbers and text.
        pub(super) const $name: Call<$argument> = unsafe { Call::new($number) };
    )* };
}
calls! {
    QUERYCAP(sys::v4l2_capability) = vidioc::VIDIOC_QUERYCAP,
    ENUM_FMT(sys::v4l2_fmtdesc) = vidioc::VIDIOC_ENUM_FMT,
    ENUM_FRAMESIZES(sys::v4l2_frmsizeenum) = vidioc::VIDIOC_ENUM_FRAMESIZES,
    ENUM_FRAMEINTERVALS(sys::v4l2_frmivalenum) = vidioc::VIDIOC_ENUM_FRAMEINTERVALS,
    G_PARM(sys::v4l2_streamparm) = vidioc::VIDIOC_G_PARM,
    S_PARM(sys::v4l2_streamparm) = vidioc::VIDIOC_S_PARM,
    G_INPUT(c_int) = vidioc::VIDIOC_G_INPUT,
    ENUMINPUT(sys::v4l2_input) = vidioc::VIDIOC_ENUMINPUT,
    QUERY_EXT_CTRL(sys::v4l2_query_ext_ctrl) = vidioc::VIDIOC_QUERY_EXT_CTRL,
    QUERYMENU(sys::v4l2_querymenu) = vidioc::VIDIOC_QUERYMENU,
    REQBUFS(sys::v4l2_requestbuffers) = vidioc::VIDIOC_REQBUFS,
    STREAMON(c_int) = vidioc::VIDIOC_STREAMON,
    STREAMOFF(c_int) = vidioc::VIDIOC_STREAMOFF,
    // Missing in the crate.
    G_DV_TIMINGS(sys::v4l2_dv_timings) = request(READ | 1, 88, size_of::<sys::v4l2_dv_timings>()),
    QUERY_DV_TIMINGS(sys::v4l2_dv_timings) = request(READ, 99, size_of::<sys::v4l2_dv_timings>()),
}

pub(super) fn text(bytes: &[u8]) -> String {
    let end = bytes.iter().position(|&byte| byte == 0).unwrap_or(bytes.len());
    String::from_utf8_lossy(&bytes[..end]).trim().to_owned()
}

impl Node {
    /// Opens a device file.
    pub(crate) fn open(path: &str) -> io::Result<Self> {
        let flags = (OFlags::NONBLOCK | OFlags::CLOEXEC).bits() as i32;
        OpenOptions::new().read(true).write(true).custom_flags(flags).open(path).map(|file| Self(Some(file)))
    }

    /// Closes the device: all later calls fail, as for a lost device.
    pub(crate) fn close(&mut self) {
        self.0 = None;
    }

    pub(super) fn file(&self) -> io::Result<&File> {
        self.0.as_ref().ok_or_else(|| Errno::NODEV.into())
    }

    /// A call whose argument holds no pointer.
    pub(super) fn call<T: KernelStruct>(&self, call: Call<T>, argument: &mut T) -> io::Result<()> {
        // SAFETY: by the contract of `Call`, the kernel follows no pointer in the argument.
        unsafe { self.call_with_pointers(call.number, argument) }
    }

    /// A call whose argument the kernel may find pointers in.
    ///
    /// # Safety
    /// The number is that of a call that takes a `T`. Every pointer that the kernel follows for this call
    /// points to memory that is borrowed, exclusively if it is written, for longer than the call.
    pub(super) unsafe fn call_with_pointers<T: KernelStruct>(
        &self,
        request: Request,
        argument: &mut T,
    ) -> io::Result<()> {
        if (request >> SIZE_SHIFT & SIZE_MASK) as usize != size_of::<T>() {
            return Err(io::Error::other("a call of the kernel with an argument of another size"));
        }
        let file = self.file()?.as_raw_fd();
        loop {
            // SAFETY: the call number holds the size of the argument, which is that of `T` as just checked,
            // so the kernel stays within `argument`, which is borrowed exclusively, and within what the
            // caller vouches for.
            let done = unsafe { v4l2::ioctl(file, request, std::ptr::from_mut(argument).cast()) };
            match done {
                Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                done => return done,
            }
        }
    }

    /// Waits until a buffer can be exchanged or an event occurs. Returns `false` after the time-out.
    pub(crate) fn wait(&self, direction: Direction, patience: Duration) -> io::Result<bool> {
        let events = match direction {
            Direction::Capture => PollFlags::IN,
            Direction::Output => PollFlags::OUT,
        };
        let mut files = [PollFd::from_borrowed_fd(self.file()?.as_fd(), events)];
        let patience = Timespec::try_from(patience).map_err(io::Error::other)?;
        match poll(&mut files, Some(&patience)) {
            // Interrupted: the caller checks its own clock.
            Err(Errno::INTR) => Ok(false),
            Err(error) => Err(error.into()),
            Ok(count) => Ok(count > 0),
        }
    }

    pub(crate) fn capabilities(&self) -> io::Result<Capabilities> {
        let mut found: sys::v4l2_capability = zeroed();
        self.call(QUERYCAP, &mut found)?;
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
}

/// Calls `ask` with rising indices until the list ends. A device without the list gives an empty one.
pub(super) fn enumerate<T>(mut ask: impl FnMut(u32) -> io::Result<T>) -> io::Result<Vec<T>> {
    /// Longest list; a faulty driver might never end it.
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

/// Whether an error means that the item or the call does not exist.
pub(crate) fn has_none(error: &io::Error) -> bool {
    is(error, Errno::INVAL) || is(error, Errno::NOTTY)
}
