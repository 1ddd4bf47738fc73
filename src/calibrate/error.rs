//! Errors of calibration.

use std::path::PathBuf;

use thiserror::Error;

use epirig_calibration::lens::views::{LensError, with_view_named};
use epirig_calibration::photometry::PhotometryError;
use epirig_calibration::rectification::RectifyError;
use epirig_calibration::stage_axis::StageAxisError;
use epirig_calibration::target::{OtherSize, TargetError};
use epirig_calibration::texture_motion::TextureMotionError;
use epirig_core::fault::{Blame, Fault};
use epirig_core::progress::Cancelled;
use epirig_core::rows::RowsError;
use epirig_core::tau::TauError;
use epirig_data::packed::PackedError;
use epirig_data::sequence::SequenceError;
use epirig_data::storage::ReadError;

/// Error that prevents a calibration, or its use.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum CalibrateError {
    /// The caller has cancelled the work.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
    /// Frames cannot be read.
    #[error(transparent)]
    Sequence(#[from] SequenceError),
    /// A file cannot be read, or is not of the right kind.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// Frames that are held on disk cannot be written or read.
    #[error(transparent)]
    Packed(#[from] PackedError),
    /// Rows of them cannot be read.
    #[error(transparent)]
    Rows(#[from] RowsError),
    /// There is nothing to calibrate with.
    #[error(
        "{} has nothing to calibrate with: there are no dark, flat or board frames, and no target or lens is described. Without \
         --positions stage, the motion is measured in the frames themselves. For the lens, take calibration frames with the \
         scan ([plan] dark, flat, board), describe [target] and [optics] in the rig's profile, or give a lens with --lens", path.display()
    )]
    Nothing {
        /// Folder of the sequence.
        path: PathBuf,
    },
    /// Dark or flat frames are not good enough.
    #[error(transparent)]
    Photometry(#[from] PhotometryError),
    /// There are board frames, but no description of the board.
    #[error(
        "there are {frames} board frames, but no description of the board; write square, columns and rows (inner corners) into [board] of the rig's profile, \
         or use --set board.square=\"16 mm\" --set board.columns=9 --set board.rows=6"
    )]
    BoardNotDescribed {
        /// Number of board frames.
        frames: usize,
    },
    /// A board that is of another size than the profile says.
    #[error(
        "the rig's profile describes a board of {} x {} inner corners ([{section}] columns, rows), but {} of {} boards that are seen whole have {}{} x {}; \
         count its inner corners, and correct the profile or give --set {section}.columns={} --set {section}.rows={}",
        told.0, told.1, shown.boards, shown.of, if shown.at_least { "at least " } else { "" }, shown.columns, shown.rows,
        shown.columns, shown.rows
    )]
    OtherBoard {
        /// The section of the profile.
        section: &'static str,
        /// Inner corners along a row and along a column, as told.
        told: (usize, usize),
        /// What is seen.
        shown: OtherSize,
    },
    /// Too few board frames show a board.
    #[error(
        "a board of {columns} x {rows} inner corners is found well in {found} of {frames} board frames{}, at least {needed} are needed; {}",
        if *blurred > 0 { format!(" (it is blurred in {blurred} others)") } else { String::new() },
        if 2 * blurred > *frames {
            "focus the camera on the board, hold it still, and take them again"
        } else {
            "hold the whole board still and in view, tilted in different directions, and check columns and rows of [board] (inner corners)"
        }
    )]
    BoardsNotFound {
        /// Inner corners along a row.
        columns: usize,
        /// Inner corners along a column.
        rows: usize,
        /// Frames in which the board was found, and sharp.
        found: usize,
        /// Number of board frames.
        frames: usize,
        /// Frames in which the board was found, but blurred.
        blurred: usize,
        /// Number of frames needed.
        needed: usize,
    },
    /// The board frames do not determine the lens.
    #[error("the board frames do not determine the lens: {}", with_view_named(source, source.view(), file))]
    Lens {
        /// The cause.
        source: LensError,
        /// The frame concerned, if there is one.
        file: String,
    },
    /// The dark frames are brighter than the flat frames.
    #[error(
        "the dark frames have a mean of {dark_dn:.0} DN, the flat frames of {flat_dn:.0} DN: they seem to be exchanged; give dark frames as \
         dark and flat frames as flat"
    )]
    Exchanged {
        /// Mean of the dark frames, in DN.
        dark_dn: f64,
        /// Mean of the flat frames, in DN.
        flat_dn: f64,
    },
    /// The lens model does not describe the boards.
    #[error(
        "the lens model leaves residuals of {rms_px:.2} px RMS at the corners (limit {limit_px} px); check that the board is flat and stiff, that [board] describes it, \
         and that nothing was moved or refocused between board frames"
    )]
    LensDoesNotFit {
        /// Root mean square of the residuals, in px.
        rms_px: f64,
        /// The limit, in px.
        limit_px: f64,
    },
    /// The lens belongs to frames of another size.
    #[error(
        "the lens of {name} is for frames of {} x {}, these are {} x {}; calibrate with the present format of the camera",
        found.1, found.0, expected.1, expected.0
    )]
    LensSize {
        /// Source of the lens.
        name: String,
        /// Its rows and columns.
        found: (usize, usize),
        /// Rows and columns of the frames.
        expected: (usize, usize),
    },
    /// Corners of the target are missing or cannot be identified.
    #[error("the target on the object: {0}")]
    Target(#[from] TargetError),
    /// The target is out of focus.
    #[error(
        "the target's edges are blurred over {blur_px:.1} px (limit {limit_px} px); focus the camera on the object"
    )]
    TargetBlurred {
        /// Median standard deviation of the blur, in px.
        blur_px: f64,
        /// The limit, in px.
        limit_px: f64,
    },
    /// Positions from a target are wanted, but no target is described.
    #[error(
        "positions from the target are wanted, but [target] is not described; write square, columns, rows (inner corners) into the rig's profile"
    )]
    NoTarget,
    /// The target is at the same place in all frames.
    #[error(
        "the target moves by {moved_px:.2} px at most from the first frame to the last: the stage or the target did not move, or all frames were taken at one \
         position; look at the frames and take them again"
    )]
    StandsStill {
        /// Largest motion of a corner, in px.
        moved_px: f64,
    },
    /// The measured positions have no scale.
    #[error(
        "the positions were measured, but their scale in mm is unknown; import the frames with --step-mm or --positions, and calibrate again"
    )]
    NoBaseline,
    /// The target does not determine the stage axis.
    #[error("the target on the object does not determine the stage axis: {0}")]
    StageAxis(#[from] StageAxisError),
    /// The size of the squares contradicts the stage.
    #[error(
        "the squares of the target say that the stage travelled {target_mm:.2} mm, the stage says {stage_mm:.2} mm ({percent:+.1} %; {limit_percent} % are allowed); measure the printed \
         squares (ruler on the sheet), correct [target] square, or check the stage's steps per mm"
    )]
    ScaleContradicts {
        /// Travel by the target, in mm.
        target_mm: f64,
        /// Travel by the stage, in mm.
        stage_mm: f64,
        /// Difference in %.
        percent: f64,
        /// The limit, in %.
        limit_percent: f64,
    },
    /// The positions of the frames are not in order.
    #[error(
        "the measured positions of the frames give no baseline: {0}; check the stage's positioning error, or use its reported positions with --positions stage"
    )]
    Positions(#[from] TauError),
    /// Positions cannot be measured from the texture.
    #[error("positions from the texture: {0}; use the given positions with --positions stage")]
    TextureMotion(#[source] TextureMotionError),
    /// The texture of some frames does not connect them with the others.
    #[error(
        "positions from the texture: {found} cannot be connected with the others, because they share too little texture, or it repeats; {cure} use the given positions with --positions stage"
    )]
    Apart {
        /// These frames.
        found: String,
        /// What helps where the frames come from.
        cure: &'static str,
    },
    /// Frames that do not stand beyond the one before.
    #[error(
        "positions from the texture must increase, but {found}; {cure} use the given positions with --positions stage"
    )]
    Returns {
        /// These frames and where they stand, in words.
        found: String,
        /// What helps where the frames come from.
        cure: &'static str,
    },
    /// The frames cannot be rectified.
    #[error(transparent)]
    Rectify(#[from] RectifyError),
    /// The record or a map of it is invalid.
    #[error("{}: {reason}; run `epirig calibrate --overwrite` again", path.display())]
    BadRecord {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        reason: String,
    },
    /// The record belongs to other frames.
    #[error("{} is stale: {what}; run `epirig calibrate --overwrite` again, or ignore it with `match --as-captured`", path.display())]
    Stale {
        /// The file.
        path: PathBuf,
        /// What has changed.
        what: String,
    },
    /// A calibration exists already.
    #[error("{} exists already; add --overwrite to replace it", path.display())]
    Exists {
        /// The file.
        path: PathBuf,
    },
    /// The operating system refused.
    #[error("cannot {action} {}: {source}; check the disk, and that you may write to the sequence's folder", path.display())]
    Io {
        /// The operation.
        action: &'static str,
        /// The path.
        path: PathBuf,
        /// The error of the operating system.
        source: std::io::Error,
    },
}

