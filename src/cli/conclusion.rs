//! The last sentence of a measurement: what was measured, and whether it is as planned.

use crate::profile::Profile;
use crate::results::SurfaceSummary;
use epirig_data::sequence::Sequence;

/// The depth that the rig's profile plans (`target.relief`), in mm, if it is recorded with the sequence.
pub(super) fn planned_mm(sequence: &Sequence) -> Option<f64> {
    // Records of another version may be unreadable; then nothing is compared.
    Profile::of_sequence(sequence).ok().flatten().and_then(|rig| rig.target.relief_mm)
}

/// The sentence about `surface`, whose depth was planned to be `planned_mm`.
pub(super) fn conclusion(surface: &SurfaceSummary, planned_mm: Option<f64>) -> String {
    let Some(levels) = &surface.levels else {
        let reason = surface.no_levels.as_deref().unwrap_or("the reason is not known");
        let planned = planned_mm.map_or(String::new(), |mm| format!(" (planned: {mm} mm)"));
        return format!("no hollows were found{planned}: {reason}");
    };
    let (what, how) = if levels.raised { ("raised parts", "high") } else { ("hollows", "deep") };
    let half_width_mm = levels.budget.combined.map(|combined| combined.half_width_95_mm);
    depth((what, how), levels.depth.depth_mm, half_width_mm, planned_mm)
}

/// A depth with its 95 % interval, in mm, against the planned one.
fn depth(
    (what, how): (&str, &str),
    depth_mm: f64,
    half_width_mm: Option<f64>,
    planned_mm: Option<f64>,
) -> String {
    let Some(half_width_mm) = half_width_mm else {
        return format!(
            "{what} {depth_mm:.4} mm {how}; how well that is known cannot be said, as too few parts of the field are \
             independent"
        );
    };
    let measured = format!("{what} {depth_mm:.4} mm +- {half_width_mm:.4} mm {how} (95 % coverage)");
    match planned_mm.map(|planned_mm| (planned_mm, depth_mm - planned_mm)) {
        None => measured,
        Some((planned_mm, more_mm)) if more_mm.abs() <= half_width_mm => {
            format!("{measured}, as planned: {planned_mm} mm lies within the interval")
        }
        Some((planned_mm, more_mm)) => format!(
            "{measured}, not as planned: {:.4} mm {} than {planned_mm} mm",
            more_mm.abs(),
            if more_mm > 0.0 { "more" } else { "less" },
        ),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_depth_is_compared_with_its_interval() {
        let hollows = ("hollows", "deep");
        assert_eq!(
            depth(hollows, 0.2003, Some(0.0012), Some(0.2)),
            "hollows 0.2003 mm +- 0.0012 mm deep (95 % coverage), as planned: 0.2 mm lies within the interval"
        );
        assert_eq!(
            depth(hollows, 0.2003, Some(0.0012), Some(0.25)),
            "hollows 0.2003 mm +- 0.0012 mm deep (95 % coverage), not as planned: 0.0497 mm less than 0.25 mm"
        );
        assert!(depth(hollows, 0.2003, Some(0.0001), Some(0.2)).ends_with("0.0003 mm more than 0.2 mm"));
        assert_eq!(
            depth(("raised parts", "high"), 0.2, Some(0.01), None),
            "raised parts 0.2000 mm +- 0.0100 mm high (95 % coverage)"
        );
        assert!(depth(hollows, 0.2, None, Some(0.2)).contains("cannot be said"));
    }
}
