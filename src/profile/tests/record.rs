//! A record gives back the profile, bit by bit.

use proptest::prelude::*;
use proptest::sample::select;
use serde_json::{Value as Json, json};

use super::super::schema::SECTIONS;
use super::super::*;
use super::set;
use epirig_core::settings::quantity::{Quantity, Unit};
use epirig_core::settings::{Allowed, Key, Kind};

/// What other keys need, or what decides whether they count.
const FIXED: [&str; 10] = [
    "stage.driver=sim",
    "camera.device=sim",
    "camera.size=1024x768",
    "sim.scene=tile",
    "optics.focal_length=900 px",
    "optics.sensor_width=9 mm",
    "optics.distance=0.9 m",
    "target.relief=0.2 mm",
    "target.bands=2",
    "camera.controls.gain=7",
];

/// Any value of a key, as the command line has it.
fn value(key: &'static Key) -> BoxedStrategy<String> {
    let with_unit = |(number, unit): (f64, Unit)| format!("{number} {}", unit.name);
    match key.kind {
        Kind::Whole(least, most) => (least..=most).prop_map(|number| number.to_string()).boxed(),
        Kind::Number => any::<f64>()
            .prop_filter("JSON knows no others", |number| number.is_finite())
            .prop_map(|number| format!("{number:e}"))
            .boxed(),
        Kind::Flag => any::<bool>().prop_map(|flag| flag.to_string()).boxed(),
        Kind::Measure { unit, allowed: Allowed::UpTo(most), .. } => {
            (0.0..=most, Just(unit)).prop_map(with_unit).boxed()
        }
        Kind::Measure { unit, allowed: Allowed::Within(most), .. } => {
            (-most..=most, Just(unit)).prop_map(with_unit).boxed()
        }
        Kind::Measure { unit, allowed: Allowed::Among(values), .. } => {
            (select(values), Just(unit)).prop_map(with_unit).boxed()
        }
        Kind::Measure { unit, .. } => {
            // A time is at least 1 ns and at most 24 h.
            let range = if unit.quantity == Quantity::Time { 1.0..24.0 } else { 0.01..1e3 };
            (range, select(key.kind.units().collect::<Vec<_>>())).prop_map(with_unit).boxed()
        }
        Kind::Text | Kind::Form { .. } | Kind::Choice(_) => Just(key.example.to_owned()).boxed(),
    }
}

/// A profile with a value for every key that counts with a simulated stage.
fn profile() -> impl Strategy<Value = Profile> {
    let base = Profile::of(&set(&FIXED[..4])).unwrap();
    let is_fixed = |key: &Key| FIXED.iter().any(|text| text.starts_with(&format!("{}=", key.path())));
    let keys = SECTIONS.iter().flat_map(|section| section.keys());
    let keys: Vec<&'static Key> = keys
        .filter(|key| super::super::schema::stage::belongs_to(key, base.stage.driver) && !is_fixed(key))
        .collect();
    let values: Vec<BoxedStrategy<String>> = keys.iter().map(|key| value(key)).collect();
    values.prop_map(move |values| {
        let texts = keys.iter().zip(values).map(|(key, value)| format!("{}={value}", key.path()));
        let texts: Vec<String> = texts.chain(FIXED.map(str::to_owned)).collect();
        Profile::of(&set(&texts.iter().map(String::as_str).collect::<Vec<_>>())).unwrap()
    })
}

fn again(record: &Json) -> Profile {
    let text = serde_json::to_string_pretty(record).unwrap();
    Profile::of_record(&serde_json::from_str(&text).unwrap()).unwrap()
}

proptest! {
    #[test]
    fn a_record_gives_back_what_was_written(profile in profile()) {
        let record = profile.record();
        let back = again(&record);
        prop_assert_eq!(&back, &profile);
        prop_assert_eq!(back.record(), record);
    }
}

