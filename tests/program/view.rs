//! `epirig view`: what the browser is told is what is on disk.

use std::fs;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::path::Path;
use std::process::{Command, Stdio};

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use epirig::panel::CurrentResults;
use epirig::results::{ResultsKind, read_map};
use epirig_core::grid::Grid;
use epirig_data::formats::MapFormat;
use epirig_data::sequence::{Sequence, decode_grey};
use epirig_server::{Query, RefusalKind, Reply, Site};
use epirig_simulator::{Simulator, SimulatorConfig};
use serde_json::{Value, json};

use crate::small_rig;
use crate::support::{epirig, names, succeeds, write_png};

const COLUMNS: usize = 128;
const ROWS: usize = 64;

/// A match of a small plane, with heights.
pub(crate) fn matched(folder: &Path) {
    fs::create_dir(folder.join("photos")).unwrap();
    let simulator = Simulator::new(SimulatorConfig::textured_plane(COLUMNS, ROWS, 9)).unwrap();
    for (index, &position) in simulator.config().scan.positions_mm().iter().enumerate() {
        write_png(&folder.join(format!("photos/{index}.png")), &simulator.expose(position, index as u32));
    }
    let scale = ["--step-mm", "2", "--focal-length-px", "500"];
    succeeds(folder, &[&["import", "photos", "--out", "seq"], &scale[..]].concat());
    succeeds(folder, &["match", "seq"]);
}

fn get(view: &CurrentResults, path: &str) -> Reply {
    let (path, query) = path.split_once('?').unwrap_or((path, ""));
    let parts: Vec<&str> = path.split('/').collect();
    view.get(&parts, &Query::parse(query)).unwrap_or_else(|refusal| panic!("{path}: {}", refusal.message))
}

fn refused(view: &CurrentResults, path: &str) -> RefusalKind {
    let (path, query) = path.split_once('?').unwrap_or((path, ""));
    let parts: Vec<&str> = path.split('/').collect();
    view.get(&parts, &Query::parse(query)).expect_err(path).kind
}

fn json(reply: &Reply) -> Value {
    serde_json::from_slice(&reply.bytes).unwrap()
}

fn numbers(bytes: &[u8]) -> Vec<f32> {
    bytes.chunks_exact(4).map(|four| f32::from_le_bytes(four.try_into().unwrap())).collect()
}

/// The record and the numbers of a framed reply.
fn framed(reply: &Reply) -> (Value, Vec<f32>) {
    let length = u32::from_le_bytes(reply.bytes[..4].try_into().unwrap()) as usize;
    (serde_json::from_slice(&reply.bytes[4..4 + length]).unwrap(), numbers(&reply.bytes[4 + length..]))
}

fn copy(from: &Path, to: &Path) {
    fs::create_dir(to).unwrap();
    for entry in fs::read_dir(from).unwrap().map(Result::unwrap) {
        let target = to.join(entry.file_name());
        if entry.file_type().unwrap().is_dir() {
            copy(&entry.path(), &target);
        } else {
            fs::copy(entry.path(), target).unwrap();
        }
    }
}

