//! The view of a sequence and its results.

mod compare;
mod course;
mod current;
mod epis;
mod facts;
mod files;
mod frames;
mod line;
mod maps;
mod mesh;
mod pixel;
mod pyramid;
mod row_cost;
mod statistics;
mod surface;
mod value;
mod view;

use serde_json::Value;

use epirig_server::{LARGEST_ORDER, Query, Refusal, Reply};
use view::ResultsView;

pub use current::CurrentResults;

/// Bytes of the largest question with a mask: a picture of 20 million pixels in grey, not compressed, as text.
const LARGEST_MASK: usize = 32 << 20;

/// Bytes of the largest question that is read at a path.
pub(super) fn largest_question(path: &[&str]) -> usize {
    match path {
        ["surface"] => LARGEST_MASK,
        _ => LARGEST_ORDER,
    }
}

/// The questions that are answered: a line for each.
impl ResultsView {
    fn get(&self, path: &[&str], query: &Query) -> Result<Reply, Refusal> {
        match path {
            ["maps", id, level, row, column] => {
                Ok(Reply::numbers(&self.maps.tile(id, pyramid::Place::parse([level, row, column])?)?))
            }
            ["frames", t, level, row, column] => {
                let place = pyramid::Place::parse([level, row, column])?;
                Ok(Reply::numbers(&self.frames.tile(t, query.text("kind"), place)?))
            }
            ["pixel"] => pixel::explain(self, query.value("x")?, query.value("y")?),
            ["value"] => Reply::json(&value::value(self, query)?),
            ["row-cost"] => row_cost::row_cost(self, query.value("y")?),
            ["line"] => Reply::json(&line::line(self, query)?),
            ["line.csv"] => Ok(Reply::file("text/csv; charset=utf-8", line::csv(self, query)?)),
            ["trends"] => Reply::json(&surface::trends()),
            ["mesh"] => mesh::mesh(self, query),
            ["compare"] => compare::compare(self, query),
            ["stage"] => Reply::json(&course::course(self)),
            ["calibration"] => Reply::json(&files::calibration(self)),
            ["calibration", name] => files::calibration_picture(self, name),
            ["downloads"] => Reply::json(&files::downloads(self)),
            ["download", name @ ..] => files::download(self, &name.join("/")),
            _ => Err(Refusal::unknown(path)),
        }
    }

    fn post(&self, path: &[&str], asked: &Value) -> Result<Reply, Refusal> {
        match path {
            ["surface"] => Reply::json(&surface::surface(self, asked)?),
            _ => Err(Refusal::unknown(path)),
        }
    }
}
