//! The kinds of results.

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

    /// Its verb, its record, the version of that, and its subfolders.
    const fn row(self) -> (&'static str, &'static str, u32, &'static [&'static str]) {
        match self {
            Self::Match => ("match", "match.json", 6, &["figures", "surface"]),
            Self::Surface => ("surface", "surface.json", 6, &[]),
            Self::Compare => ("compare", "compare.json", 2, &[]),
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

    /// Its subfolders.
    pub(super) const fn folders(self) -> &'static [&'static str] {
        self.row().3
    }
}