#[test]
fn maps_pixels_and_epis_are_those_on_disk() {
    let folder = tempfile::tempdir().unwrap();
    matched(folder.path());
    let seq = folder.path().join("seq");
    let before = names(&seq);
    let view = CurrentResults::open(&seq, None).unwrap();
    let facts = json(&get(&view, "results"));
    assert_eq!(facts["sequence"]["frames"], 9);
    let ids: Vec<&str> =
        facts["maps"].as_array().unwrap().iter().map(|map| map["id"].as_str().unwrap()).collect();
    assert_eq!(ids, ["height", "height-sigma", "disparity", "sigma", "confidence", "cost", "mask"]);

    let disparity = read_map(&seq.join("results/disparity.tiff")).unwrap();
    let tile = numbers(&get(&view, "maps/disparity/0/0/0").bytes);
    let (x, y) = (20, 11);
    assert_eq!(tile[y * 256 + x], disparity.at(x, y));
    assert!(tile[y * 256 + COLUMNS].is_nan() && tile[ROWS * 256].is_nan());

    // The EPI is the row of each frame as its file has it.
    let (pixel, epi) = framed(&get(&view, &format!("pixel?x={x}&y={y}")));
    let columns = pixel["columns"].as_u64().unwrap() as usize;
    let first = pixel["epi"]["first_column"].as_u64().unwrap() as usize;
    assert_eq!(epi.len(), 9 * columns);
    for (t, record) in Sequence::open(&seq).unwrap().frames().iter().enumerate() {
        let frame = decode_grey(&fs::read(seq.join(&record.file)).unwrap()).unwrap().frame;
        let mut row = vec![0.0; COLUMNS];
        frame.samples().copy_to_f32(y * COLUMNS, &mut row);
        assert_eq!(epi[t * columns..(t + 1) * columns], row[first..first + columns], "frame {t}");
    }
    // The line is that of the disparity, and the lowest cost lies within a candidate of it.
    let found = f64::from(disparity.at(x, y));
    assert_eq!(pixel["line"]["disparity_px"].as_f64(), Some(found));
    assert_eq!(pixel["cost"]["chosen_px"].as_f64(), Some(found));
    let list = |name: &str| -> Vec<f64> {
        pixel["cost"][name]
            .as_array()
            .unwrap()
            .iter()
            .map(|value| value.as_f64().unwrap_or(f64::NAN))
            .collect()
    };
    let (candidates, costs) = (list("disparity_px"), list("cost"));
    let best =
        (0..costs.len()).filter(|&k| costs[k].is_finite()).min_by(|&a, &b| costs[a].total_cmp(&costs[b]));
    assert!((candidates[best.unwrap()] - found).abs() <= 0.5, "{candidates:?} {costs:?} {found}");
    // Along its line a point keeps its intensity.
    let along = pixel["intensity"]["along"].as_array().unwrap();
    assert_eq!(along.len(), 9);

    for (path, kind) in [
        ("maps/none/0/0/0", RefusalKind::NotFound),
        ("maps/disparity/0/0/1", RefusalKind::NotFound),
        ("maps/disparity/0/x/0", RefusalKind::Wrong),
        ("pixel?x=128&y=0", RefusalKind::NotFound),
        ("pixel?x=-1&y=0", RefusalKind::Wrong),
        ("pixel", RefusalKind::Wrong),
        ("frames/9/0/0/0", RefusalKind::NotFound),
        ("frames/0/0/0/0?kind=rectified", RefusalKind::NotFound),
        ("row-cost?y=64", RefusalKind::NotFound),
        ("line?x0=0&y0=0&x1=140&y1=0&width=1", RefusalKind::Wrong),
        ("line?x0=0&y0=0&x1=9&y1=0&width=0", RefusalKind::Wrong),
        ("line?x0=nan&y0=0&x1=9&y1=0&width=1", RefusalKind::Wrong),
        ("mesh?most=many", RefusalKind::Wrong),
        ("region?map=height&x0=0&y0=0&x1=129&y1=9", RefusalKind::Wrong),
        ("region?map=disparity&x0=0&y0=0&x1=9&y1=9", RefusalKind::NotFound),
        ("levelled?map=disparity&levelled_by=region-0-0-9-9", RefusalKind::NotFound),
        ("levelled?map=height&levelled_by=region-0-0-9-1", RefusalKind::Wrong),
        ("levelled?map=height&levelled_by=points-9-9-20-20-31-31", RefusalKind::Wrong),
        ("maps/height/0/0/0?levelled_by=points-9-9", RefusalKind::Wrong),
        ("compare?with=../seq/results&map=height", RefusalKind::NotFound),
        ("download/../sequence.json", RefusalKind::NotFound),
        ("download/surface/../match.json", RefusalKind::NotFound),
        ("calibration/../../x.png", RefusalKind::NotFound),
        ("", RefusalKind::NotFound),
    ] {
        assert_eq!(refused(&view, path), kind, "{path}");
    }
    assert_eq!(
        get(&view, "download/disparity.tiff").bytes,
        fs::read(seq.join("results/disparity.tiff")).unwrap()
    );
    // Nothing was added or left.
    assert_eq!(names(&seq), before);
}

