//! The simulated rig, and the numbers that it is made of.

use serde::{Deserialize, Serialize};

use super::bands::Print;
use super::chess::SOFTNESS_PX;
use super::error::{SimulatorError, require, require_positive};
use super::hand_board::{BoardPose, HandBoard};
use super::optics::Optics;
use super::pinhole::Pinhole;
use super::rays::Rays;
use super::scene::{Hit, Scene};
use super::sensor::Sensor;
use super::step_error::StepError;
use super::texture::{Paint, Texture};
use super::truth::{Truth, truth};
use super::{lamp, render};
use epirig_core::frame::Frame;
use epirig_core::grid::Grid;
use epirig_core::progress::Progress;
use epirig_core::tau::Tau;
use epirig_core::volume::Volume;

/// The part of the rig that the stage carries.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Carried {
    /// The scene: it moves towards positive x as the stage's position grows, so disparities are positive.
    Scene,
    /// The camera: it moves towards positive x, so disparities are negative.
    Camera,
}

/// The stops of the stage in a simulated scan.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct SimulatedScan {
    /// Position of the first frame, in mm from home.
    pub start_mm: f64,
    /// Distance between frames, in mm; positive.
    pub step_mm: f64,
    /// Number of frames.
    pub frames: usize,
}

impl SimulatedScan {
    /// Positions of all frames, in mm from home.
    pub fn positions_mm(&self) -> Vec<f64> {
        (0..self.frames).map(|index| self.start_mm + index as f64 * self.step_mm).collect()
    }

    /// Position halfway between the first and the last frame, in mm from home.
    pub fn middle_mm(&self) -> f64 {
        self.start_mm + 0.5 * self.step_mm * (self.frames.saturating_sub(1)) as f64
    }
}

/// The configuration of a simulator. Plain numbers, so that a record of a simulated scan can repeat it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SimulatorConfig {
    /// The scene in front of the camera. Its origin is on the optical axis when the stage is halfway.
    pub scene: Scene,
    /// The texture painted on it.
    pub texture: Texture,
    /// The camera's optics.
    pub optics: Optics,
    /// The camera's sensor.
    pub sensor: Sensor,
    /// The part of the rig that the stage carries.
    pub carried: Carried,
    /// The stops of the stage.
    pub scan: SimulatedScan,
    /// A chess-board that a person may hold before the camera.
    #[serde(default)]
    pub board: Option<HandBoard>,
    /// Standard deviation of the lamp's light from exposure to exposure, as a share of it; 0 to 0.1.
    #[serde(default)]
    pub flicker: f64,
    /// How much lighter the lamp becomes from the first to the last stop, as a share of its light;
    /// -0.9 to 0.9.
    #[serde(default)]
    pub drift: f64,
    /// Brightness of a highlight that stands still in the image while the scene moves, as a share
    /// of full scale; 0 to 0.5.
    #[serde(default)]
    pub highlight: f64,
    /// Error of the carriage's position against the reported one.
    #[serde(default)]
    pub step_error: StepError,
    /// Number of the first exposure: other numbers give other noise and other light of the same rig.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub first_exposure: u32,
}

/// Records that are older than this number are equal to those without it.
fn is_zero(number: &u32) -> bool {
    *number == 0
}

/// The simulated rig.
#[derive(Debug, Clone)]
pub struct Simulator {
    pub(super) config: SimulatorConfig,
    pub(super) paint: Paint,
    pub(super) print: Option<Print>,
    true_tau: Tau,
}

