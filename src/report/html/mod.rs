//! The report of a measurement: one HTML file that needs nothing from outside.
//!
//! One file for each section; each takes records as they are and says in words what they hold. Text from
//! outside, such as names of folders and cameras, gets in through `markup` only, which escapes it.

mod calibration;
mod contents;
mod facts;
mod maps;
mod markup;
mod picture;
mod profile;
mod scan;
mod settings;
mod steps;
#[cfg(test)]
mod tests;

pub use contents::{CalibrationPart, Maps, Report, Scan};

use super::ReportError;
use markup::{Markup, element, inline, joined, section, void, with};

/// What may be loaded: pictures inside the file, and its own style. So nothing from outside, and no program.
const POLICY: &str = "default-src 'none'; img-src data:; style-src 'unsafe-inline'";

impl Report<'_> {
    /// The report as HTML.
    ///
    /// # Errors
    /// [`ReportError`] if a picture cannot be drawn.
    pub fn html(&self) -> Result<String, ReportError> {
        let title = format!("Surface report: {}", self.name);
        let head = joined([
            void("meta", &[("charset", "utf-8")]),
            void("meta", &[("http-equiv", "Content-Security-Policy"), ("content", POLICY)]),
            void("meta", &[("name", "viewport"), ("content", "width=device-width, initial-scale=1")]),
            void("meta", &[("name", "generator"), ("content", &self.surface.program)]),
            element("title", title.as_str()),
            Markup::style(include_str!("style.css")),
            Markup::running_head(&title),
        ]);
        let sections = [
            (
                "facts",
                "Result: what was measured, with what, how good",
                facts::facts(self, maps::height(self)?),
            ),
            ("maps", "Maps", maps::maps(self)?),
            ("profile", "Profile", profile::profile(self)?),
            ("steps", "Step heights and their uncertainty", steps::steps(self)),
            ("calibration", "Calibration", calibration::calibration(self)),
            ("scan", "Scan", scan::scan(self)?),
            ("settings", "Settings, versions, hashes", settings::settings(self)),
        ];
        let links = sections
            .iter()
            .map(|(id, title, _)| element("li", inline("a", &[("href", &format!("#{id}"))], *title)));
        let contents = with("nav", &[("aria-label", "Contents")], element("ul", links.collect::<Markup>()));
        let header = element("header", joined([element("h1", title.as_str()), facts::verdict(self)]));
        let sections = sections.into_iter().map(|(id, title, inside)| section(id, title, inside));
        let main = element("main", sections.collect::<Markup>());
        Ok(Markup::document(head, joined([header, contents, main])).into_string())
    }
}
