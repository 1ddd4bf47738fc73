//! Where two faces meet, their planes cross: that tells to which face the pixels beside the crease belong.
//!
//! Windows reach across a crease as far as their misfit stays below the noise, so planes of the wrong face, or of windows that straddle, win pixels or two of the right one. The faces'
//! own planes, a few px away, tell where they cross to a tenth of a pixel.

use rayon::prelude::*;

use super::planes::{PAD, PlaneRow, SurfacePlanes};

/// Planes this far from a pixel are those of the faces, and those twice as far are the same, in px.
const BESIDE_PX: usize = 3;
/// Faces meet where their slants differ by more than this many standard deviations, as planes are known where they are carried to: among the differences of a megapixel,
/// chance exceeds it less than once in five hundred images.
const BEND_SIGMAS: f32 = 6.0;
/// Slants are those of one face if they differ by less than this share of what bends. Of a surface that is curved evenly they would differ by a half of it.
const ONE_FACE: f32 = 0.25;

/// The plane of a face where it is carried to.
#[derive(Debug, Clone, Copy)]
struct Face {
    disparity: f32,
    /// Slant from one face to the other, and along the crease.
    across: f32,
    along: f32,
    variance: f32,
    /// What windows disagree by, as maps have it.
    texture: f32,
}

/// In which direction the faces follow each other.
#[derive(Debug, Clone, Copy)]
enum Across {
    Columns,
    Rows,
}

/// Gives pixels beside creases the planes of their faces. A plane's variance grows by the squared distance over `slant_spread`, in px^2.
pub(super) fn settle_creases(map: &mut SurfacePlanes, slant_spread: f32) {
    let settled: Vec<Vec<(usize, Face, Across)>> = (0..map.rows())
        .into_par_iter()
        .map(|y| {
            let places = PAD..map.disparity.row(y).len() - PAD;
            let both = |place| {
                [Across::Columns, Across::Rows].into_iter().find_map(|across| {
                    Some((place, face_beside_crease(map, (place, y), across, slant_spread)?, across))
                })
            };
            places.filter_map(both).collect()
        })
        .collect();
    map.par_rows().zip(settled).for_each(|(row, settled)| {
        let PlaneRow { disparity, slant_x, slant_y, variance, texture, .. } = row;
        for (place, face, across) in settled {
            disparity[place] = face.disparity;
            (slant_x[place], slant_y[place]) = match across {
                Across::Columns => (face.across, face.along),
                Across::Rows => (face.along, face.across),
            };
            variance[place] = face.variance;
            texture[place] = face.texture;
        }
    });
}

