//! What a report is made from.

use crate::calibrate::Calibration;
use crate::report::Chart;
use crate::results::{MatchSummary, SurfaceSummary};
use epirig_core::frame::Frame;
use epirig_core::grid::Grid;
use epirig_data::sequence::{Event, FrameRecord, SequenceRecord, StopRecord};

/// All that a report tells.
#[derive(Debug, Clone, PartialEq)]
pub struct Report<'a> {
    /// Name of the sequence's folder.
    pub name: String,
    /// When the report is made, as in RFC 3339.
    pub made: String,
    /// What a person states beside the results: name and text.
    pub stated: Vec<(String, &'a str)>,
    /// Picture at the top, as PNG or JPEG; or why there is none, in words.
    pub logo: Option<Result<Vec<u8>, String>>,
    /// The scan.
    pub scan: Scan<'a>,
    /// The matcher's numbers and settings.
    pub matched: &'a MatchSummary,
    /// BLAKE3 of the maps that the heights come from, each with its file.
    pub map_hashes: Vec<(&'static str, String)>,
    /// The calibration that the frames were corrected with.
    pub calibration: Option<CalibrationPart<'a>>,
    /// The numbers of the surface.
    pub surface: &'a SurfaceSummary,
    /// Heights along a line.
    pub profile: &'a Chart,
    /// The maps.
    pub maps: Maps<'a>,
}

/// The records of a scan.
#[derive(Debug, Clone, PartialEq)]
pub struct Scan<'a> {
    /// The start record.
    pub record: &'a SequenceRecord,
    /// The frames.
    pub frames: &'a [FrameRecord],
    /// The journal.
    pub events: &'a [Event],
    /// The final record.
    pub stop: Option<&'a StopRecord>,
    /// Its end, in words, if it is not complete.
    pub end_in_words: Option<String>,
}

/// A calibration with its pictures.
#[derive(Debug, Clone, PartialEq)]
pub struct CalibrationPart<'a> {
    /// The record.
    pub record: &'a Calibration,
    /// Pictures as PNG, each with its name, as far as they are there.
    pub pictures: Vec<(String, Vec<u8>)>,
}

/// The maps of the reference frame.
#[derive(Debug, Clone, PartialEq)]
pub struct Maps<'a> {
    /// The reference frame as the sensor gave it, if it can be read.
    pub photograph: Option<&'a Frame>,
    /// The same as it was matched, in DN; rows x columns of the maps.
    pub matched_frame: Option<&'a Grid<f32>>,
    /// Heights after removal of the form, in mm.
    pub rest_mm: &'a Grid<f32>,
    /// Standard uncertainty of the heights, in mm.
    pub sigma_mm: &'a Grid<f32>,
    /// Disparity, in px.
    pub disparity_px: &'a Grid<f32>,
    /// Use of the pixels: 0 no height; 80 a height that is not used; 160 used, but not for the levels; 255
    /// used.
    pub used: &'a Grid<u8>,
}
