//! The simulator and the reader of the GRBL dialect against a session recorded from GRBL 1.1h.
//!
//! The recording was made with GRBL 1.1h, as built by its authors, running in simavr with a stage on its pins.

use std::time::Duration;

use epirig_devices::link::SimulatedDevice;
use epirig_devices::stage::grbl::{Response, State};
use epirig_devices::stage::simulator::{FaultScript, GrblDevice};

const SESSION: &str = include_str!("data/grbl-1.1h-session.log");

/// A line of the recording.
#[derive(Debug, Clone, PartialEq)]
enum Event {
    Sent(Vec<u8>),
    Heard(String),
    /// What was done to the rig.
    Rig(String),
}

fn events() -> Vec<(Duration, Event)> {
    let mut events = Vec::new();
    for line in SESSION.lines() {
        let Some((time, rest)) = line.trim_start().split_once(' ') else { continue };
        let Ok(time) = time.parse().map(Duration::from_secs_f64) else { continue };
        let event = if let Some(heard) = rest.strip_prefix("< ") {
            // Some polls are recorded with how long they took.
            let end = if heard.starts_with('<') {
                heard.find('>').map_or(heard.len(), |at| at + 1)
            } else {
                heard.len()
            };
            Event::Heard(heard[..end].to_owned())
        } else if let Some(rig) = rest.strip_prefix("SIM ").filter(|rig| !rig.starts_with('=')) {
            Event::Rig(rig.to_owned())
        } else if let Some(sent) = rest.strip_prefix("> ") {
            Event::Sent(match sent {
                "?" | "!" | "~" => sent.as_bytes().to_vec(),
                byte if byte.starts_with("0x") => vec![u8::from_str_radix(&byte[2..4], 16).unwrap()],
                line => format!("{line}\n").into_bytes(),
            })
        } else {
            continue;
        };
        events.push((time, event));
    }
    events
}

/// Lets simulated time pass; what the device says comes back line by line, with the time.
fn listen(
    device: &mut GrblDevice,
    partly: &mut Vec<u8>,
    from: Duration,
    to: Duration,
) -> Vec<(Duration, String)> {
    let step = Duration::from_millis(1);
    let (mut now, mut lines) = (from, Vec::new());
    while now < to {
        device.advance(step);
        now += step;
        for byte in device.take_sent() {
            match byte {
                b'\r' => {}
                b'\n' => lines.push((now, String::from_utf8(std::mem::take(partly)).unwrap())),
                byte => partly.push(byte),
            }
        }
    }
    lines.retain(|(_, line)| !line.is_empty());
    lines
}

/// What of a line must be the same. Positions in motion depend on the moment, those after a hold on where it was held.
fn same(recorded: &str, simulated: &str, tolerance_mm: f64) -> bool {
    match (Response::parse(recorded), Response::parse(simulated)) {
        (Response::Status(recorded), Response::Status(simulated)) => {
            let off_mm = (recorded.position_mm[0] - simulated.position_mm[0]).abs();
            let tolerance_mm = if recorded.state.moving() { tolerance_mm.max(0.3) } else { tolerance_mm };
            recorded.state == simulated.state && off_mm <= tolerance_mm
        }
        (recorded, simulated) => recorded == simulated,
    }
}

