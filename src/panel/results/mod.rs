//! The view of a sequence and its results.

mod compare;
mod compare_scans;
mod course;
mod current;
mod epis;
mod facts;
mod files;
mod frames;
mod levelled;
mod levelled_maps;
mod line;
mod maps;
mod mesh;
mod pixel;
mod pyramid;
mod region;
mod row_cost;
mod statistics;
mod surface;
mod value;
mod view;

use super::questions::{Json, Question};
use super::requests::{Nothing, requests};
use epirig_server::Reply;
use frames::FrameKind;
use levelled::levelled_tile;
use pyramid::Place;
use view::ResultsView;

pub(super) use compare_scans::ScansQuestion;
pub use current::CurrentResults;
pub(super) use current::results_questions;
pub(super) use facts::About;

/// Bytes of the largest question with a mask: a picture of 20 million pixels in grey, not compressed, as text.
const LARGEST_MASK: usize = 32 << 20;

requests! {
    /// A tile of a map.
    MapTile {
        id: String,
        level: usize,
        row: usize,
        column: usize,
        /// By what the map is levelled, as in `LevelledQuery`.
        levelled_by: Option<String>,
    }
    /// A tile of a frame.
    FrameTile { t: usize, kind: Option<FrameKind>, level: usize, row: usize, column: usize }
    /// A row of the maps.
    Row { y: usize }
    /// A file of the results, or a picture of the calibration.
    FileName { name: String }
}

/// Questions about tiles, which are in memory and come in great number.
fn tiles() -> Vec<Question<ResultsView>> {
    vec![
        Question::get("maps/{id}/{level}/{row}/{column}", |view: &ResultsView, asked: MapTile| {
            let MapTile { id, level, row, column, levelled_by } = asked;
            let place = Place { level, row, column };
            let tile = match levelled_by {
                Some(by) => levelled_tile(view, &id, &by, place)?,
                None => view.maps.tile(&id, place)?,
            };
            Ok(Reply::numbers(&tile))
        }),
        Question::get("frames/{t}/{level}/{row}/{column}", |view: &ResultsView, asked: FrameTile| {
            let FrameTile { t, kind, level, row, column } = asked;
            Ok(Reply::numbers(&view.frames.picture_of(t, kind)?.tile(Place { level, row, column })?))
        }),
    ]
}

/// All other questions about results: a row for each.
fn questions() -> Vec<Question<ResultsView>> {
    vec![
        Question::get("pixel", |view, asked| Ok(pixel::explain(view, &asked)?)),
        Question::get("value", |view, asked| Ok(Json(value::value(view, &asked)?))),
        Question::get("row-cost", |view, Row { y }| Ok(row_cost::row_cost(view, y)?)),
        Question::get("levelled", |view, asked| Ok(Json(levelled::levelled(view, &asked)?))),
        Question::get("region", |view, asked| Ok(Json(region::region(view, &asked)?))),
        Question::get("line", |view, ends| Ok(Json(line::line(view, &ends)?))),
        Question::get("line.csv", |view, ends| {
            Ok(Reply::of("text/csv; charset=utf-8", line::csv(view, &ends)?))
        }),
        Question::get("trends", |_, Nothing {}| Ok(Json(surface::trends()))),
        Question::get("mesh", |view, asked| Ok(mesh::mesh(view, &asked)?)),
        Question::get("compare", |view, asked| Ok(compare::compare(view, &asked)?)),
        Question::get("stage", |view, Nothing {}| Ok(Json(course::course(view)))),
        Question::get("calibration", |view, Nothing {}| Ok(Json(files::calibration(view)))),
        Question::get("calibration/{name}", |view, FileName { name }| {
            Ok(files::calibration_picture(view, &name)?)
        }),
        Question::get("downloads", |view, Nothing {}| Ok(Json(files::downloads(view)))),
        Question::get("download/{name*}", |view, FileName { name }| Ok(files::download(view, &name)?)),
        // It changes nothing.
        Question::post("surface", |view, asked| Ok(Json(surface::surface(view, asked)?)))
            .open()
            .up_to(LARGEST_MASK),
    ]
}
