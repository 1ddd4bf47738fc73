//! The files of each kind of results.

/// A kind of results: its verb and its files.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ResultsKind {
    /// Results of `epirig match`.
    Match,
    /// Results of `epirig surface`.
    Surface,
    /// Results of `epirig compare`.
    Compare,
}

const MATCH: &[&str] = &[
    "match.json",
    "disparity.tiff",
    "disparity.png",
    "disparity-detail.png",
    "sigma.tiff",
    "sigma.png",
    "cost.tiff",
    "confidence.tiff",
    "mask.png",
    "answers.png",
    "height.png",
    "height_mm.tiff",
    "height_sigma_mm.tiff",
    "measured-and-truth.png",
    "height-along-row.png",
    "height-along-row.csv",
];
const COMPARE: &[&str] = &[
    "compare.json",
    "difference.png",
    "difference_mm.tiff",
    "difference_sigma_mm.tiff",
    "places.csv",
    "significance.png",
];
const FIGURES: &[&str] = &[
    "3b-cost-image-with-mapping.png",
    "3b-cost-image-with-mapping.csv",
    "5a-intensity-profiles.png",
    "5a-intensity-profiles.csv",
    "5b-aligned-profiles.png",
    "5b-aligned-profiles.csv",
    "6-disparity-along-row.png",
    "6-disparity-along-row.csv",
];
const SURFACE: &[&str] = &[
    "surface.json",
    "filtered_mm.tiff",
    "height.png",
    "height_mm.tiff",
    "hollows.csv",
    "profile.csv",
    "profile.png",
    "pixels.png",
    "report.html",
    "used.png",
];

impl ResultsKind {
    pub(super) const ALL: [Self; 3] = [Self::Match, Self::Surface, Self::Compare];

    /// The verb that writes them.
    pub const fn verb(self) -> &'static str {
        match self {
            Self::Match => "match",
            Self::Surface => "surface",
            Self::Compare => "compare",
        }
    }

    /// The file that identifies them.
    pub const fn summary(self) -> &'static str {
        match self {
            Self::Match => "match.json",
            Self::Surface => "surface.json",
            Self::Compare => "compare.json",
        }
    }

    /// Version of its record.
    pub const fn format(self) -> u32 {
        match self {
            Self::Match => 6,
            Self::Surface => 5,
            Self::Compare => 2,
        }
    }

    pub(super) const fn files(self) -> &'static [&'static str] {
        match self {
            Self::Match => MATCH,
            Self::Surface => SURFACE,
            Self::Compare => COMPARE,
        }
    }

    /// Subfolders, with their files.
    pub(super) const fn folders(self) -> &'static [(&'static str, &'static [&'static str])] {
        match self {
            Self::Match => &[("figures", FIGURES), ("surface", SURFACE)],
            Self::Surface | Self::Compare => &[],
        }
    }
}
