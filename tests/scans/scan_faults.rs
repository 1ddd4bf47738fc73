//! Every fault of stage and camera in the middle of a scan ends in a complete sequence, or in an error that can be resumed from once the
//! fault is mended: with the frames of an undisturbed scan, to the byte. What comes of each fault is a table in TESTING.md, which
//! `EPIRIG_WRITE_TABLES=1 cargo test --test scan_faults` writes.

use std::fmt::Write as _;
use std::path::Path;
use std::sync::atomic::Ordering;
use std::sync::{Arc, Mutex};
use std::time::Duration;

use crate::faulty_rig::{Mischief, Once, Tampered, Watched, When, connect, simulated};
use crate::scan_fault_list::{
    AtFrame, FRAME, FRAMES, Mechanics, PATIENT_S, STAGE_FAULTS, StageFault, camera_faults, mechanics,
};
use crate::scan_outcome::{Noticed, ScanResult, outcome};
use epirig::capture::{CapturePlan, PauseSwitch, Rig, Unattended, Unwatched, capture, resume};
use epirig::profile::LimitsProfile;
use epirig_core::progress::Progress;
use epirig_data::storage::RealDisk;
use epirig_devices::camera::{SimCamera, SimFault};
use epirig_devices::link::LineNoise;
use epirig_devices::stage::simulator::FaultScript;
use epirig_devices::stage::{
    Driver, SimStage, SimStageConfig, Stage, StagePosition, StageSource, add_drivers, drivers,
};
use epirig_simulator::{Simulator, SimulatorConfig};

/// A noise-free simulator: frames of one place are the same to the byte. They move by half a pixel from stop to stop.
fn simulator() -> Arc<Simulator> {
    Arc::new(Simulator::new(SimulatorConfig::textured_plane(64, 48, FRAMES)).unwrap())
}

/// Stops 2 mm apart, on whole steps of the stage.
fn plan(step_mm: f64, wait_s: f64) -> CapturePlan {
    let limits = LimitsProfile { wait: Duration::from_secs_f64(wait_s), ..LimitsProfile::default() };
    let place = |index: usize| ((10.0 + 2.0 * index as f64) / step_mm).round() * step_mm;
    CapturePlan { limits, ..CapturePlan::at((0..FRAMES).map(place).collect()) }
}

fn scan(
    folder: &Path,
    plan: &CapturePlan,
    stages: &mut dyn StageSource,
    camera: &mut Tampered,
    progress: &dyn Progress,
) -> ScanResult {
    let pause = PauseSwitch::default();
    let mut rig = Rig { stages, camera, assistant: &mut Unattended, pause, progress, watcher: &Unwatched };
    if folder.join("sequence.json").exists() {
        resume(&mut rig, plan, folder, Box::new(RealDisk))
    } else {
        capture(&mut rig, plan, folder, Box::new(RealDisk))
    }
}

/// A scan with a driver, its simulated device and the line between them.
fn scan_over_line(
    simulator: &Arc<Simulator>,
    plan: &CapturePlan,
    driver: Driver,
    script: &FaultScript,
    at_frame: AtFrame,
    folder: &Path,
) -> ScanResult {
    let mut noise = LineNoise::bad(7, 0.01);
    if at_frame == AtFrame::BytesAreLost {
        (noise.double, noise.flip) = (0.0, 0.0);
    }
    let watch = StagePosition::default();
    let device = Watched::new(driver, script, watch.clone(), &noise);
    let (plant, noisy) = (device.plant(), device.noise_switch());
    let device = Arc::new(Mutex::new(device));
    let mut stages = || connect(driver, &device);
    // The camera is started once before the first frame, and then as the stage has been homed again.
    let goes = (When::Start(1), Mischief::Fault(SimFault::Disconnect { failing: 3 }));
    let mischief = if at_frame == AtFrame::CameraGoesToo { vec![goes] } else { Vec::new() };
    let mut camera = Tampered::new(SimCamera::before_simulator(Arc::clone(simulator), watch), mischief);
    let progress = Once::after(FRAME, || match at_frame {
        AtFrame::SwitchesBreak => plant.set_switches_work(false),
        AtFrame::BytesAreLost | AtFrame::BytesAreLostDoubledAndFlipped => noisy.store(true, Ordering::SeqCst),
        AtFrame::Nothing | AtFrame::CameraGoesToo => {}
    });
    scan(folder, plan, &mut stages, &mut camera, &progress)
}

