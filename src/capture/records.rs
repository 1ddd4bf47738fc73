//! Records of a camera and its frames in a sequence.

use epirig_data::sequence::{CameraRecord, ExposureRecord};
use epirig_devices::camera::{Configuration, FrameFacts, TimingRule};

/// The settings of a camera.
pub(super) fn camera_record(configuration: &Configuration, averaged: usize) -> CameraRecord {
    CameraRecord {
        format: configuration.format.four_cc.to_string(),
        columns: configuration.format.size.columns,
        rows: configuration.format.size.rows,
        rate_hz: configuration.interval.map(|interval| interval.rate_hz()).filter(|rate| rate.is_finite()),
        exposure_us: configuration.exposure_us,
        controls: configuration.pinned.iter().map(|pinned| (pinned.name.clone(), pinned.value)).collect(),
        averaged,
    }
}

/// The exposure of a frame. For averages: times of the last frame and sums of the counts. `None` without
/// exposures.
pub(super) fn exposure_record(exposures: &[FrameFacts]) -> Option<ExposureRecord> {
    let last = exposures.last()?;
    let timing = match last.timing {
        TimingRule::StartOfExposure => "start-of-exposure",
        TimingRule::EndOfFrame => "end-of-frame",
        TimingRule::Counted => "counted",
    };
    Some(ExposureRecord {
        requested_ns: last.requested.as_ns(),
        exposure_start_ns: last.exposure_start.as_ns(),
        timing: timing.to_owned(),
        stamp_ns: last.stamp.as_ns(),
        received_ns: last.received.as_ns(),
        flags: exposures.iter().fold(0, |flags, exposure| flags | exposure.flags),
        stale: exposures.iter().map(|exposure| exposure.stale).sum(),
        damaged: exposures.iter().map(|exposure| exposure.damaged).sum(),
        missed: exposures.iter().map(|exposure| exposure.missed).sum(),
        unsteady: exposures.iter().map(|exposure| exposure.unsteady).sum(),
        restarts: exposures.iter().map(|exposure| exposure.restarts).sum(),
        difference_dn: last.difference_dn,
    })
}
