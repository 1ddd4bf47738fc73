//! Where the camera stood in each frame, and which way it went, from the texture of what it saw.
//!
//! A camera on a straight line sees each point move along a straight line of the picture, towards a vanishing point
//! that all have in common. How far it goes is the product of the camera's position and the point's inverse depth. So
//! ratios of displacements between any frames are the same for all points. Points with texture are followed from an
//! anchor frame to every other in which they are seen, and not only to the next: a displacement over many frames, one
//! over few, and those of points of other anchors must agree.
//!
//! 1. In small pictures, two frames show how far each point moves (`start`). Then each further frame has one
//!    unknown, its position (`search`). All positions over the whole width of the picture are tried with all points at
//!    once. Nothing is assumed about steps, so gaps, steps back and repeated frames are found like others. Where this
//!    fails, it is tried without what repeats in the pictures (`unrepeated`), and then in larger ones.
//! 2. In larger pictures, up to the frames' own size, points are placed in each frame by least squares (`follow`),
//!    near where the cameras that are known so far put them (`expected`).
//! 3. All cameras and points are adjusted together (`bundle`), with weights that leave out outliers.
//! 4. Whether frames are turned or displaced by themselves is tested on points that were not adjusted (`choose`).

mod bundle;
mod cameras;
mod cause;
mod choose;
mod error;
mod expected;
mod fit;
mod follow;
mod frames;
mod model;
mod normal;
mod point;
mod search;
mod seen;
mod start;
mod steps;
#[cfg(test)]
mod tests;
mod track;
mod uncertainty;
mod unrepeated;

pub use cameras::{CameraPose, Cameras};
pub use error::TextureMotionError;
pub use frames::Frames;
pub use model::MotionModel;
pub use steps::{Return, Step, in_usual_steps};

use crate::lens::LensEstimate;
use bundle::with_free_focal_length;
use cause::{cause, contradiction};
use choose::choose;
use expected::Expected;
use fit::LensPrior;
use search::{Found, SMALL_REACH, SOME, search};
use track::Track;
use uncertainty::Uncertainty;
use unrepeated::Unrepeated;

/// Longest side of the pictures of the first search, in px.
const SEARCH_SIDE: usize = 256;
/// Where they show no clear motion, the search goes on in larger ones, up to so many times as long: frames of 24 MP
/// are then reduced by six, and grains of two of their pixels keep a third of their contrast. Twice the length has four
/// times as many places to try, and four times as many bytes.
const LARGER: usize = 4;
/// Shortest side of any picture, in px: points need room.
const LEAST_SIDE: usize = 24;
/// From one size to the next: a start that is right to a tenth of a pixel is then within half a pixel.
const FINER: usize = 3;

/// How the camera moved.
#[derive(Debug, Clone, PartialEq)]
pub struct TextureMotion {
    /// Position of each frame: how far a typical point of the scene has moved since the first, in px; the last
    /// is positive.
    pub position_px: Vec<f64>,
    /// tau of each frame: its position as a share of the last one's. It need not increase.
    pub tau: Vec<f64>,
    /// Standard uncertainty of each, with that of the first and the last at 0 and 1: from the scatter of
    /// points at different places, and from the bias of interpolation.
    pub tau_sigma: Vec<f64>,
    /// Standard uncertainty of each step of tau, from a frame to the next.
    pub step_sigma: Vec<f64>,
    /// Whether contents move to higher columns from the first frame to the last.
    pub moves_right: bool,
    /// Angle from the rows to the motion of the contents, in rad, in (-pi/2, pi/2]: positive if contents that move to
    /// higher columns also move to higher rows.
    pub angle_rad: f64,
    /// Its standard uncertainty, in rad.
    pub angle_sigma_rad: f64,
    /// The cameras of all frames; positions grow from the first frame to the last.
    pub cameras: Cameras,
    /// What of them was adjusted.
    pub model: MotionModel,
    /// Whether it could be tested if more is to be adjusted: half of the points must connect all frames.
    pub is_tested: bool,
    /// Standard uncertainty of the angle between motion and picture, in rad.
    pub pan_sigma_rad: f64,
    /// The part of it that would be left with the focal length known, in rad: whether there is an angle at all.
    pub pan_own_sigma_rad: f64,
    /// Standard uncertainty of k1; 0 if it was not adjusted.
    pub k1_sigma: f64,
    /// Standard uncertainty of the focal length as a share of it; 0 if it may not be adjusted.
    pub focal_length_sigma: f64,
    /// Standard uncertainty of the row of a typical point from frame to frame, in px.
    pub rows_sigma_px: f64,
    /// Median of the standard uncertainties of the positions along the path, in px of a typical point. Larger than that
    /// of tau where frames turn: a turn to the side moves all points like a step.
    pub position_sigma_px: f64,
    /// Standard uncertainty that the motion brings to disparities, in px.
    pub disparity_sigma_px: f64,
    /// What is left of it beside an offset, a slope and a scale of the map: it bends a plane.
    pub bend_sigma_px: f64,
    /// Inverse depth of a typical point, in 1 / length of the path.
    pub typical_rho: f64,
    /// Number of points that were followed and agree.
    pub points: usize,
    /// Share of the places of points that contradict the others.
    pub rejected: f64,
    /// Root mean square of the residuals on either axis, in px.
    pub residual_px: f64,
}

