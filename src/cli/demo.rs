//! `epirig demo`.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use serde::Serialize;

use super::evaluate::table;
use super::matching::describe;
use super::need::{close_others, refuse_more_than_there_is};
use super::rig::given;
use super::run::{Existing, examine_shortly, measure_frames};
use super::scan::{Course, Devices, scan};
use super::surface::measure_surface;
use super::{CliError, Talk};
use crate::pipeline::{Frames, Held, Measurement, match_need};
use crate::profile::{Draft, Profile, SIM};
use crate::report::{Chart, MapPicture, Series, ValueRange, Window, side_by_side};
use crate::results::{MatchSummary, ResultsFolder, ResultsKind, SurfaceSummary, names};
use epirig_core::grid::Grid;
use epirig_core::shell::quoted;
use epirig_data::formats::MapFacts;
use epirig_matcher::evaluate::{TruthReport, compare_with_truth};
use epirig_matcher::{MatchOptions, ReferenceFrame};
use epirig_simulator::{Scene, Truth};

#[derive(Debug, Clone, Copy, ValueEnum)]
enum SceneName {
    /// A 15 cm tile with hollows 0.2 mm deep, 1024 px, 101 frames
    Tile,
    /// The edge of a cube, the paper's synthetic experiment, 512 px, 100 frames
    CubeEdge,
}

/// Measure a simulated object from end to end, no hardware needed
///
/// The simulated rig moves the object past a camera; the frames are captured, written, matched and compared
/// with the truth, which only the simulation knows.
#[derive(Debug, Args)]
#[command(
    allow_negative_numbers = true,
    after_help = "Examples:
  epirig demo
  epirig demo --scene cube-edge
  epirig demo --size 512 --noise 1 --out noisy-tile"
)]
pub(super) struct Demo {
    /// Folder of the new sequence and its results [default: epirig-demo, or the first free name of
    /// epirig-demo-2, ...]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// The simulated object
    #[arg(long, value_enum, default_value = "tile")]
    scene: SceneName,
    /// Width and height of the frames, in px [default: 1024 for the tile, 512 for the cube's edge]
    #[arg(long, value_name = "PX", value_parser = clap::value_parser!(u32).range(64..=4096))]
    size: Option<u32>,
    /// Number of frames [default: 101 for the tile, 100 for the cube's edge]
    #[arg(long, value_parser = clap::value_parser!(u32).range(3..=1000))]
    frames: Option<u32>,
    /// Read noise of the simulated sensor, in grey levels of 255
    #[arg(long, value_name = "DN", default_value_t = 0.0)]
    noise: f64,
}

#[derive(Serialize)]
struct DemoOutput<'a> {
    folder: String,
    summary: &'a MatchSummary,
    truth: &'a TruthReport,
    /// The numbers of the surface, if it could be measured.
    surface: Option<&'a SurfaceSummary>,
    true_hollow_depth_mm: Option<f64>,
}

impl Demo {
    pub(super) fn run(self, talk: &Talk) -> Result<(), CliError> {
        let out = self.out.clone().unwrap_or_else(free_folder);
        let profile = self.profile()?;
        self.check_memory(&profile)?;
        let simulator = crate::rig::simulator(crate::rig::simulator_config(&profile)?)?;
        talk.say(&format!(
            "A simulated {}, {1} x {1} px, {2} frames. Everything goes to {3}.",
            match self.scene {
                SceneName::Tile => "tile",
                SceneName::CubeEdge => "edge of a cube",
            },
            simulator.config().optics.columns,
            simulator.config().scan.frames,
            quoted(&out)
        ));
        // The truth serves the comparison below only; the pipeline runs as for any rig.
        // The middle frame, by number: its truth is needed before anything is matched.
        let reference = simulator.config().scan.frames / 2;
        let truth = simulator.truth(reference)?;
        let mut devices = Devices::of(&profile, None, talk)?;
        // The demo may use few pixels or much noise, so the checks before a scan do not stop it.
        examine_shortly(&mut devices, &profile, &out, talk)?;
        scan(devices, &out, Course::New, talk)?;
        let options = MatchOptions { reference: ReferenceFrame::Index(reference), ..MatchOptions::default() };
        let (measurement, results) =
            measure_frames(&profile, (&options, Existing::Refused), &out, Some(&truth.disparity), talk)?;
        write_truth(&out.join("truth"), &truth)?;
        write_comparison(&results, &measurement, &truth, simulator.config().scene.distance_mm())?;
        results.commit()?;

        let summary = &measurement.summary;
        let ends = (summary.tau_before, summary.tau_after);
        let report = compare_with_truth(
            &measurement.maps.disparity,
            Some(&measurement.maps.sigma),
            &truth.disparity,
            ends,
        )?;
        let true_depth_mm = match simulator.config().scene {
            Scene::Tile { hollow_depth_mm, .. } => Some(hollow_depth_mm),
            _ => None,
        };
        let surface = measure_surface(&out, &out.join("results"), None, talk);
        let surface = surface.as_ref();
        let output = DemoOutput {
            folder: out.display().to_string(),
            summary,
            truth: &report,
            surface: surface.map(|(surface, _)| surface),
            true_hollow_depth_mm: true_depth_mm,
        };
        talk.result(&output, || {
            let found = surface.map_or(String::new(), |(surface, page)| {
                format!("{}\nlook at {}\n     and ", surface.conclusion.sentence, quoted(page))
            });
            format!(
                "{}\n{}\n{}{}  (measured beside the truth)\n",
                describe(&measurement),
                table(&report),
                if found.is_empty() { "look at " } else { &found },
                quoted(&out.join("results").join(names::MEASURED_AND_TRUTH)),
            )
        })
    }

