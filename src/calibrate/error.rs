//! Why there is no calibration.

use std::path::PathBuf;

use thiserror::Error;

use epirig_calibration::lens::views::LensError;
use epirig_calibration::photometry::PhotometryError;
use epirig_calibration::rectification::RectifyError;
use epirig_calibration::stage_axis::StageAxisError;
use epirig_calibration::target::TargetError;
use epirig_core::tau::TauError;
use epirig_data::formats::FormatError;
use epirig_data::sequence::SequenceError;
use epirig_data::storage::ReadError;

/// Why there is no calibration, or why it cannot be used.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum CalibrateError {
    /// Frames that cannot be read.
    #[error(transparent)]
    Sequence(#[from] SequenceError),
    /// A file that cannot be read, or is none.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// Nothing to go by.
    #[error(
        "{} has nothing to calibrate with: no dark, flat or board frames, and no target or lens is described. Take calibration frames with the \
         scan ([plan] dark, flat, board), describe [target] and [optics] in the rig's profile, or give a lens with --lens", path.display()
    )]
    Nothing {
        /// Folder of the sequence.
        path: PathBuf,
    },
    /// Dark or flat frames that will not do.
    #[error(transparent)]
    Photometry(#[from] PhotometryError),
    /// Board frames without a description of the board.
    #[error(
        "there are {frames} board frames, but the board is not described; write square, columns and rows (inner corners) into [board] of the rig's profile, \
         or say it with --set board.square=\"16 mm\" --set board.columns=9 --set board.rows=6"
    )]
    BoardNotDescribed {
        /// Board frames.
        frames: usize,
    },
    /// Too few board frames in which a board is found.
    #[error(
        "a board of {columns} x {rows} inner corners is found well in {found} of {frames} board frames{}, at least {needed} are needed; {}",
        if *blurred > 0 { format!(" (it is blurred in {blurred} others)") } else { String::new() },
        if 2 * blurred > *frames {
            "focus the camera on the board, hold it still, and take them again"
        } else {
            "hold the whole board into view and still, tilted in different directions, and check columns and rows of [board] (inner corners)"
        }
    )]
    BoardsNotFound {
        /// Inner corners along a row.
        columns: usize,
        /// Inner corners along a column.
        rows: usize,
        /// Frames in which it was found well.
        found: usize,
        /// Board frames.
        frames: usize,
        /// Frames in which it was found, but blurred.
        blurred: usize,
        /// Frames that are needed.
        needed: usize,
    },
    /// Boards that do not tell the lens.
    #[error("the board frames do not tell the lens: {}", source.with_view_named(file))]
    Lens {
        /// Why.
        source: LensError,
        /// The frame that it is about, if it is about one.
        file: String,
    },
    /// Dark frames that are lighter than flat frames.
    #[error(
        "the dark frames have {dark_dn:.0} DN in the mean, the flat frames {flat_dn:.0} DN: they seem to have been exchanged; give dark frames as \
         dark and flat frames as flat"
    )]
    Exchanged {
        /// Mean of the dark frames, in DN.
        dark_dn: f64,
        /// Mean of the flat frames, in DN.
        flat_dn: f64,
    },
    /// A lens that does not describe the boards.
    #[error(
        "the lens leaves {rms_px:.2} px of the corners' places unexplained (limit {limit_px} px); check that the board is flat and stiff, that [board] describes it, \
         and that nothing was moved or refocused between board frames"
    )]
    LensDoesNotFit {
        /// Root mean square of the residuals, in px.
        rms_px: f64,
        /// The limit, in px.
        limit_px: f64,
    },
    /// A lens for frames of another size.
    #[error(
        "the lens of {name} is for frames of {columns} x {rows}, these are {expected_columns} x {expected_rows}; calibrate with the camera's present format"
    )]
    LensSize {
        /// Where the lens is from.
        name: String,
        /// Its columns.
        columns: usize,
        /// Its rows.
        rows: usize,
        /// Columns of the frames.
        expected_columns: usize,
        /// Rows of the frames.
        expected_rows: usize,
    },
    /// Corners of the target that cannot be told apart, or are not there.
    #[error("the target on the object: {0}")]
    Target(#[from] TargetError),
    /// A target that is out of focus.
    #[error(
        "the target's edges are blurred over {blur_px:.1} px (limit {limit_px} px); focus the camera on the object"
    )]
    TargetBlurred {
        /// Median standard deviation of the blur, in px.
        blur_px: f64,
        /// The limit, in px.
        limit_px: f64,
    },
    /// Positions from a target that is not described.
    #[error(
        "positions from the target are asked for, but no [target] is described; write square, columns, rows (inner corners) into the rig's profile"
    )]
    NoTarget,
    /// A target that is at the same place in all frames.
    #[error(
        "the target moves by {moved_px:.2} px at most from the first frame to the last: the stage or the target did not move, or all frames show one \
         place; look at the frames and take them again"
    )]
    StandsStill {
        /// How far a corner moves at most, in px.
        moved_px: f64,
    },
    /// Measured positions without a scale.
    #[error(
        "the positions were measured, but nothing tells how many mm they are; import the frames with --step-mm or --positions, and calibrate again"
    )]
    NoBaseline,
    /// Tracks that do not tell the stage axis.
    #[error("the target on the object does not tell the stage axis: {0}")]
    StageAxis(#[from] StageAxisError),
    /// Squares that contradict the stage.
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
    /// Frames that do not follow each other.
    #[error(
        "the measured positions of the frames make no baseline: {0}; look at the stage's positioning error, or take the stage's own with --positions stage"
    )]
    Positions(#[from] TauError),
    /// Positions from texture that cannot be found.
    #[error("positions from the texture: {reason}; take the stage's own with --positions stage")]
    Texture {
        /// Why.
        reason: String,
    },
    /// Frames that cannot be rectified.
    #[error(transparent)]
    Rectify(#[from] RectifyError),
    /// The record cannot be read.
    #[error("{}: {reason}; run `epirig calibrate --overwrite` again", path.display())]
    BadRecord {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        reason: String,
    },
    /// A map that belongs to the record.
    #[error("{}: {source}; run `epirig calibrate --overwrite` again", path.display())]
    Map {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        source: FormatError,
    },
    /// The record is of other frames.
    #[error("{} is stale: {what}; run `epirig calibrate --overwrite` again, or ignore it with `match --as-captured`", path.display())]
    Stale {
        /// The file.
        path: PathBuf,
        /// What has changed.
        what: String,
    },
    /// There is a calibration already.
    #[error("{} is there already; add --overwrite to replace it", path.display())]
    Exists {
        /// The file.
        path: PathBuf,
    },
    /// The operating system refused.
    #[error("cannot {action} {}: {source}; check the disk, and that you may write to the sequence's folder", path.display())]
    Io {
        /// What was tried.
        action: &'static str,
        /// On what.
        path: PathBuf,
        /// What the operating system said.
        source: std::io::Error,
    },
}

impl CalibrateError {
    /// Whether the calibration was rejected for what the frames show, rather than failed for another reason.
    pub fn is_rejection(&self) -> bool {
        !matches!(
            self,
            Self::Sequence(_)
                | Self::Read(_)
                | Self::BadRecord { .. }
                | Self::Map { .. }
                | Self::Stale { .. }
                | Self::Exists { .. }
                | Self::Io { .. }
        )
    }
}