#[test]
fn the_simulator_says_what_grbl_said() {
    let events = events();
    // Before, GRBL finds its memory empty (error:7), as a new board does; the simulator begins with the defaults. After, two
    // inputs are not in the recording.
    let first = events.iter().position(|(_, event)| *event == Event::Sent(b"$I\n".to_vec())).unwrap();
    let last = events
        .iter()
        .position(|(_, event)| matches!(event, Event::Sent(line) if line.starts_with(b"G1 X1X1")))
        .unwrap();
    let mut device = GrblDevice::factory(FaultScript::default());
    let mut partly = Vec::new();
    let mut now = events[first].0;
    listen(&mut device, &mut partly, Duration::ZERO, Duration::from_millis(100));
    let (mut index, mut compared, mut tolerance_mm) = (first, 0, 0.0005);
    while index < last {
        let (_, event) = &events[index];
        match event {
            Event::Sent(bytes) => {
                // From here on positions depend on the very moment of a hold.
                if bytes == b"!" {
                    tolerance_mm = 0.5;
                }
                bytes.iter().for_each(|&byte| device.receive(byte));
            }
            Event::Rig(what) => match what.as_str() {
                "reset" => device.power_cycle(),
                "lim x 1" => device.plant().press_switches(true),
                "lim x 0" => device.plant().set_switches_work(false),
                "lim x auto" => {
                    device.plant().press_switches(false);
                    device.plant().set_switches_work(true);
                }
                // The recorder left out the line that began the homing ("homed in 7.60 s").
                "sw z 500" => b"$H\n".iter().for_each(|&byte| device.receive(byte)),
                _ => {}
            },
            Event::Heard(_) => unreachable!("heard lines are taken with what comes before them"),
        }
        let answers: Vec<&str> = events[index + 1..]
            .iter()
            .map_while(|(_, event)| if let Event::Heard(line) = event { Some(line.as_str()) } else { None })
            .filter(|line| !line.is_empty())
            .collect();
        index +=
            1 + events[index + 1..].iter().take_while(|(_, event)| matches!(event, Event::Heard(_))).count();
        let until = events[index].0.max(now + Duration::from_millis(1));
        let mut heard = listen(&mut device, &mut partly, now, until);
        // The recorder polled until the stage stood, and kept the last answer only.
        if answers.len() > heard.len() && answers.last().is_some_and(|line| line.starts_with("<Idle")) {
            device.receive(b'?');
            heard.extend(listen(&mut device, &mut partly, until, until + Duration::from_millis(2)));
        }
        now = until;
        let said: Vec<&str> = heard.iter().map(|(_, line)| line.as_str()).collect();
        assert_eq!(answers.len(), said.len(), "{event:?}: {answers:?} recorded, {said:?} simulated");
        for (recorded, simulated) in answers.iter().zip(&said) {
            assert!(
                same(recorded, simulated, tolerance_mm),
                "{event:?}: {recorded} recorded, {simulated} simulated"
            );
            compared += 1;
        }
    }
    assert!(compared > 100, "the comparison has gone blind: {compared} lines");
}

#[test]
fn moves_take_as_long_as_they_took_grbl() {
    // The recording's step spans: 1.5 mm at 10 mm/s2 from the first pulse to the last, and the barrier's answers.
    let mut device = GrblDevice::factory(FaultScript::default());
    let mut partly = Vec::new();
    listen(&mut device, &mut partly, Duration::ZERO, Duration::from_millis(100));
    b"G91 G0 X1.5\nG4 P0\n".iter().for_each(|&byte| device.receive(byte));
    let heard = listen(&mut device, &mut partly, Duration::ZERO, Duration::from_secs(2));
    assert_eq!(heard.len(), 2);
    // 821.7 ms in the recording, with the planner's own delay and the serial line; 775 ms by the formula.
    let took = heard[1].0.as_secs_f64();
    assert!((0.7541..=0.8217).contains(&took), "{took} s");
}

#[test]
fn a_flood_of_lines_is_accepted_before_it_is_done() {
    let mut device = GrblDevice::factory(FaultScript::default());
    let mut partly = Vec::new();
    listen(&mut device, &mut partly, Duration::ZERO, Duration::from_millis(100));
    b"G91 G0 X0.1\n".repeat(12).iter().for_each(|&byte| device.receive(byte));
    let heard = listen(&mut device, &mut partly, Duration::ZERO, Duration::from_millis(20));
    assert_eq!(heard.iter().filter(|(_, line)| line == "ok").count(), 12);
    device.receive(b'?');
    let heard = listen(&mut device, &mut partly, Duration::ZERO, Duration::from_millis(2));
    assert!(heard[0].1.starts_with("<Run|"), "{heard:?}");
}

#[test]
fn every_line_of_the_recording_is_understood() {
    let mut kinds = std::collections::BTreeMap::<&str, usize>::new();
    for (_, event) in events() {
        let Event::Heard(line) = event else { continue };
        let kind = match Response::parse(&line) {
            Response::Unknown(line) if line.is_empty() => "empty",
            // Two answers that ran into one another while it booted, with its prompt.
            Response::Unknown(line) => {
                assert_eq!(line, ">:error:7");
                "start-up line"
            }
            Response::Status(status) => {
                assert_eq!(status.position_mm.len(), 3);
                if status.state == State::Idle { "idle" } else { "other state" }
            }
            Response::Ok => "ok",
            Response::Error(_) => "error",
            Response::Alarm(_) => "alarm",
            Response::Banner { version } => {
                assert_eq!(version, "1.1h");
                "banner"
            }
            Response::Setting { .. } => "setting",
            Response::Feedback { .. } => "feedback",
            other => panic!("{other:?}"),
        };
        *kinds.entry(kind).or_default() += 1;
    }
    let count = |kind: &str| kinds.get(kind).copied().unwrap_or(0);
    assert_eq!((count("setting"), count("alarm"), count("start-up line")), (68, 5, 2), "{kinds:?}");
    assert!(count("ok") > 30 && count("error") >= 12 && count("banner") >= 8, "{kinds:?}");
}
