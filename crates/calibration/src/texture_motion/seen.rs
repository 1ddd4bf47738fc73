//! A sight against the place where the cameras put its point: the residual and its derivatives.

use nalgebra::{Matrix2, Matrix2x3, Matrix2x4, SMatrix, Vector2};

use super::cameras::{Derivatives, Point, View};
use super::model::{COMMON, MotionModel};
use super::track::{Sight, Track};

/// Least standard deviation of a place, in px, however clear the texture: interpolation, and surfaces within a
/// square that are not flat.
const FLOOR_PX: f64 = 0.005;

/// A sight, its residual and the derivatives, along and across the motion, in units of their standard deviations by their
/// weights.
pub(super) struct Seen {
    pub(super) residual: Vector2<f64>,
    pub(super) point: Matrix2x3<f64>,
    pub(super) common: Matrix2x4<f64>,
    /// Position, rotation, offset: as many columns as are free.
    pub(super) frame: SMatrix<f64, 2, 6>,
}

impl Seen {
    pub(super) fn of(
        track: &Track,
        (sight, weight): (&Sight, Vector2<f64>),
        view: &View,
        point: &Point,
        free: MotionModel,
    ) -> Option<Self> {
        let ([x, y], found) = view.derivatives(point)?;
        let off = Vector2::new(sight.place[0] - x, sight.place[1] - y);
        let [along, across] = whitening(track, sight).map(|(axis, share)| (axis * share).transpose());
        let rows = [along * weight.x.sqrt(), across * weight.y.sqrt()];
        let rows = Matrix2::from_rows(&rows);
        let Self { point, common, frame, .. } = Self::unwhitened(found, free);
        Some(Self { residual: rows * off, point: rows * point, common: rows * common, frame: rows * frame })
    }

    /// The derivatives in px, without a residual.
    pub(super) fn unwhitened(found: Derivatives, free: MotionModel) -> Self {
        let Derivatives { point, common, position, rotation, offset } = found;
        let mut frame = SMatrix::<f64, 2, 6>::zeros();
        frame.set_column(0, &position);
        if free.rotations {
            frame.fixed_view_mut::<2, 3>(0, 1).copy_from(&rotation);
        }
        if free.offsets {
            let first = if free.rotations { 4 } else { 1 };
            frame.fixed_view_mut::<2, 2>(0, first).copy_from(&offset);
        }
        Self { residual: Vector2::zeros(), point, common, frame }
    }

    /// The camera unknowns of this sight: index, and derivatives of both coordinates.
    pub(super) fn unknowns(
        &self,
        frame: usize,
        free: MotionModel,
    ) -> impl Iterator<Item = (usize, Vector2<f64>)> + '_ {
        let common = (0..COMMON).map(|index| (index, self.common.column(index).into_owned()));
        let first = free.position(frame);
        let own =
            (0..free.of_frame()).map(move |index| (first + index, self.frame.column(index).into_owned()));
        common.chain(own)
    }
}

/// Axes along and across the motion, and 1 / standard deviation of a sight on them.
pub(super) fn whitening(track: &Track, sight: &Sight) -> [(Vector2<f64>, f64); 2] {
    let [x, y] = track.direction;
    let share = |variance: f64| (variance + FLOOR_PX * FLOOR_PX).sqrt().recip();
    [(Vector2::new(x, y), share(sight.along_variance)), (Vector2::new(-y, x), share(sight.across_variance))]
}