/// The face that the pixel belongs to, if it lies beside a crease and has another plane.
fn face_beside_crease(
    map: &SurfacePlanes,
    (place, y): (usize, usize),
    across: Across,
    slant_spread: f32,
) -> Option<Face> {
    let far = 2 * BESIDE_PX;
    if matches!(across, Across::Rows) && (y < far || y + far >= map.rows()) {
        return None;
    }
    let slants = match across {
        Across::Columns => [&map.slant_x, &map.slant_y],
        Across::Rows => [&map.slant_y, &map.slant_x],
    };
    let at = |away: isize| match across {
        Across::Columns => (y, place.wrapping_add_signed(away)),
        Across::Rows => (y.wrapping_add_signed(away), place),
    };
    let slant = |away: isize| {
        let (y, place) = at(away);
        slants[0].row(y)[place]
    };
    let beside = BESIDE_PX as isize;
    let bend = slant(beside) - slant(-beside);
    let same = |one: isize, other: isize| (slant(one) - slant(other)).abs() < ONE_FACE * bend.abs();
    if !same(-beside, -2 * beside) || !same(beside, 2 * beside) {
        return None;
    }
    let face = |away: isize| {
        let (y, place) = at(away);
        let across = slants[0].row(y)[place];
        Face {
            disparity: map.disparity.row(y)[place] - across * away as f32,
            across,
            along: slants[1].row(y)[place],
            variance: map.variance.row(y)[place] * (1.0 + (away * away) as f32 / slant_spread),
            texture: map.texture.row(y)[place],
        }
    };
    let (before, after) = (face(-beside), face(beside));
    let chance = (before.variance + after.variance) / slant_spread;
    let crease = (before.disparity - after.disparity) / bend;
    // Infinite variances make no crease.
    if bend * bend > BEND_SIGMAS * BEND_SIGMAS * chance && crease.abs() <= BESIDE_PX as f32 {
        let own = if crease > 0.0 { before } else { after };
        let settled = (slant(0) - own.across).abs() < ONE_FACE * bend.abs();
        return (!settled).then_some(own);
    }
    None
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    use super::*;

    const ROWS: usize = 30;
    const COLUMNS: usize = 40;
    const SPREAD: f32 = 12.0;
    const SIGMA_PX: f64 = 0.005;
    /// Where the faces of `roof` meet, in columns.
    const CREASE: f64 = 20.3;

    /// A map of the planes that touch `surface`, which gives disparity and slant along x, and along y with `turned`.
    fn map_of(surface: impl Fn(f64) -> (f64, f64), turned: bool, noise: f64) -> SurfacePlanes {
        let mut random = ChaCha8Rng::seed_from_u64(8);
        let mut map = SurfacePlanes::unknown(ROWS, COLUMNS);
        for y in 0..ROWS {
            for x in 0..COLUMNS {
                let (disparity, slant) = surface(if turned { y } else { x } as f64);
                let mut noisy = |value: f64, sigma: f64| {
                    let noise_of_one: f64 = StandardNormal.sample(&mut random);
                    (value + noise * sigma * noise_of_one) as f32
                };
                map.disparity.row_mut(y)[PAD + x] = noisy(disparity, SIGMA_PX);
                let slants =
                    [noisy(slant, SIGMA_PX / 12.0_f64.sqrt()), noisy(0.0, SIGMA_PX / 12.0_f64.sqrt())];
                let [across, along] = if turned { [1, 0] } else { [0, 1] }.map(|index: usize| slants[index]);
                map.slant_x.row_mut(y)[PAD + x] = across;
                map.slant_y.row_mut(y)[PAD + x] = along;
                map.variance.row_mut(y)[PAD + x] = (SIGMA_PX * SIGMA_PX) as f32;
            }
        }
        map
    }

    fn roof(x: f64) -> (f64, f64) {
        if x < CREASE { (0.04 * (x - CREASE), 0.04) } else { (-0.07 * (x - CREASE), -0.07) }
    }

    #[test]
    fn pixels_beside_a_crease_take_the_plane_of_their_face() {
        for turned in [false, true] {
            // Two pixels have planes of the wrong face, and one that of a window that straddles.
            let wrong = |x: f64| match x as usize {
                19 | 20 => (-0.07 * (x - CREASE), -0.07),
                21 => (-0.05, -0.01),
                _ => roof(x),
            };
            let mut map = map_of(wrong, turned, 0.0);
            settle_creases(&mut map, SPREAD);
            for y in 0..ROWS {
                for x in 0..COLUMNS {
                    let (disparity, slant) = roof(if turned { y } else { x } as f64);
                    let slants = [map.slant_x.row(y)[PAD + x], map.slant_y.row(y)[PAD + x]];
                    let found = [map.disparity.row(y)[PAD + x], slants[usize::from(turned)]];
                    assert!((f64::from(found[0]) - disparity).abs() < 1e-6, "{turned} {x} {y}: {found:?}");
                    assert!((f64::from(found[1]) - slant).abs() < 1e-6, "{turned} {x} {y}: {found:?}");
                }
            }
            let changed =
                f64::from(if turned { map.variance.row(19)[PAD + 5] } else { map.variance.row(5)[PAD + 19] });
            assert!((changed / (SIGMA_PX * SIGMA_PX) - (1.0 + 9.0 / 12.0)).abs() < 1e-5);
        }
    }

    /// Maps that must stay as they are.
    fn assert_kept(name: &str, surface: impl Fn(f64) -> (f64, f64), noise: f64) {
        let before = map_of(surface, false, noise);
        let mut after = before.clone();
        settle_creases(&mut after, SPREAD);
        for y in 0..ROWS {
            assert_eq!(before.disparity.row(y), after.disparity.row(y), "{name}, row {y}");
            assert_eq!(before.slant_x.row(y), after.slant_x.row(y), "{name}, row {y}");
        }
    }

    #[test]
    fn what_is_no_crease_stays() {
        assert_kept("noise", |x| (0.04 * x, 0.04), 1.0);
        assert_kept("curved", |x| (0.005 * x * x, 0.01 * x), 0.0);
        assert_kept("step", |x| (if x < CREASE { 0.0 } else { 0.1 }, 0.0), 0.0);
        assert_kept("a roof that is known", roof, 0.5);
    }
}
