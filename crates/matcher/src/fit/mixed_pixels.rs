//! Mixed pixels: a pixel at the rim of a surface shows two surfaces, and goes to the one that has more of it
//! (alpha matting).
//!
//! Along the nearer surface's line such a pixel shows a constant share of that surface, and for the rest the
//! background that it passes (compositing; Porter and Duff 1984). A frame in which the nearer surface has
//! moved away shows the background alone. The background's share is the slope of the regression of the one on
//! the other (matting before a known background; Smith and Blinn 1996).

use std::ops::Range;

use super::observations::Observation;
use super::spline::{FRACTIONS, Spline, SplineEpi};
use crate::lines::EpiLines;
use crate::validity::outlier_test::{BESIDE_PX, SEPARATION_PX};

/// At this distance from the rim, in px, no blur of the nearer surface is left.
const CLEAR_PX: f64 = 1.5;
/// At least so many samples, or the share is too uncertain.
const LEAST_SAMPLES: usize = 10;
/// The variance along the line that the farther surface does not explain may be this share of its texture's
/// variance: the square of the share that decides. More shows a third surface.
const LARGEST_UNEXPLAINED: f64 = DECIDING_SHARE * DECIDING_SHARE;
/// Pixels belong to the surface that has more than this share of them.
const DECIDING_SHARE: f64 = 0.5;
/// The variance of the noise is the smallest of the residuals' within this many pixels on both sides: those
/// of a rim are larger.
const NOISE_REACH: usize = 3;

/// A row's lines and the samples along them.
pub(super) struct RowSamples<'a> {
    pub(super) spline: &'a Spline,
    pub(super) epi: &'a SplineEpi,
    pub(super) lines: &'a EpiLines,
    /// The columns that frames show.
    pub(super) columns: &'a Range<usize>,
    /// Only every n-th frame from the reference frame on is there.
    pub(super) every: usize,
}

/// Two surfaces that meet at a pixel, by their disparities in px.
struct Rim {
    near: f64,
    far: f64,
    /// The side of the pixel on which the nearer one lies: 1 or -1.
    toward: f64,
}

impl RowSamples<'_> {
    /// For each pixel of the row that belongs to another surface than its guess says, as far as the texture
    /// of the farther one tells, how many columns away that surface is; 0 for the others.
    pub(super) fn find_misplaced(&self, guesses: &[f32], observations: &[Observation], misplaced: &mut [i8]) {
        for (x, misplaced) in misplaced.iter_mut().enumerate() {
            let own = guesses[x];
            let belongs = |side: isize| {
                let beside = (1..=BESIDE_PX as isize).map(|away| side * away);
                let mut beside =
                    beside.filter_map(|away| Some((away, *guesses.get(x.wrapping_add_signed(away))?)));
                let (away, other) = beside.find(|(_, other)| (other - own).abs() > SEPARATION_PX)?;
                let is_near = own.abs() > other.abs();
                let rim = Rim {
                    near: f64::from(if is_near { own } else { other }),
                    far: f64::from(if is_near { other } else { own }),
                    toward: if is_near { -side } else { side } as f64,
                };
                let share = self.share_of_far(x, &rim, noise_around(observations, x));
                share.is_some_and(|share| (share > DECIDING_SHARE) == is_near).then_some(away as i8)
            };
            *misplaced = [-1, 1].into_iter().find_map(belongs).unwrap_or(0);
        }
    }

    /// The farther surface's share of pixel `x`; `None` if its texture is not significant against noise of this
    /// variance, in DN^2, or too few frames show it.
    fn share_of_far(&self, x: usize, rim: &Rim, noise: f64) -> Option<f64> {
        let offsets = self.lines.offsets();
        let relative = rim.near - rim.far;
        // Distance by which the rim has moved away from the background behind the pixel.
        let moved = |t: usize| relative * offsets[t] * rim.toward;
        let there = |t: &usize| t.abs_diff(self.lines.reference()).is_multiple_of(self.every);
        let clear = (0..offsets.len()).filter(there).max_by(|&a, &b| moved(a).total_cmp(&moved(b)))?;
        let (mut count, mut shown, mut behind) = (0, [0.0; 2], [0.0; 2]);
        let mut products = 0.0;
        for (t, &tau) in offsets.iter().enumerate().filter(|(t, _)| there(t)) {
            if moved(clear) - moved(t) < CLEAR_PX {
                continue;
            }
            let passed = x as f64 + relative * tau + rim.far * offsets[clear];
            let samples = (self.sample(t, x as f64 + rim.near * tau), self.sample(clear, passed));
            if let (Some(value), Some(ground)) = samples {
                count += 1;
                shown = [shown[0] + value, shown[1] + value * value];
                behind = [behind[0] + ground, behind[1] + ground * ground];
                products += value * ground;
            }
        }
        let count_of = count.max(1) as f64;
        let variance = |[sum, squares]: [f64; 2]| squares / count_of - (sum / count_of).powi(2);
        let covariance = products / count_of - shown[0] / count_of * behind[0] / count_of;
        // Noise of the ground is no texture, and would lower the gradient.
        let texture = variance(behind) - noise;
        if count < LEAST_SAMPLES || texture <= noise {
            return None;
        }
        let share = covariance / texture;
        let unexplained = variance(shown) - share * covariance;
        (unexplained <= LARGEST_UNEXPLAINED * texture + noise).then_some(share)
    }

    /// The intensity of frame `t` at a column; `None` within a pixel of the borders of what is shown, where the
    /// spline is mirrored, and beyond.
    fn sample(&self, t: usize, column: f64) -> Option<f64> {
        if column < (self.columns.start + 1) as f64 || column > self.columns.end as f64 - 2.0 {
            return None;
        }
        let steps = (column * FRACTIONS as f64).round() as usize;
        let [weights, ..] = self.spline.weights(steps % FRACTIONS);
        let taps = self.epi.taps(t, (steps / FRACTIONS) as isize);
        Some(f64::from(weights.iter().zip(taps).map(|(weight, tap)| weight * tap).sum::<f32>()))
    }
}

