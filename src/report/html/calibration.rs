//! The calibration: photometry before and after, lens, stage axis, rows, positions.

use super::contents::{CalibrationPart, Report};
use super::markup::{cells, pair, pairs, table};
use super::picture::Picture;
use crate::calibrate::{Calibration, CameraMotionRecord, PositionSource, PositionsRecord, StageAxisRecord};
use crate::number::{fixed, percent, sigma, significant, with_sigma};
use epirig_calibration::lens::views::LensCalibration;
use epirig_calibration::photometry::{DarkModel, DarkRecord, FlatField, FlatModel, FrameGains, Outcome};
use maud::{Markup, html};

pub(super) fn calibration(report: &Report<'_>) -> Markup {
    let Some(part) = &report.calibration else {
        return html! {
            p {
                "The frames were matched as captured, without a calibration. So vignetting, distortion, the \
                 direction of the stage axis and the true positions were neither measured nor corrected."
            }
        };
    };
    let found = part.record;
    html! {
        (photometry(found))
        (lens(found))
        @if let Some(axis) = &found.stage_axis { (stage_axis(axis)) }
        @if let Some(motion) = &found.camera_motion { (camera_motion(motion)) }
        (positions(&found.positions))
        (remarks("Notes of the calibration:", &found.notes))
        (remarks("What would improve it:", &found.needs))
        h3 { "Pictures of the calibration" }
        (pictures(part))
    }
}

fn remarks(title: &str, sentences: &[String]) -> Markup {
    html! {
        @if !sentences.is_empty() {
            p { (title) }
            ul { @for sentence in sentences { li { (sentence) } } }
        }
    }
}

fn photometry(found: &Calibration) -> Markup {
    let photometry = &found.photometry;
    let defective =
        |pixels: &Vec<_>| (format!("{} pixels", pixels.len()), "replaced by neighbours".to_owned());
    let rows = html! {
        (outcome("dark level", &photometry.dark, dark))
        (outcome("flat field", &photometry.flat_field, flat_field))
        (outcome("defective pixels", &photometry.defective_pixels, defective))
        (outcome("brightness of the frames", &found.frame_gains, gains))
    };
    html! {
        (table("Photometry before and after the correction", &["part", "before", "after"], rows))
        @if let Some(linearity) = &found.linearity {
            p {
                "Linearity of the sensor: largest departure "
                (significant(linearity.largest_departure_percent, 2)) " % of full scale, limit "
                (significant(linearity.limit_percent, 2)) " %."
            }
        }
    }
}

/// A row: what was there before, and what is left after; or why nothing was corrected.
fn outcome<T>(name: &str, outcome: &Outcome<T>, both: impl Fn(&T) -> (String, String)) -> Markup {
    let (before, after) = match outcome {
        Outcome::Applied(found) => both(found),
        Outcome::SwitchedOff => ("not measured".to_owned(), "not corrected: switched off".to_owned()),
        Outcome::NotApplied(reason) => ("not measured".to_owned(), format!("not corrected: {reason}")),
    };
    cells(name, [&before, &after])
}

fn dark(dark: &DarkRecord) -> (String, String) {
    let dn = |value: Option<f64>| value.map_or("not known".to_owned(), |value| sigma(value, "DN"));
    let before = format!("{} DN, fixed pattern {}", fixed(dark.level_dn, 2), dn(dark.pattern_dn));
    let how = match dark.model {
        DarkModel::LevelDn(_) => "one level subtracted",
        DarkModel::Map => "a map subtracted",
        DarkModel::CutOff(_) => "nothing subtracted: the level is cut off",
    };
    (before, format!("{how}; read noise {}; {} dark frames", dn(dark.noise_dn), dark.frames))
}

fn flat_field(field: &FlatField) -> (String, String) {
    let after = match &field.model {
        FlatModel::Polynomial(polynomial) => format!(
            "divided by a polynomial of order {}; residuals in cells of the flat frames {} % rms",
            polynomial.order(),
            significant(field.residual_rms_percent, 2)
        ),
        // Residuals against the mean of the same frames say nothing.
        FlatModel::PerPixel => "divided by a gain for every pixel".to_owned(),
    };
    let noise = field.sigma_percent.map_or(String::new(), |percent| {
        format!("; standard uncertainty by noise {} %", significant(percent, 2))
    });
    (
        format!("vignetting {} %", fixed(field.vignetting_percent, 1)),
        format!("{after}{noise}; {} flat frames", field.frames),
    )
}

fn gains(gains: &FrameGains) -> (String, String) {
    let squares: f64 = gains.sigma.iter().map(|sigma| sigma * sigma).sum();
    let sigma = (squares / gains.sigma.len().max(1) as f64).sqrt();
    let after = match gains.significant {
        true => {
            format!("each frame divided by its gain, with a standard uncertainty of {} rms", percent(sigma))
        }
        false => format!("nothing divided: no larger than its uncertainty of {} rms", percent(sigma)),
    };
    (format!("flicker {} rms", percent(gains.flicker)), after)
}

fn lens(found: &Calibration) -> Markup {
    let estimate = &found.lens.estimate;
    let sigmas = estimate.sigma();
    let value = |value: f64, sigma: f64| with_sigma(value, (sigma > 0.0).then_some(sigma), "px");
    let camera = &found.mapping.camera;
    let rows = html! {
        (pair("focal length along x", value(estimate.lens.focal_length_x_px, sigmas[0])))
        (pair("focal length after rectification", format!("{} px", fixed(camera.focal_length_px, 2))))
        (pair("size after rectification", format!("{} x {} px", camera.columns, camera.rows)))
        @if let Some(views) = &found.lens.board_frames { (board_frames(views)) }
    };
    pairs("Lens", rows)
}