#[test]
fn levelled_heights_are_those_of_the_file_less_a_plane() {
    let folder = tempfile::tempdir().unwrap();
    matched(folder.path());
    let seq = folder.path().join("seq");
    let view = CurrentResults::open(&seq, None).unwrap();
    let height = read_map(&seq.join("results/height_mm.tiff")).unwrap();
    let mean =
        |values: &dyn Fn(usize, usize) -> f32, x: std::ops::Range<usize>, y: std::ops::Range<usize>| {
            let all: Vec<f64> = y
                .flat_map(|y| x.clone().map(move |x| (x, y)))
                .map(|(x, y)| f64::from(values(x, y)))
                .filter(|value| value.is_finite())
                .collect();
            (all.iter().sum::<f64>() / all.len() as f64, all.len())
        };
    let number = |value: &Value, name: &str| value[name].as_f64().unwrap();

    let region = "region?map=height&x0=20&y0=10&x1=90&y1=50";
    let plain = json(&get(&view, region));
    let (mean_mm, count) = mean(&|x, y| height.at(x, y), 20..90, 10..50);
    assert!((number(&plain, "mean_mm") - mean_mm).abs() < 1e-6);
    assert_eq!(plain["pixels"], 70 * 40);
    assert_eq!(plain["roughness"]["pixels"], count);
    let levelled = json(&get(&view, &format!("{region}&levelled_by=region-20-10-90-50")));
    for (name, by) in [("mean_mm", 1e-5), ("tilt_x_mrad", 1e-2), ("tilt_y_mrad", 1e-2)] {
        assert!(number(&levelled, name).abs() < by, "{name}: {levelled}");
    }
    let told = json(&get(&view, "levelled?map=height&levelled_by=region-20-10-90-50"));
    for name in ["tilt_x_mrad", "tilt_y_mrad"] {
        assert!((number(&told, name) - number(&plain, name)).abs() < 1e-6, "{name}: {told}");
    }
    // Roughness is about the least-squares plane, whether or not it was taken away before.
    let sq = |of: &Value| of["roughness"]["sq_mm"].as_f64().unwrap();
    assert!((sq(&levelled) - sq(&plain)).abs() < 1e-5);

    // Three points are level afterwards; each stands for the mean of 5 x 5 px.
    let by = "levelled_by=points-30-20-80-25-50-50";
    let tile = numbers(&get(&view, &format!("maps/height/0/0/0?{by}")).bytes);
    for (x, y) in [(30, 20), (80, 25), (50, 50)] {
        let (rest, _) = mean(&|x, y| tile[y * 256 + x], x - 2..x + 3, y - 2..y + 3);
        assert!(rest.abs() < 1e-5, "({x}, {y}): {rest}");
    }
    // Whatever is asked tells the same heights.
    let at = |x: usize, y: usize| f64::from(tile[y * 256 + x]);
    let value = json(&get(&view, &format!("value?map=height&x=40&y=30&{by}")));
    assert!((number(&value, "value") - at(40, 30)).abs() < 1e-6);
    let (pixel, _) = framed(&get(&view, &format!("pixel?x=40&y=30&{by}")));
    assert_eq!(pixel["values"][0]["id"], "height");
    assert!((number(&pixel["values"][0], "value") - at(40, 30)).abs() < 1e-6);
    let line = json(&get(&view, &format!("line?x0=40&y0=30&x1=60&y1=30&width=1&{by}")));
    assert!((number(&line["points"][20], "height_mm") - at(60, 30)).abs() < 1e-6);
    let (mesh, values) = framed(&get(&view, &format!("mesh?most=100000&map=height&{by}")));
    assert_eq!(mesh["step"], 1);
    assert_eq!(values[30 * COLUMNS + 40], tile[30 * 256 + 40]);
}

