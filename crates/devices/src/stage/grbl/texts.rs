//! Explanations of GRBL's numbers (GRBL 1.1, `doc/csv`).

/// Meaning of an alarm and what to do.
pub fn alarm_text(code: u8) -> &'static str {
    match code {
        1 => "a limit switch closed in a move, so steps were lost or the travel is set too long; home it",
        2 => {
            "the target is beyond the stage's own soft limits, and nothing moved; check $130 to $132, then home it"
        }
        3 => "it was reset while it moved, its position is lost; home it",
        4 | 5 => {
            "a probe failed, which epirig never uses: another program sends commands; end that program and home it"
        }
        6 => "it was reset while homing; home it again",
        7 => "the safety door opened while homing; close it and home it again",
        8 => {
            "homing moved off the limit switch, which stayed closed; check the switch and raise $27 (pull-off)"
        }
        9 => {
            "homing never found the limit switch; check switch and cable, the motor's power, $23 (direction) and $130 (travel)"
        }
        10 => "homing did not find the second switch of a dual axis; check both switches",
        _ => "an alarm that GRBL 1.1 does not have; reset and home it",
    }
}

/// Meaning of an error and what to do.
pub fn error_text(code: u8) -> &'static str {
    match code {
        1 => "a word did not begin with a letter: the line was damaged on its way; check the cable",
        2 => "a number is missing or damaged: the line was damaged on its way; check the cable",
        3 => "it does not know the command; it may not be GRBL 1.1",
        4 => "a value must not be negative",
        5 => "homing is switched off; switch it on with $22=1",
        6 => "a step pulse must take 3 us at least ($0)",
        7 => "its settings could not be read from memory and are back at the defaults; set them again",
        8 => "it must be idle for this; wait until it is at rest",
        9 => "it is locked until it is homed; home it",
        10 => "soft limits ($20) need homing; switch it on with $22=1 first",
        11 => "the line is longer than it can take: it was damaged on its way; check the cable",
        12 => "the setting asks for more steps a second than it can make",
        13 => "the safety door is open; close it",
        14 => "its start-up line or build text is too long",
        15 => "the target is outside its travel; nothing moved",
        16 => "a jog command is incomplete or damaged",
        17 => "laser mode needs a spindle with PWM",
        20 => "the command is not supported, or was damaged on its way",
        21 => "two commands of one group in a line: it was damaged on its way",
        22 => "no feed rate is set",
        23 => "the command needs a whole number: it was damaged on its way",
        24 | 25 | 26 | 28..=38 => "the line is not valid G-code: it was damaged on its way; check the cable",
        27 => "a line number is too large",
        _ => "an error that GRBL 1.1 does not have; it may be another controller",
    }
}
