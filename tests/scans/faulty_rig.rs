//! Rigs that fail in the middle of a scan: stages behind lines, stages in memory, and a camera that is tampered with.

#![allow(unreachable_pub, reason = "a module of test programs has no outside")]

use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex};
use std::time::Duration;

use epirig_core::frame::Frame;
use epirig_core::progress::Progress;
use epirig_core::settings::Settings;
use epirig_devices::camera::{
    Camera, CameraError, CameraIdentity, CameraSettings, Configuration, Control, Moment, OfferedFormat,
    Onlooker, SimCamera, SimFault, SimView, TakenFrame,
};
use epirig_devices::link::{LineNoise, Link, SimulatedDevice, SimulatedLink};
use epirig_devices::stage::simulator::{FaultScript, Plant, SimulatedStage};
use epirig_devices::stage::{CheckedStage, Connection, Driver, Stage, StageError, StagePosition, WhenMoving};

/// Between two attempts of a scan to reach a stage. A simulated line knows no time but its own.
const BETWEEN_ATTEMPTS: Duration = Duration::from_millis(500);

/// How long a line stays noisy.
const NOISY: Duration = Duration::from_secs(10);

/// A simulated device whose carriage is watched, and whose line becomes noisy for a while when it is told to.
pub struct Watched {
    device: Arc<Mutex<dyn SimulatedDevice>>,
    plant: Plant,
    mm_from_home: fn(i64) -> f64,
    settings: Settings,
    watch: StagePosition,
    noisy: Arc<AtomicBool>,
    noisy_for: Duration,
    to_device: LineNoise,
    from_device: LineNoise,
}

/// The device that a driver's simulator makes.
pub fn simulated(driver: Driver, script: &FaultScript) -> SimulatedStage {
    driver.simulated(script.clone(), 1).unwrap_or_else(|| panic!("{driver} has no line"))
}

impl Watched {
    pub fn new(driver: Driver, script: &FaultScript, watch: StagePosition, noise: &LineNoise) -> Self {
        let SimulatedStage { device, plant, mm_from_home, settings, .. } = simulated(driver, script);
        let noisy = Arc::new(AtomicBool::new(false));
        let (to_device, from_device) = (noise.clone(), noise.reversed());
        let noisy_for = Duration::ZERO;
        Self { device, plant, mm_from_home, settings, watch, noisy, noisy_for, to_device, from_device }
    }

    pub fn plant(&self) -> Plant {
        self.plant.clone()
    }

    /// What makes the line noisy.
    pub fn noise_switch(&self) -> Arc<AtomicBool> {
        Arc::clone(&self.noisy)
    }
}

impl SimulatedDevice for Watched {
    fn receive(&mut self, byte: u8) {
        if self.noisy.load(Ordering::SeqCst) {
            self.to_device.pass(byte).for_each(|byte| self.device.receive(byte));
        } else {
            self.device.receive(byte);
        }
    }

    fn advance(&mut self, time: Duration) {
        self.device.advance(time);
        if self.noisy.load(Ordering::SeqCst) {
            self.noisy_for += time;
            self.noisy.store(self.noisy_for < NOISY, Ordering::SeqCst);
        }
        self.watch.set((self.mm_from_home)(self.plant.carriage_steps()), self.watch.elapsed() + time);
    }

    fn take_sent(&mut self) -> Vec<u8> {
        let sent = self.device.take_sent();
        if !self.noisy.load(Ordering::SeqCst) {
            return sent;
        }
        sent.into_iter().flat_map(|byte| self.from_device.pass(byte)).collect()
    }

    fn connected(&self) -> bool {
        self.device.connected()
    }
}

/// Connects to a device, as often as it takes.
pub fn connect(driver: Driver, device: &Arc<Mutex<Watched>>) -> Result<Box<dyn Stage>, StageError> {
    Arc::clone(device).advance(BETWEEN_ATTEMPTS);
    let settings = device.lock().unwrap().settings.clone();
    let mut open_line = |_baud| Ok(Box::new(SimulatedLink::new(Arc::clone(device))) as Box<dyn Link>);
    let mut connection = Connection {
        open_line: &mut open_line,
        watch: StagePosition::default(),
        seed: 0,
        in_real_time: false,
        when_moving: WhenMoving::default(),
    };
    Ok(Box::new(CheckedStage::over(driver.connect(&mut connection, &settings)?)))
}

