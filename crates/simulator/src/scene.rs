//! What the simulator's camera looks at: surfaces whose intersections with a ray have a closed form.
//!
//! Scene coordinates: u along x, v along y, both from the scene's origin; depth Z along the optical axis.
//! With the scene displaced by s, a ray (a, b) = (X / Z, Y / Z) meets the surface at u = a Z - s, v = b Z.
//! Translation along x changes no point's depth, so a point's disparity is f (s_last - s_first) / Z.

use serde::{Deserialize, Serialize};

use super::bands::Bands;
use super::error::{SimulatorError, require, require_positive};

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
    /// The reverse side of a square tile (paper, section 5.2): stripes along v, hollow and raised in turn, on
    /// a dark, featureless ground.
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

/// The point at which a ray meets the surface.
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

    /// Whether every ray with |X / Z|, |Y / Z| up to `steepest` meets the surface once, in front of the
    /// camera.
    pub(super) fn check(&self, steepest: (f64, f64)) -> Result<(), SimulatorError> {
        let shows_all = |occludes: bool, how: &'static str| match occludes {
            true => Err(SimulatorError::OccludesItself(how)),
            false => Ok(()),
        };
        require_positive("distance in mm", self.distance_mm())?;
        match *self {
            Self::Plane { slope_x, slope_y, .. } => {
                let tilt = slope_x.abs() * steepest.0 + slope_y.abs() * steepest.1;
                let is_steep = tilt.is_nan() || tilt >= 1.0;
                shows_all(is_steep, "the plane is seen edge-on at the border of the image")
            }
            Self::CubeEdge { slope, .. } => {
                let is_flat = slope >= 0.0 && slope * steepest.0 < 1.0;
                shows_all(!is_flat, "a face of the cube is seen edge-on")
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
                require(side_mm > 0.0, "side in mm", side_mm, "positive")?;
                let fits =
                    wall_mm > 0.0 && hollow_width_mm >= wall_mm && pitch_mm >= hollow_width_mm + wall_mm;
                let expected = "at least a hollow and a wall, a hollow at least a wall";
                require(fits, "pitch in mm", pitch_mm, expected)?;
                let is_steep = hollow_depth_mm.is_nan() || hollow_depth_mm.abs() * steepest.0 >= wall_mm;
                shows_all(is_steep, "the hollows' walls are steeper than the view")?;
                let wall = hollow_depth_mm.abs() / wall_mm;
                let steepest_wall = match bands {
                    Some(bands) => {
                        bands.check(side_mm, wall_mm)?;
                        steepest.0.max(steepest.1)
                    }
                    None => steepest.0,
                };
                let is_steep = wall * steepest_wall >= 1.0;
                shows_all(is_steep, "the walls before the bands are steeper than the view")?;
                // Along a ray the bow's depth changes by this much per mm of depth, and a wall of the tile
                // multiplies that.
                let bowed = 4.0 * bow_mm.abs() / side_mm * (steepest.0 + steepest.1);
                let is_deep = bowed.is_nan() || bowed >= 0.5 * (1.0 - wall * steepest_wall);
                shows_all(is_deep, "the bow of the tile is too deep for so wide a view")
            }
        }
    }

    /// Where the ray (a, b) meets the surface when the scene is displaced by `offset_mm`; `None` where it
    /// meets only the featureless ground.
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
            Self::Tile { side_mm, .. } => {
                let depth_mm = self.tile_depth((a, b), offset_mm);
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

    /// Depth at which the ray meets the tile; NaN if it passes the bowl of a bowed one. Beyond the tile's
    /// edges, where nothing is, the bow goes on.
    ///
    /// The depth of a hollow is that of its stripe or of the wall before the band, whichever is less deep,
    /// and the ray meets the two where it meets the surface of each.
    fn tile_depth(&self, (a, b): (f64, f64), offset_mm: f64) -> f64 {
        let Self::Tile { distance_mm, side_mm, hollow_depth_mm, wall_mm, bow_mm, bands, .. } = *self else {
            return self.distance_mm();
        };
        let b = b.abs();
        let curvature = bow_mm / (0.25 * side_mm * side_mm);
        let met = Met { a, b, offset_mm, distance_mm, curvature, steep: curvature * (a * a + b * b) };
        let bottom_mm = met.level(hollow_depth_mm);
        let Some(bands) = bands else { return self.stripe_depth(&met, bottom_mm) };
        let start_mm = bands.start_mm(side_mm);
        if b * bottom_mm <= start_mm - wall_mm {
            return self.stripe_depth(&met, bottom_mm);
        }
        let raised_mm = met.level(0.0);
        if b * raised_mm >= start_mm {
            return raised_mm;
        }
        // The wall: depth hollow_depth (start - |v|) / wall.
        let slope = hollow_depth_mm / wall_mm;
        let end_mm = met.depth(slope * start_mm, 0.0, -slope);
        let stripe_mm = self.stripe_depth(&met, bottom_mm);
        if hollow_depth_mm > 0.0 { stripe_mm.min(end_mm) } else { stripe_mm.max(end_mm) }
    }

    /// Depth at which the ray meets the tile's stripes as if they were endless; it meets the bottom of
    /// hollows at `bottom_mm`.
    ///
    /// The one stretch that contains its own solution is the one that is hit.
    fn stripe_depth(&self, met: &Met, bottom_mm: f64) -> f64 {
        let Self::Tile { hollow_depth_mm, hollow_width_mm, pitch_mm, wall_mm, .. } = *self else {
            return self.distance_mm();
        };
        let inner = 0.5 * (hollow_width_mm - wall_mm);
        let outer = 0.5 * (hollow_width_mm + wall_mm);
        let middle = |u: f64| (u / pitch_mm + 0.5).floor() * pitch_mm;
        let bottom_u = met.across(bottom_mm);
        if (bottom_u - middle(bottom_u)).abs() <= inner {
            return bottom_mm;
        }
        // The nearest hollow is that of the raised level's u; levels differ by less than a wall.
        let raised_mm = met.level(0.0);
        let raised_u = met.across(raised_mm);
        let middle = middle(raised_u);
        let (bottom, raised) = (bottom_u - middle, raised_u - middle);
        if raised.abs() >= outer {
            return raised_mm;
        }
        // A wall: depth hollow_depth (outer - |w|) / wall, w = u - middle.
        let side = if raised + bottom < 0.0 { -1.0 } else { 1.0 };
        let slope = -side * hollow_depth_mm / wall_mm;
        met.depth(hollow_depth_mm * outer / wall_mm - slope * middle, slope, 0.0)
    }
}

