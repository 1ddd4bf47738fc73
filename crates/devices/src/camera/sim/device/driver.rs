//! The driver interface of the simulated device.

use std::time::Duration;

use super::{APERTURE_PRIORITY, CALL, EXPOSURE, EXPOSURE_AUTO, GAIN, GLANCE, INTERVAL, MANUAL, SimDevice};
use crate::camera::automatic::EXPOSURE_ABSOLUTE;
use crate::camera::pixels::FourCc;
use crate::camera::sim::fault::SimFault;
use crate::camera::sim::pictures::to_bytes;
use crate::camera::{
    ActiveFormat, CameraError, CameraIdentity, Control, ControlKind, FilledBuffer, Interval, Moment,
    OfferedFormat, Size, Sizes, VideoDevice,
};

impl VideoDevice for SimDevice {
    fn identity(&self) -> CameraIdentity {
        self.identity.clone()
    }

    fn now(&mut self) -> Moment {
        self.mind_the_stage();
        self.pass(CALL);
        self.now
    }

    fn pause(&mut self, time: Duration) {
        self.mind_the_stage();
        self.pass(time);
    }

    fn next_is_compared(&mut self) {
        for event in self.stage.take_due() {
            if let Some(fault) = self.planned.get(event).copied() {
                self.inject(fault);
            }
        }
    }

    fn offered(&mut self) -> Result<Vec<OfferedFormat>, CameraError> {
        self.there()?;
        let format = self.format();
        let interval = Interval { numerator: 1, denominator: Self::RATE_HZ };
        Ok(vec![OfferedFormat {
            four_cc: format.four_cc,
            description: "simulated grey".to_owned(),
            sizes: Sizes::Discrete(vec![(format.size, vec![interval])]),
        }])
    }

    fn active_format(&mut self) -> Result<ActiveFormat, CameraError> {
        self.there()?;
        Ok(self.format())
    }

    fn set_format(&mut self, _four_cc: FourCc, _size: Size) -> Result<ActiveFormat, CameraError> {
        self.active_format()
    }

    fn interval(&mut self) -> Result<Option<Interval>, CameraError> {
        self.there()?;
        Ok(Some(Interval { numerator: 1, denominator: Self::RATE_HZ }))
    }

    fn set_interval(&mut self, _interval: Interval) -> Result<(), CameraError> {
        self.there()
    }

    fn controls(&mut self) -> Result<Vec<Control>, CameraError> {
        self.there()?;
        let manual = self.exposure_auto == MANUAL;
        let number = |id, name: &str, minimum, maximum, default, value| Control {
            id,
            name: name.to_owned(),
            kind: ControlKind::Integer,
            minimum,
            maximum,
            step: 1,
            default,
            value: Some(value),
            read_only: false,
            inactive: false,
            items: Vec::new(),
        };
        Ok(vec![
            Control {
                kind: ControlKind::Menu,
                items: vec![
                    (MANUAL, "Manual Mode".to_owned()),
                    (APERTURE_PRIORITY, "Aperture Priority Mode".to_owned()),
                ],
                ..number(EXPOSURE_AUTO, "auto_exposure", 0, 3, APERTURE_PRIORITY, self.exposure_auto)
            },
            Control {
                inactive: !manual,
                // The exposure cannot be longer than the frame time.
                ..number(EXPOSURE_ABSOLUTE, "exposure_time_absolute", 1, 200, EXPOSURE, self.exposure)
            },
            number(GAIN, "gain", 0, 100, 0, self.gain),
        ])
    }

    fn read_control(&mut self, id: u32) -> Result<i64, CameraError> {
        let controls = self.controls()?;
        let value = controls.iter().find(|control| control.id == id).and_then(|control| control.value);
        value.ok_or_else(|| CameraError::System {
            camera: self.identity.name(),
            action: "read a control",
            detail: format!("there is no control {id:#x}"),
        })
    }

    fn write_control(&mut self, id: u32, value: i64) -> Result<(), CameraError> {
        self.there()?;
        match id {
            EXPOSURE_AUTO => self.exposure_auto = value,
            EXPOSURE_ABSOLUTE => {
                let multiple = self.exposure_multiple;
                self.exposure = ((value + multiple / 2) / multiple * multiple).clamp(1, 200);
            }
            _ => self.gain = value.clamp(0, 100),
        }
        self.light_changes();
        Ok(())
    }