impl Simulator {
    /// A simulator of this make.
    ///
    /// # Errors
    /// [`SimulatorError`] if a number makes no sense or the scene could occlude part of itself.
    pub fn new(config: SimulatorConfig) -> Result<Self, SimulatorError> {
        require_positive("step in mm", config.scan.step_mm)?;
        require_positive("number of rows", config.optics.rows as f64)?;
        require_positive("number of columns", config.optics.columns as f64)?;
        require_positive("focal length in px", config.optics.focal_length_px)?;
        require_positive("grain in mm", config.texture.grain_mm)?;
        let frames = config.scan.frames;
        require(frames >= 2, "number of frames", frames as f64, "at least 2")?;
        config.optics.check()?;
        config.sensor.check(config.optics.rows * config.optics.columns)?;
        config.scene.check(config.optics.steepest_ray())?;
        config.board.as_ref().map_or(Ok(()), HandBoard::check)?;
        let SimulatorConfig { flicker, drift, highlight, step_error, .. } = config;
        require((0.0..=0.1).contains(&flicker), "flicker", flicker, "from 0 to 0.1")?;
        require((-0.9..=0.9).contains(&drift), "drift", drift, "from -0.9 to 0.9")?;
        require((0.0..=0.5).contains(&highlight), "highlight", highlight, "from 0 to 0.5")?;
        let sigma_um = step_error.sigma_um;
        let is_error = sigma_um.is_finite() && sigma_um >= 0.0;
        require(is_error, "step error in um", sigma_um, "zero or positive")?;
        let positions = config.scan.positions_mm();
        let true_positions: Vec<f64> =
            positions.iter().map(|&position| step_error.true_position_mm(position)).collect();
        let true_tau = Tau::from_positions(&true_positions)?;
        let paint = Paint::new(&config.texture);
        let print = match config.scene {
            Scene::Tile { distance_mm, side_mm, bands: Some(bands), .. } => {
                let softness_mm = SOFTNESS_PX * distance_mm / config.optics.focal_length_px;
                Some(Print::new(&bands, side_mm, softness_mm))
            }
            _ => None,
        };
        Ok(Self { config, paint, print, true_tau })
    }

    /// The numbers that the simulator is made of.
    pub fn config(&self) -> &SimulatorConfig {
        &self.config
    }

    /// Where the carriage truly stands when the stage says that it is at `position_mm`, in mm from home.
    pub fn true_position_mm(&self, position_mm: f64) -> f64 {
        self.config.step_error.true_position_mm(position_mm)
    }

    /// Where the frames of the scan truly lie on the baseline.
    pub fn true_tau(&self) -> Tau {
        self.true_tau.clone()
    }

    /// Where the scene's origin truly lies along x in the rectified frame when the stage says that it is at
    /// `position_mm`, in mm.
    pub fn scene_offset_mm(&self, position_mm: f64) -> f64 {
        let travelled = self.true_position_mm(position_mm) - self.config.scan.middle_mm();
        match self.config.carried {
            Carried::Scene => travelled,
            Carried::Camera => -travelled,
        }
    }

    /// The frame that the camera takes with the stage at `position_mm`. `exposure` numbers the exposures: it
    /// seeds the noise, so the same number at the same position gives the same frame.
    pub fn expose(&self, position_mm: f64, exposure: u32) -> Frame {
        self.digitise(&self.irradiance(position_mm), exposure)
    }

    /// The light on the sensor with the stage at `position_mm`, as a share of full scale at reflectance 1;
    /// rows x columns.
    pub fn irradiance(&self, position_mm: f64) -> Grid<f32> {
        let mut light = self.irradiance_at_offset(self.scene_offset_mm(position_mm));
        let SimulatorConfig { drift, highlight, scan, .. } = &self.config;
        let travel_mm = scan.step_mm * (scan.frames - 1) as f64;
        let share = (position_mm - scan.middle_mm()) / travel_mm;
        lamp::change(&mut light, 1.0 + drift * share.clamp(-0.5, 0.5), *highlight);
        light
    }

    pub(super) fn irradiance_at_offset(&self, offset_mm: f64) -> Grid<f32> {
        let sight = self.config.optics.sight();
        let scene = self.config.scene;
        let shade = |ray| scene.hit(ray, offset_mm).map_or(render::GROUND, |hit| self.reflectance(&hit));
        let optics = &self.config.optics;
        render::irradiance(optics, &Rays::new(optics, |x, y| sight.ray(x, y)), shade)
    }

    /// Reflectance of a point of the scene's surface.
    #[inline]
    fn reflectance(&self, hit: &Hit) -> f32 {
        let paint = || self.paint.reflectance(hit.across_mm, hit.along_mm);
        match self.print.and_then(|print| print.at(hit.across_mm, hit.along_mm)) {
            None => paint(),
            Some((1.0, printed)) => printed as f32,
            Some((covered, printed)) => {
                let paint = f64::from(paint());
                (paint + covered * (printed - paint)) as f32
            }
        }
    }

