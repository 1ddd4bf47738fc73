//! The page of a measurement whose records are hostile or have gaps.

use serde_json::json;

use super::{CalibrationPart, Maps, Report, Scan};
use crate::report::{Chart, Series};
use crate::results::{Conclusion, FieldSummary, LevelsSummary, MatchSummary, SurfaceSummary};
use epirig_core::grid::Grid;
use epirig_data::sequence::{Event, FrameRecord, SequenceRecord, StopRecord};
use epirig_surface::{
    Budget, Combined, Contribution, Depth, DepthAtMargin, DepthOnPlateaus, Evaluation, Filters, Part,
    Roughness, ScaleSigma, Trend, TrendKind,
};

const HOSTILE: &str = "<script>alert('1')</script><img src=x onerror=alert(2)>&\"";

struct Records {
    record: SequenceRecord,
    frames: Vec<FrameRecord>,
    events: Vec<Event>,
    stop: StopRecord,
    matched: MatchSummary,
    surface: SurfaceSummary,
    profile: Chart,
    map: Grid<f32>,
    used: Grid<u8>,
}

fn from<T: serde::de::DeserializeOwned>(value: serde_json::Value) -> T {
    serde_json::from_value(value).unwrap()
}

fn frame(index: usize) -> serde_json::Value {
    json!({
        "event": "frame", "index": index, "file": format!("frames/{index:04}.png"), "blake3": "00", "bytes": 1,
        "commanded_mm": index, "reported_mm": index as f64 + 0.001, "written": "t", "mean_dn": 100.0, "saturated": 0
    })
}

fn depth(depth_mm: f64) -> Depth {
    Depth {
        depth_mm,
        sigma_mm: Some(0.0008),
        degrees_of_freedom: Some(60.0),
        half_width_95_mm: Some(0.0016),
        scale_sigma_mm: 0.0001,
    }
}

fn budget() -> Budget {
    let part = |name, evaluation, sigma_mm, share| Contribution { name, evaluation, sigma_mm, share };
    Budget {
        contributions: vec![
            part("scatter between independent parts of the field", Evaluation::A, Some(0.0008), Some(0.64)),
            part("walls: other margins", Evaluation::B, Some(0.0006), Some(0.36)),
            part("scale: length of the baseline", Evaluation::B, None, None),
        ],
        combined: Some(Combined {
            sigma_mm: 0.001,
            degrees_of_freedom: 146.0,
            coverage_factor: 1.976,
            half_width_95_mm: 0.00198,
        }),
    }
}

fn rough() -> Roughness {
    Roughness {
        sa_mm: 0.01,
        sq_mm: 0.02,
        sz_mm: f64::NAN,
        ssk: 0.0,
        sku: 3.0,
        sq_noise_mm: Some(0.01),
        sq_without_noise_mm: Some(0.01),
        pixels: 100,
    }
}