#[test]
fn a_match_is_shown_whatever_is_wrong_with_its_surface() {
    let folder = tempfile::tempdir().unwrap();
    matched(folder.path());
    succeeds(folder.path(), &["surface", "seq"]);
    let surface = folder.path().join("seq/results/surface");
    let facts = || json(&get(&CurrentResults::open(&folder.path().join("seq"), None).unwrap(), "results"));
    assert!(facts()["surface"].is_object() && facts()["unfit"].is_null());
    let text = fs::read_to_string(surface.join("surface.json")).unwrap();
    let foreign = text.replacen("\"matched_blake3\": \"", "\"matched_blake3\": \"0", 1);
    let format = ResultsKind::Surface.format();
    let older = format!("format version {}", format - 1);
    let former = text.replacen(&format!("\"format\": {format}"), &format!("\"format\": {}", format - 1), 1);
    assert!(foreign != text && former != text);
    for (record, why) in [(foreign, "of other results"), (former, older.as_str()), (String::new(), "line")] {
        fs::write(surface.join("surface.json"), record).unwrap();
        let facts = facts();
        assert!(facts["results"].is_object() && facts["surface"].is_null(), "{facts:#}");
        let unfit = facts["unfit"].as_str().unwrap();
        assert!(unfit.starts_with("the surface is not shown: ") && unfit.contains(why), "{unfit}");
        assert!(facts["maps"].as_array().unwrap().iter().any(|map| map["id"] == "disparity"));
    }
    fs::write(surface.join("surface.json"), text).unwrap();
    fs::write(surface.join("height_mm.tiff"), "no map").unwrap();
    assert!(facts()["unfit"].as_str().unwrap().contains("changed"), "{}", facts()["unfit"]);
}

#[test]
fn a_region_and_a_line_have_the_answers_of_the_command() {
    let folder = tempfile::tempdir().unwrap();
    matched(folder.path());
    let view = CurrentResults::open(&folder.path().join("seq"), None).unwrap();
    // A region of the page ends before its second corner.
    let asked = json!({ "region": [10, 4, 111, 61], "trend": "plane" });
    let found = json(&view.post(&["surface"], &asked).unwrap());
    let region =
        ["--region", "10,4,110,60", "--trend", "plane", "--profile", "12,8,40,16", "--profile-width", "3"];
    let told = succeeds(folder.path(), &[&["surface", "seq", "--json"], &region[..]].concat());
    let told: Value = serde_json::from_str(&told).unwrap();
    assert_eq!(found, told);

    // With a mask, as a file that the page sends.
    let (columns, rows) = (128, 64);
    let inside = |x: u32, y: u32| image::Luma([if x + y < 110 { 255 } else { 0 }]);
    let part = image::GrayImage::from_fn(columns, rows, inside);
    part.save(folder.path().join("part.png")).unwrap();
    image::GrayImage::new(columns, rows).save(folder.path().join("black.png")).unwrap();
    image::GrayImage::new(9, 9).save(folder.path().join("small.png")).unwrap();
    fs::write(folder.path().join("words.png"), "white").unwrap();
    let with = |name: &str, region: Value| {
        let base64 = STANDARD.encode(fs::read(folder.path().join(name)).unwrap());
        let mask = json!({ "name": name, "base64": base64 });
        view.post(&["surface"], &json!({ "region": region, "mask": mask, "trend": "plane" }))
    };
    let found = json(&with("part.png", Value::Null).unwrap());
    assert_eq!(found["field"]["mask"]["file"], "part.png");
    let masked = ["surface", "seq", "--overwrite", "--json", "--trend", "plane", "--mask", "part.png"];
    let told: Value = serde_json::from_str(&succeeds(folder.path(), &masked)).unwrap();
    assert_eq!(found, told);
    // What cannot be used is refused in the command's words.
    for (name, page, command) in [
        ("black.png", Value::Null, &[][..]),
        ("small.png", Value::Null, &[]),
        ("words.png", Value::Null, &[]),
        ("part.png", json!([120, 60, 128, 64]), &["--region", "120,60,127,63"]),
    ] {
        let refusal = with(name, page).expect_err("no mask");
        assert_eq!(refusal.kind, RefusalKind::Wrong, "{name}");
        let arguments = [&["surface", "seq", "--overwrite", "--json", "--mask", name], command].concat();
        let output = epirig(folder.path(), &arguments);
        let told: Value = serde_json::from_slice(&output.stdout).unwrap();
        assert_eq!(told["error"]["message"], refusal.message, "{name}");
    }
    let text = json!({ "mask": { "name": "part.png", "base64": "*" } });
    assert_eq!(view.post(&["surface"], &text).expect_err("wrong").kind, RefusalKind::Wrong);
    succeeds(folder.path(), &[&["surface", "seq", "--overwrite"], &region[..]].concat());

    // The same line over the surface that the command has written now.
    let view = CurrentResults::open(&folder.path().join("seq"), None).unwrap();
    let csv = get(&view, "line.csv?x0=12&y0=8&x1=40&y1=16&width=3").bytes;
    let written = fs::read(folder.path().join("seq/results/surface/profile.csv")).unwrap();
    assert_eq!(String::from_utf8(csv).unwrap(), String::from_utf8(written).unwrap());
    for wrong in
        [json!({ "region": [0, 0, 900, 3] }), json!({ "trend": "quartic" }), json!([1]), json!({ "x": 1 })]
    {
        assert_eq!(view.post(&["surface"], &wrong).expect_err("wrong").kind, RefusalKind::Wrong, "{wrong}");
    }
}

