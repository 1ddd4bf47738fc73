//! Impossible values in a calibration: for any rig, for the rest of the record, or for its sequence.

use std::f64::consts::FRAC_PI_2;
use std::ops::RangeInclusive;

use super::record::Calibration;
use super::told_twice;
use epirig_data::sequence::{Intrinsics, Sequence};

impl Calibration {
    /// The first value that is impossible for `sequence`; `None` if there is none.
    pub fn contradiction_with(&self, sequence: &Sequence) -> Option<String> {
        let record = sequence.record();
        let found = self.contradiction(sequence.frames().len(), record.rows, record.columns);
        found.or_else(|| told_twice::by_sequence(self, sequence))
    }

    /// The first value that is impossible for a sequence of `frames` frames of `rows` x `columns`, or that
    /// contradicts the rest of the record; `None` if there is none.
    pub fn contradiction(&self, frames: usize, rows: usize, columns: usize) -> Option<String> {
        let Self { mapping, photometry, positions, .. } = self;
        let gains = self.frame_gains.applied().map_or(frames, |gains| gains.gain.len());
        let or_all = |count: usize| if count == 0 { frames } else { count };
        let poses = self.camera_motion.as_ref().map_or(0, |motion| motion.poses.len());
        for (what, found) in [
            ("positions", positions.tau.len()),
            ("their sigmas", positions.tau_sigma.len()),
            ("frames in order", or_all(positions.order.len())),
            ("poses", or_all(poses)),
            ("gains", gains),
        ] {
            if found != frames {
                return Some(format!("it has {found} {what} for {frames} frames"));
            }
        }
        let mut order = positions.order.clone();
        order.sort_unstable();
        if order.iter().enumerate().any(|(place, &frame)| place != frame) {
            return Some("its order does not name every frame once".to_owned());
        }
        for (what, size) in [
            ("mapping", (mapping.raw_rows, mapping.raw_columns)),
            ("photometry", (photometry.rows, photometry.columns)),
        ] {
            if size != (rows, columns) {
                return Some(format!(
                    "its {what} is of frames of {} x {}, these are {columns} x {rows}",
                    size.1, size.0
                ));
            }
        }
        if let Some(reason) = self.impossible(rows, columns) {
            return Some(reason);
        }
        if let Some(reason) = told_twice::by_itself(self) {
            return Some(reason);
        }
        // Rectified frames show a part of the raw ones, with pixels of about the same size.
        let camera = mapping.camera;
        let fits = |size: usize, raw: usize| (1..=2 * raw).contains(&size);
        let longer = rows.max(columns);
        (!fits(camera.rows, longer) || !fits(camera.columns, longer))
            .then(|| format!("its rectified frames are {} x {}", camera.columns, camera.rows))
    }

    /// The first impossible value of lens, scale and gains, if there is one.
    fn impossible(&self, rows: usize, columns: usize) -> Option<String> {
        /// Range of lengths, in mm, as for positions.
        const LENGTHS: RangeInclusive<f64> = 1e-9..=1e9;
        /// Range of the brightness of a frame relative to a typical one.
        const GAINS: RangeInclusive<f64> = 1e-3..=1e3;
        let Self { mapping, positions, .. } = self;
        let (camera, lens) = (mapping.camera, mapping.lens);
        let of = |focal_length_px, (principal_point_x_px, principal_point_y_px)| Intrinsics {
            focal_length_px,
            principal_point_x_px,
            principal_point_y_px,
        };
        let principal_point = (lens.principal_point_x_px, lens.principal_point_y_px);
        let of_lens = [
            of(camera.focal_length_px, (camera.principal_point_x_px, camera.principal_point_y_px)),
            of(lens.focal_length_x_px, principal_point),
            of(lens.focal_length_y_px, principal_point),
        ];
        let of_lens = of_lens.iter().find_map(|intrinsics| intrinsics.impossible(rows, columns));
        let turned = mapping.roll_rad.abs().max(mapping.pan_rad.abs());
        let gains = self.frame_gains.applied().map_or(&[][..], |gains| &gains.gain);
        match () {
            () if of_lens.is_some() => of_lens,
            () if turned > FRAC_PI_2 => Some(format!("a camera rotation of {turned} rad is impossible")),
            () if positions.baseline_mm.is_some_and(|baseline_mm| !LENGTHS.contains(&baseline_mm)) => {
                Some("its baseline is impossible".to_owned())
            }
            () if positions.baseline_sigma_mm.is_some_and(|sigma_mm| !(0.0..=1e9).contains(&sigma_mm)) => {
                Some("the sigma of its baseline is impossible".to_owned())
            }
            () if gains.iter().any(|gain| !GAINS.contains(gain)) => {
                Some("a frame's gain is impossible".to_owned())
            }
            () => None,
        }
    }
}