impl Fault for CalibrateError {
    fn blame(&self) -> Blame {
        match self {
            Self::Cancelled(_) => Blame::Interruption,
            Self::Sequence(error) => error.blame(),
            Self::Read(error) => error.blame(),
            Self::Packed(error) => error.blame(),
            Self::Rows(error) => error.blame(),
            Self::Io { .. } => Blame::System,
            Self::Exists { .. }
            | Self::NoTarget
            | Self::NoBaseline
            | Self::BoardNotDescribed { .. }
            | Self::LensSize { .. } => Blame::Request,
            Self::BadRecord { .. } | Self::Stale { .. } => Blame::Data,
            Self::Nothing { .. }
            | Self::Photometry(_)
            | Self::OtherBoard { .. }
            | Self::BoardsNotFound { .. }
            | Self::Lens { .. }
            | Self::Exchanged { .. }
            | Self::LensDoesNotFit { .. }
            | Self::Target(_)
            | Self::TargetBlurred { .. }
            | Self::StandsStill { .. }
            | Self::StageAxis(_)
            | Self::ScaleContradicts { .. }
            | Self::Positions(_)
            | Self::TextureMotion(_)
            | Self::Apart { .. }
            | Self::Returns { .. }
            | Self::Rectify(_) => Blame::Rejection,
        }
    }
}
