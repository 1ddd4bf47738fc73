//! Names of the files of results that are no maps: pictures and tables of numbers.

use super::kind::ResultsKind;

macro_rules! names {
    ($($name:ident = $file:literal in $($kind:ident)+;)*) => {
        $(pub(crate) const $name: &str = $file;)*
        /// Each name with each kind of results that may have such a file.
        pub(super) const NAMES: &[(ResultsKind, &str)] = &[$($((ResultsKind::$kind, $file),)+)*];
    };
}

// A new file is a line here, and the place that writes it. A name without extension stands for two files: the picture
// of a chart, .png, and its numbers, .csv.
names! {
    DISPARITY = "disparity.png" in Match;
    DISPARITY_DETAIL = "disparity-detail.png" in Match;
    SIGMA = "sigma.png" in Match;
    ANSWERS = "answers.png" in Match;
    HEIGHT = "height.png" in Match Surface;
    COST_IMAGE = "figures/3b-cost-image-with-mapping" in Match;
    INTENSITY_PROFILES = "figures/5a-intensity-profiles" in Match;
    ALIGNED_PROFILES = "figures/5b-aligned-profiles" in Match;
    DISPARITY_ALONG_ROW = "figures/6-disparity-along-row" in Match;
    MEASURED_AND_TRUTH = "measured-and-truth.png" in Match;
    HEIGHT_ALONG_ROW = "height-along-row" in Match;
    HOLLOWS = "hollows.csv" in Surface;
    PROFILE = "profile" in Surface;
    PIXELS = "pixels.png" in Surface;
    REPORT = "report.html" in Surface;
    DIFFERENCE = "difference.png" in Compare;
    SIGNIFICANCE = "significance.png" in Compare;
    PLACES = "places.csv" in Compare;
}
