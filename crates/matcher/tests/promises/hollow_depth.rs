//! Hollows 0.2 mm deep in a tile 900 mm away are asked to be measured to 0.003 mm together, and to 0.010 mm
//! each.

use crate::promises::{Bounds, Figures, Promise};
use epirig_core::grid::Grid;
use epirig_core::progress::Silent;
use epirig_matcher::{MatchOptions, match_volume};
use epirig_simulator::{Simulator, SimulatorConfig};

const FRAMES: usize = 100;
const DEPTH_MM: f64 = 0.2;
/// Pixels nearer than this to a wall are left out.
const CLEAR_OF_WALLS_PX: usize = 2;
/// Rows of the strip across the tile that is looked at; all hollows cross it.
const ROWS: usize = 256;

const MEAN_OFF_MM: Promise = Promise::as_asked(Bounds::at_most(0.003));
const WORST_OFF_MM: Promise = Promise::as_asked(Bounds::at_most(0.010));

/// A hollow or a ridge between two: its columns clear of walls.
struct Level {
    hollow: bool,
    columns: std::ops::Range<usize>,
}

/// What crosses row `y`, from left to right, where the tile is in view.
fn levels(height_mm: &Grid<f32>, y: usize) -> Vec<Level> {
    let row = height_mm.row(y);
    let kind = |x: usize| match row[x] {
        height if height.abs() < 1e-3 => Some(false),
        height if (f64::from(height) + DEPTH_MM).abs() < 1e-3 => Some(true),
        _ => None,
    };
    let mut levels = Vec::new();
    let mut first = 0;
    while first < row.len() {
        let end = (first..row.len()).find(|&x| kind(x) != kind(first)).unwrap_or(row.len());
        let columns = first + CLEAR_OF_WALLS_PX..end.saturating_sub(CLEAR_OF_WALLS_PX);
        if let Some(hollow) = kind(first)
            && !columns.is_empty()
        {
            levels.push(Level { hollow, columns });
        }
        first = end;
    }
    levels
}

#[test]
fn the_hollows_of_the_ideal_tile_have_their_depth() {
    let mut config = SimulatorConfig::tile(1024, FRAMES);
    config.optics.rows = ROWS;
    config.optics.principal_point_y_px = 0.5 * (ROWS as f64 - 1.0);
    config.sensor.read_noise_dn = 1.0;
    let baseline_mm = config.scan.step_mm * (FRAMES - 1) as f64;
    let focal_length_px = config.optics.focal_length_px;
    let simulator = Simulator::new(config).unwrap();
    let maps =
        match_volume(&simulator.render_volume(&Silent).unwrap(), &MatchOptions::default(), &Silent).unwrap();
    let truth = simulator.truth(maps.reference).unwrap();

    // Z = f b / d of all answered pixels of a level. Walls are upright, so one row tells all columns.
    let depth_mm = |level: &Level| {
        let row = |y: usize| maps.disparity.row(y)[level.columns.clone()].iter();
        let known: Vec<f64> = (0..ROWS)
            .flat_map(row)
            .filter(|disparity| !disparity.is_nan())
            .map(|&disparity| focal_length_px * baseline_mm / f64::from(disparity))
            .collect();
        let pixels = ROWS * level.columns.len();
        assert!(2 * known.len() > pixels, "{:?}: {} of {pixels} answered", level.columns, known.len());
        known.iter().sum::<f64>() / known.len() as f64
    };
    let levels = levels(&truth.height_mm, ROWS / 2);
    let each: Vec<f64> = levels
        .windows(3)
        .filter(|three| three[1].hollow && !three[0].hollow && !three[2].hollow)
        .map(|three| depth_mm(&three[1]) - 0.5 * (depth_mm(&three[0]) + depth_mm(&three[2])))
        .collect();
    let mean = each.iter().sum::<f64>() / each.len() as f64;
    let worst = each.iter().map(|depth| (depth - DEPTH_MM).abs()).fold(0.0, f64::max);
    println!("{} hollows: mean {mean:.4} mm, worst single error {worst:.4} mm; {each:.4?}", each.len());
    assert!(each.len() >= 15, "{} hollows in view", each.len());
    let mut figures = Figures::default();
    figures.check("mean depth off by, in mm", MEAN_OFF_MM, (mean - DEPTH_MM).abs());
    figures.check("worst hollow off by, in mm", WORST_OFF_MM, worst);
    figures.finish();
}
