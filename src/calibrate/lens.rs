//! The lens: from board frames, a file, a data sheet, or nowhere.

use super::find::{Remarks, read_all};
use super::plan::{from_data_sheet, unknown};
use super::{CalibrateError, CalibrationPlan, LensKnowledge, LensRecord, LensSource};
use crate::lens::views::{LensCalibration, PlanarPoint, View, choose_terms};
use crate::progress::Progress;
use crate::sequence::{FrameKind, Sequence};
use crate::target::{ChessBoard, FoundBoard, find_boards};

/// Edges that are blurred over more, as a standard deviation: a corner's place then depends on how the blur is shaped, which differs over the field.
pub(super) const MOST_BLUR_PX: f64 = 3.0;
/// Root mean square of the residuals beyond which a lens describes nothing: ten times that of a board on paper by a cheap camera.
const MOST_RMS_PX: f64 = 1.0;
/// Board frames without which no lens is searched.
const LEAST_VIEWS: usize = 3;
/// Corners of a view without which it is left out: twice those of a homography.
const LEAST_CORNERS: usize = 8;

pub(super) fn find_lens(
    sequence: &Sequence,
    plan: &CalibrationPlan,
    remarks: &mut Remarks,
    progress: &dyn Progress,
) -> Result<LensRecord, CalibrateError> {
    let (rows, columns) = (sequence.record().rows, sequence.record().columns);
    let boards = sequence.calibration_frames(FrameKind::Board);
    let known = |source, estimate| LensRecord { source, file: None, estimate, board_frames: None };
    match (&plan.lens, boards.len()) {
        (Some(LensKnowledge::File { name, estimate }), _) => {
            if (estimate.rows, estimate.columns) != (rows, columns) {
                return Err(CalibrateError::LensSize {
                    name: name.clone(),
                    columns: estimate.columns,
                    rows: estimate.rows,
                    expected_columns: columns,
                    expected_rows: rows,
                });
            }
            Ok(LensRecord { file: Some(name.clone()), ..known(LensSource::File, estimate.clone()) })
        }
        (Some(LensKnowledge::DataSheet { lens, focal_length_sigma }), 0) => {
            remarks.needs.push(
                "the lens is as its data sheet says; board frames ([plan] board, [board]) would tell focal length and distortion".to_owned(),
            );
            Ok(known(LensSource::DataSheet, from_data_sheet(*lens, *focal_length_sigma, rows, columns)))
        }
        (None, 0) => Ok(known(LensSource::Unknown, unknown(rows, columns))),
        (_, frames) => {
            let board = plan.board.ok_or(CalibrateError::BoardNotDescribed { frames })?;
            let found = from_boards(sequence, &board, remarks, progress)?;
            let estimate = found.estimate.clone();
            Ok(LensRecord { board_frames: Some(found), ..known(LensSource::BoardFrames, estimate) })
        }
    }
}

fn from_boards(
    sequence: &Sequence,
    board: &ChessBoard,
    remarks: &mut Remarks,
    progress: &dyn Progress,
) -> Result<LensCalibration, CalibrateError> {
    let records = sequence.calibration_frames(FrameKind::Board);
    let frames = read_all(sequence, &records, "reading board frames", progress)?;
    progress.begin("looking for the board", frames.len() as u64);
    let found: Vec<Option<FoundBoard>> = {
        use rayon::prelude::*;
        let find = |frame| {
            let found = find_boards(frame, board, 1).into_iter().next();
            progress.advance(1);
            found.filter(|found| found.corners.len() >= LEAST_CORNERS)
        };
        frames.par_iter().map(find).collect()
    };
    progress.end();
    let mut views: Vec<View> = Vec::new();
    // Where each view is from: messages of the lens count views, a person counts files.
    let mut files: Vec<&str> = Vec::new();
    let mut blurred = 0;
    for (record, found) in records.iter().zip(&found) {
        match found {
            None => remarks.notes.push(format!("{}: no board is found", record.file)),
            Some(found) if found.blur_px > MOST_BLUR_PX => {
                blurred += 1;
                remarks
                    .notes
                    .push(format!("{}: blurred over {:.1} px, left out", record.file, found.blur_px));
            }
            Some(found) => {
                views.push(view(found, board));
                files.push(&record.file);
            }
        }
    }
    if views.len() < LEAST_VIEWS {
        return Err(CalibrateError::BoardsNotFound {
            columns: board.columns,
            rows: board.rows,
            found: views.len(),
            frames: records.len(),
            blurred,
            needed: LEAST_VIEWS,
        });
    }
    progress.begin("calibrating the lens", 1);
    let (rows, columns) = (sequence.record().rows, sequence.record().columns);
    let calibration = choose_terms(&views, rows, columns)?;
    progress.end();
    if calibration.rms_px > MOST_RMS_PX {
        return Err(CalibrateError::LensDoesNotFit { rms_px: calibration.rms_px, limit_px: MOST_RMS_PX });
    }
    remarks.notes.push(format!("views of the lens are, from 0: {}", files.join(", ")));
    remarks.needs.extend(calibration.warnings.iter().map(ToString::to_string));
    Ok(calibration)
}

fn view(found: &FoundBoard, board: &ChessBoard) -> View {
    found
        .corners
        .iter()
        .map(|seen| PlanarPoint {
            x_mm: f64::from(seen.column) * board.square_mm,
            y_mm: f64::from(seen.row) * board.square_mm,
            x_px: seen.corner.x_px,
            y_px: seen.corner.y_px,
            sigma_px: seen.corner.sigma_px,
        })
        .collect()
}