#[test]
fn rectified_frames_are_shown_as_they_were_matched() {
    let folder = tempfile::tempdir().unwrap();
    let seq = folder.path().join("seq");
    copy(&small_rig::scan().join("seq"), &seq);
    succeeds(folder.path(), &["calibrate", "seq"]);
    succeeds(folder.path(), &["match", "seq", "--range", "150..260", "--quick"]);
    succeeds(
        folder.path(),
        &["match", "seq", "--range", "150..260", "--quick", "--method", "normalised", "--out", "seq/other"],
    );
    let view = CurrentResults::open(&seq, None).unwrap();
    let facts = json(&get(&view, "results"));
    assert_eq!(facts["frames"]["kinds"], json!(["raw", "rectified"]));
    assert_eq!(facts["others"], json!(["other"]));
    let (x, y) = (100, 90);
    let (pixel, epi) = framed(&get(&view, &format!("pixel?x={x}&y={y}")));
    let columns = pixel["columns"].as_u64().unwrap() as usize;
    let first = pixel["epi"]["first_column"].as_u64().unwrap() as usize;
    for t in [0, 4, 8] {
        let tile = numbers(&get(&view, &format!("frames/{t}/0/0/0?kind=rectified")).bytes);
        let row = &tile[y * 256 + first..y * 256 + first + columns];
        // The EPI has the frame's gain besides: one factor for the whole row.
        let of_epi = &epi[t * columns..(t + 1) * columns];
        let gain = of_epi.iter().sum::<f32>() / row.iter().sum::<f32>();
        assert!((gain - 1.0).abs() < 0.1, "{gain}");
        // A count is 1/128 DN.
        assert!(row.iter().zip(of_epi).all(|(a, b)| (a * gain - b).abs() < 0.05), "frame {t}");
    }
    let (compared, values) = framed(&get(&view, "compare?with=other&map=height"));
    assert_eq!(
        values.len() as u64,
        2 * compared["rows"].as_u64().unwrap() * compared["columns"].as_u64().unwrap()
    );
    let stage = json(&get(&view, "stage"));
    assert_eq!(stage["frames"].as_array().unwrap().len(), 9);
    assert!(stage["frames"][4]["measured_error_px"].is_number(), "{stage}");
    let figures = json(&get(&view, "calibration"));
    let name = figures["figures"][0]["name"].as_str().unwrap();
    assert!(get(&view, &format!("calibration/{name}.png")).bytes.starts_with(b"\x89PNG"));
}

#[test]
fn a_damaged_frame_is_told_and_the_maps_are_still_shown() {
    let folder = tempfile::tempdir().unwrap();
    matched(folder.path());
    let seq = folder.path().join("seq");
    let frame = Sequence::open(&seq).unwrap().frames()[3].file.clone();
    fs::write(seq.join(&frame), "damaged").unwrap();
    let view = CurrentResults::open(&seq, None).unwrap();
    assert!(!get(&view, "maps/disparity/0/0/0").bytes.is_empty());
    let refusal = view.get(&["pixel"], &Query::parse("x=9&y=9")).expect_err("damaged");
    assert!(refusal.message.contains(&frame), "{}", refusal.message);
}