fn stage_outcome(simulator: &Arc<Simulator>, fault: &StageFault, driver: Driver) -> String {
    // The first move is from home to the first stop, the second stays there for frame 0.
    let script: FaultScript = fault.script.replace('N', &(FRAME + 2).to_string()).parse().unwrap();
    let plan = plan(simulated(driver, &script).step_mm, fault.wait_s);
    let run = |folder: &Path, script: &FaultScript, at_frame: AtFrame| {
        scan_over_line(simulator, &plan, driver, script, at_frame, folder)
    };
    // Only this stage counts steps without looking at what they do.
    let noticed =
        if driver.name() == "native" && fault.is_hidden { Noticed::NotAtOnce } else { Noticed::AtOnce };
    outcome(
        &format!("{}: {}", driver.name(), fault.words),
        noticed,
        simulator,
        &plan.positions_mm,
        |folder| run(folder, &script, fault.at_frame),
        |folder| run(folder, &FaultScript::default(), AtFrame::Nothing),
    )
}

/// A scan with a stage in memory.
fn scan_in_memory(
    simulator: &Arc<Simulator>,
    plan: &CapturePlan,
    stage: &SimStageConfig,
    mischief: &[(When, Mischief)],
    folder: &Path,
) -> ScanResult {
    let watch = StagePosition::default();
    let seen = watch.clone();
    let mut stages = || Ok(Box::new(SimStage::seen_through(stage.clone(), seen.clone())) as Box<dyn Stage>);
    let mut camera =
        Tampered::new(SimCamera::before_simulator(Arc::clone(simulator), watch), mischief.to_vec());
    scan(folder, plan, &mut stages, &mut camera, &Once::after(0, || {}))
}

fn outcome_in_memory(simulator: &Arc<Simulator>, fault: &Mechanics) -> String {
    let plan = plan(0.004, PATIENT_S);
    let sound = SimStageConfig::ideal(fault.stage.travel_mm);
    let noticed = if fault.stage.slip_probability > 0.0 { Noticed::NotAtOnce } else { Noticed::AtOnce };
    outcome(
        fault.words,
        noticed,
        simulator,
        &plan.positions_mm,
        |folder| scan_in_memory(simulator, &plan, &fault.stage, &fault.mischief, folder),
        |folder| scan_in_memory(simulator, &plan, &sound, &[], folder),
    )
}

/// Both tables, as Markdown.
fn tables(simulator: &Arc<Simulator>) -> String {
    add_drivers(&[&crate::plain::Plain]);
    let drivers: Vec<Driver> = drivers().into_iter().filter(|driver| driver.has_line()).collect();
    let column = |driver: Driver| {
        move || STAGE_FAULTS.iter().map(|fault| stage_outcome(simulator, fault, driver)).collect::<Vec<_>>()
    };
    let in_memory = || {
        let faults = camera_faults().into_iter().chain(mechanics());
        faults.map(|fault| (fault.words, outcome_in_memory(simulator, &fault))).collect::<Vec<_>>()
    };
    // Most of the time goes by while scans wait for their stages and for the disk.
    let (columns, rows) = std::thread::scope(|scope| {
        let columns: Vec<_> = drivers.iter().map(|driver| scope.spawn(column(*driver))).collect();
        let rows = scope.spawn(in_memory);
        let columns: Vec<_> = columns.into_iter().map(|column| column.join().unwrap()).collect();
        (columns, rows.join().unwrap())
    });
    let mut text = "| fault of the stage or its line |".to_owned();
    drivers.iter().for_each(|driver| write!(text, " {driver} |").unwrap());
    text += "\n| --- |";
    drivers.iter().for_each(|_| text += " --- |");
    for (index, fault) in STAGE_FAULTS.iter().enumerate() {
        write!(text, "\n| {} |", fault.words).unwrap();
        columns.iter().for_each(|column| write!(text, " {} |", column[index]).unwrap());
    }
    text += "\n";
    text += "\n| fault of the camera, or of the mechanics | what comes of it |\n| --- | --- |\n";
    for (fault, comes) in rows {
        writeln!(text, "| {fault} | {comes} |").unwrap();
    }
    text
}

const BEGIN: &str = "<!-- scan-faults.md -->\n";
const END: &str = "<!-- end of scan-faults.md -->";

#[test]
fn every_fault_in_mid_scan_ends_whole_or_resumably_as_the_table_says() {
    let found = tables(&simulator());
    std::fs::write(Path::new(env!("CARGO_TARGET_TMPDIR")).join("scan-faults.md"), &found).unwrap();
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("TESTING.md");
    let text = std::fs::read_to_string(&path).unwrap();
    let (before, rest) = text.split_once(BEGIN).unwrap();
    let (told, after) = rest.split_once(END).unwrap();
    if std::env::var_os("EPIRIG_WRITE_TABLES").is_some() {
        std::fs::write(&path, format!("{before}{BEGIN}{found}{END}{after}")).unwrap();
        return;
    }
    for (found, told) in found.lines().zip(told.lines()) {
        assert_eq!(found, told, "TESTING.md tells otherwise; EPIRIG_WRITE_TABLES=1 writes it anew");
    }
    assert_eq!(found, told, "TESTING.md has other rows; EPIRIG_WRITE_TABLES=1 writes it anew");
}
