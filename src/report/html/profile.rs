//! The profile between its two expected planes, as in figure 6 of the paper.

use super::contents::Report;
use super::picture::Picture;
use crate::number::fixed;
use crate::report::ReportError;
use maud::{Markup, html};

pub(super) fn profile(report: &Report<'_>) -> Result<Markup, ReportError> {
    let chart = report.profile;
    let planes = match &report.surface.levels {
        Some(levels) => format!(
            "The dashed lines are the two levels that were fitted to the whole field: 0 mm and {} mm.",
            fixed(-levels.depth.depth_mm, 4)
        ),
        None => "There is one level only, so no second plane is drawn.".to_owned(),
    };
    let figure = Picture::chart(chart)?.figure(
        &format!("Chart: {}, with a band of one standard uncertainty to both sides", chart.title),
        format!(
            "{}. The band is one standard uncertainty of the heights to both sides, without that of the scale. \
             {planes}",
            chart.title
        ),
    );
    Ok(html! { (figure) p { "The numbers are in profile.csv beside this file." } })
}
