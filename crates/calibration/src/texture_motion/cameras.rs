//! The cameras of all frames: one camera that moves along a straight line, and what each frame departs from it.

use nalgebra::{Matrix2, Matrix2x3, Matrix2x4, Rotation3, Vector2, Vector3};

/// Where the camera was in a frame, beside the straight line and the mean orientation.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct CameraPose {
    /// Position along the line, in units of the path's length.
    pub position: f64,
    /// Rotation vector from the mean orientation to that of the frame, in rad.
    pub rotation_rad: Vector3<f64>,
    /// Displacement across the line, in the same unit as `position`, along [`Cameras::across`].
    pub offset: [f64; 2],
}

/// A camera on a straight line: a point with the bearing x = (u, v, 1) and the inverse depth rho in the mean
/// orientation is seen in frame t along y = R(w_t) (x - rho (s_t m + d_t)).
///
/// m is the direction of motion, s_t the position, w_t the rotation and d_t the offset. The place in the picture is
/// c + f q (1 + k1 |q|^2) with q = (y1, y2) / y3 (Brown 1971, its first term).
#[derive(Debug, Clone, PartialEq)]
pub struct Cameras {
    /// Focal length, in px.
    pub focal_length_px: f64,
    /// Principal point: column and row, in px.
    pub centre_px: [f64; 2],
    /// First radial term of the distortion, without unit.
    pub k1: f64,
    /// Direction of the motion in the mean orientation, a unit vector: columns, rows, view.
    pub direction: Vector3<f64>,
    /// The pose of every frame.
    pub frames: Vec<CameraPose>,
}

/// A point of the scene.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Point {
    /// u and v of its bearing.
    pub(super) bearing: [f64; 2],
    /// Inverse depth, in 1 / length of the path.
    pub(super) rho: f64,
}

/// Derivatives of a place in px.
pub(super) struct Derivatives {
    /// By u, v and rho of the point.
    pub(super) point: Matrix2x3<f64>,
    /// By the turn of the direction along both vectors of [`Cameras::across`], by k1, and by the logarithm of the focal
    /// length, with f u, f v and f rho of the point and f w of the rotations sidewards held: then next to nothing changes.
    pub(super) common: Matrix2x4<f64>,
    /// By the position.
    pub(super) position: Vector2<f64>,
    /// By the rotation.
    pub(super) rotation: Matrix2x3<f64>,
    /// By both offsets.
    pub(super) offset: Matrix2<f64>,
}

impl Cameras {
    /// Two unit vectors across the direction of motion and each other.
    pub fn across(&self) -> [Vector3<f64>; 2] {
        let helper = if self.direction.y.abs() < 0.9 { Vector3::y() } else { Vector3::x() };
        let first = self.direction.cross(&helper).normalize();
        [first, self.direction.cross(&first)]
    }

    /// The same camera with so many times the focal length, with rotations that move the picture as far as before.
    pub(super) fn lengthen(&mut self, times: f64) {
        self.focal_length_px *= times;
        for pose in &mut self.frames {
            pose.rotation_rad.x /= times;
            pose.rotation_rad.y /= times;
        }
    }

    /// The same with frames that neither turn nor leave the line.
    pub(super) fn straight(&self) -> Self {
        let pose = |pose: &CameraPose| CameraPose { position: pose.position, ..CameraPose::default() };
        Self { k1: 0.0, frames: self.frames.iter().map(pose).collect(), ..self.clone() }
    }

