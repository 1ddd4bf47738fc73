//! What the twin's camera looks at: surfaces whose intersections with a ray have a closed form.
//!
//! Scene coordinates: u along x, v along y, both from the scene's origin; depth Z along the optical axis. With the scene
//! displaced by s, a ray (a, b) = (X / Z, Y / Z) meets the surface at u = a Z - s, v = b Z. Translation along x changes no
//! point's depth, so a point's disparity is f (s_last - s_first) / Z.

use serde::{Deserialize, Serialize};

use super::TwinError;
use super::bands::Bands;

/// The depth of a bowed tile is solved until it changes by less than this, in mm ...
const BOW_SOLVED_MM: f64 = 1e-10;
/// ... and each step must at least halve what is left, so that this many are enough for any tile.
const BOW_STEPS: usize = 64;

/// A surface.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", tag = "kind")]
pub enum Scene {
    /// An endless plane, Z = distance + slope_x u + slope_y v.
    Plane {
        /// Depth at the origin, in mm.
        distance_mm: f64,
        /// Change of depth along u, mm per mm.
        slope_x: f64,
        /// Change of depth along v, mm per mm.
        slope_y: f64,
    },
    /// The edge of a cube that points at the camera (paper, section 5.1): Z = distance + slope |u|.
    CubeEdge {
        /// Depth of the edge, in mm.
        distance_mm: f64,
        /// Change of depth along |u|; 1 for faces at 45 degrees.
        slope: f64,
    },
    /// The reverse side of a square tile (paper, section 5.2): stripes along v, hollow and raised in turn, on a dark,
    /// featureless ground.
    Tile {
        /// Depth of the raised stripes, in mm.
        distance_mm: f64,
        /// Side of the tile, in mm.
        side_mm: f64,
        /// How much deeper the hollows lie, in mm.
        hollow_depth_mm: f64,
        /// Width of a hollow at half its depth, in mm.
        hollow_width_mm: f64,
        /// Distance from hollow to hollow, in mm. A hollow is centred on u = 0.
        pitch_mm: f64,
        /// Width of the sloping walls between the two levels, in mm.
        wall_mm: f64,
        /// How much deeper the middle of an edge lies than the tile's middle, in mm: the depth grows by
        /// bow (u^2 + v^2) / (side / 2)^2.
        #[serde(default)]
        bow_mm: f64,
        /// Chess-boards along the upper and the lower edge; hollows end before them with walls as everywhere.
        #[serde(default)]
        bands: Option<Bands>,
    },
}

/// Where a ray meets the surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hit {
    /// Depth along the optical axis, in mm.
    pub depth_mm: f64,
    /// First coordinate on the surface along which the texture is laid, in mm.
    pub across_mm: f64,
    /// Second coordinate on the surface, in mm.
    pub along_mm: f64,
}

impl Scene {
    /// Distance of the scene's nearest level, which heights are counted from, in mm.
    pub fn distance_mm(&self) -> f64 {
        match *self {
            Self::Plane { distance_mm, .. }
            | Self::CubeEdge { distance_mm, .. }
            | Self::Tile { distance_mm, .. } => distance_mm,
        }
    }