/// What is known before the frames are looked at, and what is asked.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MotionOptions {
    /// How many times a point is placed in a frame, at most. 200,000 take some seconds.
    pub observations: usize,
    /// The lens; `None`: [`LensEstimate::unknown`]. A motion is found without it; it matters for the angle to the picture, and for
    /// rotations.
    pub lens: Option<MotionLens>,
    /// What may be adjusted, if the tracks tell it.
    pub may: MotionModel,
}

/// A lens as it is known before the frames are looked at.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MotionLens {
    /// Focal length, in px.
    pub focal_length_px: f64,
    /// Its standard uncertainty as a share of it, more than 0. It counts if the focal length may be adjusted.
    pub focal_length_sigma: f64,
    /// Standard uncertainty of k1, which is known to be near 0; more than 0. It counts if k1 may be adjusted.
    pub k1_sigma: f64,
    /// Principal point: column and row, in px.
    pub centre_px: [f64; 2],
}

impl MotionLens {
    /// As a lens is known.
    pub fn of(estimate: &LensEstimate) -> Self {
        let (lens, sigma) = (&estimate.lens, estimate.sigma());
        Self {
            focal_length_px: lens.focal_length_x_px,
            focal_length_sigma: sigma[0] / lens.focal_length_x_px,
            k1_sigma: sigma[4],
            centre_px: [lens.principal_point_x_px, lens.principal_point_y_px],
        }
    }
}

impl MotionOptions {
    /// For the positions alone, with so many observations.
    pub fn of_positions(observations: usize) -> Self {
        Self { observations, lens: None, may: MotionModel::default() }
    }

    fn lens(&self, rows: usize, columns: usize) -> MotionLens {
        self.lens.unwrap_or_else(|| MotionLens::of(&LensEstimate::unknown(rows, columns)))
    }
}

/// Where rows are not known this well, in px, frames cannot be matched.
const LARGEST_ROWS_SIGMA_PX: f64 = 1.0;

/// Error of disparities that good photographs have besides, in px: what costs less is not told.
const COST_PX: f64 = 0.03;
/// Error of a disparity for a movement across the rows of 1 px over the baseline. Texture that is not vertical then
/// moves along the rows, too: by as much as gradients across and along the rows correlate within a window. Measured on
/// rendered photographs that were turned by 0.03 and 0.1 degrees: 0.18 px.
const COST_OF_DRIFT: f64 = 0.2;
/// What is not this many standard uncertainties off is not told.
const SIGNIFICANT: f64 = 3.0;

impl TextureMotion {
    /// How far a typical point moves across the rows from the first frame to the last, in px; positive to higher rows.
    pub fn drift_px(&self) -> f64 {
        self.position_px.last().copied().unwrap_or(0.0) * self.angle_rad.sin() * self.along_columns()
    }

    /// 1 if contents move to higher columns, -1 if to lower ones.
    fn along_columns(&self) -> f64 {
        if self.moves_right { 1.0 } else { -1.0 }
    }

    /// Whether the motion is so far from the rows that a match loses accuracy by it.
    pub fn turn_costs(&self) -> bool {
        COST_OF_DRIFT * self.drift_px().abs() > COST_PX
            && self.angle_rad.abs() > SIGNIFICANT * self.angle_sigma_rad
    }
}

/// Reductions of frames of this size for the first search: the first that is tried, and the least.
fn search_factors(rows: usize, columns: usize) -> (usize, usize) {
    let most = (rows.min(columns) / LEAST_SIDE).max(1);
    let first = rows.max(columns).div_ceil(SEARCH_SIDE).clamp(1, most);
    (first, first.div_ceil(LARGER))
}

/// Bytes that [`texture_motion`] takes at most for so many frames of this size, besides the frames themselves.
pub fn need(count: usize, rows: usize, columns: usize) -> u64 {
    let pixels = |factor: usize| (rows / factor) as u64 * (columns / factor) as u64;
    let (_, least) = search_factors(rows, columns);
    // The search holds all frames, small. Then points are placed in pictures of full size: those of an anchor in some
    // at once, and all of them in one picture for each thread.
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    let large = (SOME + 1).max(threads) as u64 * pixels(1);
    size_of::<f32>() as u64 * large.max(count as u64 * pixels(least))
}

