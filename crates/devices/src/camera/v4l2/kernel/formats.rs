//! Formats, sizes and rates.

use std::io;

use v4l::v4l_sys as sys;
use v4l::v4l2::vidioc;

use super::call::{
    Direction, ENUM_FMT, ENUM_FRAMEINTERVALS, ENUM_FRAMESIZES, G_PARM, Node, Request, S_PARM, enumerate,
    text, zeroed,
};

/// `struct v4l2_pix_format`.
#[derive(Debug, Clone, Copy)]
pub(in crate::camera::v4l2) struct PixFormat {
    pub(in crate::camera::v4l2) four_cc: u32,
    pub(in crate::camera::v4l2) columns: u32,
    pub(in crate::camera::v4l2) rows: u32,
    pub(in crate::camera::v4l2) stride: u32,
    pub(in crate::camera::v4l2) image_bytes: u32,
    pub(in crate::camera::v4l2) field: u32,
}

/// An answer of `VIDIOC_ENUM_FRAMESIZES`: columns and rows.
#[derive(Debug, Clone, Copy)]
pub(in crate::camera::v4l2) enum FrameSize {
    Discrete((u32, u32)),
    Range { least: (u32, u32), greatest: (u32, u32), step: (u32, u32) },
}

impl Node {
    /// Formats that the device offers: code and description.
    pub(in crate::camera::v4l2) fn formats(&self) -> io::Result<Vec<(u32, String)>> {
        enumerate(|index| {
            let mut found = sys::v4l2_fmtdesc { index, type_: Direction::Capture as u32, ..zeroed() };
            self.call(ENUM_FMT, &mut found)?;
            Ok((found.pixelformat, text(&found.description)))
        })
    }

    pub(in crate::camera::v4l2) fn frame_sizes(&self, four_cc: u32) -> io::Result<Vec<FrameSize>> {
        enumerate(|index| {
            let mut found = sys::v4l2_frmsizeenum { index, pixel_format: four_cc, ..zeroed() };
            self.call(ENUM_FRAMESIZES, &mut found)?;
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

    /// Intervals of a discrete size, as fractions of a second; for a range, the shortest and the longest.
    pub(in crate::camera::v4l2) fn intervals(
        &self,
        four_cc: u32,
        columns: u32,
        rows: u32,
    ) -> io::Result<Vec<(u32, u32)>> {
        let found = enumerate(|index| {
            let mut found = sys::v4l2_frmivalenum {
                index,
                pixel_format: four_cc,
                width: columns,
                height: rows,
                ..zeroed()
            };
            self.call(ENUM_FRAMEINTERVALS, &mut found)?;
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

    pub(in crate::camera::v4l2) fn format(&self, direction: Direction) -> io::Result<PixFormat> {
        let mut format = sys::v4l2_format { type_: direction as u32, ..zeroed() };
        self.exchange_format(vidioc::VIDIOC_G_FMT, &mut format)?;
        Ok(pix_format(&format))
    }

    /// Sets a progressive format, and returns the format that the driver chose.
    pub(in crate::camera::v4l2) fn set_format(
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
        self.exchange_format(vidioc::VIDIOC_S_FMT, &mut format)?;
        Ok(pix_format(&format))
    }

    /// Of capture and output devices; others are refused.
    fn exchange_format(&self, request: Request, format: &mut sys::v4l2_format) -> io::Result<()> {
        let takes_formats = [vidioc::VIDIOC_G_FMT, vidioc::VIDIOC_S_FMT].contains(&request);
        if !takes_formats || ![Direction::Capture as u32, Direction::Output as u32].contains(&format.type_) {
            return Err(io::Error::other("a call for other formats than those of images"));
        }
        // SAFETY: the number is one of two that take this structure. It holds pointers for overlays alone,
        // and its type is that of capture or output, as just checked.
        unsafe { self.call_with_pointers(request, format) }
    }

    /// Time per frame, as a fraction of a second.
    pub(in crate::camera::v4l2) fn interval(&self) -> io::Result<(u32, u32)> {
        let mut parameters = sys::v4l2_streamparm { type_: Direction::Capture as u32, ..zeroed() };
        self.call(G_PARM, &mut parameters)?;
        // SAFETY: the members of the union are structures of u32 and bytes, valid whatever was written.
        let interval = unsafe { parameters.parm.capture.timeperframe };
        Ok((interval.numerator, interval.denominator))
    }

    pub(in crate::camera::v4l2) fn set_interval(&self, numerator: u32, denominator: u32) -> io::Result<()> {
        let mut parameters = sys::v4l2_streamparm { type_: Direction::Capture as u32, ..zeroed() };
        parameters.parm.capture.timeperframe = sys::v4l2_fract { numerator, denominator };
        self.call(S_PARM, &mut parameters)
    }
}

fn pixels_of(format: &sys::v4l2_format) -> sys::v4l2_pix_format {
    // SAFETY: the members of the union are structures of numbers and bytes (and, of overlays, raw pointers),
    // valid whatever was written; of capture and output devices it is this one.
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
