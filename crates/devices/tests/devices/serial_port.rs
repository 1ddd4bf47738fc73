//! Real terminals: ports are locked, hang-ups are noticed, and the drivers work in real time.

use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use epirig_devices::link::{
    LineNoise, Link, LinkError, PtyServer, SerialLink, SimulatedDevice, holder, serve,
};
use epirig_devices::stage::grbl::GrblOptions;
use epirig_devices::stage::native::{BAUD, NativeOptions};
use epirig_devices::stage::simulator::{GrblDevice, NativeDevice};
use epirig_devices::stage::{GrblStage, NativeStage, Stage, StageError, Urgency};

struct Bench {
    port: String,
    _server: PtyServer,
    _folder: tempfile::TempDir,
}

fn bench(device: impl SimulatedDevice + 'static, noise: &LineNoise) -> Bench {
    let folder = tempfile::tempdir().unwrap();
    let port = folder.path().join("port");
    let server = serve(device, noise, &port).unwrap();
    Bench { port: port.to_string_lossy().into_owned(), _server: server, _folder: folder }
}

impl Bench {
    fn open(&self) -> Result<SerialLink, LinkError> {
        SerialLink::open(&self.port, BAUD)
    }

    fn native(&self) -> NativeStage {
        NativeStage::connect(Box::new(self.open().unwrap()), NativeOptions::default()).unwrap()
    }
}

fn quiet() -> LineNoise {
    LineNoise::quiet(0)
}

#[test]
fn a_port_is_one_process_alone() {
    let bench = bench(NativeDevice::default(), &quiet());
    let link = bench.open().unwrap();
    let pid = std::process::id();
    let error = bench.open().err().unwrap();
    assert_eq!(error, LinkError::Busy { port: bench.port.clone(), holder: format!("process {pid}") });
    assert_eq!(holder(&bench.port), Some(pid as i32));
    drop(link);
    assert_eq!(holder(&bench.port), None);
    bench.open().unwrap();
}

#[test]
fn what_is_no_port_is_named() {
    let error = SerialLink::open("/dev/no-such-port", BAUD).err().unwrap();
    assert_eq!(error, LinkError::NoSuchPort("/dev/no-such-port".to_owned()));
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("file");
    std::fs::write(&file, "no terminal").unwrap();
    let error = SerialLink::open(&file.to_string_lossy(), BAUD).err().unwrap().to_string();
    assert!(error.contains("cannot open it as a serial port"), "{error}");
    assert_eq!(std::fs::read(&file).unwrap(), b"no terminal");
}

#[test]
fn the_native_driver_works_in_real_time() {
    let device = NativeDevice::default();
    let plant = device.plant();
    let bench = bench(device, &quiet());
    let mut stage = bench.native();
    stage.home().unwrap();
    let home = plant.carriage_steps();
    for index in 1..=3 {
        stage.move_to(1.5 * f64::from(index)).unwrap();
        assert_eq!(plant.carriage_steps() - home, i64::from(index) * 375);
    }
    // Another program finds the stage where this one left it.
    drop(stage);
    assert_eq!(bench.native().position_mm(), Ok(4.5));
}

#[test]
fn the_grbl_driver_works_in_real_time_through_a_line_that_lies() {
    let device = GrblDevice::default();
    let plant = device.plant();
    let bench = bench(device, &LineNoise::bad(3, 0.0005));
    let mut right = 0;
    let connect = || GrblStage::connect(Box::new(bench.open().unwrap()), GrblOptions::default());
    for _ in 0..3 {
        let Ok(mut stage) = connect() else { continue };
        if stage.home().is_err() {
            continue;
        }
        let home = plant.carriage_steps();
        for index in 1..=3 {
            match stage.move_to(1.5 * f64::from(index)) {
                Ok(()) => {
                    assert_eq!(home - plant.carriage_steps(), i64::from(index) * 375);
                    right += 1;
                }
                Err(_) => break,
            }
        }
        if right >= 3 {
            return;
        }
    }
    panic!("{right} moves right");
}

#[test]
fn a_hang_up_in_mid_move_is_noticed_and_the_stage_is_found_again() {
    let device = Arc::new(Mutex::new(NativeDevice::new("hang-up@1+0.3s/1.5s".parse().unwrap())));
    let plant = device.lock().unwrap().plant();
    let bench = bench(device, &quiet());
    // A process that is started now does not keep the terminal open.
    let mut other = std::process::Command::new("sleep").arg("60").spawn().unwrap();
    let mut stage = bench.native();
    stage.home().unwrap();
    let home = plant.carriage_steps();
    let error = stage.move_to(100.0).unwrap_err();
    other.kill().unwrap();
    other.wait().unwrap();
    assert!(matches!(error, StageError::Link(LinkError::Lost { .. })), "{error}");
    assert_eq!(stage.move_to(100.0), Err(StageError::NotHomed));
    drop(stage);
    let since = Instant::now();
    while bench.open().is_err() {
        assert!(since.elapsed() < Duration::from_secs(10), "the port has not come back");
        std::thread::sleep(Duration::from_millis(50));
    }
    let mut stage = bench.native();
    assert_eq!(stage.position_mm(), Err(StageError::NotHomed));
    stage.home().unwrap();
    assert_eq!((stage.home_shift_mm(), plant.carriage_steps()), (Some(0.0), home));
    stage.move_to(3.0).unwrap();
}

#[test]
fn another_thread_stops_a_move() {
    let device = NativeDevice::default();
    let plant = device.plant();
    let bench = bench(device, &quiet());
    let mut stage = bench.native();
    stage.home().unwrap();
    let home = plant.carriage_steps();
    let switch = stage.stop_switch();
    let presser = std::thread::spawn(move || {
        std::thread::sleep(Duration::from_millis(600));
        switch.press(Urgency::Soon);
    });
    let began = Instant::now();
    let error = stage.move_to(150.0).unwrap_err();
    presser.join().unwrap();
    // Far less than the 30 s of the move.
    assert!(began.elapsed() < Duration::from_secs(15));
    let StageError::Stopped { position_mm: Some(position_mm) } = error else { panic!("{error}") };
    assert!(((plant.carriage_steps() - home) as f64 - position_mm * 250.0).abs() < 1e-6);
}

#[test]
fn the_line_is_closed_when_the_device_is_gone_for_good() {
    let bench = bench(NativeDevice::default(), &quiet());
    let mut link = bench.open().unwrap();
    drop(bench);
    let mut buffer = [0; 8];
    let since = Instant::now();
    let error = loop {
        match link.receive(&mut buffer, Duration::from_millis(100)) {
            Ok(_) => assert!(since.elapsed() < Duration::from_secs(10)),
            Err(error) => break error,
        }
    };
    assert!(matches!(error, LinkError::Lost { .. }), "{error}");
}
