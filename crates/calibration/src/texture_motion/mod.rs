//! Where the camera stood in each frame, and which way it went, from the texture of what it saw.
//!
//! A point i at inverse depth rho_i is seen in frame t at c_i + rho_i s_t along the motion: s_t, the position, is
//! common to all points. So ratios of displacements between any frames are the same at every depth. Points with
//! texture are followed from an anchor frame to every other in which they are seen, and not only to the next: a
//! displacement over many frames, one over few, and those of points of other anchors must agree.
//!
//! 1. In small pictures, two frames show how far each point moves (`start`). Then each further frame has one
//!    unknown, s (`search`). All s over the whole width of the picture are tried with all points at once. Nothing is
//!    assumed about steps, so gaps, steps back and repeated frames are found like others.
//! 2. In larger pictures, up to the frames' own size, points are placed in each frame by least squares (`follow`).
//! 3. All s, c and rho are adjusted together (`adjust`), with weights that leave out outliers.
//!
//! The direction of the motion follows from displacements across it.

mod adjust;
mod error;
mod follow;
mod frames;
mod point;
mod search;
mod start;
mod steps;
#[cfg(test)]
mod tests;

pub use error::TextureMotionError;
pub use frames::Frames;
pub use steps::{Return, Step, in_usual_steps};

use adjust::Adjusted;
use search::{Found, SOME};

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
    /// Number of points that were followed and agree.
    pub points: usize,
    /// Root mean square of their residuals along the motion, in px.
    pub residual_px: f64,
}

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

    /// The way in which images are to be turned, so that the motion is along the rows.
    pub fn cure(&self) -> Turn {
        Turn::against(self.angle_rad)
    }
}

epirig_core::choices! {
    /// A way to turn images.
    pub enum Turn {
        /// As the hands of a clock.
        Clockwise = "clockwise",
        /// Against them.
        CounterClockwise = "counter-clockwise",
    }
}

impl Turn {
    /// The way that brings a motion at this angle, in any unit, to the rows: positive if what goes to the right goes
    /// down, too.
    pub fn against(angle: f64) -> Self {
        // Rows count downwards: contents that move to the right and down go clockwise from the rows.
        if angle > 0.0 { Self::CounterClockwise } else { Self::Clockwise }
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
/// `observations` bounds the effort: how many times a point is placed in a frame, at most. 200,000 take some
/// seconds.
///
/// # Errors
/// [`TextureMotionError`] if nothing moves, or the texture does not connect the frames.
pub fn texture_motion(frames: &dyn Frames, observations: usize) -> Result<TextureMotion, TextureMotionError> {
    if frames.count() < 3 {
        return Err(TextureMotionError::TooFew { frames: frames.count() });
    }
    let (rows, columns) = frames.size();
    let (first, least) = search_factors(rows, columns);
    let (mut found, mut factor) = search::search(frames, first, least)?;
    loop {
        factor = factor.div_ceil(FINER);
        let followed = follow::follow(frames, factor, &found, observations)?;
        let adjusted = adjust::adjust(&followed, &found)?;
        if factor == 1 {
            return Ok(motion(&adjusted));
        }
        found = adjusted.found;
    }
}

/// From positions on any scale to those of a typical point, and to tau.
fn motion(adjusted: &Adjusted) -> TextureMotion {
    let Found { position, direction, .. } = &adjusted.found;
    let [first, last] = [position[0], position[position.len() - 1]];
    let scale = if last < first { -adjusted.typical_rho } else { adjusted.typical_rho };
    let tau: Vec<f64> = position.iter().map(|position| (position - first) / (last - first)).collect();
    let (tau_sigma, step_sigma) = adjusted.sigmas(&tau);
    TextureMotion {
        position_px: position.iter().map(|position| scale * (position - first)).collect(),
        tau,
        tau_sigma,
        step_sigma,
        moves_right: (last - first) * adjusted.typical_rho * direction[0] > 0.0,
        angle_rad: (direction[1] / direction[0]).atan(),
        angle_sigma_rad: adjusted.angle_sigma,
        points: adjusted.points,
        residual_px: adjusted.residual,
    }
}
