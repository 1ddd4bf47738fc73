//! The numbers of `match.json`.

use crate::calibrate::{Calibration, InputHashes, PositionSource};
use crate::results::{LockingSummary, MatchSummary, Region, ResultsKind};
use epirig_core::grid::Grid;
use epirig_core::statistics::upper_median;
use epirig_data::sequence::Sequence;
use epirig_matcher::inspect::EpiLines;
use epirig_matcher::{DisparityMaps, MatchOptions, Validity};
use epirig_surface::Heights;

/// The program and its version, as records have it.
pub(super) const PROGRAM: &str = concat!("epirig ", env!("CARGO_PKG_VERSION"));

/// The numbers of `match.json`; `calibration` is what the frames were corrected with.
pub(super) fn summarise(
    sequence: &Sequence,
    calibration: Option<&Calibration>,
    lines: &EpiLines,
    maps: &DisparityMaps,
    (options, region): (&MatchOptions, &Region),
    heights: Option<&Heights>,
    seconds: f64,
) -> MatchSummary {
    let (tau_before, tau_after) = (lines.tau_before(), lines.tau_after());
    let (median_disparity_px, median_sigma_px) =
        rayon::join(|| median(&maps.disparity), || median(&maps.sigma));
    let (object, object_answered) = of_object(maps);
    MatchSummary {
        format: ResultsKind::Match.format(),
        program: PROGRAM.to_owned(),
        sequence_uid: sequence.record().uid.clone(),
        scan_ended: sequence.ended().to_owned(),
        frames_blake3: InputHashes::of(sequence).frames,
        calibration: calibration.map(Calibration::hash),
        positions: positions_name(sequence, calibration).to_owned(),
        region: region.rectangle,
        mask: region.mask.as_ref().map(|mask| mask.facts.clone()),
        settings: MatchOptions { search: options.search_used(), ..options.clone() },
        reference: maps.reference,
        tau_before,
        tau_after,
        minimum_px: maps.range.minimum_px,
        maximum_px: maps.range.maximum_px,
        range_found: maps.range_found,
        ordering_constraint: maps.ordering,
        order_violations: maps.order_violations(tau_before, tau_after),
        object,
        object_answered,
        answered: maps.share(Validity::Found),
        leaves_image: maps.share(Validity::LeavesImage),
        beyond_range: maps.share(Validity::BeyondRange),
        no_texture: maps.share(Validity::NoTexture),
        ambiguous: maps.share(Validity::Ambiguous),
        occluded: maps.share(Validity::Occluded),
        outside: maps.share(Validity::Outside),
        median_disparity_px,
        median_sigma_px,
        pixel_locking: maps.locking.map(LockingSummary::from),
        light: maps.light,
        distance_mm: heights.map(|heights| heights.distance_mm),
        seconds,
    }
}

/// The object's share of the pixels, and the answered share of the object.
fn of_object(maps: &DisparityMaps) -> (f64, f64) {
    let object = maps.object();
    let inside = || object.values().iter().zip(maps.validity.values()).filter(|&(&inside, _)| inside);
    let pixels = inside().count() as f64;
    let answered = inside().filter(|&(_, &validity)| validity == Validity::Found).count() as f64;
    (pixels / object.values().len().max(1) as f64, if pixels > 0.0 { answered / pixels } else { 0.0 })
}

fn median(map: &Grid<f32>) -> Option<f64> {
    let mut known: Vec<f32> = map.values().iter().copied().filter(|value| !value.is_nan()).collect();
    upper_median(&mut known).map(f64::from)
}

/// Where tau comes from.
fn positions_name(sequence: &Sequence, calibration: Option<&Calibration>) -> &'static str {
    let imported = sequence.frames().iter().any(|frame| frame.source.is_some());
    match calibration.map(|calibration| calibration.positions.source) {
        Some(PositionSource::Target) => "target",
        Some(PositionSource::Texture) => "texture",
        Some(PositionSource::Automatic | PositionSource::Stage) | None => match sequence.positions_mm() {
            None => "equal-steps",
            Some(_) if imported => "import",
            Some(_) => "stage",
        },
    }
}
