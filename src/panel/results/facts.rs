//! What the page is told first: of the program, the sequence, and its results.

use serde::Serialize;
use serde_json::Value;

use super::frames::FrameKind;
use super::view::{RESULTS, ResultsView};
use crate::panel::results::maps::MapInfo;
use crate::results::{MatchSummary, ResultsKind, results_beside};
use epirig_core::grid::Grid;
use epirig_data::sequence::Origin;

/// The program, and what it shows.
#[derive(Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub(in crate::panel) struct About {
    program: &'static str,
    version: &'static str,
    /// `view` or `ui`.
    #[cfg_attr(test, ts(type = "'view' | 'ui'"))]
    mode: &'static str,
    /// Whether there is a rig.
    rig: bool,
    sequence: Option<String>,
    /// Which results are there; another text after another match, or for another sequence.
    results: Option<String>,
}

impl About {
    pub(in crate::panel) fn of(
        mode: &'static str,
        rig: bool,
        sequence: Option<String>,
        results: Option<String>,
    ) -> Self {
        Self { program: "epirig", version: env!("CARGO_PKG_VERSION"), mode, rig, sequence, results }
    }
}

pub(super) fn about(view: &ResultsView) -> About {
    About::of("view", false, Some(view.sequence.name()), Some(view.id.clone()))
}

#[derive(Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub(super) struct Results<'a> {
    id: &'a str,
    sequence: SequenceInfo<'a>,
    results: Option<MatchInfo<'a>>,
    others: Vec<String>,
    geometry: Option<Geometry>,
    #[cfg_attr(test, ts(as = "Option<crate::results::SurfaceSummary>"))]
    surface: Option<Value>,
    /// What exists and is not shown, and why.
    unfit: Option<&'a str>,
    /// The part of the picture that has answers: x and y of its first pixel, and of the one after its last.
    answered_px: Option<[usize; 4]>,
    maps: Vec<MapInfo<'a>>,
    frames: FramesInfo,
}

#[derive(Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
struct SequenceInfo<'a> {
    name: String,
    uid: &'a str,
    created: &'a str,
    frames: usize,
    rows: usize,
    columns: usize,
    bit_depth: u8,
    ended: &'static str,
    end_in_words: Option<String>,
    origin: String,
}

#[derive(Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
struct MatchInfo<'a> {
    name: String,
    calibrated: bool,
    quick: bool,
    #[serde(flatten)]
    summary: &'a MatchSummary,
    tau: Vec<f64>,
}

#[derive(Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
struct Geometry {
    pixel_mm: f64,
    distance_mm: f64,
    /// The place whose lateral coordinates are zero: where the optical axis meets the image.
    origin_px: [f64; 2],
}

#[derive(Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
struct FramesInfo {
    count: usize,
    rows: usize,
    columns: usize,
    bit_depth: u8,
    reference: usize,
    kinds: Vec<FrameKind>,
    matched: FrameKind,
}

