//! State of an input and of its signal.

use std::io;

use v4l::v4l_sys as sys;

use super::call::{Call, ENUMINPUT, G_DV_TIMINGS, G_INPUT, Node, QUERY_DV_TIMINGS, zeroed};

/// Tolerance of pixel clocks, the same as the kernel's, because receivers measure roughly.
const SAME_CLOCK_HZ: u64 = 250_000;

/// Whether a receiver with the timings `set` receives those that arrive.
pub(crate) fn is_like(set: &sys::v4l2_bt_timings, arriving: &sys::v4l2_bt_timings) -> bool {
    let shape = |timings: &sys::v4l2_bt_timings| (timings.width, timings.height, timings.interlaced);
    let clocks = (set.pixelclock, arriving.pixelclock);
    shape(set) == shape(arriving) && clocks.0.abs_diff(clocks.1) <= SAME_CLOCK_HZ
}

impl Node {
    /// State of the selected input.
    pub(crate) fn input(&self) -> io::Result<sys::v4l2_input> {
        let mut index: std::os::raw::c_int = 0;
        self.call(G_INPUT, &mut index)?;
        let mut input = sys::v4l2_input { index: index as u32, ..zeroed() };
        self.call(ENUMINPUT, &mut input)?;
        Ok(input)
    }

    /// The timings set for the input.
    pub(crate) fn dv_timings(&self) -> io::Result<sys::v4l2_bt_timings> {
        self.timings(G_DV_TIMINGS)
    }

    /// The timings of the received signal.
    pub(crate) fn arriving_dv_timings(&self) -> io::Result<sys::v4l2_bt_timings> {
        self.timings(QUERY_DV_TIMINGS)
    }

    fn timings(&self, call: Call<sys::v4l2_dv_timings>) -> io::Result<sys::v4l2_bt_timings> {
        let mut timings: sys::v4l2_dv_timings = zeroed();
        self.call(call, &mut timings)?;
        // SAFETY: the members of the union are structures of numbers, valid whatever was written.
        Ok(unsafe { timings.__bindgen_anon_1.bt })
    }
}
