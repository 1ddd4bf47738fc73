//! The lens: from board frames, a file, a data sheet, or unknown.

use super::boards::{MOST_BLUR_PX, refuse_other_size};
use super::frames::read_all;
use super::remarks::Remarks;
use super::{CalibrateError, CalibrationPlan, LensKnowledge, LensRecord, LensSource};
use epirig_calibration::lens::LensEstimate;
use epirig_calibration::lens::views::{
    LensCalibration, LensError, PlanarPoint, View, choose_terms, with_view_named,
};
use epirig_calibration::target::{ChessBoard, FoundBoard, find_boards};
use epirig_core::progress::Progress;
use epirig_data::sequence::{FrameKind, Sequence};

/// Largest RMS residual of a valid lens, in px: ten times that of a paper board with a cheap camera.
const MOST_RMS_PX: f64 = 1.0;
/// Fewest board frames for a lens.
const LEAST_VIEWS: usize = 3;
/// One view of this many may contradict the others; with more contradictions it is unknown which views are
/// right.
const LEAST_AGREEING: usize = 4;
/// Fewest corners of a view: twice those of a homography.
const LEAST_CORNERS: usize = 8;

pub(super) fn find_lens(
    sequence: &Sequence,
    plan: &CalibrationPlan,
    remarks: &mut Remarks,
    progress: &dyn Progress,
) -> Result<LensRecord, CalibrateError> {
    let (rows, columns) = (sequence.record().rows, sequence.record().columns);
    let boards = sequence.calibration_frames(FrameKind::Board);
    let known = |source, estimate| LensRecord {
        source,
        file: None,
        estimate,
        board_frames: None,
        corners_of_board: 0,
        board_files: Vec::new(),
    };
    match (&plan.lens, boards.len()) {
        (Some(LensKnowledge::File { name, estimate }), _) => {
            let (found, expected) = ((estimate.rows, estimate.columns), (rows, columns));
            if found != expected {
                return Err(CalibrateError::LensSize { name: name.clone(), found, expected });
            }
            Ok(LensRecord { file: Some(name.clone()), ..known(LensSource::File, estimate.as_ref().clone()) })
        }
        (Some(LensKnowledge::DataSheet { lens, focal_length_sigma }), 0) => {
            remarks.needs.push(
                "the lens is taken from its data sheet; board frames ([plan] board, [board]) would give focal length and distortion".to_owned(),
            );
            Ok(known(
                LensSource::DataSheet,
                LensEstimate::from_data_sheet(*lens, *focal_length_sigma, rows, columns),
            ))
        }
        (None, 0) => Ok(known(LensSource::Unknown, LensEstimate::unknown(rows, columns))),
        (_, frames) => {
            let board = plan.board.ok_or(CalibrateError::BoardNotDescribed { frames })?;
            let (found, board_files) = from_boards(sequence, &board, remarks, progress)?;
            let estimate = found.estimate.clone();
            let known = known(LensSource::BoardFrames, estimate);
            let corners_of_board = board.corners();
            Ok(LensRecord { board_frames: Some(found), corners_of_board, board_files, ..known })
        }
    }
}

fn from_boards(
    sequence: &Sequence,
    board: &ChessBoard,
    remarks: &mut Remarks,
    progress: &dyn Progress,
) -> Result<(LensCalibration, Vec<String>), CalibrateError> {
    let records = sequence.calibration_frames(FrameKind::Board);
    let frames = read_all(sequence, &records, "reading board frames", progress)?;
    progress.begin("looking for the board", frames.len() as u64);
    let found: Vec<Option<FoundBoard>> = {
        use rayon::prelude::*;
        let find = |frame| {
            if progress.cancelled() {
                return None;
            }
            let found = find_boards(frame, board, 1).into_iter().next();
            progress.advance(1);
            found.filter(|found| found.corners.len() >= LEAST_CORNERS)
        };
        frames.par_iter().map(find).collect()
    };
    progress.end();
    progress.unless_cancelled()?;
    let size = (sequence.record().rows, sequence.record().columns);
    refuse_other_size("board", found.iter().flatten(), board, size)?;
    let mut views: Vec<View> = Vec::new();
    // The file of each view: errors of the lens count views, but users know files.
    let mut files: Vec<&str> = Vec::new();
    let (mut empty, mut blurred): (Vec<&str>, Vec<&str>) = (Vec::new(), Vec::new());
    for (record, found) in records.iter().zip(&found) {
        match found {
            None => empty.push(&record.file),
            Some(found) if found.blur_px > MOST_BLUR_PX => blurred.push(&record.file),
            Some(found) => {
                views.push(view(found, board));
                files.push(&record.file);
            }
        }
    }
    let of = |files: &[&str]| format!("{} of {} board frames", files.len(), records.len());
    if !empty.is_empty() {
        remarks.notes.push(format!("no board was found in {}: {}", of(&empty), empty.join(", ")));
    }
    if !blurred.is_empty() {
        remarks.notes.push(format!(
            "{} left out, blurred over more than {MOST_BLUR_PX} px: {}",
            of(&blurred),
            blurred.join(", ")
        ));
    }
    if views.len() < LEAST_VIEWS {
        return Err(CalibrateError::BoardsNotFound {
            columns: board.columns,
            rows: board.rows,
            found: views.len(),
            frames: records.len(),
            blurred: blurred.len(),
            needed: LEAST_VIEWS,
        });
    }
    progress.begin("calibrating the lens", 1);
    let (rows, columns) = (sequence.record().rows, sequence.record().columns);
    let calibration = without_wrong_views(&mut views, &mut files, (rows, columns), remarks)?;
    progress.end();
    if calibration.rms_px > MOST_RMS_PX {
        return Err(CalibrateError::LensDoesNotFit { rms_px: calibration.rms_px, limit_px: MOST_RMS_PX });
    }
    let name = |view: Option<usize>| view.and_then(|view| files.get(view)).copied().unwrap_or_default();
    let warnings = calibration.warnings.iter();
    remarks
        .needs
        .extend(warnings.map(|warning| with_view_named(warning, warning.view(), name(warning.view()))));
    Ok((calibration, files.into_iter().map(str::to_owned).collect()))
}

/// The lens on which most views agree. A view that fits no lens together with the others is dropped and
/// named. So one frame of another board, or with wrong labels, does not spoil the others.
fn without_wrong_views(
    views: &mut Vec<View>,
    files: &mut Vec<&str>,
    (rows, columns): (usize, usize),
    remarks: &mut Remarks,
) -> Result<LensCalibration, CalibrateError> {
    let mut may_go = views.len() / LEAST_AGREEING;
    loop {
        let error = match choose_terms(views, rows, columns) {
            Ok(calibration) => return Ok(calibration),
            Err(error) => error,
        };
        let file = error.view().and_then(|view| files.get(view)).map_or(String::new(), ToString::to_string);
        match error {
            LensError::ViewWrong { view, rejected, points } if may_go > 0 && views.len() > LEAST_VIEWS => {
                remarks.notes.push(format!(
                    "{file} is left out: it contradicts the other views ({rejected} of its {points} corners are outliers); look at it"
                ));
                views.remove(view);
                files.remove(view);
                may_go -= 1;
            }
            source => return Err(CalibrateError::Lens { source, file }),
        }
    }
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