    /// Whether every ray with |X / Z|, |Y / Z| up to `steepest` meets the surface once, in front of the camera.
    pub(super) fn check(&self, steepest: (f64, f64)) -> Result<(), TwinError> {
        let bad = |what, value, expected| Err(TwinError::BadNumber { what, value, expected });
        let distance_mm = self.distance_mm();
        if !(distance_mm.is_finite() && distance_mm > 0.0) {
            return bad("distance in mm", distance_mm, "positive");
        }
        match *self {
            Self::Plane { slope_x, slope_y, .. } => {
                let tilt = slope_x.abs() * steepest.0 + slope_y.abs() * steepest.1;
                if tilt.is_nan() || tilt >= 1.0 {
                    return Err(TwinError::HidesItself(
                        "the plane is seen edge-on at the border of the image",
                    ));
                }
            }
            Self::CubeEdge { slope, .. } => {
                if !(slope >= 0.0 && slope * steepest.0 < 1.0) {
                    return Err(TwinError::HidesItself("a face of the cube is seen edge-on"));
                }
            }
            Self::Tile {
                side_mm,
                hollow_depth_mm,
                hollow_width_mm,
                pitch_mm,
                wall_mm,
                bow_mm,
                bands,
                ..
            } => {
                if side_mm.is_nan() || side_mm <= 0.0 {
                    return bad("side in mm", side_mm, "positive");
                }
                let fits =
                    wall_mm > 0.0 && hollow_width_mm >= wall_mm && pitch_mm >= hollow_width_mm + wall_mm;
                if !fits {
                    return bad(
                        "pitch in mm",
                        pitch_mm,
                        "at least a hollow and a wall, a hollow at least a wall",
                    );
                }
                if hollow_depth_mm.is_nan() || hollow_depth_mm.abs() * steepest.0 >= wall_mm {
                    return Err(TwinError::HidesItself("the hollows' walls are steeper than the view"));
                }
                let wall = hollow_depth_mm.abs() / wall_mm;
                let steepest_wall = match bands {
                    Some(bands) => {
                        bands.check(side_mm, wall_mm)?;
                        steepest.0.max(steepest.1)
                    }
                    None => steepest.0,
                };
                if wall * steepest_wall >= 1.0 {
                    return Err(TwinError::HidesItself(
                        "the walls before the bands are steeper than the view",
                    ));
                }
                // Along a ray the bow's depth changes by this much per mm of depth, and a wall of the tile multiplies that.
                let bowed = 4.0 * bow_mm.abs() / side_mm * (steepest.0 + steepest.1);
                if bowed.is_nan() || bowed >= 0.5 * (1.0 - wall * steepest_wall) {
                    return Err(TwinError::HidesItself("the bow of the tile is too deep for so wide a view"));
                }
            }
        }
        Ok(())
    }

    /// Where the ray (a, b) meets the surface when the scene is displaced by `offset_mm`; `None` where it meets only the
    /// featureless ground.
    pub fn hit(&self, (a, b): (f64, f64), offset_mm: f64) -> Option<Hit> {
        match *self {
            Self::Plane { distance_mm, slope_x, slope_y } => {
                let depth_mm = (distance_mm - slope_x * offset_mm) / (1.0 - slope_x * a - slope_y * b);
                let across_mm = (a * depth_mm - offset_mm) * (1.0 + slope_x * slope_x).sqrt();
                let along_mm = b * depth_mm * (1.0 + slope_y * slope_y).sqrt();
                (depth_mm > 0.0).then_some(Hit { depth_mm, across_mm, along_mm })
            }
            Self::CubeEdge { distance_mm, slope } => {
                // The sign of u is that of the ray's u at the depth of the edge.
                let signed_slope = slope * (a * distance_mm - offset_mm).signum();
                let depth_mm = (distance_mm - signed_slope * offset_mm) / (1.0 - signed_slope * a);
                let across_mm = (a * depth_mm - offset_mm) * (1.0 + slope * slope).sqrt();
                Some(Hit { depth_mm, across_mm, along_mm: b * depth_mm })
            }
            Self::Tile { side_mm, bow_mm, .. } => {
                let depth_mm = if bow_mm == 0.0 {
                    self.tile_depth((a, b), offset_mm, 0.0)
                } else {
                    self.bowed_depth((a, b), offset_mm)
                };
                let (u, v) = (a * depth_mm - offset_mm, b * depth_mm);
                let inside = u.abs() <= 0.5 * side_mm && v.abs() <= 0.5 * side_mm;
                inside.then_some(Hit { depth_mm, across_mm: u, along_mm: v })
            }
        }
    }

    /// Depth of the tile's raised level at (u, v), in mm. Beyond its edges the bow goes no deeper.
    pub(super) fn raised_depth(&self, u: f64, v: f64) -> f64 {
        match *self {
            Self::Tile { distance_mm, side_mm, bow_mm, .. } if bow_mm != 0.0 => {
                let half = 0.5 * side_mm;
                let share = |place: f64| (place / half).clamp(-1.0, 1.0).powi(2);
                distance_mm + bow_mm * (share(u) + share(v))
            }
            _ => self.distance_mm(),
        }
    }

    /// Where the ray meets a bowed tile: the flat tile at the depth that the bow has there, again and again.
    fn bowed_depth(&self, (a, b): (f64, f64), offset_mm: f64) -> f64 {
        let mut deeper_mm = 0.0;
        for _ in 0..BOW_STEPS {
            let depth_mm = self.tile_depth((a, b), offset_mm, deeper_mm);
            let next = self.raised_depth(a * depth_mm - offset_mm, b * depth_mm) - self.distance_mm();
            let change = next - deeper_mm;
            deeper_mm = next;
            if change.abs() < BOW_SOLVED_MM {
                break;
            }
        }
        self.tile_depth((a, b), offset_mm, deeper_mm)
    }

