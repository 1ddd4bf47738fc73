//! The depth of hollows as `epirig surface` measures it: how far it is off, and how often its interval holds.
//!
//! `cargo bench -p epirig-surface --bench depths [-- --seed N] [--frames N]` prints a table in Markdown, a row
//! for each width, depth and shape; `--test` measures one small scene.

#![allow(clippy::unwrap_used, missing_docs, reason = "a bench stops at the first thing that does not work")]

#[path = "../../../matcher/benches/turned/light.rs"]
mod light;
#[path = "../../../matcher/benches/turned/render.rs"]
mod render;
#[allow(dead_code, reason = "the matcher's bench has more scenes")]
#[path = "../../../matcher/benches/turned/scenes.rs"]
mod scenes;
#[allow(dead_code, reason = "the matcher's bench has more textures")]
#[path = "../../../matcher/benches/turned/texture.rs"]
mod texture;

use epirig_core::progress::Silent;
use epirig_core::volume::Volume;
use epirig_matcher::evaluate::match_halves;
use epirig_matcher::{EQUAL_DISCS_PX, GROWN_DISCS_PX, MatchOptions, match_volume};
use epirig_surface::{Geometry, StepsOptions, TrendKind, find_extent, find_steps, heights};

use light::Light;
use render::{Size, rendered};
use scenes::{BASE_PX, Disparity, Scene, across, walled};
use texture::Paint;

/// The shape of hollows.
#[derive(Debug, Clone, Copy)]
enum Shape {
    /// Turned by so many degrees from the columns; as far apart as they are wide.
    Stripes(f64),
    /// Round, in squares twice as wide as they.
    Pits,
}

impl Shape {
    fn name(self) -> String {
        match self {
            Self::Stripes(degrees) => format!("stripes, {degrees} deg"),
            Self::Pits => "pits".to_owned(),
        }
    }
}

/// Hollows of one kind.
#[derive(Debug, Clone, Copy)]
struct Hollows {
    shape: Shape,
    /// At half of their depth, in px.
    width_px: f64,
    /// In px of disparity.
    depth_px: f64,
}

impl Hollows {
    /// A plane with such hollows. Where they begin differs from seed to seed.
    fn scene(&self, seed: u64) -> Scene {
        let &Self { shape, width_px, depth_px } = self;
        let shift = (seed as f64 * 0.618_034).fract() * 2.0 * width_px;
        let near = move |place: f64| (place + shift).rem_euclid(2.0 * width_px) - width_px;
        let disparity: Disparity = match shape {
            Shape::Stripes(degrees) => {
                let across = across(degrees);
                Box::new(move |x, y| BASE_PX - depth_px * walled(0.5 * width_px - near(across(x, y)).abs()))
            }
            Shape::Pits => {
                Box::new(move |x, y| BASE_PX - depth_px * walled(0.5 * width_px - near(x).hypot(near(y))))
            }
        };
        Scene {
            name: shape.name(),
            disparity,
            paint: Paint::Grains,
            noise_dn: 1.0,
            depth_px: Some(depth_px),
            rectified: false,
            light: Light::Steady,
            seed: seed.wrapping_mul(7919),
        }
    }
}

/// Depths of hollows, in px of disparity: 0.05, 0.2 and 1 mm of the paper's tile.
const DEPTHS_PX: [f64; 3] = [0.025, 0.1, 0.5];
/// Their widths, in px of the image: 2, 4 and 8 mm of that tile.
const WIDTHS_PX: [f64; 3] = [6.3, 12.6, 25.3];
/// Scenes of each kind.
const SEEDS: u64 = 6;
const SHAPES: [Shape; 3] = [Shape::Stripes(0.0), Shape::Stripes(30.0), Shape::Pits];
/// Focal length in px and baseline in mm, so that 0.1 px is 0.2 mm deep.
const FOCAL_PX: f64 = 1000.0;
const BASELINE_MM: f64 = 0.648;

/// What was measured, if anything was: by how much it is off and half the width of its interval, over the true
/// depth; and its standard uncertainty in the same unit.
type Measured = Result<[f64; 3], String>;

