//! The kinds of results.

use super::maps::ResultMap;
use super::names::NAMES;
use epirig_core::choice::Choice as _;

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

impl ResultsKind {
    pub(super) const ALL: [Self; 3] = [Self::Match, Self::Surface, Self::Compare];

    /// Its verb, its record, and the version of that.
    const fn row(self) -> (&'static str, &'static str, u32) {
        match self {
            Self::Match => ("match", "match.json", 6),
            Self::Surface => ("surface", "surface.json", 5),
            Self::Compare => ("compare", "compare.json", 2),
        }
    }

    /// The verb that writes them.
    pub const fn verb(self) -> &'static str {
        self.row().0
    }

    /// The file that identifies them.
    pub const fn summary(self) -> &'static str {
        self.row().1
    }

    /// Version of its record.
    pub const fn format(self) -> u32 {
        self.row().2
    }

    /// Whether its results may have a file of this name, which may be in one of the [`folders`](Self::folders).
    pub(super) fn has(self, name: &str) -> bool {
        if let Some(name) = name.strip_prefix("surface/") {
            return self == Self::Match && Self::Surface.has(name);
        }
        let is_map = |map: &ResultMap| map.row().kind == self && map.row().file == name;
        let chart = name.strip_suffix(".png").or_else(|| name.strip_suffix(".csv"));
        let is_named = |other: &str| if other.contains('.') { other == name } else { Some(other) == chart };
        let is_other = |&(kind, other): &(Self, &str)| kind == self && is_named(other);
        name == self.summary() || ResultMap::ALL.iter().any(is_map) || NAMES.iter().any(is_other)
    }

    /// Its subfolders.
    pub(super) const fn folders(self) -> &'static [&'static str] {
        match self {
            Self::Match => &["figures", "surface"],
            Self::Surface | Self::Compare => &[],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::ResultsKind::{Compare, Match, Surface};

    #[test]
    fn each_kind_has_its_files_alone() {
        for (kind, name) in [
            (Match, "match.json"),
            (Match, "mask.png"),
            (Match, "height-along-row.csv"),
            (Match, "figures/6-disparity-along-row.png"),
            (Match, "surface/profile.csv"),
            (Surface, "filtered_mm.tiff"),
            (Surface, "height.png"),
            (Compare, "difference_sigma_mm.tiff"),
        ] {
            assert!(kind.has(name), "{name}");
        }
        for (kind, name) in [
            (Match, "disparity.png.csv"),
            (Match, "height-along-row"),
            (Match, "6-disparity-along-row.png"),
            (Match, "surface/mask.png"),
            (Surface, "surface/profile.csv"),
            (Surface, "match.json"),
            (Compare, "difference.csv"),
        ] {
            assert!(!kind.has(name), "{name}");
        }
    }
}
