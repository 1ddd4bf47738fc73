//! A lens from its data sheet, before the size of the images is known.

use super::Intrinsics;

/// A lens as far as its data sheet tells.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NominalLens {
    /// Its focal length.
    pub focal_length: FocalLength,
    /// Principal point, column and row in px; the image's middle if not known.
    pub principal_point_px: Option<(f64, f64)>,
}

/// A focal length.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum FocalLength {
    /// Focal length in px.
    Px(f64),
    /// Focal length in widths of the image, whatever its number of columns: 25 mm before a sensor 9 mm wide
    /// are 2.78.
    ImageWidths(f64),
}

impl FocalLength {
    /// The focal length in px of an image of `columns`.
    ///
    /// ```
    /// use epirig_data::sequence::FocalLength;
    ///
    /// assert_eq!(FocalLength::ImageWidths(2.5).px(1000), 2500.0);
    /// ```
    pub fn px(self, columns: usize) -> f64 {
        match self {
            Self::Px(px) => px,
            Self::ImageWidths(widths) => widths * columns as f64,
        }
    }
}

impl NominalLens {
    /// Lens and pixels for an image of `columns` x `rows`.
    pub fn intrinsics(&self, columns: usize, rows: usize) -> Intrinsics {
        let centred = Intrinsics::centred(self.focal_length.px(columns), columns, rows);
        self.principal_point_px.map_or(centred, |(x_px, y_px)| Intrinsics {
            principal_point_x_px: x_px,
            principal_point_y_px: y_px,
            ..centred
        })
    }
}
