//! Serialisation of a profile in a record: other types as text, times as seconds.

use std::fmt::Display;

use serde::{Deserialize, Deserializer, Serializer};

/// The value for records without this field.
pub(super) fn data_sheet_sigma() -> f64 {
    0.02
}

/// A time in s.
///
/// A double holds the times of a profile (a day at most) to 0.02 ns, and reading rounds to whole ns. So the
/// round trip is exact.
pub(super) mod seconds {
    use std::time::Duration;

    use serde::de::Error as _;
    use serde::{Deserialize, Deserializer, Serializer};

    pub(in crate::profile) fn serialize<S: Serializer>(time: &Duration, to: S) -> Result<S::Ok, S::Error> {
        to.serialize_f64(time.as_secs_f64())
    }

    pub(in crate::profile) fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<Duration, D::Error> {
        let seconds = f64::deserialize(from)?;
        Duration::try_from_secs_f64(seconds)
            .map_err(|error| D::Error::custom(format!("{seconds} s is not a valid time: {error}")))
    }
}

/// [`Size`](epirig_devices::camera::Size) as `1024x768`.
pub(super) mod size {
    use serde::{Deserializer, Serializer};

    use epirig_devices::camera::Size;

    pub(in crate::profile) fn serialize<S: Serializer>(
        size: &Option<Size>,
        to: S,
    ) -> Result<S::Ok, S::Error> {
        super::write(size.map(|size| format!("{}x{}", size.columns, size.rows)), to)
    }

    pub(in crate::profile) fn deserialize<'de, D: Deserializer<'de>>(
        from: D,
    ) -> Result<Option<Size>, D::Error> {
        super::read(from, str::parse)
    }
}

fn write<S: Serializer>(text: Option<String>, to: S) -> Result<S::Ok, S::Error> {
    match text {
        Some(text) => to.serialize_some(&text),
        None => to.serialize_none(),
    }
}

