//! The state of an input and of its signal.

use std::io;
use std::mem::size_of;

use v4l::v4l_sys as sys;
use v4l::v4l2::vidioc;

use super::call::{Node, READ, Request, request, zeroed};

/// `VIDIOC_G_DV_TIMINGS` and `VIDIOC_QUERY_DV_TIMINGS`, which the crate leaves out.
const GET_DV_TIMINGS: Request = request(READ | 1, 88, size_of::<sys::v4l2_dv_timings>());
const QUERY_DV_TIMINGS: Request = request(READ, 99, size_of::<sys::v4l2_dv_timings>());

/// `struct v4l2_input`.
#[derive(Debug, Clone, Copy)]
pub(in crate::camera::v4l2) struct InputState {
    pub(in crate::camera::v4l2) status: u32,
    pub(in crate::camera::v4l2) capabilities: u32,
}

/// What counts of `struct v4l2_bt_timings`.
#[derive(Debug, Clone, Copy)]
pub(in crate::camera::v4l2) struct DvTimings {
    pub(in crate::camera::v4l2) columns: u32,
    pub(in crate::camera::v4l2) rows: u32,
    pub(in crate::camera::v4l2) interlaced: u32,
    pub(in crate::camera::v4l2) pixel_clock_hz: u64,
}

/// Pixel clocks are as good as equal if they differ by no more: the kernel's own measure, because receivers measure roughly.
const SAME_CLOCK_HZ: u64 = 250_000;

impl DvTimings {
    /// Whether a receiver that is set for these timings receives those.
    pub(in crate::camera::v4l2) fn is_like(&self, other: &Self) -> bool {
        let shape = |timings: &Self| (timings.columns, timings.rows, timings.interlaced);
        shape(self) == shape(other) && self.pixel_clock_hz.abs_diff(other.pixel_clock_hz) <= SAME_CLOCK_HZ
    }
}

impl Node {
    /// The state of the selected input.
    pub(in crate::camera::v4l2) fn input(&self) -> io::Result<InputState> {
        let mut index: std::os::raw::c_int = 0;
        self.call(vidioc::VIDIOC_G_INPUT, &mut index)?;
        let mut input = sys::v4l2_input { index: index as u32, ..zeroed() };
        self.call(vidioc::VIDIOC_ENUMINPUT, &mut input)?;
        Ok(InputState { status: input.status, capabilities: input.capabilities })
    }

    /// The timings that the input is set for.
    pub(in crate::camera::v4l2) fn dv_timings(&self) -> io::Result<DvTimings> {
        self.timings(GET_DV_TIMINGS)
    }

    /// The timings of the signal that arrives.
    pub(in crate::camera::v4l2) fn arriving_dv_timings(&self) -> io::Result<DvTimings> {
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
}
