//! Creases: where two faces meet, their planes cross, and that tells which face a pixel beside the crease
//! belongs to.
//!
//! Windows reach across a crease as long as their misfit stays below the noise. So a pixel or two beside it
//! get the plane of the wrong face, or of a window astride. The planes a few px to both sides tell to a tenth
//! of a pixel where the faces cross. Of the planes of a face, the one is used that is known best at the pixel
//! to which it is carried: narrow windows know their slant badly.

use std::ops::RangeInclusive;

use rayon::prelude::*;

use super::carried::CarriedPlane;
use super::padded::PAD;
use super::planes::SurfacePlanes;

/// Planes this far from a pixel are those of the faces, in px: windows reach 3 px, ...
const BESIDE_PX: RangeInclusive<isize> = 3..=6;
/// ... and those as far again are the same.
const BEYOND_PX: RangeInclusive<isize> = 7..=12;
/// Faces meet where their slants differ by more than this many standard deviations: among the differences of
/// a megapixel, chance exceeds it less than once in five hundred images.
const CHANGE_SIGMAS: f32 = 6.0;
/// Slants are those of one face if they differ by less than this share of the change. Of a surface that is
/// curved evenly they would differ by a half of it.
const ONE_FACE: f32 = 0.25;
/// A pixel's plane is its face's if neither disparity nor slant differ by more than this many standard
/// deviations; chance exceeds it once in four hundred.
const ALIKE_SIGMAS: f32 = 3.0;

/// In which direction the faces follow each other.
#[derive(Debug, Clone, Copy)]
enum Across {
    Columns,
    Rows,
}

impl Across {
    /// The place `away` px along the direction.
    fn at(self, (place, y): (usize, usize), away: isize) -> (usize, usize) {
        match self {
            Self::Columns => (place.wrapping_add_signed(away), y),
            Self::Rows => (place, y.wrapping_add_signed(away)),
        }
    }

    fn slant(self, plane: &CarriedPlane) -> f32 {
        match self {
            Self::Columns => plane.slant_x,
            Self::Rows => plane.slant_y,
        }
    }
}

/// The plane of a face where it is carried to.
#[derive(Debug, Clone, Copy)]
struct Face {
    plane: CarriedPlane,
    /// As the map has it where the plane comes from.
    texture: f32,
}

/// A pixel beside a crease.
struct Beside {
    place: usize,
    face: Face,
    /// Whether the pixel has the face's plane already.
    decided: bool,
}

/// Gives pixels beside creases the planes of their faces. Returns the places of these pixels in the padded
/// row, for each row. The variance of a carried plane grows by this `share` of the variance that both slants
/// make: a half where windows are as wide as high.
pub(super) fn decide_creases(map: &mut SurfacePlanes, share: f32) -> Vec<Vec<usize>> {
    let beside: Vec<Vec<Beside>> = (0..map.rows())
        .into_par_iter()
        .map(|y| {
            let changes =
                [Across::Columns, Across::Rows].map(|across| (across, slant_changes(map, y, across)));
            let any = |place: usize| {
                let mut changed = changes.iter().filter(|(_, changes)| changes[place - PAD]);
                changed.find_map(|&(across, _)| face_beside_crease(map, (place, y), across, share))
            };
            (PAD..map.disparity.row(y).len() - PAD).filter_map(any).collect()
        })
        .collect();
    let undecided = |row: &Vec<Beside>| {
        row.iter().filter(|pixel| !pixel.decided).map(|pixel| (pixel.place, pixel.face.plane)).collect()
    };
    map.take(&beside.iter().map(undecided).collect::<Vec<_>>());
    map.texture.par_rows().zip(&beside).for_each(|(texture, row)| {
        row.iter().filter(|pixel| !pixel.decided).for_each(|pixel| texture[pixel.place] = pixel.face.texture);
    });
    beside.into_iter().map(|row| row.into_iter().map(|pixel| pixel.place).collect()).collect()
}

/// Whether slants on both sides of each pixel of row `y` hint at a crease: half as clearly as they must, at
/// one of two distances. Most pixels are spared [`face_beside_crease`] by that, which is slow.
fn slant_changes(map: &SurfacePlanes, y: usize, across: Across) -> Vec<bool> {
    let (slants, farthest) = match across {
        Across::Columns => (&map.slant_x, 0),
        Across::Rows => (&map.slant_y, *BEYOND_PX.end() as usize),
    };
    let places = map.disparity.row(y).len() - 2 * PAD;
    let mut changes = vec![false; places];
    // Slants that are needed lie in the image.
    if y < farthest || y + farthest >= map.rows() {
        return changes;
    }
    for away in [*BESIDE_PX.start(), *BESIDE_PX.end()] {
        let [before, after] = [-away, away].map(|away| {
            let (first, y) = across.at((PAD, y), away);
            let room = first..first + places;
            (&slants.row(y)[room.clone()], &map.slant_variance.row(y)[room])
        });
        let slants = before.0.iter().zip(after.0).zip(before.1.iter().zip(after.1));
        for (changes, ((before, after), chance)) in changes.iter_mut().zip(slants) {
            let change = after - before;
            *changes |= 4.0 * change * change > CHANGE_SIGMAS * CHANGE_SIGMAS * (chance.0 + chance.1);
        }
    }
    changes
}