impl Records {
    fn new() -> Self {
        let retake = json!({"event": "retake", "index": 1, "attempt": 1, "reason": HOSTILE, "at": "t"});
        let resumed = json!({"event": "resumed", "after": HOSTILE, "at": "t"});
        let settings = json!({
            "method": "variance", "window_px": 3, "search": "factorised", "quick": false, "semi_global": false,
            "interpolation": "linear", "range": null, "disparity_step_px": 0.5, "reference": "middle", "min_visible": 0.5,
            "occlusion": "auto", "ordering_constraint": "auto", "fit": true, "wanted_sigma_px": 0.003,
            "max_sigma_px": 1.0, "min_confidence": 0.1
        });
        Self {
            record: from(json!({
                "format": 2, "uid": "uid-1", "program": HOSTILE, "created": "2026-01-02T03:04:05Z",
                "origin": {
                    "kind": "captured", "stage": HOSTILE, "stage_settings": {(HOSTILE): 1.0}, "camera": HOSTILE,
                    "configuration": {
                        "format": "GREY", "columns": 8, "rows": 8, "exposure_us": 10000.0, "controls": {(HOSTILE): 3}, "averaged": 1
                    }
                },
                "rows": 8, "columns": 8, "bit_depth": 8, "frames": 3, "positions_mm": [0.0, 1.0, 2.0], "intrinsics": null
            })),
            frames: (0..2).map(|index| from(frame(index))).collect(),
            events: [frame(0), retake, resumed, frame(1)].map(from).to_vec(),
            stop: from(json!({
                "format": 2, "exit_status": "not-closed", "frames": 2, "reason": HOSTILE, "stopped": "t",
                "closure": {
                    "home_shift_mm": -0.5,
                    "comparison": {"frame": 0, "x_px": 2e-7, "y_px": -0.00123, "sigma_px": 7.8e-5, "light": 1.0}
                }
            })),
            matched: from(json!({
                "format": 3, "program": "epirig 0", "sequence_uid": "uid-1", "frames_blake3": "ef56", "scan_ended": "not-closed", "positions": "stage",
                "settings": settings, "reference": 1, "tau_before": 0.5, "tau_after": 0.5, "minimum_px": -1.0,
                "maximum_px": 1.0, "range_found": true, "ordering_constraint": "on", "order_violations": 0,
                "answered": 0.999, "leaves_image": 0.0, "beyond_range": 0.0, "no_texture": 0.001, "ambiguous": 0.0,
                "occluded": 0.0, "median_disparity_px": 400.0, "median_sigma_px": 0.01, "seconds": 1.0
            })),
            surface: SurfaceSummary {
                format: 5,
                program: "epirig 0".to_owned(),
                sequence_uid: "uid-1".to_owned(),
                matched_blake3: "cd34".to_owned(),
                conclusion: Conclusion {
                    sentence: "hollows 0.2004 mm +- 0.0020 mm deep (95 % coverage)".to_owned(),
                    depth: Some("0.2004 mm +- 0.0020 mm".to_owned()),
                    planned_mm: Some(0.25),
                    as_planned: Some(false),
                    verdict: None,
                    verdict_sentence: None,
                },
                conformity: None,
                scan_ended: "not-closed".to_owned(),
                distance_mm: 900.0,
                pixel_mm: 0.3,
                origin_px: (3.5, 3.5),
                scale_sigma: ScaleSigma { focal_length: Some(0.02), baseline: None },
                field: FieldSummary {
                    region: None,
                    mask: None,
                    answered_px: 64,
                    target_px: 0,
                    used_px: 60,
                    uncertain_px: 1,
                    apart_px: 1,
                    rim_px: 2,
                    outlier_px: 1,
                },
                trend: Trend {
                    kind: TrendKind::Quadric,
                    centre_mm: (0.0, 0.0),
                    coefficients: vec![0.0; 6],
                    sigmas: vec![None; 6],
                    pixels: 60,
                    outliers: 0,
                    half_extent_mm: (1.0, 1.0),
                },
                tilt_deg: (0.1, -0.1),
                bow_mm: 0.2,
                levels: Some(LevelsSummary {
                    by_halves: true,
                    depth: depth(0.200_412_3),
                    budget: budget(),
                    raised: false,
                    margin_px: 3,
                    by_margin: vec![DepthAtMargin {
                        margin_px: 3,
                        depth_mm: 0.2,
                        sigma_mm: None,
                        half_width_95_mm: None,
                        used_px: 60,
                    }],
                    on_plateaus: Some(DepthOnPlateaus { depth: depth(0.199), width_px: 12.0, used_px: 30 }),
                    wall_width_mm: Some(0.9),
                    correlation_reach_px: 4,
                    roughness: None,
                    upper: None,
                    lower: None,
                    parts: vec![Part {
                        centre_x_px: 3.0,
                        centre_y_px: 4.0,
                        area_px: 20,
                        area_mm2: 1.8,
                        used_px: 10,
                        depth: depth(0.201),
                    }],
                }),
                no_levels: None,
                filters: Filters::default(),
                roughness: rough(),
            },
            profile: Chart {
                title: "Height after removal of the form".to_owned(),
                series: vec![Series::line("height", vec![(0.0, 0.0), (1.0, f64::NAN), (2.0, 1.0)])],
                ..Chart::default()
            },
            map: Grid::from_values(
                8,
                8,
                (0..64).map(|index| if index % 9 == 0 { f32::NAN } else { index as f32 }).collect(),
            )
            .unwrap(),
            used: Grid::filled(8, 8, 255),
        }
    }

    fn report(&self) -> Report<'_> {
        Report {
            name: HOSTILE.to_owned(),
            made: "2026-01-02T03:04:06Z".to_owned(),
            stated: vec![("customer".to_owned(), HOSTILE)],
            logo: None,
            scan: Scan {
                record: &self.record,
                frames: &self.frames,
                events: &self.events,
                stop: Some(&self.stop),
                end_in_words: Some(format!("positions are wrong ({HOSTILE})")),
            },
            matched: &self.matched,
            map_hashes: vec![("disparity.tiff", "ab12".to_owned())],
            calibration: None,
            surface: &self.surface,
            profile: &self.profile,
            maps: Maps {
                photograph: None,
                matched_frame: Some(&self.map),
                rest_mm: &self.map,
                sigma_mm: &self.map,
                disparity_px: &self.map,
                used: &self.used,
            },
        }
    }
}

