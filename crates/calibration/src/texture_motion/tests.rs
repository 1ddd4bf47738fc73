//! Rendered scenes whose motion is known: planes that are inclined, and a cube's edge, at positions of any kind.

use super::cameras::{Point, View};
use super::*;
use epirig_core::frame::{Frame, Samples};
use epirig_core::grid::Grid;
use epirig_core::image::{reduced, reduced_frame};
use epirig_core::statistics::root_mean_square;
use epirig_simulator::{Scene, Sensor, Simulator, SimulatorConfig};
use nalgebra::Vector3;
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use std::sync::atomic::{AtomicUsize, Ordering};

const COLUMNS: usize = 360;
const ROWS: usize = 128;
/// Movement of what is 500 mm away, in px for a step of 1.
const STEP_PX: f64 = 4.0;

struct Rendered(Vec<Frame>);

impl Frames for Rendered {
    fn count(&self) -> usize {
        self.0.len()
    }

    fn size(&self) -> (usize, usize) {
        (self.0[0].rows(), self.0[0].columns())
    }

    fn picture(&self, index: usize, factor: usize) -> Grid<f32> {
        reduced_frame(&self.0[index], factor)
    }
}

/// A plane that is nearer at one side by 30 %, with noise of 1.5 DN.
fn plane(seed: u64) -> SimulatorConfig {
    let mut config = SimulatorConfig::textured_plane(COLUMNS, ROWS, 2);
    config.scene = Scene::Plane { distance_mm: 500.0, slope_x: 0.6, slope_y: 0.2 };
    config.texture.seed = seed;
    config.sensor = Sensor { read_noise_dn: 1.5, seed, ..Sensor::ideal(8) };
    config
}

/// Frames at places in steps.
fn frames(config: SimulatorConfig, places: &[f64]) -> Rendered {
    let step_mm = STEP_PX * 500.0 / config.optics.focal_length_px;
    let middle = 0.5
        * (places.iter().copied().fold(f64::MAX, f64::min) + places.iter().copied().fold(f64::MIN, f64::max));
    let simulator = Simulator::new(config).unwrap();
    let shown = places.iter().enumerate();
    Rendered(
        shown
            .map(|(index, place)| simulator.expose(10.0 + (place - middle) * step_mm, index as u32))
            .collect(),
    )
}

fn found(config: SimulatorConfig, places: &[f64]) -> TextureMotion {
    texture_motion(&frames(config, places), &MotionOptions::of_positions(100_000))
        .unwrap_or_else(|error| panic!("{places:?}: {error}"))
}

/// Errors of tau against the places, and the movement from the first to the last, in px.
fn errors(motion: &TextureMotion, places: &[f64]) -> (Vec<f64>, f64) {
    let (first, last) = (places[0], places[places.len() - 1]);
    let truth = places.iter().map(|place| (place - first) / (last - first));
    let errors = motion.tau.iter().zip(truth).map(|(tau, truth)| tau - truth).collect();
    (errors, *motion.position_px.last().unwrap())
}

fn uneven(count: usize, seed: u64) -> Vec<f64> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut place = 0.0;
    (0..count)
        .map(|_| {
            let here = place;
            place += random.random_range(0.9..1.1);
            here
        })
        .collect()
}

fn without(places: &[f64], missing: &[usize]) -> Vec<f64> {
    let kept = places.iter().enumerate().filter(|(index, _)| !missing.contains(index));
    kept.map(|(_, place)| *place).collect()
}

/// Places with every kind of jump.
fn cases(seed: u64) -> Vec<(&'static str, Vec<f64>)> {
    let even: Vec<f64> = (0..16).map(f64::from).collect();
    let hand = uneven(20, seed);
    let mut repeated = even.clone();
    repeated.insert(6, 5.0);
    let mut back = even.clone();
    back.insert(9, 7.3);
    let mut long = even.clone();
    long.iter_mut().skip(10).for_each(|place| *place += 2.0);
    vec![
        ("even", even.clone()),
        ("uneven", uneven(16, seed + 100)),
        ("one missing", without(&even, &[7])),
        ("two missing", without(&even, &[7, 8])),
        ("three missing", without(&hand, &[7, 8, 9])),
        ("five missing", without(&hand, &[9, 10, 11, 12, 13])),
        ("two missing beside an end", without(&hand, &[1, 2])),
        ("three missing beside the other", without(&hand, &[16, 17, 18])),
        ("several gaps", without(&hand, &[2, 3, 7, 11, 12, 13])),
        ("a step of three", long),
        ("repeated", repeated),
        ("a step back", back),
        ("backwards", hand.iter().map(|place| -place).collect()),
    ]
}