/// Finds how the camera moved.
///
/// # Errors
/// [`TextureMotionError`] if nothing moves, or the texture does not connect the frames; `Cancelled` if the frames
/// say so.
pub fn texture_motion(
    frames: &dyn Frames,
    options: &MotionOptions,
) -> Result<TextureMotion, TextureMotionError> {
    if frames.count() < 3 {
        return Err(TextureMotionError::TooFew { frames: frames.count() });
    }
    let (rows, columns) = frames.size();
    let (first, least) = search_factors(rows, columns);
    let mut factor = first;
    let (mut reach, mut failed) = (None, None);
    loop {
        // Where pictures as they are do not connect, they are tried without what repeats in them.
        for searched in [frames, &Unrepeated(frames)] {
            TextureMotionError::if_cancelled(frames)?;
            match search(searched, factor, reach, factor == least) {
                Ok(None) => {
                    reach = Some(SMALL_REACH);
                    break;
                }
                Ok(Some(found)) => match followed(frames, found, factor, options) {
                    Ok(motion) => return Ok(motion),
                    Err(error) => failed = failed.or(Some(error)),
                },
                // Of two frames it says less than of all.
                Err(TextureMotionError::NothingFollowed) => {}
                Err(error) => failed = failed.or(Some(error)),
            }
        }
        if factor == least {
            TextureMotionError::if_cancelled(frames)?;
            return Err(match (cause(frames, first), failed) {
                // Points were followed, so they move a little.
                (Some(TextureMotionError::Still), Some(failed))
                    if failed.clone().of_other_motion(1.0).is_none() =>
                {
                    failed
                }
                (Some(cause), _) => cause,
                (None, failed) => failed.unwrap_or(TextureMotionError::NothingFollowed),
            });
        }
        factor = factor.div_ceil(2).max(least);
    }
}

/// The motion from what a search found in pictures that are reduced by `factor`.
fn followed(
    frames: &dyn Frames,
    found: Found,
    mut factor: usize,
    options: &MotionOptions,
) -> Result<TextureMotion, TextureMotionError> {
    let (rows, columns) = frames.size();
    let MotionLens { focal_length_px, focal_length_sigma, k1_sigma, centre_px } = options.lens(rows, columns);
    let lens = LensPrior { focal_length_px, focal_length_sigma, k1_sigma };
    let mut expected = Expected::of_search(found, focal_length_px, centre_px);
    loop {
        factor = factor.div_ceil(FINER);
        let tracks = follow::follow(frames, factor, &expected, options.observations);
        TextureMotionError::if_cancelled(frames)?;
        if factor == 1 {
            let chosen = choose(&tracks, &expected.cameras, lens, options.may, frames)?;
            contradiction(&chosen.fit, (rows, columns)).map_or(Ok(()), Err)?;
            let motion = motion(&tracks, chosen, options.may)?;
            // Where frames turn and that cannot be adjusted, points are off by more than the uncertainty says.
            let rows_px = motion.rows_sigma_px.max(motion.residual_px);
            return match rows_px < LARGEST_ROWS_SIGMA_PX {
                true => Ok(motion),
                false => Err(TextureMotionError::Uncertain { rows_px }),
            };
        }
        let MotionModel { pan, rotations, .. } = options.may;
        let model = MotionModel { pan, rotations, ..MotionModel::default() };
        let fit = bundle::adjust(&tracks, &expected.cameras, lens, model)?;
        expected = Expected::of_fit(&fit, &tracks, expected.anchors);
    }
}

/// From the adjusted cameras to positions of a typical point, and to tau.
fn motion(
    tracks: &[Track],
    chosen: choose::Chosen,
    may: MotionModel,
) -> Result<TextureMotion, TextureMotionError> {
    let choose::Chosen { fit, is_tested } = chosen;
    let model = fit.free;
    let fit = if may.focal_length { with_free_focal_length(tracks, fit)? } else { fit };
    let uncertainty = Uncertainty::of(tracks, &fit);
    let position: Vec<f64> = fit.cameras.frames.iter().map(|frame| frame.position).collect();
    let [first, last] = [position[0], position[position.len() - 1]];
    let tau: Vec<f64> = position.iter().map(|position| (position - first) / (last - first)).collect();
    let (tau_sigma, step_sigma) = uncertainty.of_tau(&tau);
    let [disparity_sigma_px, bend_sigma_px] = uncertainty.of_disparities(&tau);
    let px = uncertainty.typical_px();
    let direction = fit.cameras.direction;
    let [angle_sigma_rad, pan_sigma_rad, pan_own_sigma_rad] = uncertainty.of_direction();
    let agreement = fit.agreement(tracks);
    Ok(TextureMotion {
        position_px: position.iter().map(|position| px * (position - first)).collect(),
        tau,
        tau_sigma,
        step_sigma,
        moves_right: direction.x < 0.0,
        angle_rad: (direction.y / direction.x).atan(),
        angle_sigma_rad,
        model,
        is_tested,
        pan_sigma_rad,
        pan_own_sigma_rad,
        k1_sigma: if fit.free.k1 { uncertainty.of_k1() } else { 0.0 },
        focal_length_sigma: if fit.free.focal_length { uncertainty.of_focal_length() } else { 0.0 },
        rows_sigma_px: uncertainty.of_rows(),
        position_sigma_px: uncertainty.of_positions() * px,
        disparity_sigma_px,
        bend_sigma_px,
        typical_rho: uncertainty.typical_rho(),
        points: agreement.points,
        rejected: agreement.rejected,
        residual_px: agreement.residual_px,
        cameras: fit.cameras,
    })
}
