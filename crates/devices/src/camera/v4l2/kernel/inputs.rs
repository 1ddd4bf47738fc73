//! State of an input and of its signal.

use std::io;

use v4l::v4l_sys as sys;

use super::call::{Call, ENUMINPUT, G_DV_TIMINGS, G_INPUT, Node, QUERY_DV_TIMINGS, zeroed};

/// `struct v4l2_input`.
#[derive(Debug, Clone, Copy)]
pub(in crate::camera::v4l2) struct InputState {
    pub(in crate::camera::v4l2) status: u32,
    pub(in crate::camera::v4l2) capabilities: u32,
}

/// The relevant fields of `struct v4l2_bt_timings`.
#[derive(Debug, Clone, Copy)]
pub(in crate::camera::v4l2) struct DvTimings {
    pub(in crate::camera::v4l2) columns: u32,
    pub(in crate::camera::v4l2) rows: u32,
    pub(in crate::camera::v4l2) interlaced: u32,
    pub(in crate::camera::v4l2) pixel_clock_hz: u64,
}

/// Tolerance of pixel clocks, the same as the kernel's, because receivers measure roughly.
const SAME_CLOCK_HZ: u64 = 250_000;

impl DvTimings {
    /// Whether a receiver with these timings receives those of `other`.
    pub(in crate::camera::v4l2) fn is_like(&self, other: &Self) -> bool {
        let shape = |timings: &Self| (timings.columns, timings.rows, timings.interlaced);
        shape(self) == shape(other) && self.pixel_clock_hz.abs_diff(other.pixel_clock_hz) <= SAME_CLOCK_HZ
    }
}

impl Node {
    /// State of the selected input.
    pub(in crate::camera::v4l2) fn input(&self) -> io::Result<InputState> {
        let mut index: std::os::raw::c_int = 0;
        self.call(G_INPUT, &mut index)?;
        let mut input = sys::v4l2_input { index: index as u32, ..zeroed() };
        self.call(ENUMINPUT, &mut input)?;
        Ok(InputState { status: input.status, capabilities: input.capabilities })
    }

    /// The timings set for the input.
    pub(in crate::camera::v4l2) fn dv_timings(&self) -> io::Result<DvTimings> {
        self.timings(G_DV_TIMINGS)
    }

    /// The timings of the received signal.
    pub(in crate::camera::v4l2) fn arriving_dv_timings(&self) -> io::Result<DvTimings> {
        self.timings(QUERY_DV_TIMINGS)
    }

    fn timings(&self, call: Call<sys::v4l2_dv_timings>) -> io::Result<DvTimings> {
        let mut timings: sys::v4l2_dv_timings = zeroed();
        self.call(call, &mut timings)?;
        // SAFETY: the members of the union are structures of numbers, valid whatever was written. They are
        // packed: fields are copied.
        let bt = unsafe { timings.__bindgen_anon_1.bt };
        Ok(DvTimings {
            columns: bt.width,
            rows: bt.height,
            interlaced: bt.interlaced,
            pixel_clock_hz: bt.pixelclock,
        })
    }
}
