//! The report of a measurement: one HTML file that needs nothing from outside.
//!
//! One file for each section; each takes records as they are and says in words what they hold. Text from
//! outside, such as names of folders and cameras, is escaped by `maud`.

mod calibration;
mod contents;
mod facts;
mod limits;
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
use markup::{in_style, visible};
use maud::{DOCTYPE, Markup, PreEscaped, html};

/// What may be loaded: pictures inside the file, and its own style. So nothing from outside, and no program.
const POLICY: &str = "default-src 'none'; img-src data:; style-src 'unsafe-inline'";

impl Report<'_> {
    /// The report as HTML.
    ///
    /// # Errors
    /// [`ReportError`] if a picture cannot be drawn.
    pub fn html(&self) -> Result<String, ReportError> {
        let title = format!("Surface report: {}", self.name);
        let running_head = format!("@page {{ @top-left {{ content: \"{}\"; }} }}", in_style(&title));
        let sections: [(&str, &str, Markup); 7] = [
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
        let page = html! {
            (DOCTYPE)
            html lang="en" {
                head {
                    meta charset="utf-8";
                    meta http-equiv="Content-Security-Policy" content=(POLICY);
                    meta name="viewport" content="width=device-width, initial-scale=1";
                    meta name="generator" content=(self.surface.program);
                    title { (title) }
                    style { (PreEscaped(include_str!("style.css"))) }
                    style { (PreEscaped(running_head)) }
                }
                body {
                    header { (facts::logo(self)) h1 { (title) } (facts::verdict(self)) }
                    nav aria-label="Contents" {
                        ul { @for (id, title, _) in &sections { li { a href={ "#" (id) } { (title) } } } }
                    }
                    main {
                        @for (id, title, inside) in &sections {
                            section id=(id) aria-labelledby={ (id) "-heading" } {
                                h2 id={ (id) "-heading" } { (title) }
                                (inside)
                            }
                        }
                    }
                }
            }
        };
        Ok(visible(&page.into_string()))
    }
}
