//! Lines of the GRBL dialect: system commands and the G-code that a stage needs.

use super::modal::Modal;
use super::motion::Block;
use super::settings::AXES;
use super::{GrblDevice, LONGEST_LINE, State, Waiting};

/// The content of a line of G-code.
#[derive(Debug, Clone, Copy, Default)]
struct Words {
    dwell: bool,
    machine: bool,
    set_offset: bool,
    axes_mm: [Option<f64>; AXES],
}

/// GRBL's number of an error.
type Refusal = u8;

impl GrblDevice {
    pub(super) fn execute(&mut self, line: &[u8]) {
        let line = String::from_utf8_lossy(line).into_owned();
        let done = if line.len() > LONGEST_LINE {
            Err(11)
        } else if let Some(command) = line.strip_prefix('$') {
            self.system(command)
        } else if line.is_empty() {
            Ok(true)
        } else if matches!(self.state, State::Alarm | State::Jog) {
            Err(9)
        } else {
            self.gcode(&line)
        };
        match done {
            Ok(true) => self.say("ok"),
            // Answered later.
            Ok(false) => {}
            Err(code) => self.say(&format!("error:{code}")),
        }
    }

    fn system(&mut self, command: &str) -> Result<bool, Refusal> {
        let at_rest = matches!(self.state, State::Idle | State::Alarm);
        match command {
            "$" if at_rest => self.table.lines().iter().for_each(|line| self.say(line)),
            "I" if at_rest => {
                self.say("[VER:1.1h.20190830:]");
                self.say("[OPT:V,15,128]");
            }
            "" => self.say("[HLP:$$ $# $G $I $N $x=val $Nx=line $J=line $SLP $C $X $H ~ ! ? ctrl-x]"),
            "G" => {
                let motion = if self.modal.rapid { "G0" } else { "G1" };
                let distance = if self.modal.absolute { "G90" } else { "G91" };
                let feed = self.modal.feed_mm_min;
                self.say(&format!("[GC:{motion} G54 G17 G21 {distance} G94 M5 M9 T0 F{feed:.0} S0]"));
            }
            "X" => {
                if self.state == State::Alarm {
                    self.state = State::Idle;
                    self.say("[MSG:Caution: Unlocked]");
                }
            }
            "H" if !self.table.on(22) => return Err(5),
            "H" if at_rest => {
                self.state = State::Home;
                self.waiting = Some(Waiting::Homing);
                self.motion.begin_homing(&self.table);
                return Ok(false);
            }
            "$" | "I" | "H" => return Err(8),
            _ => {
                if let Some(jog) = command.strip_prefix("J=") {
                    return self.jog(jog);
                }
                return self.set(command, at_rest).map(|()| true);
            }
        }
        Ok(true)
    }

    fn set(&mut self, command: &str, at_rest: bool) -> Result<(), Refusal> {
        let (number, value) = command.split_once('=').ok_or(3_u8)?;
        let number: u8 = number.parse().map_err(|_| 3_u8)?;
        let value: f64 = value.parse().map_err(|_| 2_u8)?;
        match number {
            _ if !at_rest => Err(8),
            _ if !self.table.knows(number) => Err(3),
            _ if value < 0.0 => Err(4),
            // Soft limits need homing, so switching homing off switches them off too.
            20 if value != 0.0 && !self.table.on(22) => Err(10),
            _ => {
                self.table.set(number, value);
                if number == 22 && value == 0.0 {
                    self.table.set(20, 0.0);
                }
                Ok(())
            }
        }
    }

    fn jog(&mut self, line: &str) -> Result<bool, Refusal> {
        if !matches!(self.state, State::Idle | State::Jog) {
            return Err(8);
        }
        // It has a feed of its own.
        let mut modal = Modal { feed_mm_min: 0.0, ..self.modal };
        let words = parse(line, &mut modal)?;
        if words.axes_mm.iter().all(Option::is_none) || words.dwell || words.set_offset {
            return Err(16);
        }
        if modal.feed_mm_min <= 0.0 {
            return Err(22);
        }
        let target_mm = self.target_mm(&words, &modal);
        if self.table.on(20) && self.beyond(target_mm) {
            return Err(15);
        }
        Ok(self.enqueue(Block::new(target_mm, Some(modal.feed_mm_min), true)))
    }

