//! A line to a simulated device, with the faults of real lines.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::{Link, LinkError};

/// A device without a clock of its own: its owner advances its time.
pub trait SimulatedDevice: Send {
    /// Receives a byte from the host.
    fn receive(&mut self, byte: u8);

    /// Advances the time.
    fn advance(&mut self, time: Duration);

    /// Returns the bytes sent since the last call.
    fn take_sent(&mut self) -> Vec<u8>;

    /// Whether its cable is connected.
    fn connected(&self) -> bool {
        true
    }
}

impl<D: SimulatedDevice + ?Sized> SimulatedDevice for Arc<Mutex<D>> {
    fn receive(&mut self, byte: u8) {
        self.lock().unwrap_or_else(PoisonError::into_inner).receive(byte);
    }

    fn advance(&mut self, time: Duration) {
        self.lock().unwrap_or_else(PoisonError::into_inner).advance(time);
    }

    fn take_sent(&mut self) -> Vec<u8> {
        self.lock().unwrap_or_else(PoisonError::into_inner).take_sent()
    }

    fn connected(&self) -> bool {
        self.lock().unwrap_or_else(PoisonError::into_inner).connected()
    }
}

/// Random faults of a line; each direction has its own.
///
/// ```
/// use epirig_devices::link::LineNoise;
///
/// let mut noise = LineNoise::quiet(7);
/// noise.lose = 0.5;
/// let left = (0..1000).filter(|_| noise.pass(42).next().is_some()).count();
/// assert!((400..600).contains(&left));
/// ```
#[derive(Debug, Clone)]
pub struct LineNoise {
    /// Probability that a byte is lost.
    pub lose: f64,
    /// Probability that a byte arrives twice.
    pub double: f64,
    /// Probability that one bit of a byte is flipped.
    pub flip: f64,
    /// Probability that a byte, and all after it, are delayed.
    pub delay: f64,
    /// Longest delay.
    pub longest_delay: Duration,
    random: ChaCha8Rng,
}

impl LineNoise {
    /// A line without faults; fields can be changed.
    pub fn quiet(seed: u64) -> Self {
        Self {
            lose: 0.0,
            double: 0.0,
            flip: 0.0,
            delay: 0.0,
            longest_delay: Duration::from_millis(50),
            random: ChaCha8Rng::seed_from_u64(seed),
        }
    }

    /// A line that loses, doubles and flips bytes with the same probability each.
    pub fn bad(seed: u64, rate: f64) -> Self {
        Self { lose: rate, double: rate, flip: rate, ..Self::quiet(seed) }
    }

    /// The same faults with other random numbers, for the other direction.
    pub fn reversed(&self) -> Self {
        let mut other = self.clone();
        other.random.set_stream(1);
        other
    }

    fn happens(&mut self, probability: f64) -> bool {
        // A fault with probability 0 draws no random number, so that faults do not influence each other.
        probability > 0.0 && self.random.random_bool(probability.min(1.0))
    }

    /// The bytes that arrive for one byte: none, one (perhaps changed), or two.
    pub fn pass(&mut self, byte: u8) -> impl Iterator<Item = u8> + use<> {
        let flipped = if self.happens(self.flip) { byte ^ 1 << self.random.random_range(0..8) } else { byte };
        let count = if self.happens(self.lose) { 0 } else { 1 + usize::from(self.happens(self.double)) };
        std::iter::repeat_n(flipped, count)
    }

    /// Delay of a byte.
    pub fn hold_up(&mut self) -> Duration {
        if self.happens(self.delay) {
            self.longest_delay.mul_f64(self.random.random_range(0.0..1.0))
        } else {
            Duration::ZERO
        }
    }
}

/// Simulated time advances in these steps while a link waits.
const TIME_STEP: Duration = Duration::from_millis(1);

/// A line to a simulated device, in simulated time: waiting takes no real time, unless
/// [`in_real_time`](Self::in_real_time) asks for it.
pub struct SimulatedLink<D> {
    device: D,
    now: Duration,
    to_device: LineNoise,
    from_device: LineNoise,
    /// Bytes on their way to the host, with their time of arrival.
    arriving: VecDeque<(Duration, u8)>,
    session: u64,
    in_real_time: bool,
}

impl<D: SimulatedDevice> SimulatedLink<D> {
    /// A line without faults.
    pub fn new(device: D) -> Self {
        Self::with_noise(device, &LineNoise::quiet(0))
    }

    /// A line with faults in both directions.
    pub fn with_noise(device: D, noise: &LineNoise) -> Self {
        Self {
            device,
            now: Duration::ZERO,
            to_device: noise.clone(),
            from_device: noise.reversed(),
            arriving: VecDeque::new(),
            session: 0,
            in_real_time: false,
        }
    }

    /// The same as another session on the line.
    pub fn in_session(self, session: u64) -> Self {
        Self { session, ..self }
    }

    /// The same, but waiting takes real time.
    pub fn in_real_time(self) -> Self {
        Self { in_real_time: true, ..self }
    }

    fn lost(&self) -> LinkError {
        LinkError::Lost(self.name().to_owned())
    }

    fn collect(&mut self) {
        for byte in self.device.take_sent() {
            let after = self.arriving.back().map_or(Duration::ZERO, |(due, _)| *due);
            let due = after.max(self.now + self.from_device.hold_up());
            self.arriving.extend(self.from_device.pass(byte).map(|byte| (due, byte)));
        }
    }
}

impl<D: SimulatedDevice> Link for SimulatedLink<D> {
    fn name(&self) -> &str {
        "simulated port"
    }

    fn send(&mut self, bytes: &[u8]) -> Result<(), LinkError> {
        if !self.device.connected() {
            return Err(self.lost());
        }
        for &byte in bytes {
            for arrived in self.to_device.pass(byte) {
                self.device.receive(arrived);
            }
        }
        Ok(())
    }

    fn receive(&mut self, buffer: &mut [u8], patience: Duration) -> Result<usize, LinkError> {
        let until = self.now + patience;
        loop {
            if !self.device.connected() {
                return Err(self.lost());
            }
            self.collect();
            let now = self.now;
            let due = self.arriving.iter().take_while(|(due, _)| *due <= now).count().min(buffer.len());
            if due > 0 {
                for (to, (_, byte)) in buffer.iter_mut().zip(self.arriving.drain(..due)) {
                    *to = byte;
                }
                return Ok(due);
            }
            if self.now >= until {
                return Ok(0);
            }
            let step = TIME_STEP.min(until - self.now);
            if self.in_real_time {
                std::thread::sleep(step);
            }
            self.device.advance(step);
            self.now += step;
        }
    }

    fn now(&self) -> Duration {
        self.now
    }

    fn session(&self) -> u64 {
        self.session
    }
}
