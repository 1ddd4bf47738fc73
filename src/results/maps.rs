//! The maps of results, in one table. Whatever writes, reads, exports or shows a map takes its facts from here.

use super::classes::{ANSWER_CLASSES, Class, USED_CLASSES};
use super::kind::ResultsKind;
use epirig_data::formats::{MapFacts, Quantity};

/// What is known of a map.
#[derive(Debug, Clone, Copy)]
pub struct MapRow {
    /// Its name on the command line and on the page.
    pub id: &'static str,
    /// The results that it belongs to.
    pub kind: ResultsKind,
    /// The file among these that it is read from.
    pub file: &'static str,
    /// What it shows.
    pub title: &'static str,
    /// What its values are.
    pub quantity: Quantity,
    /// Colours of a picture span at least this much.
    pub least_span: f32,
    /// How it is shown.
    pub look: Look,
    /// The map of the standard uncertainty of its values.
    pub sigma: Option<ResultMap>,
}

/// How a map is shown.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Look {
    /// In the colours of viridis.
    Plain,
    /// The same, shaded: heights of a surface, which also has points in space.
    Relief,
    /// Values above 0 over some powers of ten.
    Decades,
    /// Values to both sides of 0.
    Difference,
    /// Grey values that stand for classes.
    Classes(&'static [Class]),
}

macro_rules! result_maps {
    ($(
        #[doc = $help:literal]
        $map:ident: $id:literal, $kind:ident, $file:literal, $title:literal,
            $quantity:ident, $least_span:literal, $look:expr, $sigma:expr;
    )*) => {
        epirig_core::choices! {
            /// A map of results. More is in its [`row`](Self::row) of the table.
            pub enum ResultMap {
                $(#[doc = $help] $map = $id,)*
            }
        }

        impl ResultMap {
            /// What is known of it.
            pub const fn row(self) -> MapRow {
                match self {
                    $(Self::$map => MapRow {
                        id: $id,
                        kind: ResultsKind::$kind,
                        file: $file,
                        title: $title,
                        quantity: Quantity::$quantity,
                        least_span: $least_span,
                        look: $look,
                        sigma: $sigma,
                    },)*
                }
            }
        }
    };
}

// A new map is a row here, and the place that computes and writes it. The columns: id, results and file; title,
// quantity, least span of colours, look, map of its sigma. The order is that of the help of `export`.
result_maps! {
    /// Disparity over the whole baseline.
    Disparity: "disparity", Match, "disparity.tiff", "Disparity",
        ImagePx, 0.05, Look::Plain, Some(Self::Sigma);
    /// Standard uncertainty of the disparity.
    Sigma: "sigma", Match, "sigma.tiff", "Standard uncertainty of the disparity",
        ImagePx, 0.001, Look::Decades, None;
    /// How much better the chosen line is than the best line elsewhere, 0 to 1.
    Confidence: "confidence", Match, "confidence.tiff", "Confidence",
        Number, 0.001, Look::Plain, None;
    /// Cost of the chosen line.
    Cost: "cost", Match, "cost.tiff", "Cost of the chosen line",
        Number, 0.001, Look::Decades, None;
    /// Why a pixel has an answer or none, with the values of mask.png.
    Mask: "mask", Match, "mask.png", "Answers of the matcher",
        Number, 1.0, Look::Classes(&ANSWER_CLASSES), None;
    /// Height as measured.
    Height: "height", Match, "height_mm.tiff", "Height",
        LengthMm, 0.01, Look::Relief, Some(Self::HeightSigma);
    /// Standard uncertainty of the height.
    HeightSigma: "height-sigma", Match, "height_sigma_mm.tiff", "Standard uncertainty of the height",
        LengthMm, 0.001, Look::Decades, None;
    /// Height as measured, where `epirig surface` used it.
    HeightUsed: "height-used", Surface, "height_mm.tiff", "Height of the surface, with the form",
        LengthMm, 0.01, Look::Relief, Some(Self::HeightSigma);
    /// Height after removal of the form, as `epirig surface` found it.
    HeightWithoutForm: "height-without-form", Surface, "height_mm.tiff", "Height after removal of the form",
        LengthMm, 0.01, Look::Relief, Some(Self::HeightSigma);
    /// The same between the cut-offs of the filters of `epirig surface`.
    HeightFiltered: "height-filtered", Surface, "filtered_mm.tiff", "Height between the cut-offs",
        LengthMm, 0.01, Look::Relief, None;
    /// Which heights `epirig surface` used, with the values of used.png.
    Used: "used", Surface, "used.png", "Use of the pixels",
        Number, 1.0, Look::Classes(&USED_CLASSES), None;
    /// Difference of height that `epirig compare` found.
    Difference: "difference", Compare, "difference_mm.tiff", "Second less first height",
        LengthMm, 0.01, Look::Difference, Some(Self::DifferenceSigma);
    /// Standard uncertainty of the difference.
    DifferenceSigma: "difference-sigma", Compare, "difference_sigma_mm.tiff", "Standard uncertainty of the difference",
        LengthMm, 0.001, Look::Decades, None;
}

impl MapRow {
    /// The unit of its values; empty if they have none.
    pub const fn unit(&self) -> &'static str {
        match self.quantity {
            Quantity::LengthMm => "mm",
            Quantity::ImagePx => "px",
            Quantity::Number => "",
        }
    }

    /// What its grey values stand for; nothing for a map of quantities.
    pub const fn classes(&self) -> &'static [Class] {
        match self.look {
            Look::Classes(classes) => classes,
            _ => &[],
        }
    }

    /// The value of a pixel that was not measured: NaN, or the grey value of the last class.
    pub fn unknown(&self) -> f32 {
        self.classes().last().map_or(f32::NAN, |class| f32::from(class.value))
    }

    /// What a file says of the map: its title, with `source`, what it was made of, if that is to be named. A pixel is
    /// `pixel_mm` wide, if that is known.
    pub fn facts(&self, pixel_mm: Option<f64>, source: Option<&str>) -> MapFacts {
        let mut title = self.title.to_owned();
        if !self.unit().is_empty() {
            title += &format!(" in {}", self.unit());
        }
        title.extend(source.map(|source| format!(", {source}")));
        MapFacts { quantity: self.quantity, pixel_mm, title, taken: None }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use epirig_core::choice::Choice as _;

    #[test]
    fn titles_name_unit_and_source() {
        let title = |map: ResultMap, source| map.row().facts(None, source).title;
        assert_eq!(title(ResultMap::Disparity, None), "Disparity in px");
        assert_eq!(title(ResultMap::Confidence, None), "Confidence");
        assert_eq!(title(ResultMap::HeightFiltered, Some("s")), "Height between the cut-offs in mm, s");
    }

    #[test]
    fn pixels_that_were_not_measured_have_no_value() {
        assert!(ResultMap::Sigma.row().unknown().is_nan());
        // Outside mask or region; no height.
        assert_eq!([ResultMap::Mask, ResultMap::Used].map(|map| map.row().unknown()), [200.0, 0.0]);
    }

    #[test]
    fn a_sigma_has_the_unit_of_its_map() {
        let with_sigma = ResultMap::ALL.iter().filter_map(|map| Some((map.row(), map.row().sigma?.row())));
        let pairs: Vec<_> = with_sigma.collect();
        assert!(pairs.len() >= 5 && pairs.iter().all(|(map, sigma)| map.quantity == sigma.quantity));
        assert!(pairs.iter().all(|(_, sigma)| sigma.look == Look::Decades));
    }
}