    /// The camera in one frame.
    pub(super) fn view(&self, frame: usize) -> View<'_> {
        let across = self.across();
        let CameraPose { position, rotation_rad, offset } = self.frames[frame];
        let displacement = self.direction * position + across[0] * offset[0] + across[1] * offset[1];
        let rotation = Rotation3::new(rotation_rad);
        View { cameras: self, across, position, rotation_rad, rotation, displacement }
    }

    /// The cameras of all frames.
    pub(super) fn views(&self) -> Vec<View<'_>> {
        (0..self.frames.len()).map(|frame| self.view(frame)).collect()
    }

    fn pixel(&self, a: f64, b: f64) -> [f64; 2] {
        let stretched = self.focal_length_px * (1.0 + self.k1 * (a * a + b * b));
        [self.centre_px[0] + stretched * a, self.centre_px[1] + stretched * b]
    }

    /// The ray (a, b, 1) of a frame that is seen at this place.
    fn ray(&self, [x, y]: [f64; 2]) -> Vector3<f64> {
        const STEPS: usize = 10;
        let x = (x - self.centre_px[0]) / self.focal_length_px;
        let y = (y - self.centre_px[1]) / self.focal_length_px;
        let (mut a, mut b) = (x, y);
        for _ in 0..STEPS {
            let stretched = 1.0 + self.k1 * (a * a + b * b);
            (a, b) = (x / stretched, y / stretched);
        }
        Vector3::new(a, b, 1.0)
    }
}

/// The camera in one frame.
pub(super) struct View<'a> {
    cameras: &'a Cameras,
    across: [Vector3<f64>; 2],
    position: f64,
    rotation_rad: Vector3<f64>,
    rotation: Rotation3<f64>,
    /// In units of the path's length.
    displacement: Vector3<f64>,
}

impl View<'_> {
    /// Where a point is seen: column and row, in px; `None` behind the camera.
    pub(super) fn place(&self, point: &Point) -> Option<[f64; 2]> {
        let ray = self.rotation * (point.ray() - self.displacement * point.rho);
        (ray.z > 0.0).then(|| self.cameras.pixel(ray.x / ray.z, ray.y / ray.z))
    }

    /// The point at inverse depth `rho` that is seen at this place.
    pub(super) fn point_at(&self, place: [f64; 2], rho: f64) -> Point {
        let [ray, displacement] = self.line(place);
        let moved = displacement * rho;
        let seen = ray * (1.0 - moved.z) + moved;
        Point { bearing: [seen.x, seen.y], rho }
    }

    /// The ray of a place in the mean orientation, with a third part of 1, and the camera's displacement: a point there
    /// is their sum, ray times (1 - rho displacement.z) plus rho times displacement.
    pub(super) fn line(&self, place: [f64; 2]) -> [Vector3<f64>; 2] {
        let ray = self.rotation.inverse() * self.cameras.ray(place);
        [ray / ray.z, self.displacement]
    }

    /// Place of a point, in px, and its derivatives; `None` behind the camera.
    pub(super) fn derivatives(&self, point: &Point) -> Option<([f64; 2], Derivatives)> {
        let ray = self.rotation * (point.ray() - self.displacement * point.rho);
        if ray.z <= 0.0 {
            return None;
        }
        let (k1, focal_length_px) = (self.cameras.k1, self.cameras.focal_length_px);
        let (a, b) = (ray.x / ray.z, ray.y / ray.z);
        let square = a * a + b * b;
        let projected = Matrix2x3::new(1.0, 0.0, -a, 0.0, 1.0, -b) / ray.z;
        let distorted =
            Matrix2::identity() * (1.0 + k1 * square) + Matrix2::new(a * a, a * b, a * b, b * b) * (2.0 * k1);
        let by_ray = distorted * projected * focal_length_px;
        let by_scene = by_ray * self.rotation.matrix();
        let [across_1, across_2] = self.across.map(|across| by_scene * across * -point.rho);
        let by_k1 = Vector2::new(a, b) * (focal_length_px * square);
        let turned = |axis: Vector3<f64>| by_ray * axis.cross(&ray);
        let place = self.cameras.pixel(a, b);
        let by_point = Matrix2x3::from_columns(&[
            by_scene.column(0).into_owned(),
            by_scene.column(1).into_owned(),
            by_scene * -self.displacement,
        ]);
        let from_centre = Vector2::from(place) - Vector2::from(self.cameras.centre_px);
        let by_rotation = Matrix2x3::from_columns(&[Vector3::x(), Vector3::y(), Vector3::z()].map(turned));
        let by_focal_length = from_centre
            - by_point * Vector3::new(point.bearing[0], point.bearing[1], point.rho)
            - by_rotation * Vector3::new(self.rotation_rad.x, self.rotation_rad.y, 0.0);
        let derivatives = Derivatives {
            point: by_point,
            common: Matrix2x4::from_columns(&[
                across_1 * self.position,
                across_2 * self.position,
                by_k1,
                by_focal_length,
            ]),
            position: by_scene * self.cameras.direction * -point.rho,
            rotation: by_rotation,
            offset: Matrix2::from_columns(&[across_1, across_2]),
        };
        Some((place, derivatives))
    }
}