pub(super) fn results(view: &ResultsView) -> Results<'_> {
    let record = view.sequence.record();
    let opened = view.results.as_ref();
    let matched = opened.map(|opened| &opened.matched);
    let heights = opened.and_then(|opened| opened.heights.as_ref());
    let calibration = opened.and_then(|opened| opened.calibration.as_ref());
    let calibrated = calibration.is_some();
    let tau = calibration.map(|(calibration, _)| calibration.positions.tau.clone());
    let tau = tau.or_else(|| view.sequence.tau().ok().map(|tau| tau.values().to_vec())).unwrap_or_default();
    Results {
        id: &view.id,
        sequence: SequenceInfo {
            name: view.sequence.name(),
            uid: &record.uid,
            created: &record.created,
            frames: view.sequence.frames().len(),
            rows: record.rows,
            columns: record.columns,
            bit_depth: record.bit_depth,
            ended: view.sequence.ended(),
            end_in_words: view.sequence.end_in_words(),
            origin: origin(&record.origin),
        },
        results: matched.map(|summary| MatchInfo {
            name: file_name(&view.folder),
            calibrated,
            quick: summary.settings.quick,
            summary,
            tau,
        }),
        others: results_beside(view.sequence.folder())
            .into_iter()
            .filter(|name| view.sequence.folder().join(name) != view.folder)
            .collect(),
        geometry: heights.map(|heights| Geometry {
            pixel_mm: heights.pixel_mm(),
            distance_mm: heights.distance_mm,
            origin_px: [heights.geometry.principal_point_x_px, heights.geometry.principal_point_y_px],
        }),
        surface: surface(view),
        unfit: view.unfit.as_deref(),
        answered_px: opened.and_then(|opened| answered(&opened.disparity)),
        maps: view.maps.facts(),
        frames: FramesInfo {
            count: view.sequence.frames().len(),
            rows: record.rows,
            columns: record.columns,
            bit_depth: record.bit_depth,
            reference: matched.map_or(0, |summary| summary.reference),
            kinds: view.frames.kinds(),
            matched: if calibrated { FrameKind::Rectified } else { FrameKind::Raw },
        },
    }
}

/// The answers of `epirig surface`, if they are there.
fn surface(view: &ResultsView) -> Option<Value> {
    let record = view.surface.as_ref()?.bytes(ResultsKind::Surface.summary()).ok()??;
    serde_json::from_slice(&record).ok()
}

/// The part of a map that has values. On each side it leaves out as much as holds one value in a thousand: single
/// pixels far off are no part of an object.
fn answered(map: &Grid<f32>) -> Option<[usize; 4]> {
    let (mut by_column, mut by_row) = (vec![0; map.columns()], vec![0; map.rows()]);
    for (y, in_row) in by_row.iter_mut().enumerate() {
        for (x, _) in map.row(y).iter().enumerate().filter(|(_, value)| value.is_finite()) {
            by_column[x] += 1;
            *in_row += 1;
        }
    }
    let few = by_row.iter().sum::<usize>() / 1000;
    // How many counts at the beginning hold no more than that together.
    let left_out = |counts: &mut dyn Iterator<Item = &usize>| {
        let sums = counts.scan(0, |sum, count| {
            *sum += count;
            Some(*sum)
        });
        sums.take_while(|sum| *sum <= few).count()
    };
    let ends = |counts: &[usize]| {
        let (before, after) = (left_out(&mut counts.iter()), left_out(&mut counts.iter().rev()));
        (before < counts.len()).then(|| (before, counts.len() - after))
    };
    let ((x0, x1), (y0, y1)) = (ends(&by_column)?, ends(&by_row)?);
    Some([x0, y0, x1, y1])
}

fn origin(origin: &Origin) -> String {
    match origin {
        Origin::Captured { stage, camera, .. } => format!("captured with {camera} and {stage}"),
        Origin::Imported { folder, .. } => format!("imported from {folder}"),
        Origin::Rectified { folder, .. } => format!("corrected and rectified frames of {folder}"),
    }
}

fn file_name(path: &std::path::Path) -> String {
    let absolute = std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
    absolute.file_name().map_or_else(|| RESULTS.to_owned(), |name| name.to_string_lossy().into_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_part_with_answers_leaves_out_single_pixels() {
        let mut map = Grid::filled(60, 80, f32::NAN);
        assert_eq!(answered(&map), None);
        for y in 10..50 {
            map.row_mut(y)[20..70].fill(1.0);
        }
        assert_eq!(answered(&map), Some([20, 10, 70, 50]));
        // One of 2,002 pixels far off on two sides.
        map.row_mut(2)[75] = 1.0;
        map.row_mut(58)[3] = 1.0;
        assert_eq!(answered(&map), Some([20, 10, 70, 50]));
        assert_eq!(answered(&Grid::filled(3, 4, 0.0)), Some([0, 0, 4, 3]));
    }
}