/// A ray on its way to a bowed tile.
struct Met {
    a: f64,
    /// |Y / Z|: the tile is alike above and below.
    b: f64,
    offset_mm: f64,
    distance_mm: f64,
    /// The bow's depth per square of the distance from the tile's middle, in 1/mm.
    curvature: f64,
    /// curvature (a^2 + b^2), in 1/mm.
    steep: f64,
}

impl Met {
    /// Depth at which the ray meets the level `deeper_mm` below the raised one, in mm.
    fn level(&self, deeper_mm: f64) -> f64 {
        if self.curvature == 0.0 { self.distance_mm + deeper_mm } else { self.depth(deeper_mm, 0.0, 0.0) }
    }

    /// Where the ray meets the surface of depth distance + c + m u + n |v| + curvature (u^2 + v^2), in mm:
    /// with u = a Z - s and |v| = |b| Z the nearer root of steep Z^2 - (1 - m a - n |b| + 2 curvature a s)
    /// Z + distance + c - m s + curvature s^2 = 0, in the form that holds without bow as well.
    fn depth(&self, c: f64, m: f64, n: f64) -> f64 {
        let (a, s) = (self.a, self.offset_mm);
        let linear = 1.0 - m * a - n * self.b + 2.0 * self.curvature * a * s;
        let constant = self.distance_mm + c - m * s + self.curvature * s * s;
        2.0 * constant / (linear + (linear * linear - 4.0 * self.steep * constant).sqrt())
    }

    /// u at a depth, in mm.
    fn across(&self, depth_mm: f64) -> f64 {
        self.a * depth_mm - self.offset_mm
    }
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

    /// The depth at which the ray meets the surface, by bisection on the definition: independent of the
    /// closed forms.
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
    fn scenes_that_occlude_themselves_are_refused() {
        let edge_on = Scene::Plane { distance_mm: 700.0, slope_x: 8.0, slope_y: 0.0 };
        assert!(matches!(edge_on.check((0.2, 0.2)), Err(SimulatorError::OccludesItself(_))));
        let cube = Scene::CubeEdge { distance_mm: 700.0, slope: 6.0 };
        assert!(matches!(cube.check((0.2, 0.2)), Err(SimulatorError::OccludesItself(_))));
        assert_eq!(banded(0.2, 0.3).check((0.18, 0.18)), Ok(()));
        // The walls before the bands: 0.3 mm on 0.4 mm, seen at 1.5.
        assert_eq!(Scene::check(&banded(0.3, 0.0), (0.2, 0.9)), Ok(()));
        assert!(matches!(banded(0.3, 0.0).check((0.2, 1.5)), Err(SimulatorError::OccludesItself(_))));
        assert!(matches!(banded(0.2, 30.0).check((0.2, 0.6)), Err(SimulatorError::OccludesItself(_))));
        let flat = Scene::Plane { distance_mm: -1.0, slope_x: 0.0, slope_y: 0.0 };
        assert!(matches!(flat.check((0.2, 0.2)), Err(SimulatorError::BadNumber { .. })));
    }
}