/// The places of the other frames are whole pixels apart, where the first search is best.
#[test]
fn a_frame_between_pixels_is_connected_with_those_at_whole_ones() {
    let places = [0.0, 1.0, 2.0, 3.0, 3.0, 4.0, 5.0, 6.0, 5.3, 7.0, 8.0];
    let mut flat = SimulatorConfig::textured_plane(256, 192, 2);
    flat.texture.seed = 1;
    let motion = found(flat, &places);
    let (errors, moved_px) = errors(&motion, &places);
    assert!(errors.iter().all(|error| (error * moved_px).abs() < 0.02), "{errors:?}");
}

#[test]
fn jumps_of_any_size_are_found() {
    for (name, places) in cases(1) {
        let motion = found(plane(3), &places);
        let (errors, moved_px) = errors(&motion, &places);
        let worst = errors.iter().fold(0.0, |worst: f64, error| worst.max(error.abs())) * moved_px;
        // A fiftieth of a pixel is where errors of tau begin to cost a disparity of this length.
        assert!(worst < 0.02, "{name}: {worst} px");
    }
}

/// Frames that tell the longest side of the pictures that were asked for.
struct Watched {
    frames: Rendered,
    longest: AtomicUsize,
}

impl Watched {
    fn new(frames: Rendered) -> Self {
        Self { frames, longest: AtomicUsize::new(0) }
    }
}

impl Frames for Watched {
    fn count(&self) -> usize {
        self.frames.count()
    }

    fn size(&self) -> (usize, usize) {
        self.frames.size()
    }

    fn picture(&self, index: usize, factor: usize) -> Grid<f32> {
        let picture = self.frames.picture(index, factor);
        self.longest.fetch_max(picture.rows().max(picture.columns()), Ordering::Relaxed);
        picture
    }
}

#[test]
fn the_first_search_does_not_look_at_large_pictures() {
    // Stripes that repeat, and a blank picture.
    let cases = [(100.0, TextureMotionError::NothingFollowed), (0.0, TextureMotionError::NoTexture)];
    for (contrast, expected) in cases {
        let stripes = |index: usize| {
            let value = |at: usize| 100.0 + contrast * ((at % 1200 + 7 * index) as f64 / 16.0).sin();
            let values = (0..1200 * 200).map(|at| value(at) as u8).collect();
            Frame::new(200, 1200, 8, Samples::U8(values)).unwrap()
        };
        let frames = Watched::new(Rendered((0..4).map(stripes).collect()));
        assert_eq!(texture_motion(&frames, &MotionOptions::of_positions(100_000)), Err(expected));
        // 1200 px are reduced by five first, and by two at least.
        assert_eq!(frames.longest.into_inner(), 600);
    }
}

#[test]
fn a_small_motion_in_large_frames_is_found() {
    // 2 px from the first to the last, 1 px in pictures of half the size.
    let places: Vec<f64> = (0..6).map(|index| 0.1 * f64::from(index)).collect();
    let mut flat = SimulatorConfig::textured_plane(1200, 200, 2);
    flat.texture.seed = 1;
    let motion = found(flat, &places);
    let (errors, moved_px) = errors(&motion, &places);
    assert!((moved_px - 2.0).abs() < 0.02, "{moved_px}");
    assert!(errors.iter().all(|error| (error * moved_px).abs() < 0.02), "{errors:?}");
}

/// Scenes of one depth and of several, with little and much noise.
fn scenes(seed: u64) -> Vec<SimulatorConfig> {
    let mut flat = plane(seed);
    flat.scene = Scene::Plane { distance_mm: 500.0, slope_x: 0.0, slope_y: 0.0 };
    let mut noisy = plane(seed + 20);
    noisy.sensor.read_noise_dn = 6.0;
    let mut edge = plane(seed + 40);
    edge.scene = Scene::CubeEdge { distance_mm: 500.0, slope: 1.0 };
    vec![flat, noisy, edge]
}