    /// The light on the sensor with the board held before the camera, in pose number `pose` of an endless
    /// list that shows it tilted by 20 to 35 degrees, rolled, nearer and farther, at all parts of the image,
    /// and always wholly in view. In the units of [`irradiance`](Self::irradiance); only the dark ground if
    /// the simulator has no board.
    pub fn board_irradiance(&self, pose: usize) -> Grid<f32> {
        let optics = &self.config.optics;
        match self.config.board {
            Some(board) => board.irradiance(optics, board.pose(optics, pose)),
            None => self.uniform_irradiance(render::GROUND),
        }
    }

    /// Where the board is held in pose number `pose`; `None` if the simulator has no board.
    pub fn board_pose(&self, pose: usize) -> Option<BoardPose> {
        self.config.board.map(|board| board.pose(&self.config.optics, pose))
    }

    /// The light on the sensor from a surface of this reflectance that fills the view, in the units of
    /// [`irradiance`](Self::irradiance); rows x columns.
    pub fn uniform_irradiance(&self, reflectance: f32) -> Grid<f32> {
        let optics = &self.config.optics;
        let mut light = Grid::filled(optics.rows, optics.columns, reflectance);
        let transmission = optics.transmissions();
        for y in 0..optics.rows {
            for (x, value) in light.row_mut(y).iter_mut().enumerate() {
                *value *= transmission(x as f64, y as f64) as f32;
            }
        }
        light
    }

    /// The frame that the sensor makes of `irradiance`; `exposure` seeds the noise and the lamp, as in
    /// [`expose`](Self::expose).
    pub fn digitise(&self, irradiance: &Grid<f32>, exposure: u32) -> Frame {
        let exposure = self.config.first_exposure.wrapping_add(exposure);
        let lamp = lamp::gain(self.config.flicker, self.config.sensor.seed, exposure);
        self.config.sensor.digitise(irradiance, lamp, exposure)
    }

    /// All frames of the scan as a volume, as the camera sees them and where the stage says that they are.
    ///
    /// # Errors
    /// None in practice: a simulator's positions increase and its frames are alike by construction.
    pub fn render_volume(&self, progress: &dyn Progress) -> Result<Volume, SimulatorError> {
        let positions = self.config.scan.positions_mm();
        let tau = Tau::from_positions(&positions)?;
        let optics = &self.config.optics;
        let mut volume = Volume::new(optics.rows, optics.columns, self.config.sensor.bit_depth, tau);
        progress.begin("rendering", positions.len() as u64);
        for (index, &position_mm) in positions.iter().enumerate() {
            volume.insert(index, &self.expose(position_mm, index as u32))?;
            progress.advance(1);
        }
        progress.end();
        Ok(volume)
    }

    /// The truth of the scan for the pixels of frame `reference`.
    ///
    /// # Errors
    /// [`SimulatorError::NoSuchFrame`]; [`SimulatorError::NotRectified`] if the camera is turned or distorts.
    pub fn truth(&self, reference: usize) -> Result<Truth, SimulatorError> {
        if !self.config.optics.is_rectified() {
            return Err(SimulatorError::NotRectified);
        }
        self.truth_seen_by(&self.config.optics.pinhole(), reference)
    }

    /// The truth of the scan for the pixels of frame `reference`, as an ideal pinhole camera in the rectified
    /// frame sees it. That camera may see more than the simulator's own.
    ///
    /// # Errors
    /// [`SimulatorError::NoSuchFrame`]; [`SimulatorError::BadNumber`] for a focal length that is not
    /// positive.
    pub fn truth_seen_by(&self, camera: &Pinhole, reference: usize) -> Result<Truth, SimulatorError> {
        let last = self.config.scan.frames - 1;
        if reference > last {
            return Err(SimulatorError::NoSuchFrame { index: reference, last });
        }
        require_positive("rectified focal length in px", camera.focal_length_px)?;
        let positions = self.config.scan.positions_mm();
        let offsets_mm: Vec<f64> = positions.iter().map(|&position| self.scene_offset_mm(position)).collect();
        Ok(truth(&self.config.scene, &offsets_mm, camera, reference))
    }
}
