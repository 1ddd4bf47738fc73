//! The section `optics`: the lens and the sensor.

use super::section::{Allowed, Kind, Setting, from_value, measure, section};
use epirig_calibration::lens::{Distortion, Lens};
use epirig_core::settings::quantity::{MM, PERCENT, PX, Quantity};

/// Focal length of the lens.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum FocalLength {
    /// In px.
    Px(f64),
    /// In mm.
    Mm(f64),
}

from_value! {
    FocalLength: Setting::Measure(length) => Some(match length.unit.quantity {
        Quantity::Pixels => Self::Px(length.in_unit(PX)),
        _ => Self::Mm(length.in_unit(MM)),
    });
}

section! {
    /// The lens and the sensor; heights in mm need them.
    pub struct OpticsProfile in "optics" {
        /// Focal length of the lens; a value in mm needs sensor_width.
        "focal_length" => focal_length: Option<FocalLength> =
            Kind::Measure { unit: MM, or: Some(PX), allowed: Allowed::Positive }, like "25 mm";
        /// Relative standard uncertainty of the focal length; part of the interval of a depth, and limits how
        /// far calibration changes it.
        "focal_length_sigma" => focal_length_sigma: f64 = measure(PERCENT, Allowed::UpTo(100.0)),
            like "0.5 %" or "2 %";
        /// Width of the part of the sensor that the image covers.
        "sensor_width" => sensor_width_mm: Option<f64> = measure(MM, Allowed::Positive), like "9 mm";
        /// Column of the principal point, from the centre of the first column; by default the centre of the
        /// image.
        "principal_point_x" => principal_point_x_px: Option<f64> = measure(PX, Allowed::Any), like "511.5 px";
        /// Row of the principal point, from the centre of the first row; only together with
        /// principal_point_x.
        "principal_point_y" => principal_point_y_px: Option<f64> = measure(PX, Allowed::Any), like "383.5 px";
        /// Distance from the lens to the object.
        "distance" => distance_mm: Option<f64> = measure(MM, Allowed::Positive), like "900 mm";
        /// Radial distortion of the lens, coefficient of r^2, as in OpenCV.
        "k1" => k1: f64 = Kind::Number, like "-0.02" or "0";
        /// Radial distortion, coefficient of r^4.
        "k2" => k2: f64 = Kind::Number, like "0.01" or "0";
        /// Tangential distortion, along y.
        "p1" => p1: f64 = Kind::Number, like "0.001" or "0";
        /// Tangential distortion, along x.
        "p2" => p2: f64 = Kind::Number, like "-0.001" or "0";
        /// Radial distortion, coefficient of r^6.
        "k3" => k3: f64 = Kind::Number, like "0.001" or "0";
    }
}

impl OpticsProfile {
    /// The lens for images of `columns` x `rows`. The principal point defaults to their centre. `None` if the
    /// focal length in px is unknown.
    pub fn lens(&self, columns: usize, rows: usize) -> Option<Lens> {
        let middle = |size: usize| 0.5 * (size as f64 - 1.0);
        let (x_px, y_px) = self.principal_point_px().unwrap_or((middle(columns), middle(rows)));
        let lens = Lens::pinhole(self.focal_length_px(columns)?, x_px, y_px);
        let Self { k1, k2, p1, p2, k3, .. } = *self;
        Some(Lens { distortion: Distortion { k1, k2, p1, p2, k3 }, ..lens })
    }

    /// Column and row of the principal point, in px; `None`: the centre of the image.
    pub fn principal_point_px(&self) -> Option<(f64, f64)> {
        self.principal_point_x_px.zip(self.principal_point_y_px)
    }

    /// Focal length in px for images with this number of columns. A length is divided by the width of a
    /// pixel: `sensor_width_mm` / `columns`. `None` if it is unknown.
    pub fn focal_length_px(&self, columns: usize) -> Option<f64> {
        Some(match self.focal_length? {
            FocalLength::Px(length_px) => length_px,
            FocalLength::Mm(length_mm) => length_mm / self.sensor_width_mm? * columns as f64,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_focal_length_in_mm_is_counted_in_pixels_of_the_sensor() {
        let optics = OpticsProfile {
            focal_length: Some(FocalLength::Mm(25.0)),
            sensor_width_mm: Some(10.0),
            k1: -0.1,
            ..OpticsProfile::default()
        };
        // Pixels of 10 mm / 1000 = 10 um: 25 mm are 2500 px.
        assert_eq!(optics.focal_length_px(1000), Some(2500.0));
        assert_eq!(optics.focal_length_px(500), Some(1250.0));
        let lens = optics.lens(1000, 500).unwrap();
        assert_eq!(lens.to_array(), [2500.0, 2500.0, 499.5, 249.5, -0.1, 0.0, 0.0, 0.0, 0.0]);
        let (x_px, y_px) = (Some(7.0), Some(9.0));
        let stated =
            OpticsProfile { principal_point_x_px: x_px, principal_point_y_px: y_px, ..optics.clone() };
        assert_eq!(stated.lens(1000, 500).unwrap().to_array()[2..4], [7.0, 9.0]);
        let without_width = OpticsProfile { sensor_width_mm: None, ..optics.clone() };
        assert_eq!(without_width.focal_length_px(1000), None);
        let in_px = OpticsProfile { focal_length: Some(FocalLength::Px(2844.0)), ..optics };
        assert_eq!(in_px.focal_length_px(1000), Some(2844.0));
    }
}