impl Point {
    /// The same in pixels, seen by a camera whose focal length is so many times as long.
    pub(super) fn seen_by_longer(&self, times: f64) -> Self {
        Self { bearing: self.bearing.map(|part| part / times), rho: self.rho / times }
    }

    fn ray(&self) -> Vector3<f64> {
        Vector3::new(self.bearing[0], self.bearing[1], 1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cameras() -> Cameras {
        let pose = |position: f64| CameraPose {
            position,
            rotation_rad: Vector3::new(2e-4, -3e-4, 1e-4) * position,
            offset: [0.004 * position, -0.002],
        };
        Cameras {
            focal_length_px: 1200.0,
            centre_px: [500.0, 300.0],
            k1: -0.05,
            direction: Vector3::new(0.9, 0.3, -0.1).normalize(),
            frames: [0.0, 0.4, 1.0].map(pose).to_vec(),
        }
    }

    #[test]
    fn a_point_is_seen_where_it_was_found() {
        let cameras = cameras();
        let point = cameras.view(1).point_at([120.0, 440.0], 0.2);
        let [x, y] = cameras.view(1).place(&point).unwrap();
        assert!((x - 120.0).abs() < 1e-9 && (y - 440.0).abs() < 1e-9, "{x} {y}");
    }

    #[test]
    fn derivatives_are_those_of_the_places() {
        const STEP: f64 = 1e-6;
        let cameras = cameras();
        let point = Point { bearing: [-0.2, 0.15], rho: 0.22 };
        let (_, found) = cameras.view(2).derivatives(&point).unwrap();
        let check = |name: &str, found: Vector2<f64>, change: &dyn Fn(f64, &mut Cameras, &mut Point)| {
            let at = |step: f64| {
                let (mut cameras, mut point) = (cameras.clone(), point);
                change(step, &mut cameras, &mut point);
                Vector2::from(cameras.view(2).place(&point).unwrap())
            };
            let expected = (at(STEP) - at(-STEP)) / (2.0 * STEP);
            assert!((found - expected).norm() < 1e-3 * (1.0 + expected.norm()), "{name}: {found} {expected}");
        };
        let column = |matrix: &Matrix2x3<f64>, index: usize| matrix.column(index).into_owned();
        check("u", column(&found.point, 0), &|step, _, point| point.bearing[0] += step);
        check("v", column(&found.point, 1), &|step, _, point| point.bearing[1] += step);
        check("rho", column(&found.point, 2), &|step, _, point| point.rho += step);
        check("offset 1", found.offset.column(0).into_owned(), &|step, cameras, _| {
            cameras.frames[2].offset[0] += step;
        });
        check("offset 2", found.offset.column(1).into_owned(), &|step, cameras, _| {
            cameras.frames[2].offset[1] += step;
        });
        // Offsets turn with the direction, so this frame has none.
        let mut straight = cameras.clone();
        straight.frames[2].offset = [0.0; 2];
        let (_, of_straight) = straight.view(2).derivatives(&point).unwrap();
        for (index, axis) in straight.across().into_iter().enumerate() {
            check("direction", of_straight.common.column(index).into_owned(), &|step, cameras, _| {
                cameras.frames[2].offset = [0.0; 2];
                cameras.direction = (cameras.direction + axis * step).normalize();
            });
        }
        check("k1", found.common.column(2).into_owned(), &|step, cameras, _| cameras.k1 += step);
        check("focal length", found.common.column(3).into_owned(), &|step, cameras, point| {
            cameras.lengthen(step.exp());
            *point = point.seen_by_longer(step.exp());
        });
        check("position", found.position, &|step, cameras, _| cameras.frames[2].position += step);
        for axis in 0..3 {
            check("rotation", column(&found.rotation, axis), &|step, cameras, _| {
                cameras.frames[2].rotation_rad[axis] += step;
            });
        }
    }
}