fn read<'de, D: Deserializer<'de>, T, E: Display>(
    from: D,
    parse: impl Fn(&str) -> Result<T, E>,
) -> Result<Option<T>, D::Error> {
    let text = Option::<String>::deserialize(from)?;
    text.map(|text| parse(&text).map_err(serde::de::Error::custom)).transpose()
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use proptest::option;
    use proptest::prelude::*;
    use proptest::sample::select;

    use super::super::*;
    use epirig_calibration::lens::Distortion;
    use epirig_core::choice::Choice as _;
    use epirig_core::settings::{Setting, Settings};
    use epirig_devices::camera::Size;
    use epirig_devices::camera::pixels::BayerUse;
    use epirig_devices::stage::drivers;

    /// Any number that JSON can hold.
    fn number() -> impl Strategy<Value = f64> {
        prop_oneof![any::<f64>().prop_filter("JSON knows no others", |value| value.is_finite()), -1e4..1e4]
    }

    /// Times of a profile: whole ns up to a day.
    fn time() -> impl Strategy<Value = Duration> {
        (0_u64..=86_400_000_000_000).prop_map(Duration::from_nanos)
    }

    fn stage() -> impl Strategy<Value = StageProfile> {
        let setting = prop_oneof![
            number().prop_map(Setting::Number),
            any::<i64>().prop_map(Setting::Whole),
            any::<bool>().prop_map(Setting::Flag),
            "\\PC{0,9}".prop_map(Setting::Text),
        ];
        let stage = (select(drivers()), option::of("\\PC{0,9}"), number(), number(), setting);
        stage.prop_map(|(driver, port, approach_mm, tolerance_mm, setting)| {
            let mut settings = Settings::default();
            driver.keys().iter().for_each(|key| settings.set(key, setting.clone()));
            StageProfile { driver, port, approach_mm, tolerance_mm, settings }
        })
    }

    fn camera() -> impl Strategy<Value = CameraProfile> {
        let size = (1_usize..10_000, 1_usize..10_000).prop_map(|(columns, rows)| Size { columns, rows });
        let bayer = select(BayerUse::ALL.to_vec());
        let options = proptest::array::uniform3(option::of(number()));
        let controls = proptest::collection::vec((".{0,9}", ".{0,9}"), 0..4);
        (
            option::of(".{0,9}"),
            option::of("[A-Z]{4}"),
            option::of(size),
            options,
            option::of(bayer),
            time(),
            controls,
        )
            .prop_map(|(device, format, size, options, bayer, patience, controls)| CameraProfile {
                device,
                format,
                size,
                rate_hz: options[0],
                exposure_us: options[1],
                bayer,
                patience,
                mains_hz: options[2],
                controls,
            })
    }

    fn plan() -> impl Strategy<Value = PlanProfile> {
        let counts = proptest::array::uniform4(0_usize..70_000);
        (number(), option::of(number()), option::of(2_usize..=100_000), time(), counts).prop_map(
            |(start_mm, step_mm, frames, settle, [average, dark, flat, board])| PlanProfile {
                start_mm,
                step_mm,
                frames,
                settle,
                average,
                dark,
                flat,
                board,
            },
        )
    }

    fn optics() -> impl Strategy<Value = OpticsProfile> {
        let length = prop_oneof![number().prop_map(FocalLength::Px), number().prop_map(FocalLength::Mm)];
        let options = proptest::array::uniform2(option::of(number()));
        let numbers = proptest::array::uniform6(number());
        (option::of(length), options, option::of((number(), number())), numbers).prop_map(
            |(focal_length, [sensor_width_mm, distance_mm], principal_point_px, numbers)| {
                let [focal_length_sigma, k1, k2, p1, p2, k3] = numbers;
                let distortion = Distortion { k1, k2, p1, p2, k3 };
                OpticsProfile {
                    focal_length,
                    focal_length_sigma,
                    sensor_width_mm,
                    principal_point_px,
                    distance_mm,
                    distortion,
                }
            },
        )
    }

    fn board() -> impl Strategy<Value = BoardProfile> {
        (number(), 2_usize..=1000, 2_usize..=1000).prop_map(|(square_mm, columns, rows)| BoardProfile {
            square_mm,
            columns,
            rows,
        })
    }

    fn target() -> impl Strategy<Value = TargetProfile> {
        let print = (board(), option::of(number()))
            .prop_map(|(board, band_distance_mm)| PrintProfile { board, band_distance_mm });
        (option::of(number()), option::of(print))
            .prop_map(|(relief_mm, print)| TargetProfile { relief_mm, print })
    }

    fn faults() -> impl Strategy<Value = SimFaults> {
        (proptest::array::uniform11(number()), any::<usize>()).prop_map(|(numbers, hot_pixels)| {
            let [
                roll_rad,
                pan_rad,
                k1,
                vignetting,
                flicker,
                drift,
                highlight_dn,
                step_error_um,
                bow_mm,
                black_level_dn,
                pixel_gains,
            ] = numbers;
            SimFaults {
                roll_rad,
                pan_rad,
                k1,
                vignetting,
                flicker,
                drift,
                highlight_dn,
                step_error_um,
                bow_mm,
                black_level_dn,
                pixel_gains,
                hot_pixels,
            }
        })
    }

    fn limits_and_sim() -> impl Strategy<Value = (LimitsProfile, SimProfile)> {
        let scene = select(SceneName::ALL.to_vec());
        let numbers = proptest::array::uniform4(number());
        (0_usize..=100, numbers, time(), scene, any::<[u64; 2]>(), any::<bool>(), faults()).prop_map(
            |(
                retakes,
                [saturated, position_mm, shift_px, noise_dn],
                wait,
                scene,
                [seed, texture_seed],
                real_time,
                faults,
            )| {
                let limits = LimitsProfile { retakes, saturated, position_mm, wait, shift_px };
                (limits, SimProfile { scene, noise_dn, seed, texture_seed, real_time, faults })
            },
        )
    }

    proptest! {
        #[test]
        fn a_record_gives_back_what_was_written(
            stage in stage(),
            camera in camera(),
            plan in plan(),
            optics in optics(),
            target in target(),
            board in option::of(board()),
            (limits, sim) in limits_and_sim(),
        ) {
            let profile = Profile { stage, camera, plan, optics, target, board, limits, sim };
            let text = serde_json::to_string_pretty(&profile).unwrap();
            prop_assert_eq!(serde_json::from_str::<Profile>(&text).unwrap(), profile);
        }
    }

    #[test]
    fn a_record_has_units_in_its_names_and_refuses_what_it_does_not_know() {
        let profile = Profile::read(SIM, "sim.toml", &[]).unwrap();
        let text = serde_json::to_string(&profile).unwrap();
        for part in [
            r#""driver":"sim""#,
            r#""travel_mm":200.0"#,
            r#""size":"1024x1024""#,
            r#""patience_s":10.0"#,
            r#""settle_s":0.2"#,
            r#""focal_length":{"mm":25.0}"#,
            r#""saturated":0.01"#,
            r#""wait_s":300.0"#,
            r#""scene":"tile""#,
        ] {
            assert!(text.contains(part), "{part} in {text}");
        }
        for (right, wrong) in [
            (r#""step_mm""#, r#""step_cm""#),
            (r#""target""#, r#""goal""#),
            (r#""settle_s":0.2"#, r#""settle_s":-1.0"#),
            (r#""size":"1024x1024""#, r#""size":"1024""#),
            (r#""bayer":null"#, r#""bayer":"red""#),
        ] {
            assert!(serde_json::from_str::<Profile>(&text.replace(right, wrong)).is_err(), "{wrong}");
        }
    }

    #[test]
    fn a_record_of_before_boards_and_faults_reads_as_if_there_were_none() {
        let profile = Profile::read(SIM, "sim.toml", &[]).unwrap();
        let mut record = serde_json::to_value(&profile).unwrap();
        let mut forget = |section: Option<&str>, field: &str| {
            let fields = match section {
                Some(section) => &mut record[section],
                None => &mut record,
            };
            assert!(fields.as_object_mut().unwrap().remove(field).is_some(), "{field}");
        };
        forget(None, "board");
        forget(Some("plan"), "board");
        forget(Some("optics"), "focal_length_sigma");
        forget(Some("optics"), "distortion");
        forget(Some("target"), "print");
        forget(Some("sim"), "faults");
        assert_eq!(serde_json::from_value::<Profile>(record).unwrap(), profile);
    }
}
