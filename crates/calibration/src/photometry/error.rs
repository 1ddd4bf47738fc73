//! Why dark and flat frames give no correction.

use epirig_core::frame::FrameFormat;
use thiserror::Error;

/// An error of dark or flat frames, or of the record of a correction.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum PhotometryError {
    /// An empty list of frames.
    #[error("there is no {what} frame; take at least one, better eight")]
    NoFrames {
        /// `dark` or `flat`.
        what: &'static str,
    },
    /// Frames of different shapes.
    #[error(
        "{what} frame {index} is {found}, but must be {expected} as the others; take all with the same settings"
    )]
    Shapes {
        /// `dark` or `flat`.
        what: &'static str,
        /// Index of the frame, from 0.
        index: usize,
        /// Its size and bit depth.
        found: FrameFormat,
        /// Those of the others.
        expected: FrameFormat,
    },
    /// Flat frames with too many samples at full scale.
    #[error(
        "{percent:.2} % of the flat frames' samples are at full scale, {most_percent} % are allowed; use less light or a shorter exposure, and \
         take the flat frames again"
    )]
    Saturated {
        /// Share found, in %.
        percent: f64,
        /// Largest share that is allowed, in %.
        most_percent: f64,
    },
    /// Flat frames with too little light.
    #[error(
        "the flat frames have only {level_dn:.1} DN at column {}, row {}, {least_dn:.1} DN are the least; use more light or a longer exposure, \
         check that nothing covers the lens there, and take the flat frames again",
        at.0, at.1
    )]
    TooDark {
        /// Mean of the darkest cell less the dark level, in DN.
        level_dn: f64,
        /// The least that is accepted, in DN.
        least_dn: f64,
        /// Column and row of the cell's middle.
        at: (usize, usize),
    },
    /// A frame whose brightness as a whole differs.
    #[error(
        "flat frame {index} is {percent:+.1} % brighter than the others ({most_percent} % are allowed); let the lamp warm up, keep the exposure \
         fixed, and take the flat frames again"
    )]
    LampUnsteady {
        /// Index of the frame, from 0.
        index: usize,
        /// How much brighter it is than the median of all, in %.
        percent: f64,
        /// Largest difference that is allowed, in %.
        most_percent: f64,
    },
    /// A frame that shows something else than the others.
    #[error(
        "flat frame {index} differs from the others by {percent:+.2} % around column {}, row {} ({most_percent:.2} % are allowed): the lamp, \
         the target or a shadow moved; leave everything still and take the flat frames again",
        at.0, at.1
    )]
    FrameDiffers {
        /// Index of the frame, from 0.
        index: usize,
        /// How much brighter it is there than the others, apart from its brightness as a whole, in %.
        percent: f64,
        /// Largest difference that is allowed, in %.
        most_percent: f64,
        /// Column and row of the cell's middle.
        at: (usize, usize),
    },
    /// A structure that no lens makes.
    #[error(
        "the flat frames are not uniform: {cells} of {all_cells} cells depart by more than {limit_percent:.2} % from anything smooth, most at column \
         {}, row {} ({percent:+.2} %); remove shadows, edges and texture from the view (put the target out of focus), light it evenly and take \
         the flat frames again",
        at.0, at.1
    )]
    NotUniform {
        /// Cells that depart by more than the limit.
        cells: usize,
        /// Cells of the grid.
        all_cells: usize,
        /// The limit, in %.
        limit_percent: f64,
        /// The largest departure, in %.
        percent: f64,
        /// Column and row of that cell's middle.
        at: (usize, usize),
    },
    /// A polynomial that the image cannot determine.
    #[error(
        "a polynomial of order {order} needs more than {cells} cells; choose an order up to {highest}, or a larger image"
    )]
    Undetermined {
        /// Order asked for.
        order: usize,
        /// Cells that the image has.
        cells: usize,
        /// Highest order that is supported.
        highest: usize,
    },
    /// A model of the flat field that is zero or negative somewhere.
    #[error(
        "the flat field's model is not positive everywhere, so nothing can be divided by it; choose a lower order, or take the flat frames \
         again with more light"
    )]
    NotPositive,
    /// A record that needs a map that was not given, or one of another size.
    #[error(
        "the record of the photometry needs the map of the {what} of {columns} x {rows}; give the file that was stored with it"
    )]
    MapMissing {
        /// `dark frame` or `flat field`.
        what: &'static str,
        /// Columns that it must have.
        columns: usize,
        /// Rows that it must have.
        rows: usize,
    },
}