#[test]
fn stated_uncertainties_of_tau_hold() {
    let mut normalised = Vec::new();
    for seed in 1..=4 {
        let all = cases(seed);
        for (index, config) in scenes(seed).into_iter().enumerate() {
            let (name, places) = &all[(3 * seed as usize + 2 * index) % all.len()];
            let motion = found(config, places);
            let (errors, moved_px) = errors(&motion, places);
            let inner = 1..places.len() - 1;
            let here: Vec<f64> = inner.map(|frame| errors[frame] / motion.tau_sigma[frame]).collect();
            println!(
                "{name}, scene {index}: {:.2} sigma RMS, sigma {:.4} px, angle {:+.1} sigma",
                root_mean_square(&here),
                moved_px * root_mean_square(&motion.tau_sigma),
                motion.angle_rad / motion.angle_sigma_rad
            );
            normalised.extend(here);
        }
    }
    let within = |limit: f64| {
        normalised.iter().filter(|error| error.abs() < limit).count() as f64 / normalised.len() as f64
    };
    println!("{:.3} within 1 sigma, {:.3} within 2, of {}", within(1.0), within(2.0), normalised.len());
    // Errors of a scene have its first and last frame in common: some 170 numbers count as about 50, so shares of
    // 68 and 95 % scatter by 7 and 3 %.
    assert!(within(1.0) > 0.61 && within(2.0) > 0.92);
}

/// The model of a camera that neither turns nor leaves its line, in a direction of any kind.
const STRAIGHT: MotionModel =
    MotionModel { pan: true, focal_length: false, rotations: false, offsets: false, k1: false };

fn known(focal_length_px: f64, centre_px: [f64; 2]) -> MotionLens {
    MotionLens { focal_length_px, focal_length_sigma: 0.001, k1_sigma: 0.1, centre_px }
}

/// The lens that the simulator's camera has, for motions with an angle to the picture.
fn through(config: &SimulatorConfig) -> MotionOptions {
    let optics = &config.optics;
    let centre = [optics.principal_point_x_px, optics.principal_point_y_px];
    MotionOptions {
        lens: Some(known(optics.focal_length_px, centre)),
        may: MotionModel { rotations: true, offsets: true, k1: true, ..STRAIGHT },
        ..MotionOptions::of_positions(100_000)
    }
}

#[test]
fn the_direction_of_the_motion_is_found() {
    let turns = [
        (0.0, 0.0),
        (0.5, 0.0),
        (2.0, 3.0),
        (7.0, -3.0),
        (45.0, 0.0),
        (90.0, 1.0),
        (-90.0, 0.0),
        (178.0, 2.0),
    ];
    let mut normalised = Vec::new();
    for (index, (roll_deg, pan_deg)) in turns.into_iter().enumerate() {
        let mut config = plane(index as u64 + 50);
        let (roll, pan) = (f64::to_radians(roll_deg), f64::to_radians(pan_deg));
        (config.optics.roll_rad, config.optics.pan_rad) = (roll, pan);
        let places = uneven(16, index as u64);
        let options = through(&config);
        let motion = texture_motion(&frames(config, &places), &options).unwrap();
        assert_eq!(motion.model, STRAIGHT, "{roll_deg} {pan_deg}");
        // The axis of columns of the rectified camera, in the raw one.
        let truth = Vector3::new(pan.cos() * roll.cos(), -pan.cos() * roll.sin(), pan.sin());
        let m = motion.cameras.direction;
        let m = m * m.dot(&truth).signum();
        let in_picture = (m.x * truth.y - m.y * truth.x).asin();
        println!(
            "{roll_deg} {pan_deg}: off by {:+.4} deg in the picture (sigma {:.4}), {:+.4} towards it ({:.4}), rows {:.4} px",
            in_picture.to_degrees(),
            motion.angle_sigma_rad.to_degrees(),
            (m.z - truth.z).to_degrees(),
            motion.pan_sigma_rad.to_degrees(),
            motion.rows_sigma_px,
        );
        normalised.extend([in_picture / motion.angle_sigma_rad, (m.z - truth.z) / motion.pan_sigma_rad]);
        // 60 px of movement, and some 300 points that are known to 0.02 px.
        assert!(in_picture.to_degrees().abs() < 0.02 && motion.rows_sigma_px < 0.01);
    }
    // Of 16 normal numbers, the root mean square is beyond 1.6 once in a thousand times.
    let rms = root_mean_square(&normalised);
    assert!(rms < 1.6 && normalised.iter().all(|error| error.abs() < 4.0), "{rms} {normalised:?}");
}

