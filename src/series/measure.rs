//! What is followed from sequence to sequence: a quantity is a line of this table.

use std::path::Path;

use crate::calibrate::{CALIBRATION, Calibration, has_calibration, read_calibration_file};
use crate::results::{MatchSummary, ResultFiles, ResultsKind, SurfaceFacts, read_surface_facts};
use epirig_core::fault::Fault;
use epirig_core::statistics::upper_median;
use epirig_data::sequence::Sequence;

epirig_core::choices! {
    /// A quantity that is followed from sequence to sequence.
    pub enum Measure {
        /// Depth of the hollows, or height of the raised parts.
        Depth = "depth",
        /// Bow of the form: the flatness deviation of the rig, if the object is flat.
        Bow = "bow",
        /// How wide the walls look, from 10 % to 90 % of the depth.
        WallWidth = "wall-width",
        /// Standard uncertainty of a typical disparity, by the noise.
        Noise = "noise",
        /// Share of the object that has a disparity.
        Answered = "answered",
        /// Distance of the object from the camera.
        Distance = "distance",
        /// Mean intensity of the frames.
        Brightness = "brightness",
        /// Change of the light from frame to frame.
        Flicker = "flicker",
        /// Largest mean residual of the board's corners in a part of the image: what the lens leaves of the x-y mapping.
        Mapping = "mapping",
        /// Blur of the target's edges: the focus.
        Blur = "blur",
        /// Positioning error of the stage, by the target.
        StageError = "stage-error",
        /// Roll of the camera against the stage axis.
        Roll = "roll",
        /// Pan of the camera against the stage axis.
        Pan = "pan",
    }
}

/// A value with its standard uncertainty, where that is known.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Measured {
    pub(super) value: f64,
    pub(super) sigma: Option<f64>,
    /// The part of it that differs from scan to scan.
    pub(super) scatter: Option<f64>,
}

/// What is known of a sequence.
pub(super) struct Known {
    sequence: Sequence,
    calibration: Option<Calibration>,
    matched: Option<MatchSummary>,
    surface: Option<SurfaceFacts>,
}

type Read = fn(&Known) -> Option<Measured>;

impl Measure {
    /// Its unit; empty for a share.
    pub fn unit(self) -> &'static str {
        self.row().0
    }

    /// The value for a sequence; `None` if it was not measured.
    pub(super) fn of(self, known: &Known) -> Option<Measured> {
        self.row().1(known).filter(|measured| measured.value.is_finite())
    }

    fn row(self) -> (&'static str, Read) {
        match self {
            Self::Depth => ("mm", |known| {
                let surface = known.surface.as_ref()?;
                let (sigma, scatter) = (surface.depth_sigma_mm(), surface.depth_scatter_mm());
                Some(Measured { value: surface.depth_mm()?, sigma, scatter })
            }),
            Self::Bow => ("mm", |known| exact(Some(known.surface.as_ref()?.bow_mm))),
            Self::WallWidth => ("mm", |known| exact(known.surface.as_ref()?.wall_width_mm())),
            Self::Noise => ("px", |known| exact(known.matched.as_ref()?.median_sigma_px)),
            Self::Answered => ("", |known| exact(Some(known.matched.as_ref()?.object_answered))),
            Self::Distance => ("mm", |known| exact(known.matched.as_ref()?.distance_mm)),
            Self::Brightness => ("DN", |known| {
                let mut means: Vec<f64> = known.sequence.frames().iter().map(|frame| frame.mean_dn).collect();
                exact(upper_median(&mut means))
            }),
            Self::Flicker => ("", |known| {
                exact(known.calibration.as_ref()?.frame_gains.applied().map(|gains| gains.flicker))
            }),
            Self::Mapping => ("px", |known| {
                exact(known.calibration.as_ref()?.lens.board_frames.as_ref()?.mapping_deviation_px())
            }),
            Self::Blur => ("px", |known| exact(axis(known)?.blur_px)),
            Self::StageError => ("um", |known| {
                exact(Some(known.calibration.as_ref()?.positions.positioning_error.as_ref()?.rms_um))
            }),
            Self::Roll => ("deg", |known| {
                let axis = axis(known)?;
                Some(scattered(axis.roll_deg, axis.roll_sigma_deg))
            }),
            Self::Pan => ("deg", |known| {
                let axis = axis(known)?;
                Some(scattered(axis.pan_deg, axis.pan_sigma_deg))
            }),
        }
    }
}

/// What was read; the reason if nothing was.
fn kept<T, E: Fault>(read: Result<T, E>, problems: &mut Vec<String>) -> Option<T> {
    read.map_err(|error| problems.push(error.message())).ok()
}

/// Whether a record belongs to this sequence.
fn is_own(found: &str, uid: &str, name: &str, problems: &mut Vec<String>) -> bool {
    if found != uid {
        problems.push(format!("its {name} is of another sequence; make it anew with --overwrite"));
    }
    found == uid
}

fn exact(value: Option<f64>) -> Option<Measured> {
    value.map(|value| Measured { value, sigma: None, scatter: None })
}

/// A value whose uncertainty is that by noise.
fn scattered(value: f64, sigma: f64) -> Measured {
    Measured { value, sigma: Some(sigma), scatter: Some(sigma) }
}

fn axis(known: &Known) -> Option<&crate::calibrate::StageAxisRecord> {
    known.calibration.as_ref()?.stage_axis.as_ref()
}

impl Known {
    /// Of the sequence in `folder`, and the reason for each record that is there and is left out; `None` for no sequence.
    pub(super) fn of(folder: &Path) -> Option<(Self, Vec<String>)> {
        // Why a sequence or its surface cannot be read is told by its entry in the list.
        let sequence = Sequence::open(folder).ok()?;
        let uid = sequence.record().uid.clone();
        let results = folder.join("results");
        let mut problems = Vec::new();
        let calibration = match has_calibration(folder) {
            true => kept(read_calibration_file(&folder.join(CALIBRATION)), &mut problems),
            false => None,
        };
        let opened = match ResultFiles::open_match(&results) {
            Err(error) if error.is_missing() => None,
            opened => kept(opened, &mut problems),
        };
        let calibration =
            calibration.filter(|found| is_own(&found.sequence_uid, &uid, CALIBRATION, &mut problems));
        let summary = ResultsKind::Match.summary();
        let opened = opened.filter(|(_, found)| is_own(&found.sequence_uid, &uid, summary, &mut problems));
        let surface = read_surface_facts(&results.join("surface")).ok().filter(|facts| {
            opened.as_ref().is_some_and(|(files, _)| facts.matched_blake3 == files.record_hash())
        });
        let matched = opened.map(|(_, summary)| summary);
        Some((Self { sequence, calibration, matched, surface }, problems))
    }

    /// Lower and upper limit of a quantity by which the surface was judged, in the unit of the quantity.
    pub(super) fn limits(&self, measure: Measure) -> Option<(Option<f64>, Option<f64>)> {
        match measure {
            Measure::Depth => self.surface.as_ref()?.depth_limits_mm(),
            _ => None,
        }
    }
}