    fn check_signal(&mut self) -> Result<(), CameraError> {
        self.there()?;
        if self.signal_lost {
            return Err(CameraError::NoSignal { camera: self.identity.name(), what: "no signal".to_owned() });
        }
        Ok(())
    }

    fn start(&mut self, buffers: usize) -> Result<usize, CameraError> {
        self.there()?;
        self.mind_the_stage();
        if self.happens(SimFault::RequestError) {
            return Err(self.stream_error("get buffers"));
        }
        if self.happens(SimFault::StartError) {
            return Err(self.stream_error("start"));
        }
        self.stop()?;
        self.streaming = true;
        self.buffers = buffers;
        self.next_complete = self.now.after(INTERVAL);
        Ok(buffers)
    }

    fn stop(&mut self) -> Result<(), CameraError> {
        self.streaming = false;
        self.dead = false;
        self.unheard = false;
        self.queue.clear();
        self.taken.clear();
        Ok(())
    }

    fn dequeue(&mut self, patience: Duration) -> Result<Option<FilledBuffer>, CameraError> {
        self.there()?;
        self.mind_the_stage();
        if self.dead || !self.streaming {
            return Err(self.stream_error("take a buffer"));
        }
        self.pass(CALL);
        let until = self.now.after(patience);
        while self.queue.is_empty() && self.now < until {
            let step = self.next_complete.since(self.now).max(CALL).min(until.since(self.now));
            match self.real_time {
                // The stage may move meanwhile.
                Some(_) => {
                    self.pass(step.min(GLANCE));
                    self.mind_the_stage();
                }
                None => self.pass(step),
            }
        }
        let Some(mut exposed) = self.queue.pop_front() else { return Ok(None) };
        exposed.buffer.received = self.now;
        exposed.buffer.index = exposed.number as usize;
        self.taken.push(exposed);
        Ok(Some(exposed.buffer))
    }

    fn bytes(&mut self, buffer: &FilledBuffer) -> Result<&[u8], CameraError> {
        let found = self.taken.iter().find(|taken| taken.buffer.index == buffer.index).copied();
        let Some(exposed) = found else { return Err(self.stream_error("read a buffer")) };
        let shown_mm = if exposed.late { exposed.before_mm } else { exposed.position_mm };
        self.bytes = to_bytes(&self.pictures.frame(exposed.view, shown_mm, exposed.light, exposed.number));
        if exposed.torn {
            let before = to_bytes(&self.pictures.frame(
                exposed.view,
                exposed.before_mm,
                exposed.light,
                exposed.number,
            ));
            let half = self.format().stride * (self.format().size.rows / 2);
            self.bytes[half..].copy_from_slice(&before[half..]);
        }
        Ok(&self.bytes[..exposed.buffer.bytes_used])
    }

    fn requeue(&mut self, buffer: FilledBuffer) -> Result<(), CameraError> {
        self.there()?;
        if self.happens(SimFault::QueueError) {
            return Err(self.stream_error("give a buffer back"));
        }
        self.taken.retain(|taken| taken.buffer.index != buffer.index);
        Ok(())
    }

    fn let_go(&mut self) {}

    fn reopen(&mut self) -> Result<(), CameraError> {
        if let Some(failing) = self.gone.filter(|failing| *failing > 0) {
            self.gone = Some(failing - 1);
            return Err(CameraError::Gone(self.identity.name()));
        }
        self.gone = None;
        // A camera that was without power has its defaults.
        (self.exposure, self.exposure_auto, self.gain) = (EXPOSURE, APERTURE_PRIORITY, 0);
        self.light = vec![(0, 1.0)];
        if self.identity.model.ends_with("another one") {
            return Err(CameraError::AnotherCamera {
                path: "the simulated camera".to_owned(),
                expected: self.identity.model.replace(", another one", ""),
                found: self.identity.model.clone(),
            });
        }
        Ok(())
    }
}
