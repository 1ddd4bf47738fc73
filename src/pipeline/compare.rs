//! Compares the heights of two scans of one object, and writes files and pictures.

use serde::Serialize;
use thiserror::Error;

use super::{OpenedResults, PipelineError, matched_frame, steps_options};
use crate::report::csv::table;
use crate::report::{MapPicture, Millimetres, ReportError, ValueRange};
use crate::results::{MaskFacts, Region, ResultMap, ResultsError, ResultsFolder, ResultsKind, names};
use epirig_calibration::registration::{ShiftError, Similarity, similarity_between};
use epirig_core::fault::{Blame, Fault};
use epirig_core::frame::{Frame, FrameError, Samples};
use epirig_core::grid::Grid;
use epirig_data::sequence::Sequence;
use epirig_surface::comparison::{
    Comparison, ComparisonError, DifferenceStatistics, Place, Registration, compare,
};
use epirig_surface::{Heights, Rectangle, ScaleSigma, TrendKind};

/// Samples of the frames that are registered: fine enough that rounding does not count.
const BIT_DEPTH: u8 = 16;
/// Colours of the significance reach to this many sigma.
const MOST_SIGMA: f32 = 5.0;

/// Why two scans cannot be compared.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum CompareError {
    /// The frames differ in size.
    #[error(
        "the frames of the first scan have {} rows x {} columns, and those of the second {} x {}; take both scans with the same camera \
         settings, and calibrate both or none", first.0, first.1, second.0, second.1
    )]
    Sizes {
        /// Rows and columns of the first.
        first: (usize, usize),
        /// Rows and columns of the second.
        second: (usize, usize),
    },
    /// The pictures do not show how the object moved.
    #[error(
        "the scans cannot be registered: {0}. Place the object as in the first scan, within a quarter of the picture and a degree, and \
         light it alike"
    )]
    NotRegistrable(#[source] ShiftError),
    /// The height maps have too little in common.
    #[error(transparent)]
    Comparison(#[from] ComparisonError),
    /// A scan cannot be read.
    #[error(transparent)]
    Pipeline(#[from] PipelineError),
    /// A frame that was read is none.
    #[error("the reference frame cannot be registered: {0}; run `epirig verify` on the sequence")]
    Frame(#[from] FrameError),
    /// A picture cannot be drawn.
    #[error(transparent)]
    Report(#[from] ReportError),
    /// The files cannot be written.
    #[error(transparent)]
    Results(#[from] ResultsError),
}

impl Fault for CompareError {
    fn blame(&self) -> Blame {
        match self {
            Self::Sizes { .. } => Blame::Request,
            Self::NotRegistrable(_) | Self::Comparison(_) | Self::Frame(_) => Blame::Data,
            Self::Pipeline(error) => error.blame(),
            Self::Report(error) => error.blame(),
            Self::Results(error) => error.blame(),
        }
    }
}

/// A scan whose heights are known.
#[derive(Debug, Clone, Copy)]
pub struct MeasuredScan<'a> {
    /// The sequence.
    pub sequence: &'a Sequence,
    /// Its results.
    pub opened: &'a OpenedResults,
    /// The heights in them.
    pub heights: &'a Heights,
}

/// Contents of `compare.json`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CompareSummary {
    /// Version of the format.
    pub format: u32,
    /// Version of the program.
    pub program: String,
    /// Uid of the first sequence.
    pub first_uid: String,
    /// Uid of the second sequence.
    pub second_uid: String,
    /// Hash of the `match.json` of the first results.
    pub first_matched_blake3: String,
    /// Hash of the `match.json` of the second results.
    pub second_matched_blake3: String,
    /// How the picture moved from the first scan to the second.
    pub motion: MotionSummary,
    /// Form that was removed from the difference.
    pub trend: TrendKind,
    /// Its height in the middle of the first map, in mm. Heights of two scans have no common zero.
    pub offset_mm: f64,
    /// Its tilt along x and y, in deg.
    pub tilt_deg: (f64, f64),
    /// Width of a pixel of the first map, in mm.
    pub pixel_mm: f64,
    /// Column and row of the first map where x and y are zero.
    pub origin_px: (f64, f64),
    /// Relative standard uncertainties of the scale of both scans. They are not in the sigma of the difference: what
    /// both scans share changes each difference by its share, and makes none.
    pub scale_sigma: [ScaleSigma; 2],
    /// Region of the first map, if one was given.
    pub region: Option<Rectangle>,
    /// Mask of the first map, if one was given.
    pub mask: Option<MaskFacts>,
    /// How the differences are distributed.
    pub difference: DifferenceStatistics,
    /// Where the difference is significant, the largest volume first.
    pub places: Vec<Place>,
}

/// How the picture of the object moved.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct MotionSummary {
    /// Shift of the middle of the picture, to higher columns and rows, in px.
    pub shift_px: (f64, f64),
    /// The same, in mm on the object.
    pub shift_mm: (f64, f64),
    /// Turn from the axis of columns towards that of rows, in deg.
    pub turn_deg: f64,
    /// Size in the second picture over that in the first.
    pub scale: f64,
    /// Standard uncertainty of a place, in px.
    pub sigma_px: f64,
    /// Parts of the picture that turn and scale come from; 0 if neither was found.
    pub parts: usize,
}

/// Two scans of one object, compared.
#[derive(Debug, Clone, PartialEq)]
pub struct ComparedScans {
    /// The heights of the second less those of the first, at the pixels of the first.
    pub found: Comparison,
    /// How the picture moved.
    pub motion: MotionSummary,
    /// The reference frame of the first.
    photograph: Grid<f32>,
}

/// Registers `second` to `first`, and compares their heights in `region` of the first.
///
/// # Errors
/// [`CompareError`].
pub fn compared_scans(
    [first, second]: [MeasuredScan<'_>; 2],
    trend: TrendKind,
    region: &Region,
) -> Result<ComparedScans, CompareError> {
    let size = |heights: &Heights| (heights.height_mm.rows(), heights.height_mm.columns());
    let (rows, columns) = size(first.heights);
    if size(second.heights) != (rows, columns) {
        let (first, second) = (size(first.heights), size(second.heights));
        return Err(CompareError::Sizes { first, second });
    }
    let photograph = photograph(&first)?;
    let frames = [as_frame(&photograph, &first)?, as_frame(&self::photograph(&second)?, &second)?];
    let motion = similarity_between(&frames[0], &frames[1]).map_err(CompareError::NotRegistrable)?;
    let place = |x: f64, y: f64| motion.place(x, y);
    let registration = Registration { place: &place, sigma_px: motion.sigma_px };
    let inside = region.inside(rows, columns);
    let margins_px = [&first, &second].map(|scan| {
        let options = steps_options(&scan.opened.matched.settings, trend);
        (options.margin_px, options.rim_px())
    });
    let heights = [first.heights, second.heights];
    let found = compare(heights, registration, trend, inside.as_ref(), margins_px)?;
    let motion = summarised(&motion, (rows, columns), first.heights.pixel_mm());
    Ok(ComparedScans { found, motion, photograph })
}

/// Compares two scans as [`compared_scans`], and writes all into `folder`, which the caller commits.
///
/// # Errors
/// [`CompareError`].
pub fn compare_scans(
    scans: [MeasuredScan<'_>; 2],
    trend: TrendKind,
    region: &Region,
    folder: &ResultsFolder,
) -> Result<CompareSummary, CompareError> {
    let ComparedScans { found, motion, photograph } = compared_scans(scans, trend, region)?;
    let [first, second] = scans;
    let millimetres = Millimetres::of(first.heights);
    let Millimetres { pixel_mm, origin_px } = millimetres;
    let summary = CompareSummary {
        format: ResultsKind::Compare.format(),
        program: concat!("epirig ", env!("CARGO_PKG_VERSION")).to_owned(),
        first_uid: first.sequence.record().uid.clone(),
        second_uid: second.sequence.record().uid.clone(),
        first_matched_blake3: first.opened.files.record_hash().to_owned(),
        second_matched_blake3: second.opened.files.record_hash().to_owned(),
        motion,
        trend,
        offset_mm: found.trend.coefficients.first().copied().unwrap_or(0.0),
        tilt_deg: found.trend.tilt_deg(),
        pixel_mm,
        origin_px,
        scale_sigma: scans.map(|scan| scan.heights.geometry.scale),
        region: region.rectangle,
        mask: region.mask.as_ref().map(|mask| mask.facts.clone()),
        difference: found.statistics,
        places: found.places.clone(),
    };
    write(folder, &found, &summary, (&photograph, millimetres))?;
    Ok(summary)
}

/// The reference frame, as it was matched.
fn photograph(scan: &MeasuredScan<'_>) -> Result<Grid<f32>, PipelineError> {
    matched_frame(scan.sequence, scan.opened.calibration.as_ref(), scan.opened.matched.reference)
}

/// A photograph as a frame of 16 bit, whose full scale is that of the camera.
fn as_frame(photograph: &Grid<f32>, scan: &MeasuredScan<'_>) -> Result<Frame, FrameError> {
    let full = epirig_core::frame::full_scale(scan.sequence.record().bit_depth);
    let steps = f32::from(u16::MAX) / f32::from(full);
    // What a rectified frame does not show becomes black: the cast takes NaN to 0, and clips.
    let samples = photograph.values().iter().map(|value| (value * steps).round() as u16).collect();
    Frame::new(photograph.rows(), photograph.columns(), BIT_DEPTH, Samples::U16(samples))
}

fn summarised(motion: &Similarity, (rows, columns): (usize, usize), pixel_mm: f64) -> MotionSummary {
    let middle = (0.5 * (columns as f64 - 1.0), 0.5 * (rows as f64 - 1.0));
    let place = motion.place(middle.0, middle.1);
    let shift_px = (place.0 - middle.0, place.1 - middle.1);
    MotionSummary {
        shift_px,
        shift_mm: (shift_px.0 * pixel_mm, shift_px.1 * pixel_mm),
        turn_deg: motion.turn_rad.to_degrees(),
        scale: motion.scale,
        sigma_px: motion.sigma_px,
        parts: motion.parts,
    }
}

fn write(
    folder: &ResultsFolder,
    found: &Comparison,
    summary: &CompareSummary,
    (photograph, millimetres): (&Grid<f32>, Millimetres),
) -> Result<(), CompareError> {
    let Comparison { difference_mm, sigma_mm, .. } = found;
    let between = format!("sequence {} less {}", summary.second_uid, summary.first_uid);
    for (map, values) in [(ResultMap::Difference, difference_mm), (ResultMap::DifferenceSigma, sigma_mm)] {
        let facts = map.row().facts(Some(summary.pixel_mm), Some(&between));
        folder.write_map(map.row().file, values, &facts)?;
    }
    let difference = MapPicture::of(ResultMap::Difference, difference_mm).in_mm(Some(millimetres));
    folder.write_picture(names::DIFFERENCE, &difference.beside(Some(photograph)).picture()?)?;
    let mut significance = difference_mm.clone();
    significance.values_mut().iter_mut().zip(sigma_mm.values()).for_each(|(value, sigma)| *value /= sigma);
    let range = ValueRange { low: -MOST_SIGMA, high: MOST_SIGMA };
    let title = "Difference over its standard uncertainty";
    let significance = MapPicture::new(&significance, title, "sigma", range).diverging();
    folder.write_picture(names::SIGNIFICANCE, &significance.in_mm(Some(millimetres)).picture()?)?;
    folder.write(names::PLACES, places_csv(&summary.places));
    folder.set_record(summary.clone());
    Ok(())
}

fn places_csv(places: &[Place]) -> String {
    let rows = places.iter().map(|place| {
        let Place { centre_px: (x, y), area_px, area_mm2, mean_mm, largest_mm, volume_mm3 } = place;
        format!("{x},{y},{area_px},{area_mm2},{mean_mm},{largest_mm},{volume_mm3}")
    });
    table("centre_x_px,centre_y_px,area_px,area_mm2,mean_mm,largest_mm,volume_mm3", rows)
}