/// Variance of the noise around column `x`, in DN^2; 0 if no observation tells.
fn noise_around(observations: &[Observation], x: usize) -> f64 {
    let near = &observations[x.saturating_sub(NOISE_REACH)..(x + NOISE_REACH + 1).min(observations.len())];
    let smallest = near
        .iter()
        .filter(|observation| observation.weight > 0.0)
        .map(|observation| observation.variance)
        .fold(f32::INFINITY, f32::min);
    if smallest.is_finite() { f64::from(smallest) } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    use super::*;
    use crate::fit::observations::UNOBSERVED;
    use epirig_core::tau::Tau;
    use epirig_core::volume::Volume;

    const FRAMES: usize = 41;
    const COLUMNS: usize = 120;
    const NEAR_PX: f32 = 30.4;
    const FAR_PX: f32 = 20.4;
    /// The pixel at the rim.
    const MIXED: usize = 60;
    const NOISE_DN: f64 = 1.0;

    fn far_texture(x: f64) -> f64 {
        100.0 + 20.0 * (0.9 * x).sin() + 20.0 * (1.7 * x + 1.0).sin()
    }

    fn near_texture(x: f64) -> f64 {
        140.0 + 20.0 * (1.1 * x).sin() + 20.0 * (1.9 * x + 2.0).sin()
    }

    /// A near surface to the right of a rim that covers `share` of the pixel in frame `reference`, before a
    /// farther one that shows `far`. Pixels show what covers their square.
    fn scene(share: f64, reference: usize, far: impl Fn(f64) -> f64) -> (Volume, EpiLines) {
        let tau = Tau::equidistant(FRAMES).unwrap();
        let lines = EpiLines::new(&tau, reference, COLUMNS);
        let mut volume = Volume::fine(1, COLUMNS, 8, tau);
        let mut random = ChaCha8Rng::seed_from_u64(3);
        let rim = MIXED as f64 + 0.5 - share;
        for (index, count) in volume.fine_counts_mut().unwrap().iter_mut().enumerate() {
            let (x, tau) = ((index % COLUMNS) as f64, lines.offsets()[index / COLUMNS]);
            let (near, far) = (x - f64::from(NEAR_PX) * tau, far(x - f64::from(FAR_PX) * tau));
            let covered = (near + 0.5 - rim).clamp(0.0, 1.0);
            let noise: f64 = StandardNormal.sample(&mut random);
            let value = covered * near_texture(near) + (1.0 - covered) * far + NOISE_DN * noise;
            *count = (128.0 * value).round() as u16;
        }
        (volume, lines)
    }

    /// The columns that are marked if the pixel is taken for one of the surface of disparity `own`.
    fn marked((volume, lines): &(Volume, EpiLines), own: f32) -> Vec<usize> {
        let spline = Spline::new();
        let mut epi = SplineEpi::default();
        epi.take(&spline, volume, None, 0, 0..FRAMES);
        let guesses: Vec<f32> = (0..COLUMNS)
            .map(|x| match x.cmp(&MIXED) {
                std::cmp::Ordering::Less => FAR_PX,
                std::cmp::Ordering::Equal => own,
                std::cmp::Ordering::Greater => NEAR_PX,
            })
            .collect();
        let observations = [Observation { weight: 1.0, variance: NOISE_DN as f32, ..UNOBSERVED }; COLUMNS];
        let mut misplaced = [0; COLUMNS];
        RowSamples { spline: &spline, epi: &epi, lines, columns: &(0..COLUMNS), every: 1 }.find_misplaced(
            &guesses,
            &observations,
            &mut misplaced,
        );
        (0..COLUMNS).filter(|&x| misplaced[x] != 0).collect()
    }

    #[test]
    fn a_mixed_pixel_belongs_to_what_has_more_of_it() {
        for reference in [0, FRAMES / 2, FRAMES - 1] {
            for share in [0.0, 0.2, 0.35, 0.65, 0.8, 1.0] {
                let scene = scene(share, reference, far_texture);
                let (right, wrong) = if share > 0.5 { (NEAR_PX, FAR_PX) } else { (FAR_PX, NEAR_PX) };
                let place = format!("reference {reference}, share {share}");
                assert!(marked(&scene, right).is_empty(), "{place}: {:?}", marked(&scene, right));
                assert!(marked(&scene, wrong).contains(&MIXED), "{place}");
            }
        }
    }

    #[test]
    fn without_texture_behind_nothing_is_told() {
        let scene = scene(0.8, FRAMES / 2, |_| 100.0);
        assert!([NEAR_PX, FAR_PX].into_iter().all(|own| marked(&scene, own).is_empty()));
    }

    #[test]
    fn a_third_surface_tells_nothing_of_two() {
        // In the last frame, where the near surface has moved away, something else occludes what it has laid
        // bare.
        let (mut volume, lines) = scene(0.0, FRAMES / 2, far_texture);
        let mut third = scene(0.0, FRAMES / 2, |x| far_texture(1.3 * x + 40.0)).0;
        let last = (FRAMES - 1) * COLUMNS;
        let occluded = third.fine_counts_mut().unwrap()[last..].to_vec();
        volume.fine_counts_mut().unwrap()[last..].copy_from_slice(&occluded);
        assert!(marked(&(volume, lines), FAR_PX).is_empty());
    }
}
