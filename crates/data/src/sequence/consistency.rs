//! Consistency of the records of a sequence: what is stated twice has to agree.

use std::collections::{BTreeMap, BTreeSet};

use super::finding::{Finding, RESTORE};
use super::reader::{JOURNAL, START, STOP};
use super::record::{CertificateRecord, Event, ExitStatus, FrameKind, FrameRecord, Origin};
use super::{Sequence, SequenceError, course};
use epirig_core::choice::Choice as _;
use epirig_core::tau::Tau;

impl Sequence {
    /// Refuses records that contradict each other: it is not known which of them is wrong. No frame is read.
    ///
    /// # Errors
    /// [`SequenceError::Contradiction`].
    pub fn check_records(&self) -> Result<(), SequenceError> {
        let mut found = self.contradictions();
        if found.is_empty() {
            return Ok(());
        }
        let others = found.len() - 1;
        let Finding { file, problem } = found.swap_remove(0);
        Err(SequenceError::Contradiction { folder: self.folder().to_owned(), file, problem, others })
    }

    /// All contradictions between the records, and impossible values. Missing frames are not among them.
    pub fn contradictions(&self) -> Vec<Finding> {
        let mut found = Vec::new();
        self.check_plan(&mut found);
        self.check_configuration(&mut found);
        // Whatever the program takes with a rig, it certifies.
        let with_rig =
            matches!(self.record().origin, Origin::Captured { .. }) && self.record().origin.rig().is_some();
        let certified = with_rig || self.frames().iter().any(|frame| frame.certificate.is_some());
        for &kind in FrameKind::ALL {
            let mut seen = BTreeSet::new();
            let calibration = self.calibration_frames(kind);
            let frames = if kind == FrameKind::Scan { self.frames() } else { &calibration };
            for frame in frames {
                let name = match kind {
                    FrameKind::Scan => format!("frame {}", frame.index),
                    other => format!("{} frame {}", other.folder(), frame.index),
                };
                if !seen.insert(frame.index) {
                    found.push(Finding::new(&name, format!("it is named twice in the journal; {RESTORE}")));
                }
                if certified && kind == FrameKind::Scan && frame.certificate.is_none() {
                    found.push(Finding::new(&name, format!("its certificate is missing; {RESTORE}")));
                }
                for problem in self.frame_problems(kind, frame) {
                    found.push(Finding::new(&name, format!("{problem}; {RESTORE}")));
                }
            }
        }
        self.check_certificates(&mut found);
        self.check_closure(&mut found);
        found.extend(course::findings(self));
        for event in self.events() {
            if let Event::Retake(retake) = event
                && retake.index >= self.record().frames
            {
                let problem =
                    format!("frame {} was taken again, but is not in the plan; {RESTORE}", retake.index);
                found.push(Finding::new(JOURNAL, problem));
            }
        }
        if self.frames().len() > 1
            && let Err(error) = self.tau()
        {
            found.push(Finding::new(JOURNAL, error.to_string()));
        }
        if let Some(stop) = self.stop()
            && stop.exit_status == ExitStatus::Complete
            && stop.frames != self.frames().len()
        {
            let problem =
                format!("counts {} frames, the journal {}; {RESTORE}", stop.frames, self.frames().len());
            found.push(Finding::new(STOP, problem));
        }
        found
    }

    fn check_plan(&self, found: &mut Vec<Finding>) {
        let record = self.record();
        let Some(positions) = &record.positions_mm else { return };
        if positions.len() != record.frames {
            let problem =
                format!("{} positions are planned for {} frames; {RESTORE}", positions.len(), record.frames);
            found.push(Finding::new(START, problem));
        }
        if let Err(error) = Tau::from_positions(positions)
            && positions.len() > 1
        {
            found.push(Finding::new(START, format!("planned positions: {error}; {RESTORE}")));
        }
    }