/// A camera that turns by itself and leaves its line, before a plane with a closed-form texture.
struct Wobbling {
    cameras: Cameras,
    waves: Vec<[f64; 4]>,
    noise_dn: f64,
}

impl Wobbling {
    const DISTANCE: f64 = 4.0;

    fn new(seed: u64, rotation_deg: f64, offset: f64) -> Self {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let mut around = |size: f64| random.random_range(-1.7..1.7) * size;
        let frames = (0..16)
            .map(|index| CameraPose {
                position: f64::from(index) / 15.0 + around(0.004),
                rotation_rad: Vector3::new(around(1.0), around(1.0), around(1.0)) * rotation_deg.to_radians(),
                offset: [around(offset), around(offset)],
            })
            .collect();
        let cameras = Cameras {
            focal_length_px: 500.0,
            centre_px: [179.5, 99.5],
            k1: 0.0,
            direction: Vector3::new(-1.0, 0.02, 0.01).normalize(),
            frames,
        };
        // Wavelengths from 4 to 40 px.
        let wave = |_| {
            let angle = random.random_range(0.0..std::f64::consts::TAU);
            let share = 10_f64.powf(random.random_range(-1.0..0.0));
            let number = std::f64::consts::TAU * cameras.focal_length_px / (4.0 * Self::DISTANCE / share);
            [number * angle.cos(), number * angle.sin(), angle * 7.0, 4.0]
        };
        let waves = (0..60).map(wave).collect();
        Self { cameras, waves, noise_dn: 1.0 }
    }

    /// Depth of the surface in the mean orientation, at a place in the same unit: inclined, and wavy.
    fn depth(x: f64, y: f64) -> f64 {
        Self::DISTANCE * (1.0 + 0.08 * x + 0.05 * y + 0.1 * (2.5 * x).sin() * (2.0 * y).cos())
    }

    /// The point of the surface that a frame sees at a place, in the mean orientation, and where it is.
    fn seen(&self, view: &View, place: [f64; 2]) -> Vector3<f64> {
        let [ray, from] = view.line(place);
        let mut depth = Self::DISTANCE;
        for _ in 0..30 {
            let point = from + ray * (depth - from.z);
            depth = Self::depth(point.x, point.y);
        }
        from + ray * (depth - from.z)
    }

    fn picture(&self, frame: usize) -> Grid<f32> {
        let view = self.cameras.view(frame);
        let mut random = ChaCha8Rng::seed_from_u64(frame as u64);
        let mut picture = Grid::filled(200, 360, 0.0);
        for row in 0..200 {
            for (column, value) in picture.row_mut(row).iter_mut().enumerate() {
                let point = self.seen(&view, [column as f64, row as f64]);
                let wave = |[x, y, phase, size]: &[f64; 4]| size * (x * point.x + y * point.y + phase).sin();
                let noise: f64 = (0..6).map(|_| random.random_range(-1.0..1.0)).sum::<f64>() / 2.0_f64.sqrt();
                let exact = 128.0 + self.waves.iter().map(wave).sum::<f64>() + self.noise_dn * noise;
                *value = exact.round().clamp(0.0, 255.0) as f32;
            }
        }
        picture
    }

