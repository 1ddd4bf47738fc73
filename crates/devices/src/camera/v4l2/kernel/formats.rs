//! Formats, sizes and rates.

use std::io;

use v4l::v4l_sys as sys;
use v4l::v4l2::vidioc;

use super::call::{
    Direction, ENUM_FMT, ENUM_FRAMEINTERVALS, ENUM_FRAMESIZES, G_PARM, Node, Request, S_PARM, enumerate,
    text, zeroed,
};
use crate::camera::{Interval, Size, Sizes};

/// An answer of `VIDIOC_ENUM_FRAMESIZES`.
enum Listed {
    /// Columns and rows.
    Discrete(u32, u32),
    Range(Sizes),
}

fn size(columns: u32, rows: u32) -> Size {
    Size { columns: columns as usize, rows: rows as usize }
}

fn interval(fraction: sys::v4l2_fract) -> Interval {
    Interval { numerator: fraction.numerator, denominator: fraction.denominator }
}

impl Node {
    /// Formats that the device offers: code and description.
    pub(crate) fn formats(&self) -> io::Result<Vec<(u32, String)>> {
        enumerate(|index| {
            let mut found = sys::v4l2_fmtdesc { index, type_: Direction::Capture as u32, ..zeroed() };
            self.call(ENUM_FMT, &mut found)?;
            Ok((found.pixelformat, text(&found.description)))
        })
    }

    /// The sizes of a format, each with its intervals.
    pub(crate) fn sizes(&self, four_cc: u32) -> io::Result<Sizes> {
        let listed = enumerate(|index| {
            let mut found = sys::v4l2_frmsizeenum { index, pixel_format: four_cc, ..zeroed() };
            self.call(ENUM_FRAMESIZES, &mut found)?;
            let sizes = found.__bindgen_anon_1;
            // SAFETY: all members of the union are structures of u32, valid whatever was written.
            let (discrete, range) = unsafe { (sizes.discrete, sizes.stepwise) };
            Ok(if found.type_ == sys::v4l2_frmsizetypes_V4L2_FRMSIZE_TYPE_DISCRETE {
                Listed::Discrete(discrete.width, discrete.height)
            } else {
                Listed::Range(Sizes::Range {
                    least: size(range.min_width, range.min_height),
                    greatest: size(range.max_width, range.max_height),
                    step: size(range.step_width, range.step_height),
                })
            })
        })?;
        let mut discrete = Vec::new();
        for one in listed {
            match one {
                Listed::Range(range) if discrete.is_empty() => return Ok(range),
                Listed::Range(_) => {}
                Listed::Discrete(columns, rows) => {
                    discrete.push((size(columns, rows), self.intervals(four_cc, columns, rows)?));
                }
            }
        }
        if discrete.is_empty() {
            // The driver lists none; setting a size will show what it supports.
            let (one, largest) = (size(1, 1), size(u16::MAX.into(), u16::MAX.into()));
            return Ok(Sizes::Range { least: one, greatest: largest, step: one });
        }
        Ok(Sizes::Discrete(discrete))
    }

    /// Intervals of a discrete size; for a range, the shortest and the longest.
    fn intervals(&self, four_cc: u32, columns: u32, rows: u32) -> io::Result<Vec<Interval>> {
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
            Ok(if found.type_ == sys::v4l2_frmivaltypes_V4L2_FRMIVAL_TYPE_DISCRETE {
                vec![interval(discrete)]
            } else {
                vec![interval(range.min), interval(range.max)]
            })
        })?;
        Ok(found.concat())
    }

    pub(crate) fn format(&self, direction: Direction) -> io::Result<sys::v4l2_pix_format> {
        let mut format = sys::v4l2_format { type_: direction as u32, ..zeroed() };
        self.exchange_format(vidioc::VIDIOC_G_FMT, &mut format)?;
        Ok(pixels_of(&format))
    }

    /// Sets a progressive format, and returns the format that the driver chose.
    pub(crate) fn set_format(
        &self,
        direction: Direction,
        four_cc: u32,
        columns: u32,
        rows: u32,
    ) -> io::Result<sys::v4l2_pix_format> {
        let mut format = sys::v4l2_format { type_: direction as u32, ..zeroed() };
        format.fmt.pix = sys::v4l2_pix_format {
            width: columns,
            height: rows,
            pixelformat: four_cc,
            field: sys::v4l2_field_V4L2_FIELD_NONE,
            ..pixels_of(&zeroed())
        };
        self.exchange_format(vidioc::VIDIOC_S_FMT, &mut format)?;
        Ok(pixels_of(&format))
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

    /// Time per frame.
    pub(crate) fn interval(&self) -> io::Result<Interval> {
        let mut parameters = sys::v4l2_streamparm { type_: Direction::Capture as u32, ..zeroed() };
        self.call(G_PARM, &mut parameters)?;
        // SAFETY: the members of the union are structures of u32 and bytes, valid whatever was written.
        Ok(interval(unsafe { parameters.parm.capture.timeperframe }))
    }

    pub(crate) fn set_interval(&self, interval: Interval) -> io::Result<()> {
        let Interval { numerator, denominator } = interval;
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