    /// The camera's setting against the frames.
    fn check_configuration(&self, found: &mut Vec<Finding>) {
        let record = self.record();
        let Origin::Captured { configuration: Some(set), .. } = &record.origin else { return };
        let size = (record.rows, record.columns);
        // Of a colour mosaic four pixels make one; an odd row or column is left out.
        if size != (set.rows, set.columns) && size != (set.rows / 2, set.columns / 2) {
            let problem = format!(
                "the camera was set to {} x {}, frames are {} x {}; {RESTORE}",
                set.columns, set.rows, record.columns, record.rows
            );
            found.push(Finding::new(START, problem));
        }
        if set.averaged == 0 || (set.averaged > 1 && record.bit_depth != 16) {
            let problem = format!(
                "{} frames were averaged to one of {} bit; {RESTORE}",
                set.averaged, record.bit_depth
            );
            found.push(Finding::new(START, problem));
        }
    }

    /// Checks that all certificates of a scan agree (until it is resumed with other limits), and that each
    /// attempt before a frame is recorded.
    fn check_certificates(&self, found: &mut Vec<Finding>) {
        let mut shared = None;
        let mut tolerance_mm = self.record().origin.limits().map(|limits| limits.position_mm);
        let mut retakes: BTreeMap<usize, usize> = BTreeMap::new();
        for event in self.events() {
            match event {
                Event::Resumed(resumed) => {
                    shared = None;
                    tolerance_mm = tolerance_mm.map(|mm| resumed.position_tolerance_mm.unwrap_or(mm));
                }
                Event::Retake(retake) => *retakes.entry(retake.index).or_default() += 1,
                Event::Frame(frame) => {
                    let name = format!("frame {}", frame.index);
                    let Some(certificate) = &frame.certificate else {
                        if let Some(off) = tolerance_mm.and_then(|mm| off_position(frame, mm)) {
                            found.push(Finding::new(&name, format!("{off}; {RESTORE}")));
                        }
                        continue;
                    };
                    let CertificateRecord { position_tolerance_mm, settle_ms, saturated_limit, .. } =
                        *certificate;
                    if let Some(allowed_mm) = tolerance_mm.filter(|mm| *mm != position_tolerance_mm) {
                        let problem = format!(
                            "its certificate allows the stage to be {position_tolerance_mm} mm off, the rig {allowed_mm} mm; {RESTORE}"
                        );
                        found.push(Finding::new(&name, problem));
                    }
                    let can_be = position_tolerance_mm >= 0.0 && settle_ms >= 0.0;
                    // The same for all frames of a scan, until it is resumed.
                    let limits =
                        (position_tolerance_mm, settle_ms, saturated_limit, certificate.controls_as_set);
                    let problem = if !can_be || !(0.0..=1.0).contains(&saturated_limit) {
                        Some("the limits in its certificate cannot be".to_owned())
                    } else if *shared.get_or_insert(limits) != limits {
                        Some("its certificate has other limits than those of the frames around it".to_owned())
                    } else {
                        None
                    };
                    found.extend(problem.map(|problem| Finding::new(&name, format!("{problem}; {RESTORE}"))));
                    let told = retakes.get(&frame.index).copied().unwrap_or_default();
                    if certificate.attempt == 0 || certificate.attempt - 1 > told {
                        let problem = format!(
                            "it is attempt {}, but {told} earlier ones are told of; {RESTORE}",
                            certificate.attempt
                        );
                        found.push(Finding::new(&name, problem));
                    }
                }
                Event::Dark(_) | Event::Flat(_) | Event::Board(_) => {}
            }
        }
    }

    /// Checks the closure of a scan that is called complete.
    fn check_closure(&self, found: &mut Vec<Finding>) {
        let Some(stop) = self.stop() else { return };
        if let Some(times) = &stop.times
            && [times.total_s, times.moving_s, times.settling_s, times.exposing_s]
                .iter()
                .any(|time| *time < 0.0)
        {
            found.push(Finding::new(STOP, format!("a time below 0 s cannot be; {RESTORE}")));
        }
        let Some(closure) = stop.closure.as_ref().filter(|_| stop.exit_status == ExitStatus::Complete) else {
            return;
        };
        let certificates = self.frames().iter().filter_map(|frame| frame.certificate.as_ref());
        let allowed_mm =
            certificates.map(|certificate| certificate.position_tolerance_mm).fold(0.0, f64::max);
        if let Some(shift_mm) = closure.home_shift_mm
            && shift_mm.abs() > allowed_mm
        {
            let problem = format!(
                "the scan is called complete, but home was found {shift_mm} mm from where it had been, {allowed_mm} mm are allowed; {RESTORE}"
            );
            found.push(Finding::new(STOP, problem));
        }
        let Some(seen) = &closure.comparison else { return };
        let resumed = self.events().iter().any(|event| matches!(event, Event::Resumed(_)));
        // A scan may be resumed with other limits than it was begun with.
        let limits = self.record().origin.limits().filter(|_| !resumed);
        let allowed_px = limits.map_or(f64::INFINITY, |limits| limits.shift_px);
        let can_be = seen.frame < self.record().frames && seen.sigma_px >= 0.0 && seen.light > 0.0;
        if !can_be || seen.x_px.hypot(seen.y_px) > allowed_px {
            let problem = format!(
                "the scan is called complete, but the picture had moved by {}, {} px at its end, by the record; {RESTORE}",
                seen.x_px, seen.y_px
            );
            found.push(Finding::new(STOP, problem));
        }
    }