    /// Root mean square by which rows and columns of points of the scene differ from frame to frame after rectification
    /// by the cameras that were found, beside what a straight motion explains, in px.
    fn rows_off_px(&self, found: &TextureMotion) -> f64 {
        let m = found.cameras.direction;
        let truth = self.cameras.views();
        let views = found.cameras.views();
        let middle = self.cameras.view(8);
        let mut squares = Vec::new();
        for place in
            (0..35).map(|index| [20.0 + 53.0 * f64::from(index % 7), 15.0 + 42.0 * f64::from(index / 7)])
        {
            let point = self.seen(&middle, place);
            let known = Point { bearing: [point.x / point.z, point.y / point.z], rho: 1.0 / point.z };
            let rows: Vec<f64> = truth
                .iter()
                .zip(&views)
                .filter_map(|(truth, found)| Some((truth.place(&known)?, found)))
                .map(|(place, found_view)| {
                    let [ray, displacement] = found_view.line(place);
                    // The frame's offset at the distance of the point; the path is one long.
                    let offset = displacement - m * displacement.dot(&m);
                    let ray = ray + offset * known.rho;
                    let view = (Vector3::z() - m * m.z).normalize();
                    found.cameras.focal_length_px * ray.dot(&view.cross(&m)) / ray.dot(&view)
                })
                .collect();
            let mean = rows.iter().sum::<f64>() / rows.len() as f64;
            squares.extend(rows.iter().map(|row| row - mean));
        }
        root_mean_square(&squares)
    }
}

struct Pictures(Vec<Grid<f32>>);

impl Frames for Pictures {
    fn count(&self) -> usize {
        self.0.len()
    }

    fn size(&self) -> (usize, usize) {
        (self.0[0].rows(), self.0[0].columns())
    }

    fn picture(&self, index: usize, factor: usize) -> Grid<f32> {
        reduced(&self.0[index], factor)
    }
}

#[test]
fn frames_that_turn_or_leave_the_line_are_found() {
    for (rotation_deg, offset, model) in [
        (0.0, 0.0, STRAIGHT),
        (0.02, 0.0, MotionModel { rotations: true, ..STRAIGHT }),
        (0.2, 0.0, MotionModel { rotations: true, ..STRAIGHT }),
        (0.0, 0.01, MotionModel { rotations: true, offsets: true, ..STRAIGHT }),
    ] {
        for seed in [1, 2] {
            let scene = Wobbling::new(seed, rotation_deg, offset);
            let frames = Pictures((0..16).into_par_iter().map(|frame| scene.picture(frame)).collect());
            let options = MotionOptions {
                lens: Some(known(scene.cameras.focal_length_px, scene.cameras.centre_px)),
                may: MotionModel { rotations: true, offsets: true, ..STRAIGHT },
                ..MotionOptions::of_positions(100_000)
            };
            let motion = texture_motion(&frames, &options).unwrap();
            let off_px = scene.rows_off_px(&motion);
            println!(
                "{rotation_deg} deg, {offset}: {:?}, rows off by {off_px:.4} px (sigma {:.4}), residuals {:.4} px, {} points, {:.3} rejected, moved {:.1} px",
                motion.model,
                motion.rows_sigma_px,
                motion.residual_px,
                motion.points,
                motion.rejected,
                motion.position_px.last().unwrap()
            );
            assert_eq!(motion.model, model);
            assert!(off_px < 0.02, "{off_px}");
        }
    }
}

/// A camera that turns tells its focal length; one that leaves its line does not, and nothing is made up.
#[test]
fn turns_tell_the_focal_length() {
    for (rotation_deg, offset, tells) in [(0.1, 0.0, true), (0.0, 0.01, false)] {
        for seed in [1, 2] {
            let scene = Wobbling::new(seed, rotation_deg, offset);
            let frames = Pictures((0..16).into_par_iter().map(|frame| scene.picture(frame)).collect());
            let Cameras { focal_length_px, centre_px, .. } = scene.cameras;
            let guess = MotionLens { focal_length_sigma: 0.5, ..known(focal_length_px / 1.4, centre_px) };
            let options = MotionOptions {
                lens: Some(guess),
                may: MotionModel { focal_length: true, rotations: true, offsets: true, ..STRAIGHT },
                ..MotionOptions::of_positions(100_000)
            };
            let motion = texture_motion(&frames, &options).unwrap();
            let found = motion.cameras.focal_length_px;
            let (off, sigma) = ((found / focal_length_px).ln(), motion.focal_length_sigma);
            println!("{:?}: focal length off by {off:.4} (sigma {sigma:.4})", motion.model);
            assert_eq!(motion.model.focal_length, tells);
            if tells {
                assert!(off.abs() < 3.0 * sigma && sigma < 0.05, "{off} {sigma}");
            } else {
                assert!((found - guess.focal_length_px).abs() < 1e-9);
            }
        }
    }
}