fn board_frames(found: &LensCalibration) -> Markup {
    let points: usize = found.views.iter().map(|view| view.points).sum();
    html! {
        (pair("board frames", html! {
            (found.views.len()) " views, " (points) " points, " (found.rejected.len())
            " rejected; residuals " (sigma(found.rms_px, "px")) " rms"
        }))
        (pair("coverage of the frame", html! {
            (percent(found.coverage.cells)) " of the cells, "
            (percent(found.coverage.radius)) " of the radius"
        }))
        @if !found.warnings.is_empty() {
            (pair("warnings", html! { ul { @for warning in &found.warnings { li { (warning) } } } }))
        }
    }
}

fn stage_axis(axis: &StageAxisRecord) -> Markup {
    let rows = html! {
        (pair("roll", with_sigma(axis.roll_deg, Some(axis.roll_sigma_deg), "deg")))
        (pair("pan", with_sigma(axis.pan_deg, Some(axis.pan_sigma_deg), "deg")))
        (pair("distance of corners from their rows", format!("{} rms", sigma(axis.rows_rms_px, "px"))))
        (pair("standard uncertainty of a corner", sigma(axis.corner_sigma_px, "px")))
        (pair("observations", html! {
            (axis.observations) " of " (axis.corners) " corners in " (axis.frames) " frames; "
            (axis.rejected.len()) " rejected"
        }))
    };
    pairs("Stage axis and rectification", rows)
}

fn camera_motion(motion: &CameraMotionRecord) -> Markup {
    let turned = match motion.poses.is_empty() {
        true if motion.is_tested => "no more than can be measured".to_owned(),
        true => "not known: too few points".to_owned(),
        false => {
            let rms = motion.rotation_rms_deg().map(|rms| fixed(rms, 3)).join(", ");
            format!("{rms} deg rms (pitch, yaw, roll), corrected")
        }
    };
    let corrected = if motion.is_applied { "corrected" } else { "not significant, left" };
    let rows = html! {
        (pair("roll", with_sigma(motion.roll_deg, Some(motion.roll_sigma_deg), "deg")))
        (pair("pan", with_sigma(motion.pan_deg, Some(motion.pan_sigma_deg), "deg")))
        (pair("rotations of single frames", turned))
        (pair("drift of rows over the path", format!("{} px, {corrected}", fixed(motion.drift_px, 2))))
        (pair("standard uncertainty of rows", sigma(motion.rows_sigma_px, "px")))
        (pair("standard uncertainty of all disparities together", sigma(motion.disparity_sigma_px, "px")))
        (pair("that bends a plane", sigma(motion.bend_sigma_px, "px")))
        (pair("points", html! {
            (motion.points) " followed, " (percent(motion.rejected)) " of their places rejected; residuals "
            (sigma(motion.residual_px, "px")) " rms"
        }))
    };
    pairs("Camera motion by the texture", rows)
}

fn positions(positions: &PositionsRecord) -> Markup {
    let source = match positions.source {
        PositionSource::Target => "measured by the target",
        PositionSource::Texture => "measured by the texture of the object",
        PositionSource::Stage | PositionSource::Automatic => "as the stage reported",
    };
    let rows = html! {
        (pair("positions of the frames", source))
        @if let Some(error) = &positions.positioning_error {
            @let outliers = error.outliers.iter();
            @let outliers =
                outliers.map(|&frame| format!("{frame} ({} um)", fixed(error.error_um(frame), 1)));
            @let outliers = outliers.collect::<Vec<_>>().join(", ");
            (pair("measured minus reported", format!("{} um rms", fixed(error.rms_um, 2))))
            (pair("largest", format!("{} um", fixed(error.largest_um, 1))))
            (pair("frames with outliers", if outliers.is_empty() { "none" } else { &outliers }))
        }
        @if let Some(scale) = &positions.target_scale {
            @let difference = format!("{} %", significant(100.0 * scale.contradiction(), 2));
            (pair("baseline by the target's squares minus by the stage", difference))
        }
    };
    pairs("Positions", rows)
}

/// The picture that says nothing if every pixel has a gain of its own.
const RESIDUALS: &str = "flat-field-residuals";

/// What the pictures of a calibration show, by their names.
const PICTURES: [(&str, &str); 7] = [
    ("flat-field", "Map of the flat field: brightness over its mean, in %"),
    (RESIDUALS, "Residuals of the flat field in cells of the frame, in %"),
    ("frame-gains", "Chart of the brightness of every frame before the correction, in %"),
    ("lens-residuals", "Residuals of the lens: observed minus predicted corners, magnified"),
    ("lens-coverage", "Number of the board's corners in each cell of the frame"),
    ("rows", "Chart of the distance of every corner from its row after rectification, in px"),
    ("positioning-error", "Chart of the stage's error in every frame: measured minus reported, in um"),
];

fn pictures(part: &CalibrationPart<'_>) -> Markup {
    let flat_field = part.record.photometry.flat_field.applied();
    let per_pixel = flat_field.is_some_and(|field| field.model == FlatModel::PerPixel);
    let shown: Vec<Markup> = PICTURES
        .iter()
        .filter(|(name, _)| !(per_pixel && *name == RESIDUALS))
        .filter_map(|(name, words)| {
            let (_, png) = part.pictures.iter().find(|(there, _)| there == name)?;
            Some(Picture::drawn(png)?.figure(words, format!("{words}.")))
        })
        .collect();
    html! {
        @if shown.is_empty() { p { "The folder of the calibration holds no pictures." } }
        @for picture in shown { (picture) }
    }
}