fn main() {
    let arguments: Vec<String> = std::env::args().collect();
    let after = |name: &str| {
        let place = arguments.iter().position(|argument| argument == name)?;
        arguments[place + 1].parse::<u64>().ok()
    };
    let seed = after("--seed").unwrap_or(1);
    let options = MatchOptions::default();
    if arguments.iter().any(|argument| argument == "--test") {
        let hollows = Hollows { shape: Shape::Stripes(0.0), width_px: 25.3, depth_px: 0.5 };
        let volume = rendered(&hollows.scene(seed), Size { side_px: 128, frames: 21 });
        let [off, ..] = measured(&volume, hollows.depth_px, &options).unwrap();
        // With twice the pixels and frames it is some thousandths.
        assert!(off.abs() < 0.02, "the depth is off by {off} of itself");
        return;
    }
    let frames = after("--frames").map_or(51, |frames| frames as usize);
    print_table(seed, Size { side_px: 256, frames }, &options);
}

/// A row for each kind of hollows; reasons of refusals differ by their numbers alone, so the first is told.
fn print_table(first_seed: u64, size: Size, options: &MatchOptions) {
    println!(
        "| hollows | width, px | depth, px | off, % | +- | in sigma | spread | stated +-, % | intervals hold | refused |\n\
         | --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | --- |"
    );
    let kinds = SHAPES
        .iter()
        .flat_map(|&shape| WIDTHS_PX.map(|width_px| (shape, width_px)))
        .flat_map(|(shape, width_px)| DEPTHS_PX.map(|depth_px| Hollows { shape, width_px, depth_px }));
    for hollows in kinds {
        let all: Vec<Measured> = (first_seed..first_seed + SEEDS)
            .map(|seed| {
                let scene = hollows.scene(seed);
                measured(&rendered(&scene, size), hollows.depth_px, options)
            })
            .collect();
        println!("{}", line(&hollows, &all));
    }
}

fn measured(volume: &Volume, depth_px: f64, options: &MatchOptions) -> Measured {
    let maps = match_volume(volume, options, &Silent).map_err(|error| error.to_string())?;
    let halves = match_halves(volume, maps.reference, options, &Silent).map_err(|error| error.to_string())?;
    let middle = |pixels: usize| 0.5 * (pixels - 1) as f64;
    let geometry = Geometry::exact(FOCAL_PX, BASELINE_MM, (middle(volume.columns()), middle(volume.rows())));
    let heights = heights(geometry, &maps.disparity, &maps.sigma).ok_or("no heights")?;
    let options =
        StepsOptions::for_window(TrendKind::Quadric, EQUAL_DISCS_PX).with_grown_window(GROWN_DISCS_PX);
    let extent = find_extent(&heights, None, (options.margin_px, options.rim_px()))
        .map_err(|error| error.to_string())?;
    let halves = halves.map(|half| heights.of_half(&half).only(&extent.used));
    let steps = find_steps(&heights.only(&extent.used), Some(&halves), &options)
        .map_err(|error| error.to_string())?;
    let true_mm = FOCAL_PX * BASELINE_MM * (1.0 / (BASE_PX - depth_px) - 1.0 / BASE_PX);
    let combined = steps.budget.combined.ok_or("no interval")?;
    Ok([steps.depth.depth_mm - true_mm, combined.half_width_95_mm, combined.sigma_mm].map(|mm| mm / true_mm))
}

fn line(hollows: &Hollows, all: &[Measured]) -> String {
    let known: Vec<&[f64; 3]> = all.iter().flatten().collect();
    let count = known.len() as f64;
    let mean = |of: &dyn Fn(&[f64; 3]) -> f64| known.iter().map(|one| of(one)).sum::<f64>() / count;
    let off = mean(&|[off, ..]| *off);
    let spread = (mean(&|[other, ..]| (other - off).powi(2)) * count / (count - 1.0)).sqrt();
    let z = mean(&|[off, _, sigma]| off / sigma);
    let z_spread = (mean(&|[off, _, sigma]| (off / sigma - z).powi(2)) * count / (count - 1.0)).sqrt();
    let holds = known.iter().filter(|[off, half_width, _]| off.abs() <= *half_width).count();
    let refused = all.len() - known.len();
    let why = all.iter().find_map(|one| one.as_ref().err()).map_or("", |why| why);
    format!(
        "| {} | {} | {} | {:+.2} | {:.2} | {z:+.2} | {z_spread:.2} | {:.2} | {holds} of {} | {refused} {why} |",
        hollows.shape.name(),
        hollows.width_px,
        hollows.depth_px,
        100.0 * off,
        100.0 * spread / count.sqrt(),
        100.0 * mean(&|[_, half_width, _]| *half_width),
        known.len(),
    )
}
