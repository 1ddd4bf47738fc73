//! Lens and baseline, and how well they are known: by the calibration, else by the records of the sequence.

use crate::calibrate::{Calibration, LensSource};
use crate::profile::Profile;
use epirig_data::sequence::{Origin, Sequence};
use epirig_surface::{Geometry, ScaleSigma};

/// Lens and baseline: from the calibration, or as far as the sequence's records hold them.
pub fn geometry(sequence: &Sequence, calibration: Option<&Calibration>) -> Option<Geometry> {
    if let Some(calibration) = calibration {
        let camera = calibration.mapping.camera;
        let positions = &calibration.positions;
        let baseline_mm = positions.baseline_mm?;
        let point = (camera.principal_point_x_px, camera.principal_point_y_px);
        let exact = Geometry::exact(camera.focal_length_px, baseline_mm, point);
        let known = calibration.lens.source != LensSource::Unknown;
        return known.then(|| exact.with_scale(calibrated_scale(calibration)));
    }
    let positions = sequence.positions_mm()?;
    let baseline_mm = positions.last()? - positions.first()?;
    let intrinsics = sequence.record().intrinsics?;
    let point = (intrinsics.principal_point_x_px, intrinsics.principal_point_y_px);
    Some(Geometry::exact(intrinsics.focal_length_px, baseline_mm, point).with_scale(stated_scale(sequence)))
}

/// As far as the calibration knows it.
pub(super) fn calibrated_scale(calibration: &Calibration) -> ScaleSigma {
    let relative = |sigma: f64, value: f64| (sigma > 0.0).then_some((sigma / value).abs());
    let (lens, positions) = (&calibration.lens.estimate, &calibration.positions);
    let baseline = positions.baseline_sigma_mm.zip(positions.baseline_mm);
    ScaleSigma {
        focal_length: relative(lens.sigma()[0], lens.lens.focal_length_x_px),
        baseline: baseline.and_then(|(sigma_mm, baseline_mm)| relative(sigma_mm, baseline_mm)),
    }
}

/// As the records state it. The rig's profile tells how well the focal length is known; no record tells how long the
/// stage's millimetre is.
fn stated_scale(sequence: &Sequence) -> ScaleSigma {
    if let Origin::Rectified { focal_length_sigma, baseline_sigma, .. } = sequence.record().origin {
        return ScaleSigma { focal_length: focal_length_sigma, baseline: baseline_sigma };
    }
    // The rig in records of another version may be unreadable; then nothing is known.
    let rig = Profile::of_sequence(sequence).ok().flatten();
    ScaleSigma { focal_length: rig.map(|rig| rig.optics.focal_length_sigma), baseline: None }
}
