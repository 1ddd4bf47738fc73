//! Sequences of the simulator with their calibration frames, and heights against the simulator's truth.

#![allow(dead_code, reason = "each test program uses a part of this")]
#![allow(unreachable_pub, reason = "a module of test programs has no outside")]

use std::path::Path;

use epirig::calibrate::{CalibrationPlan, PositionSource};
use epirig_calibration::photometry::PhotometryOptions;
use epirig_calibration::target::{ChessBoard, Target};
use epirig_core::frame::Frame;
use epirig_core::grid::Grid;
use epirig_data::sequence::{
    ExitStatus, FrameFacts, FrameKind, Intrinsics, Origin, Sequence, SequenceRecord, SequenceWriter,
    StopFacts,
};
use epirig_simulator::{Scene, Simulator, SimulatorConfig};
use nalgebra::{DMatrix, DVector};

/// Calibration frames of a sequence.
#[derive(Debug, Clone, Copy)]
pub struct Extras {
    pub dark: usize,
    pub flat: usize,
    pub board: usize,
}

/// Reflectance of what flat frames are taken of: bright, not saturated.
const FLAT: f32 = 1.0;

/// A sequence in `folder` of what `simulator` shows: the frames of its scan under `light` (one plane for each), and calibration frames.
pub fn write_sequence(simulator: &Simulator, light: &[Grid<f32>], extras: Extras, folder: &Path) -> Sequence {
    let config = simulator.config();
    let positions_mm = config.scan.positions_mm();
    let (rows, columns) = (config.optics.rows, config.optics.columns);
    let origin = Origin::Captured {
        stage_settings: Default::default(),
        stage: "simulator".to_owned(),
        camera: "simulator".to_owned(),
        configuration: None,
        limits: None,
        rig: None,
        simulator: None,
    };
    let record = SequenceRecord {
        positions_mm: Some(positions_mm.clone()),
        intrinsics: Some(Intrinsics::centred(config.optics.focal_length_px, columns, rows)),
        ..SequenceRecord::new(origin, (rows, columns), config.sensor.bit_depth, positions_mm.len())
    };
    let mut writer = SequenceWriter::create(folder, &record).unwrap();
    // Every exposure has noise of its own.
    let mut exposure = 0;
    let mut digitise = |light: &Grid<f32>| -> Frame {
        exposure += 1;
        simulator.digitise(light, exposure)
    };
    for (&position_mm, light) in positions_mm.iter().zip(light) {
        let at = Some(position_mm);
        let facts = FrameFacts { commanded_mm: at, reported_mm: at, ..FrameFacts::default() };
        writer.add(&digitise(light), facts).unwrap();
    }
    let mut put = |kind, index, light: &Grid<f32>| {
        writer.put(kind, index, &digitise(light), FrameFacts::default()).unwrap();
    };
    (0..extras.dark).for_each(|index| put(FrameKind::Dark, index, &simulator.uniform_irradiance(0.0)));
    (0..extras.flat).for_each(|index| put(FrameKind::Flat, index, &simulator.uniform_irradiance(FLAT)));
    (0..extras.board).for_each(|index| put(FrameKind::Board, index, &simulator.board_irradiance(index)));
    writer.finish(ExitStatus::Complete, StopFacts::default()).unwrap();
    Sequence::open(folder).unwrap()
}

/// The light of all frames of the scan.
pub fn scan_light(simulator: &Simulator) -> Vec<Grid<f32>> {
    simulator
        .config()
        .scan
        .positions_mm()
        .iter()
        .map(|&position_mm| simulator.irradiance(position_mm))
        .collect()
}

/// The chess-boards on the simulator's tile, as a person measures them.
pub fn target(config: &SimulatorConfig) -> Target {
    let Scene::Tile { side_mm, bands: Some(bands), .. } = config.scene else {
        panic!("a tile with chess-boards is needed");
    };
    let board = ChessBoard { columns: bands.columns - 1, rows: bands.rows - 1, square_mm: bands.square_mm };
    Target { board, bands: 2, band_distance_mm: side_mm - bands.rows as f64 * bands.square_mm }
}

/// What a person tells the calibration: the boards' squares, and nothing of the lens.
pub fn plan(config: &SimulatorConfig) -> CalibrationPlan {
    let board = config.board.map(|board| ChessBoard {
        columns: board.columns - 1,
        rows: board.rows - 1,
        square_mm: board.square_mm,
    });
    CalibrationPlan {
        target: Some(target(config)),
        board,
        lens: None,
        photometry: PhotometryOptions::default(),
        exposures: Vec::new(),
        positions: PositionSource::Automatic,
        frames_on_disk: false,
    }
}