    /// Problems of the line of a frame.
    fn frame_problems(&self, kind: FrameKind, frame: &FrameRecord) -> Vec<String> {
        let record = self.record();
        let mut problems = Vec::new();
        let expected = kind.file(frame.index);
        if frame.file != expected {
            problems.push(format!("its file is {} instead of {expected}", frame.file));
        }
        // Whether it fits the bit depth, the frame itself tells better.
        let mean_is_possible = (0.0..=f64::from(u16::MAX)).contains(&frame.mean_dn);
        if !mean_is_possible || frame.saturated > record.rows * record.columns {
            problems.push(format!(
                "a mean of {} DN with {} samples at full scale cannot be",
                frame.mean_dn, frame.saturated
            ));
        }
        if let Some(exposure) = &frame.exposure {
            if exposure.exposure_start_ns < exposure.requested_ns {
                problems.push("its exposure began before the stage was at rest".to_owned());
            }
            if exposure.received_ns < exposure.exposure_start_ns {
                problems.push("it was received before its exposure began".to_owned());
            }
        }
        if kind == FrameKind::Scan {
            if frame.index >= record.frames {
                problems.push("it is not in the plan".to_owned());
            } else if let Some(positions) = &record.positions_mm
                && frame.commanded_mm != positions.get(frame.index).copied()
            {
                problems.push("its position is not the planned one".to_owned());
            }
            if let Some(certificate) = &frame.certificate {
                problems.extend(certificate_problems(frame, certificate));
                let share = frame.saturated as f64 / (record.rows * record.columns) as f64;
                if certificate.saturated_share != share {
                    problems.push(format!(
                        "{share} of its samples are at full scale by one number, {} by another",
                        certificate.saturated_share
                    ));
                }
            }
        }
        problems
    }
}

/// The position of the stage is recorded five times: commanded, read before and after the exposure, reported,
/// and its tolerance.
fn certificate_problems(frame: &FrameRecord, certificate: &CertificateRecord) -> Vec<String> {
    let mut problems = Vec::new();
    let (tolerance_mm, readings) = (certificate.position_tolerance_mm, certificate.readings_mm);
    match frame.reported_mm {
        None => problems.push("the position that the stage reported is missing".to_owned()),
        Some(reported_mm) if reported_mm != readings[1] => problems.push(format!(
            "the stage reported {reported_mm} mm, but was read at {} mm after the exposure",
            readings[1]
        )),
        Some(_) => {}
    }
    problems.extend(off_position(frame, tolerance_mm));
    if certificate.saturated_share > certificate.saturated_limit {
        problems.push("more of it is at full scale than its own limit allows".to_owned());
    }
    problems
}

/// That the stage stood farther from where it was sent than is allowed, by any of its readings.
fn off_position(frame: &FrameRecord, tolerance_mm: f64) -> Option<String> {
    let commanded_mm = frame.commanded_mm?;
    let readings = frame.certificate.iter().flat_map(|certificate| certificate.readings_mm);
    let mut places = readings.chain(frame.reported_mm);
    let place_mm = places.find(|place_mm| (place_mm - commanded_mm).abs() > tolerance_mm)?;
    Some(format!(
        "the stage was sent to {commanded_mm} mm and stood at {place_mm} mm, {tolerance_mm} mm are allowed"
    ))
}