    /// Depth at which the ray meets the tile without bow, `deeper_mm` farther away than it is.
    ///
    /// The depth of a hollow is that of its stripe or of the wall before the band, whichever is less deep, and the ray meets
    /// the two where it meets the surface of each.
    fn tile_depth(&self, (a, b): (f64, f64), offset_mm: f64, deeper_mm: f64) -> f64 {
        let Self::Tile { distance_mm, side_mm, hollow_depth_mm, wall_mm, bands, .. } = *self else {
            return self.distance_mm();
        };
        let raised_mm = distance_mm + deeper_mm;
        let stripes = self.relief(a, offset_mm, raised_mm);
        let Some(bands) = bands else { return raised_mm + stripes };
        let ends = relief_before_band(b.abs(), raised_mm, hollow_depth_mm, bands.start_mm(side_mm), wall_mm);
        raised_mm + if hollow_depth_mm > 0.0 { stripes.min(ends) } else { stripes.max(ends) }
    }

    /// How much deeper than the raised stripes, at depth `raised_mm`, the ray with X / Z = a meets the tile's stripes, in mm.
    ///
    /// On a stretch where the depth is distance + c + m u the ray's u is (a (distance + c) - s) / (1 - m a); the one stretch
    /// that contains its own solution is the one that is hit.
    fn relief(&self, a: f64, offset_mm: f64, raised_mm: f64) -> f64 {
        let Self::Tile { hollow_depth_mm, hollow_width_mm, pitch_mm, wall_mm, .. } = *self else {
            return 0.0;
        };
        let inner = 0.5 * (hollow_width_mm - wall_mm);
        let outer = 0.5 * (hollow_width_mm + wall_mm);
        // Distance of the nearest hollow's middle, from the raised level's u; levels differ by less than a wall.
        let raised_u = a * raised_mm - offset_mm;
        let middle = (raised_u / pitch_mm).round() * pitch_mm;
        let from_middle = |c: f64, m: f64| (a * (raised_mm + c) - offset_mm - middle) / (1.0 - m * a);
        let bottom = from_middle(hollow_depth_mm, 0.0);
        if bottom.abs() <= inner {
            return hollow_depth_mm;
        }
        let raised = raised_u - middle;
        if raised.abs() >= outer {
            return 0.0;
        }
        // A wall: depth hollow_depth (outer - |w|) / wall, w = u - middle.
        let side = if raised + bottom < 0.0 { -1.0 } else { 1.0 };
        let slope = -side * hollow_depth_mm / wall_mm;
        let w = from_middle(hollow_depth_mm * outer / wall_mm, slope);
        hollow_depth_mm * (outer - side * w) / wall_mm
    }
}