    fn gcode(&mut self, line: &str) -> Result<bool, Refusal> {
        let mut modal = self.modal;
        let words = parse(line, &mut modal)?;
        let moves = words.axes_mm.iter().any(Option::is_some) && !words.set_offset;
        if moves && !modal.rapid && modal.feed_mm_min <= 0.0 {
            return Err(22);
        }
        self.modal = modal;
        if words.set_offset {
            let planned_mm = self.motion.planned_mm(&self.table);
            for ((offset, word), planned) in
                self.modal.offset_mm.iter_mut().zip(words.axes_mm).zip(planned_mm)
            {
                *offset = word.map_or(*offset, |word| planned - word);
            }
            self.offset_in = 0;
        }
        if words.dwell {
            self.waiting = Some(Waiting::Motion);
            return Ok(false);
        }
        if !moves {
            return Ok(true);
        }
        let target_mm = self.target_mm(&words, &self.modal);
        if self.table.on(20) && self.beyond(target_mm) {
            self.waiting = Some(Waiting::SoftLimit);
            if self.motion.moving() {
                self.hold();
            }
            return Ok(false);
        }
        let feed = (!self.modal.rapid).then_some(self.modal.feed_mm_min);
        Ok(self.enqueue(Block::new(target_mm, feed, false)))
    }

    fn enqueue(&mut self, block: Block) -> bool {
        let room = self.motion.queue(block);
        if !room {
            self.waiting = Some(Waiting::Room(block));
        }
        room
    }

    fn target_mm(&self, words: &Words, modal: &Modal) -> [f64; AXES] {
        let mut target_mm = self.motion.planned_mm(&self.table);
        for (axis, word) in words.axes_mm.iter().enumerate() {
            if let Some(word) = word {
                target_mm[axis] = match (words.machine, modal.absolute) {
                    (true, _) => *word,
                    (false, true) => word + modal.offset_mm[axis],
                    (false, false) => target_mm[axis] + word,
                };
            }
        }
        target_mm
    }

    /// Machine coordinates range from minus the travel to 0.
    fn beyond(&self, target_mm: [f64; AXES]) -> bool {
        (130..).zip(target_mm).any(|(travel, mm)| mm > 0.0 || mm < -self.table.get(travel))
    }
}

/// Parses words such as `G90`, `X-2.5`, `F300`, and updates `modal`.
fn parse(line: &str, modal: &mut Modal) -> Result<Words, Refusal> {
    let mut words = Words::default();
    let mut rest = line;
    while let Some(letter) = rest.chars().next() {
        if !letter.is_ascii_uppercase() {
            return Err(1);
        }
        rest = &rest[1..];
        let end = rest.find(|c: char| !matches!(c, '0'..='9' | '.' | '-' | '+')).unwrap_or(rest.len());
        let number: f64 = rest[..end].parse().map_err(|_| 2_u8)?;
        rest = &rest[end..];
        match (letter, number) {
            ('G', 0.0) => modal.rapid = true,
            ('G', 1.0) => modal.rapid = false,
            ('G', 4.0) => words.dwell = true,
            ('G', 21.0 | 54.0 | 94.0 | 17.0) => {}
            ('G', 53.0) => words.machine = true,
            ('G', 90.0) => modal.absolute = true,
            ('G', 91.0) => modal.absolute = false,
            ('G', 92.0) => words.set_offset = true,
            ('X' | 'Y' | 'Z', _) => {
                let axis = &mut words.axes_mm[usize::from(letter as u8 - b'X')];
                if axis.replace(number).is_some() {
                    return Err(25);
                }
            }
            ('F', _) if number >= 0.0 => modal.feed_mm_min = number,
            ('P', _) if number >= 0.0 => {}
            ('F' | 'P', _) => return Err(4),
            _ => return Err(20),
        }
    }
    Ok(words)
}
