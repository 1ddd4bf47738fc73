//! The results on the page, compared with the heights of another scan of the object.

use std::path::Path;

use super::compare::{CompareInfo, OtherScan, differences};
use super::view::{RESULTS, ResultsView};
use crate::memory::available;
use crate::panel::PanelError;
use crate::panel::questions::Framed;
use crate::panel::requests::requests;
use crate::pipeline::{
    ComparedScans, MeasuredScan, OpenedResults, compared_scans, open_results, surface_need,
};
use crate::results::Region;
use epirig_data::sequence::Sequence;
use epirig_surface::{Heights, TrendKind};

requests! {
    /// What is to be compared with the results on the page.
    ScansQuestion {
        /// Which results are on the page.
        #[serde(default)]
        #[cfg_attr(test, ts(skip))]
        of: Option<String>,
        /// Name of the other sequence in the list.
        sequence: String,
    }
}

/// The heights of this view less those of the sequence in `folder`, registered by their reference frames and without a
/// plane, as `epirig compare` does it.
pub(super) fn compare_scans(view: &ResultsView, folder: &Path) -> Result<Framed<CompareInfo>, PanelError> {
    let (sequence, own) = (&view.sequence, view.results()?);
    let other_sequence = Sequence::open(folder)?;
    let other = open_results(&other_sequence, &folder.join(RESULTS))?;
    let heights = (heights_of(sequence, own)?, heights_of(&other_sequence, &other)?);
    let needed = 2 * surface_need(own.disparity.rows(), own.disparity.columns());
    if let Some(available) = available().filter(|available| needed > available.bytes) {
        let (work, available, bound) = ("comparing the heights", available.bytes, available.bound);
        return Err(PanelError::Memory { work, needed, available, bound });
    }
    let scans = [
        MeasuredScan { sequence, opened: own, heights: heights.0 },
        MeasuredScan { sequence: &other_sequence, opened: &other, heights: heights.1 },
    ];
    let ComparedScans { found, motion, .. } = compared_scans(scans, TrendKind::Plane, &Region::default())?;
    // The page tells this less the other one.
    let difference = found.difference_mm.map(|value| -value);
    let mut in_sigmas = difference.clone();
    in_sigmas.values_mut().iter_mut().zip(found.sigma_mm.values()).for_each(|(value, sigma)| *value /= sigma);
    let scan = OtherScan { shift_px: motion.shift_px, turn_deg: motion.turn_deg, places: found.places.len() };
    Ok(differences(&difference, &in_sigmas, "mm", Some(scan)))
}

fn heights_of<'a>(sequence: &Sequence, opened: &'a OpenedResults) -> Result<&'a Heights, PanelError> {
    opened.heights.as_ref().ok_or_else(|| {
        let name = sequence.name();
        PanelError::NotThere(format!(
            "{name} has no heights; calibrate and match it, or import it with focal length and step"
        ))
    })
}