/// The text that a person reads, without markup.
fn read(html: &str) -> String {
    let mut text = String::new();
    let mut outside = true;
    for letter in html.chars() {
        match letter {
            '<' => {
                outside = false;
                text.push(' ');
            }
            '>' => outside = true,
            letter if outside => text.push(letter),
            _ => {}
        }
    }
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

#[test]
fn hostile_records_stay_text() {
    let records = Records::new();
    let html = records.report().html().unwrap();
    assert!(!html.contains("<script") && !html.contains("<img src=x"), "{html}");
    // In heading, title, stage, camera, control, version, retake, interruption, end.
    assert!(html.matches("&lt;script&gt;alert('1')").count() >= 9);
}

#[test]
fn the_verdict_names_depth_interval_and_a_scan_that_is_not_closed() {
    let records = Records::new();
    let html = records.report().html().unwrap();
    let text = read(&html);
    let verdict = "Hollows 0.2004 mm \u{b1} 0.0020 mm deep (95 % coverage). Warning";
    assert!(text.contains(verdict), "{text}");
    let row = "depth of the hollows 0.2004 mm \u{b1} 0.0020 mm (95 % coverage, k = 1.98)";
    assert!(text.contains(row), "{text}");
    assert!(text.contains("planned 0.25 mm, outside of the interval"), "{text}");
    // 2 % of 900 mm are 18 mm.
    assert!(text.contains("distance 900 mm, standard uncertainty 18 mm"), "{text}");
    assert!(
        text.contains("Scale: known to 2.0 % (standard uncertainty), baseline taken as exact."),
        "{text}"
    );
    assert!(html.contains("<data value=\"0.2004123\">"));
    assert!(text.contains("Warning: positions are wrong") && text.contains("(recorded as not-closed)"));
    assert!(html.contains("class=\"bad\""));
    for sentence in ["positions are wrong", "uid-1", "ab12", "0.0008", "disparity_step_px 0.5"] {
        assert!(text.contains(sentence), "{sentence}: {text}");
    }
}

#[test]
fn numbers_end_where_their_uncertainty_ends() {
    let html = Records::new().report().html().unwrap();
    let text = read(&html);
    let moved = "moved along x by 0 px, standard uncertainty 0.000078 px; along y by \u{2212}0.001230 px, standard \
                 uncertainty 0.000078 px; light 100.0 % of before";
    for wanted in [moved, "home found again at \u{2212}0.50 mm", "exposure 10.0 ms"] {
        assert!(text.contains(wanted), "{wanted}: {text}");
    }
    // The sign between a value and its uncertainty stands for 95 % coverage alone.
    assert_eq!(text.matches('\u{b1}').count(), 6, "{text}");
    assert!(html.contains("@top-left { content: \"Surface report\\3a "), "{html}");
}

#[test]
fn what_is_not_known_is_said_and_never_a_number() {
    let mut records = Records::new();
    let levels = records.surface.levels.as_mut().unwrap();
    levels.depth = Depth { sigma_mm: None, degrees_of_freedom: None, half_width_95_mm: None, ..levels.depth };
    levels.budget.combined = None;
    let html = records.report().html().unwrap();
    let text = read(&html);
    assert!(text.contains("0.200 mm, uncertainty unknown (too few independent parts)"), "{text}");
    assert!(text.contains("there is no combined uncertainty"), "{text}");
    assert!(text.contains("unknown") && !text.contains("NaN") && !text.contains(" inf "), "{text}");
    records.surface.levels = None;
    records.surface.no_levels = Some("the heights have one level".to_owned());
    let text = read(&records.report().html().unwrap());
    assert!(text.contains("There is no step height: the heights have one level."), "{text}");
}

#[test]
fn heights_that_sigma_does_not_explain_are_a_note() {
    let mut records = Records::new();
    for (sq_mm, sq_noise_mm, noted) in
        [(0.05, Some(0.026), false), (0.05, Some(0.024), true), (0.05, None, false)]
    {
        let levels = records.surface.levels.as_mut().unwrap();
        levels.roughness = Some(Roughness { sq_mm, sq_noise_mm, ..rough() });
        let text = read(&records.report().html().unwrap());
        assert_eq!(
            text.contains("Note: heights lie 0.0500 mm off their levels"),
            noted,
            "{sq_noise_mm:?}: {text}"
        );
    }
}

#[test]
fn a_calibration_tells_what_it_did_not_correct() {
    let records = Records::new();
    let mut found = crate::report::calibration::tests::bare().calibration;
    found.notes = vec![HOSTILE.to_owned()];
    let mut png = std::io::Cursor::new(Vec::new());
    image::RgbImage::new(2, 2).write_to(&mut png, image::ImageFormat::Png).unwrap();
    let pictures = ["rows", "other"].map(|name| (name.to_owned(), png.get_ref().clone()));
    let part = CalibrationPart { record: &found, pictures: pictures.to_vec() };
    let report = Report { calibration: Some(part), ..records.report() };
    let html = report.html().unwrap();
    let text = read(&html);
    assert!(text.contains("brightness of the frames not measured not corrected: switched off"), "{text}");
    // The picture that has no name here is not shown.
    let shown = html.matches("alt=\"Chart of the distance of every corner from its row").count();
    assert_eq!((shown, html.matches("class=\"chart\"").count()), (1, 4));
    assert!(!html.contains("<script"));
}
