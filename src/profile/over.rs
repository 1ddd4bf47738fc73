//! A recorded profile with overrides.

use super::error::Place;
use super::given::{Given, Value};
use super::schema::{Key, board, optics, target};
use super::settings::{Setting, Settings};
use super::{BoardProfile, FocalLength, Override, Profile, ProfileError, read};
use epirig_calibration::lens::Distortion;
use epirig_core::settings::quantity::{MM, Measure, PERCENT, PX, Unit};

/// Name of the source of recorded values, in messages.
const RECORD: &str = "sequence.json";

impl Profile {
    /// This profile's lens, target and board, changed by `overrides`; all other sections have their defaults.
    ///
    /// # Errors
    /// [`ProfileError`] with all mistakes in the overrides, and with all contradictions to the recorded
    /// values.
    pub fn lens_and_targets_over(&self, overrides: &[Override]) -> Result<Self, ProfileError> {
        let mut known = Known(Settings::default());
        known.optics(self);
        if let Some(own) = self.board {
            known.board([&board::SQUARE, &board::COLUMNS, &board::ROWS], own);
        }
        if let Some(print) = self.target.print {
            known.board([&target::SQUARE, &target::COLUMNS, &target::ROWS], print.board);
            if let Some(distance_mm) = print.band_distance_mm {
                known.set(&target::BANDS, Value::Whole(2));
                known.measure(&target::BAND_DISTANCE, distance_mm, MM);
            }
        }
        let mut settings = known.0;
        for value in overrides {
            settings.replace(value);
            // With one band, the recorded distance of the bands has no meaning and is dropped.
            if value.key == target::BANDS.path() && value.value == "1" {
                settings.forget(&target::BAND_DISTANCE);
            }
        }
        let (profile, mistakes) = read::read(settings);
        if mistakes.is_empty() { Ok(profile) } else { Err(ProfileError { mistakes }) }
    }
}

/// Values that are interpreted already.
struct Known(Settings);

impl Known {
    fn set(&mut self, key: &'static Key, value: Value) {
        let place = Place::Override { from: RECORD.to_owned() };
        self.0.settings.push(Setting { key, unit: None, given: Given::Known(value), place });
    }

    fn measure(&mut self, key: &'static Key, value: f64, unit: Unit) {
        self.set(key, Value::Measure(Measure { value, unit }));
    }

    fn optics(&mut self, profile: &Profile) {
        let optics = &profile.optics;
        match optics.focal_length {
            Some(FocalLength::Px(px)) => self.measure(&optics::FOCAL_LENGTH, px, PX),
            Some(FocalLength::Mm(mm)) => self.measure(&optics::FOCAL_LENGTH, mm, MM),
            // Without the focal length, its uncertainty and the distortion have no meaning.
            None => return,
        }
        self.measure(&optics::FOCAL_LENGTH_SIGMA, 100.0 * optics.focal_length_sigma, PERCENT);
        if let Some(width_mm) = optics.sensor_width_mm {
            self.measure(&optics::SENSOR_WIDTH, width_mm, MM);
        }
        if let Some((x_px, y_px)) = optics.principal_point_px {
            self.measure(&optics::PRINCIPAL_POINT_X, x_px, PX);
            self.measure(&optics::PRINCIPAL_POINT_Y, y_px, PX);
        }
        let Distortion { k1, k2, p1, p2, k3 } = optics.distortion;
        for (key, value) in
            [(&optics::K1, k1), (&optics::K2, k2), (&optics::P1, p1), (&optics::P2, p2), (&optics::K3, k3)]
        {
            self.set(key, Value::Number(value));
        }
    }

    fn board(&mut self, [square, columns, rows]: [&'static Key; 3], board: BoardProfile) {
        let count = |count: usize| Value::Whole(i64::try_from(count).unwrap_or(i64::MAX));
        self.measure(square, board.square_mm, MM);
        self.set(columns, count(board.columns));
        self.set(rows, count(board.rows));
    }
}
