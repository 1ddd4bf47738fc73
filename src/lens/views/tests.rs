//! Against lenses that are known.