/// What a ray of the rectified frame truly meets.
#[derive(Debug, Clone, Copy)]
pub struct Place {
    /// Height towards the camera over the middle of the raised level, in mm.
    pub height_mm: f64,
    /// Place on the tile, in mm from its middle.
    pub u_mm: f64,
    pub v_mm: f64,
    /// Whether it is the bottom of a hollow, the raised level, or part of a wall.
    pub level: Level,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Level {
    Raised,
    Hollow,
    Wall,
}

/// What each pixel of a camera truly sees in frame `reference`, between the bands of the tile; `ray` is that of a pixel in the rectified
/// frame.
pub fn places(
    simulator: &Simulator,
    reference: usize,
    (rows, columns): (usize, usize),
    ray: impl Fn(f64, f64) -> (f64, f64),
) -> Grid<Option<Place>> {
    let config = simulator.config();
    let Scene::Tile { distance_mm, side_mm, hollow_depth_mm, bow_mm, bands, .. } = config.scene else {
        panic!("a tile is needed");
    };
    let offset_mm = simulator.scene_offset_mm(config.scan.positions_mm()[reference]);
    let free_mm = bands.map_or(0.5 * side_mm, |bands| 0.5 * side_mm - bands.rows as f64 * bands.square_mm);
    let mut found = Grid::filled(rows, columns, None);
    for y in 0..rows {
        for x in 0..columns {
            let Some(hit) = config.scene.hit(ray(x as f64, y as f64), offset_mm) else { continue };
            let (u_mm, v_mm) = (hit.across_mm, hit.along_mm);
            let bowed_mm = bow_mm * (u_mm * u_mm + v_mm * v_mm) / (0.25 * side_mm * side_mm);
            let below_mm = hit.depth_mm - distance_mm - bowed_mm;
            let level = match below_mm {
                _ if below_mm.abs() < 1e-6 => Level::Raised,
                _ if (below_mm - hollow_depth_mm).abs() < 1e-6 => Level::Hollow,
                _ => Level::Wall,
            };
            if v_mm.abs() < free_mm {
                let height_mm = distance_mm - hit.depth_mm;
                found.row_mut(y)[x] = Some(Place { height_mm, u_mm, v_mm, level });
            }
        }
    }
    found
}

/// Pixels whose whole neighbourhood of `margin_px` to each side lies on one level: the matcher's windows see nothing else.
pub fn clear_of_walls(places: &Grid<Option<Place>>, margin_px: usize) -> Vec<(usize, usize, Place)> {
    let mut clear = Vec::new();
    for y in margin_px..places.rows().saturating_sub(margin_px) {
        for x in margin_px..places.columns().saturating_sub(margin_px) {
            let Some(place) = places.at(x, y).filter(|place| place.level != Level::Wall) else { continue };
            let alike = |x| {
                (y - margin_px..=y + margin_px)
                    .all(|y| places.at(x, y).is_some_and(|other: Place| other.level == place.level))
            };
            if (x - margin_px..=x + margin_px).all(alike) {
                clear.push((x, y, place));
            }
        }
    }
    clear
}

/// Heights against truth.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HeightErrors {
    /// Share of the pixels clear of walls that have an answer.
    pub answered: f64,
    /// Measured depth of the hollows less the true one, in mm.
    pub depth_error_mm: f64,
    /// Root mean square of measured less true height after a quadric, in mm.
    pub rms_mm: f64,
}

/// Fits a quadric and a step between the levels to measured less true heights, by least squares; `None` if either level has no answer.
pub fn height_errors(height_mm: &Grid<f32>, clear: &[(usize, usize, Place)]) -> Option<HeightErrors> {
    let answered: Vec<(f64, &Place)> = clear
        .iter()
        .map(|(x, y, place)| (f64::from(height_mm.at(*x, *y)) - place.height_mm, place))
        .filter(|(error, _)| !error.is_nan())
        .collect();
    let hollow = answered.iter().filter(|(_, place)| place.level == Level::Hollow).count();
    if hollow == 0 || hollow == answered.len() {
        return None;
    }
    let quadric = |place: &Place| {
        // In units of some 100 mm, so that all terms are about 1.
        let (u, v) = (0.01 * place.u_mm, 0.01 * place.v_mm);
        [1.0, u, v, u * u, u * v, v * v]
    };
    let step = |place: &Place| if place.level == Level::Hollow { 1.0 } else { 0.0 };
    let errors = DVector::from_iterator(answered.len(), answered.iter().map(|(error, _)| *error));
    let design = DMatrix::from_fn(answered.len(), 7, |row, column| {
        let place = answered[row].1;
        if column < 6 { quadric(place)[column] } else { step(place) }
    });
    let solve = |design: &DMatrix<f64>| {
        let normal = design.transpose() * design;
        normal.cholesky().map(|normal| normal.solve(&(design.transpose() * &errors)))
    };
    let with_step = solve(&design)?;
    let trend = design.columns(0, 6).into_owned();
    let left = &errors - &trend * solve(&trend)?;
    Some(HeightErrors {
        answered: answered.len() as f64 / clear.len() as f64,
        depth_error_mm: -with_step[6],
        rms_mm: (left.norm_squared() / answered.len() as f64).sqrt(),
    })
}
