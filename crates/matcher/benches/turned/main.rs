//! The error of the whole match on structures at any angle, with textures and seeds that nothing was tuned on.
//!
//! `cargo bench -p epirig-matcher --bench turned [-- --seed N] [--only TEXT] [--frames N]
//! [--quick]` prints a table in Markdown, a row for each scene: errors in px and in units of sigma,
//! and the time. `--only TEXT` takes the scenes whose names hold that, `--test` two small ones.
//! How well the depth of hollows is measured is told by the bench `depths` of `epirig-surface`.

#![allow(clippy::unwrap_used, missing_docs, reason = "a bench stops at the first thing that does not work")]

mod light;
mod render;
mod scenes;
#[allow(dead_code, reason = "tests use the figures")]
mod score;
mod texture;

use std::time::Instant;

use epirig_core::progress::Silent;
use epirig_matcher::{MatchOptions, ReferenceFrame, match_volume};
use render::{Size, rendered};
use scenes::scenes;
use score::Score;

/// Mean error of the small scenes of `--test`, at most, in px: half of the relief that epirig is built for, 0.1 px.
const MOST_PX: f64 = 0.05;

fn main() {
    let arguments: Vec<String> = std::env::args().collect();
    let given = |name: &str| arguments.iter().any(|argument| argument == name);
    let after =
        |name: &str| arguments.iter().position(|argument| argument == name).map(|at| &arguments[at + 1]);
    let seed = after("--seed").map_or(1, |seed| seed.parse().unwrap());
    let frames = after("--frames").map_or(51, |frames| frames.parse().unwrap());
    let is_test = given("--test");
    let size = if is_test { Size { side_px: 64, frames: 15 } } else { Size { side_px: 256, frames } };
    let options = MatchOptions { reference: ReferenceFrame::Middle, ..MatchOptions::default() };
    let options = if given("--quick") { options.quick() } else { options };
    println!("{}", Score::HEAD);
    let only = after("--only").map_or("", String::as_str);
    let asked = scenes(seed).into_iter().filter(|scene| scene.name.contains(only));
    for scene in asked.take(if is_test { 2 } else { usize::MAX }) {
        let volume = rendered(&scene, size);
        let begun = Instant::now();
        let maps = match_volume(&volume, &options, &Silent).unwrap();
        let seconds = begun.elapsed().as_secs_f64();
        let score = Score::of(&scene, &maps);
        println!("{}", score.line(&scene.name, seconds));
        // The error that a match of another frame than the truth's would have is some tenths of a pixel.
        assert!(!is_test || score.mean_px() < MOST_PX, "{}: mean error {} px", scene.name, score.mean_px());
    }
}