    /// Matching needs most memory; truth and frames fit into the same estimate.
    fn check_memory(&self, profile: &Profile) -> Result<(), CliError> {
        let (Some(size), Some(count)) = (profile.camera.size, profile.plan.frames) else { return Ok(()) };
        let need = |count: usize, rows: usize, columns: usize| {
            match_need(
                Frames { count, rows, columns, sample_bytes: 1 },
                &MatchOptions::default(),
                Held::InMemory,
            )
        };
        refuse_more_than_there_is("the demo", need(count, size.rows, size.columns), |available| {
            let smaller = [1024, 768, 512, 384, 256, 128]
                .into_iter()
                .find(|&smaller| smaller < size.rows && need(count, smaller, smaller) <= available.bytes);
            match smaller {
                Some(smaller) => format!("`--size {smaller}` would fit; or {}", close_others(available)),
                None => close_others(available),
            }
        })
    }

    /// The profile of the simulated rig of this demo.
    fn profile(&self) -> Result<Profile, CliError> {
        let (size, frames, travel_mm) = match self.scene {
            SceneName::Tile => (1024, 101, 150.0),
            // The paper's synthetic experiment (section 5.1).
            SceneName::CubeEdge => (512, 100, 40.0),
        };
        let (size, frames) = (self.size.unwrap_or(size), self.frames.unwrap_or(frames));
        let mut settings = vec![
            ("camera.size", format!("{size}x{size}")),
            ("plan.frames", frames.to_string()),
            ("plan.step_mm", (travel_mm / f64::from(frames - 1)).to_string()),
            ("sim.noise_dn", self.noise.to_string()),
            // The simulated lens is exactly as stated.
            ("optics.focal_length_sigma_percent", "0".to_owned()),
        ];
        if let SceneName::CubeEdge = self.scene {
            settings.extend([
                ("sim.scene", "cube-edge".to_owned()),
                ("optics.focal_length_px", (1.6 * f64::from(size)).to_string()),
                ("optics.distance_mm", "500".to_owned()),
            ]);
        }
        let overrides = settings.into_iter().filter_map(|(key, value)| given(key, "demo", Some(value)));
        let profile = Profile::read(SIM, "the simulated rig", &overrides.collect::<Vec<_>>())?;
        // The relief is that of the tile.
        let without = BTreeMap::from([("target.relief".to_owned(), String::new())]);
        Ok(match self.scene {
            SceneName::CubeEdge => Draft::of(&profile).changed(&without).profile()?,
            SceneName::Tile => profile,
        })
    }
}

fn write_truth(folder: &Path, truth: &Truth) -> Result<(), CliError> {
    // The folder is new, so its contents need no kind for replacement.
    let files = ResultsFolder::create(folder, ResultsKind::Match, false)?;
    let plain = MapFacts::default();
    files.write_map("disparity.pfm", &truth.disparity, &plain)?;
    files.write_map("height_mm.tiff", &truth.height_mm, &plain)?;
    files.write_map("visible_frames.tiff", &truth.visible_frames.map(f32::from), &plain)?;
    Ok(files.commit()?)
}

/// Measured and true disparity in the same colours, cut to the object, and a section through the heights.
fn write_comparison(
    results: &ResultsFolder,
    measurement: &Measurement,
    truth: &Truth,
    true_distance_mm: f64,
) -> Result<(), CliError> {
    let range = ValueRange::of(&truth.disparity, 0.05);
    let window = Window::around(&truth.disparity);
    let shown = |map: &Grid<f32>, title: &str| {
        MapPicture::new(map, title, "px", range).within(window.clone()).picture()
    };
    let pictures = side_by_side(&[
        shown(&measurement.maps.disparity, "Disparity, measured")?,
        shown(&truth.disparity, "Disparity, truth")?,
    ]);
    results.write_picture(names::MEASURED_AND_TRUTH, &pictures)?;
    let Some(heights) = &measurement.heights else { return Ok(()) };
    let y = truth.height_mm.rows() / 2;
    // Measured heights are relative to the median distance, true ones to the scene's nearest level.
    let offset = true_distance_mm - heights.distance_mm;
    let line = |name: &str, row: &[f32], offset: f64| {
        let points = row.iter().enumerate().map(|(x, &value)| (x as f64, f64::from(value) + offset));
        Series::line(name, points.collect())
    };
    let chart = Chart {
        title: format!("Height along row {y}"),
        x_label: "column (px)".to_owned(),
        y_label: "height (mm)".to_owned(),
        least_y_span: 0.0,
        series: vec![
            line("measured", heights.height_mm.row(y), offset),
            line("truth", truth.height_mm.row(y), 0.0),
        ],
        ..Chart::default()
    };
    results.write_picture(&format!("{}.png", names::HEIGHT_ALONG_ROW), &chart.picture()?)?;
    results.write(&format!("{}.csv", names::HEIGHT_ALONG_ROW), chart.csv());
    Ok(())
}

fn free_folder() -> PathBuf {
    let names = (1..).map(|number| match number {
        1 => PathBuf::from("epirig-demo"),
        number => PathBuf::from(format!("epirig-demo-{number}")),
    });
    names.into_iter().find(|path| !path.exists()).unwrap_or_default()
}