/// The face that the pixel belongs to, if it lies beside a crease.
fn face_beside_crease(
    map: &SurfacePlanes,
    pixel: (usize, usize),
    across: Across,
    share: f32,
) -> Option<Beside> {
    let face = |away: isize| {
        let (place, y) = across.at(pixel, away);
        let back = match across {
            Across::Columns => (-away as f32, 0.0),
            Across::Rows => (0.0, -away as f32),
        };
        Face { plane: map.plane(place, y).carried(back, share), texture: map.texture.row(y)[place] }
    };
    let best = |side: isize, distances: RangeInclusive<isize>| {
        let faces = distances.map(|distance| face(side * distance));
        faces.min_by(|one, other| one.plane.variance.total_cmp(&other.plane.variance))
    };
    let [before, after] = [best(-1, BESIDE_PX)?, best(1, BESIDE_PX)?];
    let slant = |face: &Face| across.slant(&face.plane);
    let change = slant(&after) - slant(&before);
    let chance = before.plane.slant_variance + after.plane.slant_variance;
    let crease = (before.plane.disparity - after.plane.disparity) / change;
    // Infinite variances make no crease.
    let changes = change * change > CHANGE_SIGMAS * CHANGE_SIGMAS * chance;
    if !changes || crease.abs() > *BESIDE_PX.start() as f32 {
        return None;
    }
    for (side, near) in [(-1, &before), (1, &after)] {
        if (slant(near) - slant(&best(side, BEYOND_PX)?)).abs() > ONE_FACE * change.abs() {
            return None;
        }
    }
    let (own, face) = (face(0), if crease > 0.0 { before } else { after });
    let alike =
        |difference: f32, variance: f32| difference * difference <= ALIKE_SIGMAS * ALIKE_SIGMAS * variance;
    let decided = alike(slant(&own) - slant(&face), own.plane.slant_variance + face.plane.slant_variance)
        && alike(own.plane.disparity - face.plane.disparity, own.plane.variance + face.plane.variance);
    Some(Beside { place: pixel.0, face, decided })
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    use super::*;

    const ROWS: usize = 44;
    const COLUMNS: usize = 44;
    /// Mean squares of the places in the windows, in px^2.
    const SPREAD: f64 = 12.0;
    const SHARE: f32 = 0.5;
    const SIGMA_PX: f64 = 0.005;
    /// Where the faces of `roof` meet, in columns.
    const CREASE: f64 = 20.3;

    /// A map of the planes that touch `surface`, which gives disparity and slant along x, and along y with
    /// `turned`.
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
                let slants = [slant, 0.0].map(|slant| noisy(slant, SIGMA_PX / SPREAD.sqrt()));
                let [across, along] = if turned { [1, 0] } else { [0, 1] }.map(|index: usize| slants[index]);
                map.slant_x.row_mut(y)[PAD + x] = across;
                map.slant_y.row_mut(y)[PAD + x] = along;
                map.variance.row_mut(y)[PAD + x] = (SIGMA_PX * SIGMA_PX) as f32;
                map.slant_variance.row_mut(y)[PAD + x] = (2.0 * SIGMA_PX * SIGMA_PX / SPREAD) as f32;
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
            let beside = decide_creases(&mut map, SHARE);
            for y in 0..ROWS {
                for x in 0..COLUMNS {
                    let (disparity, slant) = roof(if turned { y } else { x } as f64);
                    let slants = [map.slant_x.row(y)[PAD + x], map.slant_y.row(y)[PAD + x]];
                    let found = [map.disparity.row(y)[PAD + x], slants[usize::from(turned)]];
                    assert!((f64::from(found[0]) - disparity).abs() < 1e-6, "{turned} {x} {y}: {found:?}");
                    assert!((f64::from(found[1]) - slant).abs() < 1e-6, "{turned} {x} {y}: {found:?}");
                }
            }
            // Beside the crease lie those that it is at most 3 px from, as far as the faces' own planes can
            // be told.
            let told = |x: usize, y: usize| beside[y].contains(&(PAD + x));
            for across in 0..COLUMNS {
                let told = if turned { told(5, across) } else { told(across, 5) };
                assert!(!told || (18..=23).contains(&across), "{turned} {across}");
                assert!(told || !(19..=21).contains(&across), "{turned} {across}");
            }
            let changed =
                f64::from(if turned { map.variance.row(19)[PAD + 5] } else { map.variance.row(5)[PAD + 19] });
            assert!((changed / (SIGMA_PX * SIGMA_PX) - (1.0 + 9.0 / SPREAD)).abs() < 1e-5);
        }
    }

    #[test]
    fn a_face_has_the_plane_that_is_known_best_where_it_is_carried_to() {
        let mut map = map_of(roof, false, 0.0);
        for y in 0..ROWS {
            // A straddling window won; and next to it, windows that are narrow know the slant badly and have
            // it wrong.
            let straddling = PAD + 20;
            map.disparity.row_mut(y)[straddling] = -0.05;
            map.slant_x.row_mut(y)[straddling] = 0.0;
            let narrow = PAD + 17;
            map.slant_x.row_mut(y)[narrow] = 0.01;
            map.slant_variance.row_mut(y)[narrow] *= 30.0;
        }
        decide_creases(&mut map, SHARE);
        let (disparity, slant) = roof(20.0);
        for y in 0..ROWS {
            assert!((f64::from(map.disparity.row(y)[PAD + 20]) - disparity).abs() < 1e-6, "row {y}");
            assert!((f64::from(map.slant_x.row(y)[PAD + 20]) - slant).abs() < 1e-6, "row {y}");
        }
    }

    /// Maps that must stay as they are.
    fn assert_kept(name: &str, surface: impl Fn(f64) -> (f64, f64), noise: f64) {
        let before = map_of(surface, false, noise);
        let mut after = before.clone();
        decide_creases(&mut after, SHARE);
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