#[test]
fn a_page_of_former_results_is_told_so() {
    let folder = tempfile::tempdir().unwrap();
    matched(folder.path());
    let view = CurrentResults::open(&folder.path().join("seq"), None).unwrap();
    let id = |view: &CurrentResults| json(&get(view, "about"))["results"].as_str().unwrap().to_owned();
    let tile = "maps/disparity/0/0/0";
    let (former, former_tile) = (id(&view), get(&view, tile).bytes);
    assert_eq!(json(&get(&view, "results"))["id"], former.as_str());
    let of = |id: &str, path: &str| format!("{path}{}of={id}", if path.contains('?') { '&' } else { '?' });
    let all = [tile, "pixel?x=40&y=30", "downloads", "download/disparity.tiff", "frames/0/0/0/0?kind=raw"];
    all.iter().for_each(|path| drop(get(&view, &of(&former, path))));

    succeeds(folder.path(), &["match", "seq", "--method", "normalised", "--overwrite"]);
    let now = id(&view);
    assert_ne!(now, former);
    for path in all {
        assert_eq!(refused(&view, &of(&former, path)), RefusalKind::Outdated, "{path}");
        get(&view, &of(&now, path));
    }
    let asked = json!({ "region": [2, 2, 30, 30], "of": former });
    assert_eq!(view.post(&["surface"], &asked).expect_err("outdated").kind, RefusalKind::Outdated);
    // Maps and files are those of the same match.
    let disparity = read_map(&folder.path().join("seq/results/disparity.tiff")).unwrap();
    let shown = numbers(&get(&view, tile).bytes);
    let is_same = |(a, b): (&f32, &f32)| a == b || (a.is_nan() && b.is_nan());
    assert!(shown[..COLUMNS].iter().zip(disparity.row(0)).all(is_same));
    assert_ne!(get(&view, tile).bytes, former_tile);
    // An analysis of the surface adds files and facts.
    succeeds(folder.path(), &["surface", "seq"]);
    assert_ne!(id(&view), now);
    // A file that has gone since the page listed it is not there.
    fs::remove_file(folder.path().join("seq/results/cost.tiff")).unwrap();
    assert_eq!(refused(&view, "download/cost.tiff"), RefusalKind::NotFound);
}

/// Starts the program, asks it over its link, and interrupts it.
#[test]
#[cfg(unix)]
fn the_link_is_printed_and_an_interruption_ends_it() {
    let folder = tempfile::tempdir().unwrap();
    matched(folder.path());
    let mut program = Command::new(assert_cmd::cargo::cargo_bin!("epirig"))
        .args(["view", "seq"])
        .current_dir(folder.path())
        .stdout(Stdio::piped())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let mut link = String::new();
    BufReader::new(program.stdout.take().unwrap()).read_line(&mut link).unwrap();
    let (address, token) = link.trim().strip_prefix("http://").unwrap().split_once("/#token=").unwrap();
    assert_eq!(token.len(), 32);
    let mut stream = TcpStream::connect(address).unwrap();
    let request = format!("GET /api/about HTTP/1.1\r\nHost: {address}\r\nConnection: close\r\n\r\n");
    stream.write_all(request.as_bytes()).unwrap();
    let mut answer = String::new();
    stream.read_to_string(&mut answer).unwrap();
    assert!(answer.starts_with("HTTP/1.1 200") && answer.contains("\"mode\":\"view\""), "{answer}");
    assert!(answer.contains("content-security-policy: default-src 'self'"), "{answer}");
    let process = rustix::process::Pid::from_child(&program);
    rustix::process::kill_process(process, rustix::process::Signal::INT).unwrap();
    assert!(program.wait().unwrap().success());
}

#[test]
fn results_that_do_not_fit_their_frames_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    matched(folder.path());
    let seq = folder.path().join("seq");
    let summary = fs::read_to_string(seq.join("results/match.json")).unwrap();
    let refused = |words: &str| {
        let error = CurrentResults::open(&seq, Some(&seq.join("results"))).err().unwrap().to_string();
        assert!(error.contains(words), "{error}");
    };
    fs::write(seq.join("results/match.json"), summary.replace("\"reference\": 4", "\"reference\": 9"))
        .unwrap();
    refused("frame 9 as reference, but there are 9 frames");
    fs::write(seq.join("results/match.json"), summary).unwrap();
    let small = MapFormat::Tiff.encode(&Grid::filled(ROWS, COLUMNS - 1, 470.0)).unwrap();
    fs::write(seq.join("results/disparity.tiff"), &small).unwrap();
    refused("disparity.tiff was changed after it was written");
}