/// What is done to a camera.
#[derive(Debug, Clone)]
pub enum Mischief {
    Fault(SimFault),
    /// Its gain is set, and everybody told.
    Gain(u32),
    /// Something else is in front of it.
    View(SimView),
    /// It waits until this is true.
    Wait(&'static AtomicBool),
    /// Its cable is pulled as soon as somebody asks for it.
    Cable(&'static Cable),
}

/// The cable of a camera.
#[derive(Debug, Default)]
pub struct Cable {
    pulled: AtomicBool,
    looks: AtomicUsize,
}

impl Cable {
    pub const fn new() -> Self {
        Self { pulled: AtomicBool::new(false), looks: AtomicUsize::new(0) }
    }

    /// Pulls it before the next look.
    pub fn pull(&self) {
        self.pulled.store(true, Ordering::SeqCst);
    }

    /// Looks since it was pulled.
    pub fn looks(&self) -> usize {
        self.looks.load(Ordering::SeqCst)
    }
}

/// When it is done: before the given call, counted from 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum When {
    Grab(usize),
    Start(usize),
    /// Before each of the looks.
    Look,
}

/// A camera that is tampered with.
pub struct Tampered {
    camera: SimCamera,
    plan: Vec<(When, Mischief)>,
    grabs: usize,
    starts: usize,
}

impl Tampered {
    pub fn new(camera: SimCamera, plan: Vec<(When, Mischief)>) -> Self {
        Self { camera, plan, grabs: 0, starts: 0 }
    }

    fn tamper(&mut self, when: When) {
        for (_, mischief) in self.plan.iter().filter(|(planned, _)| *planned == when) {
            match mischief {
                Mischief::Fault(fault) => self.camera.device().inject(*fault),
                Mischief::View(view) => self.camera.device().view().put(*view),
                Mischief::Wait(open) => {
                    while !open.load(Ordering::SeqCst) {
                        std::thread::sleep(Duration::from_millis(1));
                    }
                }
                Mischief::Cable(cable) if cable.pulled.load(Ordering::SeqCst) => {
                    if cable.looks.fetch_add(1, Ordering::SeqCst) == 0 {
                        self.camera.device().inject(SimFault::Disconnect { failing: 0 });
                    }
                }
                Mischief::Cable(_) => {}
                Mischief::Gain(gain) => {
                    self.camera.set_control("gain", &gain.to_string()).unwrap();
                }
            }
        }
    }
}

impl Camera for Tampered {
    fn identity(&self) -> CameraIdentity {
        self.camera.identity()
    }

    fn now(&mut self) -> Moment {
        self.camera.now()
    }

    fn offered(&mut self) -> Result<Vec<OfferedFormat>, CameraError> {
        self.camera.offered()
    }

    fn controls(&mut self) -> Result<Vec<Control>, CameraError> {
        self.camera.controls()
    }

    fn set_control(&mut self, name: &str, value: &str) -> Result<Control, CameraError> {
        self.camera.set_control(name, value)
    }

    fn configure(&mut self, settings: &CameraSettings) -> Result<Configuration, CameraError> {
        self.camera.configure(settings)
    }

    fn start(&mut self) -> Result<(), CameraError> {
        self.tamper(When::Start(self.starts));
        self.starts += 1;
        self.camera.start()
    }

    fn grab_after(&mut self, moment: Moment) -> Result<TakenFrame, CameraError> {
        self.tamper(When::Grab(self.grabs));
        self.grabs += 1;
        self.camera.grab_after(moment)
    }

    fn look(&mut self, patience: Duration) -> Result<Option<Frame>, CameraError> {
        self.tamper(When::Look);
        self.camera.look(patience)
    }

    fn show_for(&mut self, time: Duration) -> Result<(), CameraError> {
        self.camera.show_for(time)
    }

    fn show_to(&mut self, onlooker: Option<Arc<dyn Onlooker>>) {
        self.camera.show_to(onlooker);
    }

    fn stop(&mut self) -> Result<(), CameraError> {
        self.camera.stop()
    }

    fn reconnect(&mut self, patience: Duration) -> Result<(), CameraError> {
        self.tamper(When::Start(self.starts));
        self.starts += 1;
        self.camera.reconnect(patience)
    }
}

/// Calls a function once this number of frames has been taken.
pub struct Once<F: Fn() + Sync> {
    after: usize,
    action: F,
    taken: AtomicUsize,
}

impl<F: Fn() + Sync> Once<F> {
    pub fn after(frames: usize, action: F) -> Self {
        Self { after: frames, action, taken: AtomicUsize::new(0) }
    }
}

impl<F: Fn() + Sync> Progress for Once<F> {
    fn begin(&self, _what: &str, _total: u64) {}

    fn advance(&self, _count: u64) {
        if self.taken.fetch_add(1, Ordering::SeqCst) + 1 == self.after {
            (self.action)();
        }
    }

    fn end(&self) {}

    fn note(&self, words: &str) {
        // Shown of tests that fail.
        println!("    {words}");
    }
}
