//! The sections `target` and `board`: the measured object, and chess-boards.

use super::section::{Allowed, Kind, Setting, from_value, measure, section};
use epirig_calibration::target::{ChessBoard, Target};
use epirig_core::choice::{Choice as _, names};
use epirig_core::settings::quantity::{MM, PERCENT};
use epirig_surface::conformity::{DecisionRule, Rule, Specification, Tolerance};

/// Corners per row and column; no camera resolves more.
const CORNERS: Kind = Kind::Whole(2, 1000);

section! {
    /// The measured object, and the chess-boards printed on it.
    pub struct TargetProfile in "target" {
        /// Height difference that the measurement must resolve.
        "relief" => relief_mm: Option<f64> = measure(MM, Allowed::Positive), like "0.2 mm";
        /// Limits of what is measured, which the verdict is about.
        "tolerance" => tolerance: Tolerance = TOLERANCE, like "depth 0.19..0.21 mm, sa ..5 um";
        /// How the verdict is reached: guarded-risk (ISO 14253-1, proven with at most the risk), guarded-coverage (beyond
        /// a guard band of the expanded uncertainty), or simple (the value alone).
        "decision_rule" => decision_rule: DecisionRule = Kind::Choice(names::<DecisionRule>), like "simple" or "guarded-risk";
        /// Largest probability of a wrong verdict, for guarded-risk.
        "risk" => risk: f64 = measure(PERCENT, Allowed::UpTo(50.0)), like "2.5 %" or "5 %";
        /// Side of a square of the chess-boards on the object, measured with a ruler; omit it if there are
        /// none.
        "square" => square_mm: Option<f64> = measure(MM, Allowed::Positive), like "7.5 mm";
        /// Inner corners of a chess-board along the travel: one less than squares.
        "columns" => columns: Option<usize> = CORNERS, like "18";
        /// Inner corners of a chess-board across the travel.
        "rows" => rows: Option<usize> = CORNERS, like "2";
        /// Number of chess-boards: one, or two with the relief between them.
        "bands" => bands: usize = Kind::Whole(1, 2), like "2" or "1";
        /// For two: distance from the first row of inner corners of the upper board to that of the lower.
        "band_distance" => band_distance_mm: Option<f64> = measure(MM, Allowed::Positive), like "127.5 mm";
    }
}

const TOLERANCE: Kind =
    Kind::Form { allowed: Tolerance::ALLOWED, is_valid: |text| text.parse::<Tolerance>().is_ok() };

from_value! {
    Tolerance: Setting::Text(text) => text.parse().ok();
    DecisionRule: Setting::Text(name) => Self::from_name(&name);
}

section! {
    /// The hand-held chess-board, to calibrate the lens.
    pub struct BoardProfile in "board" {
        /// Side of a square, measured with a ruler.
        "square" => square_mm: Option<f64> = measure(MM, Allowed::Positive), like "16 mm";
        /// Inner corners per row: one less than squares.
        "columns" => columns: Option<usize> = CORNERS, like "9";
        /// Rows of inner corners.
        "rows" => rows: Option<usize> = CORNERS, like "6";
    }
}

impl TargetProfile {
    /// What is asked of the surface.
    pub fn specification(&self) -> Specification {
        let rule = Rule { decision: self.decision_rule, risk: self.risk };
        Specification { tolerance: self.tolerance.clone(), rule }
    }

    /// The chess-boards printed on the object; `None`: unknown or absent.
    pub fn print(&self) -> Option<Target> {
        let Self { square_mm, columns, rows, bands, band_distance_mm, .. } = *self;
        let board = BoardProfile { square_mm, columns, rows }.chess_board()?;
        Some(Target { board, bands, band_distance_mm: band_distance_mm.unwrap_or(0.0) })
    }
}

impl BoardProfile {
    /// The chess-board, if all of it is given.
    pub fn chess_board(&self) -> Option<ChessBoard> {
        let Self { square_mm, columns, rows } = *self;
        Some(ChessBoard { columns: columns?, rows: rows?, square_mm: square_mm? })
    }
}