#[test]
fn a_record_is_what_a_person_could_have_written() {
    let step = set(&["plan.step_um=1500", "limits.saturated=2 %"]);
    let record = Profile::read(SIM, "sim.toml", &step).unwrap().record();
    for (path, value) in [
        ("/stage/driver", json!("sim")),
        ("/stage/travel", json!("200 mm")),
        ("/camera/size", json!("1024x1024")),
        ("/camera/patience", json!("10 s")),
        ("/plan/step", json!("1500 um")),
        ("/plan/frames", json!(101)),
        ("/optics/focal_length", json!("25 mm")),
        ("/optics/focal_length_sigma", json!("2 %")),
        ("/optics/k1", json!(0.0)),
        ("/limits/saturated", json!("2 %")),
        ("/limits/shift", json!("0.1 px")),
        ("/sim/scene", json!("tile")),
        ("/sim/real_time", json!(false)),
    ] {
        assert_eq!(record.pointer(path), Some(&value), "{path} in {record:#}");
    }
    assert_eq!(record["stage"].get("port"), None, "without effect");
    let real = Profile::of(&[]).unwrap();
    assert_eq!(real.record()["sim"], json!({}), "without effect");
    assert_eq!(again(&real.record()), real);
}

#[test]
fn the_order_of_controls_is_kept() {
    let controls = set(&["camera.controls.mode=1", "camera.controls.gain=auto", "camera.controls.hue=false"]);
    let profile = Profile::of(&controls).unwrap();
    assert_eq!(
        profile.record()["camera"]["controls"],
        json!([["mode", "1"], ["gain", "auto"], ["hue", "false"]])
    );
    assert_eq!(again(&profile.record()).camera.controls, profile.camera.controls);
}

#[test]
fn a_record_with_mistakes_is_refused_as_a_file_is() {
    let record = Profile::read(SIM, "sim.toml", &[]).unwrap().record();
    for (section, key, value, message) in [
        (
            "plan",
            "frames",
            json!(1_000_000),
            "plan.frames = 1000000 is not possible; it must be a whole number from 2 to 100000",
        ),
        (
            "plan",
            "frames",
            json!(null),
            "plan.frames = (null) is not possible; it must be a whole number from 2 to 100000",
        ),
        (
            "plan",
            "start",
            json!("1e300 mm"),
            "plan.start = \"1e300 mm\" is not possible; it must be from -1e9 to 1e9 mm",
        ),
        ("plan", "step", json!(1.5), "plan.step = 1.5 has no unit; write step = \"1.5 mm\" or step_mm = 1.5"),
        ("plan", "stpe", json!("1 mm"), "there is no key plan.stpe; did you mean step?"),
        (
            "camera",
            "size",
            json!("1024"),
            "camera.size = \"1024\" is not possible; it must be COLUMNSxROWS, such as 1280x720",
        ),
        (
            "camera",
            "controls",
            json!(["gain"]),
            "camera.controls is a section; write [camera.controls] and its keys in the lines below it",
        ),
        (
            "limits",
            "shift",
            json!({"px": 1}),
            "limits.shift = (a table) is not possible; it must be a number of pixels greater than 0",
        ),
    ] {
        let mut wrong = record.clone();
        wrong[section][key] = value;
        let error = Profile::of_record(&wrong).unwrap_err();
        assert_eq!(error.to_string(), format!("sequence.json: {message}"));
    }
    let mut wrong = record;
    wrong["goal"] = json!({});
    assert!(Profile::of_record(&wrong).unwrap_err().to_string().contains("no section goal"));
    assert_eq!(Profile::of_record(&json!("text")).unwrap_err().mistakes.len(), 1);
}

#[test]
fn a_recorded_profile_can_be_changed() {
    let recorded = again(&Profile::read(REAL, "real.toml", &[]).unwrap().record());
    let changed = |settings: &[&str]| recorded.clone().changed(&set(settings));
    assert_eq!(changed(&["limits.shift=0.2 px"]).unwrap().limits.shift_px, 0.2);
    assert_eq!(changed(&["plan.dark=3"]).unwrap().plan.dark, 3);
    let one = changed(&["target.bands=1"]).unwrap().target.print().unwrap();
    assert_eq!((one.bands, one.band_distance_mm), (1, 0.0));
    let lens = recorded.clone().of_lens_and_targets().unwrap();
    assert_eq!(
        (&lens.optics, &lens.target, &lens.board),
        (&recorded.optics, &recorded.target, &recorded.board)
    );
    assert_eq!((&lens.sim, &lens.plan), (&SimProfile::default(), &PlanProfile::default()));
    let error = lens.changed(&set(&["target.relief=1 m"])).unwrap_err().to_string();
    assert!(error.starts_with("--set: target.relief = 1 m is not possible: it must be less"), "{error}");
}
