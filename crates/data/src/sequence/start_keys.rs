//! Which key of a start record is wrong, where serde tells only that one of an [`Origin`](super::Origin) is.

use std::collections::BTreeMap;

use serde::Deserialize;

use super::{CameraRecord, LimitsRecord};

/// The keys of a start record that depend on the kind of its origin: of all kinds, and none of them needed.
#[derive(Debug, Deserialize)]
pub(super) struct StartKeys {
    #[serde(rename = "origin")]
    _origin: OriginKeys,
}

#[derive(Debug, Deserialize)]
struct OriginKeys {
    #[serde(rename = "kind")]
    _kind: Option<String>,
    #[serde(rename = "stage")]
    _stage: Option<String>,
    #[serde(rename = "stage_settings")]
    _stage_settings: Option<BTreeMap<String, f64>>,
    #[serde(rename = "camera")]
    _camera: Option<String>,
    #[serde(rename = "configuration")]
    _configuration: Option<CameraRecord>,
    #[serde(rename = "limits")]
    _limits: Option<LimitsRecord>,
    #[serde(rename = "folder")]
    _folder: Option<String>,
    #[serde(rename = "conversions")]
    _conversions: Option<Vec<String>>,
    #[serde(rename = "calibration_folders")]
    _calibration_folders: Option<BTreeMap<String, String>>,
    #[serde(rename = "sequence_uid")]
    _sequence_uid: Option<String>,
    #[serde(rename = "calibration")]
    _calibration: Option<String>,
    #[serde(rename = "dn_per_sample")]
    _dn_per_sample: Option<f64>,
    #[serde(rename = "original_bit_depth")]
    _original_bit_depth: Option<u8>,
}
