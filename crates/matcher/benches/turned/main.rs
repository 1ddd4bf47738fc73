//! The error of the whole match on structures at any angle, with textures and seeds that nothing was tuned on.
//!
//! `cargo bench -p epirig-matcher --bench turned [-- --seed N] [--quick] [--lines]` prints a table in
//! Markdown, a row for each scene: errors in px and in units of sigma, and the time. `--test` takes two small
//! scenes. `--depths` prints another table: how well the depth of hollows is measured, by width, depth and shape.

#![allow(clippy::unwrap_used, missing_docs, reason = "a bench stops at the first thing that does not work")]

mod depths;
mod render;
mod scenes;
#[allow(dead_code, reason = "tests use the figures")]
mod score;
mod texture;

use std::time::Instant;

use epirig_core::progress::Silent;
use epirig_matcher::{MatchOptions, ReferenceFrame, Surfaces, match_volume};
use render::{Size, rendered};
use scenes::scenes;
use score::Score;

/// Mean error of the small scenes of `--test`, at most, in px: half of the relief that epirig is built for, 0.1 px.
const MOST_PX: f64 = 0.05;

fn main() {
    let arguments: Vec<String> = std::env::args().collect();
    let given = |name: &str| arguments.iter().any(|argument| argument == name);
    let place = arguments.iter().position(|argument| argument == "--seed");
    let seed = place.map_or(1, |place| arguments[place + 1].parse().unwrap());
    let is_test = given("--test");
    let size = if is_test { Size { side_px: 64, frames: 15 } } else { Size { side_px: 256, frames: 51 } };
    let surfaces = if given("--lines") { Surfaces::Lines } else { Surfaces::Windows };
    let options = MatchOptions { reference: ReferenceFrame::Middle, surfaces, ..MatchOptions::default() };
    let options = if given("--quick") { options.quick() } else { options };
    if given("--depths") {
        depths::print_table(seed, size, &options);
        return;
    }
    println!("{}", Score::HEAD);
    for scene in scenes(seed).into_iter().take(if is_test { 2 } else { usize::MAX }) {
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