/// How much deeper than the raised level, at depth `raised_mm`, the ray with |Y / Z| = b meets an endless hollow that a wall ends where
/// the bands begin, at |v| = `start_mm`; in mm.
fn relief_before_band(b: f64, raised_mm: f64, hollow_depth_mm: f64, start_mm: f64, wall_mm: f64) -> f64 {
    if b * (raised_mm + hollow_depth_mm) <= start_mm - wall_mm {
        return hollow_depth_mm;
    }
    if b * raised_mm >= start_mm {
        return 0.0;
    }
    // The wall: depth hollow_depth (start - v) / wall, v = b Z.
    let slope = hollow_depth_mm / wall_mm;
    slope * (start_mm - b * raised_mm) / (1.0 + slope * b)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Depth of the surface at (u, v), written down from the scenes' definitions.
    fn depth(scene: &Scene, u: f64, v: f64) -> f64 {
        match *scene {
            Scene::Plane { distance_mm, slope_x, slope_y } => distance_mm + slope_x * u + slope_y * v,
            Scene::CubeEdge { distance_mm, slope } => distance_mm + slope * u.abs(),
            Scene::Tile {
                distance_mm,
                side_mm,
                hollow_depth_mm,
                hollow_width_mm,
                pitch_mm,
                wall_mm,
                bow_mm,
                bands,
            } => {
                let from_middle = (u - (u / pitch_mm).round() * pitch_mm).abs();
                let share = (0.5 * (hollow_width_mm + wall_mm) - from_middle) / wall_mm;
                let free = bands.map_or(1.0, |bands| {
                    let band_mm = bands.rows as f64 * bands.square_mm;
                    (0.5 * side_mm - band_mm - v.abs()) / wall_mm
                });
                let bow = bow_mm * (u * u + v * v) / (0.25 * side_mm * side_mm);
                distance_mm + bow + hollow_depth_mm * share.min(free).clamp(0.0, 1.0)
            }
        }
    }

    /// The depth at which the ray meets the surface, by bisection on the definition: independent of the closed forms.
    fn bisected(scene: &Scene, (a, b): (f64, f64), offset: f64) -> f64 {
        let behind = |z: f64| z - depth(scene, a * z - offset, b * z);
        let (mut near, mut far) = (1.0, 5000.0);
        assert!(behind(near) < 0.0 && behind(far) > 0.0);
        for _ in 0..200 {
            let middle = 0.5 * (near + far);
            if behind(middle) < 0.0 { near = middle } else { far = middle }
        }
        0.5 * (near + far)
    }

    fn banded(hollow_depth_mm: f64, bow_mm: f64) -> Scene {
        Scene::Tile {
            distance_mm: 900.0,
            side_mm: 150.0,
            hollow_depth_mm,
            hollow_width_mm: 4.0,
            pitch_mm: 8.0,
            wall_mm: 0.4,
            bow_mm,
            bands: Some(Bands { square_mm: 7.5, columns: 19, rows: 3 }),
        }
    }

    #[test]
    fn closed_forms_agree_with_bisection_on_the_definition() {
        let scenes = [
            Scene::Plane { distance_mm: 700.0, slope_x: 0.4, slope_y: -0.3 },
            Scene::CubeEdge { distance_mm: 500.0, slope: 1.0 },
            Scene::Tile {
                distance_mm: 900.0,
                side_mm: 150.0,
                hollow_depth_mm: 0.2,
                hollow_width_mm: 4.0,
                pitch_mm: 8.0,
                wall_mm: 0.4,
                bow_mm: 0.0,
                bands: None,
            },
            banded(0.2, 0.3),
            banded(-0.15, -1.0),
        ];
        for scene in &scenes {
            for step in 0..4000 {
                let a = -0.16 + f64::from(step) * 0.00008;
                let b = 0.084 - f64::from(step % 41) * 0.0041;
                let offset = -75.0 + f64::from(step % 101) * 1.5;
                let Some(hit) = scene.hit((a, b), offset) else {
                    let z = bisected(scene, (a, b), offset);
                    let on_tile = (a * z - offset).abs() < 75.0 - 1e-6 && (b * z).abs() < 75.0 - 1e-6;
                    assert!(matches!(scene, Scene::Tile { .. }) && !on_tile, "{scene:?} a = {a}");
                    continue;
                };
                let expected = bisected(scene, (a, b), offset);
                assert!(
                    (hit.depth_mm - expected).abs() < 1e-9,
                    "{scene:?} a = {a}: {} {expected}",
                    hit.depth_mm
                );
            }
        }
    }

    #[test]
    fn scenes_that_hide_themselves_are_refused() {
        let edge_on = Scene::Plane { distance_mm: 700.0, slope_x: 8.0, slope_y: 0.0 };
        assert!(matches!(edge_on.check((0.2, 0.2)), Err(TwinError::HidesItself(_))));
        let cube = Scene::CubeEdge { distance_mm: 700.0, slope: 6.0 };
        assert!(matches!(cube.check((0.2, 0.2)), Err(TwinError::HidesItself(_))));
        assert_eq!(banded(0.2, 0.3).check((0.18, 0.18)), Ok(()));
        // The walls before the bands: 0.3 mm on 0.4 mm, seen at 1.5.
        assert_eq!(Scene::check(&banded(0.3, 0.0), (0.2, 0.9)), Ok(()));
        assert!(matches!(banded(0.3, 0.0).check((0.2, 1.5)), Err(TwinError::HidesItself(_))));
        assert!(matches!(banded(0.2, 30.0).check((0.2, 0.6)), Err(TwinError::HidesItself(_))));
        let flat = Scene::Plane { distance_mm: -1.0, slope_x: 0.0, slope_y: 0.0 };
        assert!(matches!(flat.check((0.2, 0.2)), Err(TwinError::BadNumber { .. })));
    }
}
