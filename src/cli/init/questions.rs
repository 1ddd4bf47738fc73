//! What `epirig init` asks a person about the rig.

use std::collections::BTreeMap;
use std::io::BufRead;

use crate::profile::{Draft, Mistake, Place, Problem, key};

/// The keys that are asked for, each with the key without which it has no meaning. What a given value needs in
/// addition is asked after it.
const QUESTIONS: [(&str, Option<&str>); 11] = [
    ("plan.start", None),
    ("plan.step", None),
    ("plan.frames", None),
    ("optics.focal_length", None),
    ("optics.distance", None),
    ("target.relief", None),
    ("target.square", None),
    ("target.bands", Some("target.square")),
    ("board.square", None),
    ("plan.board", Some("board.square")),
    ("camera.mains", None),
];

/// Asks for the lens, the steps and the boards, a line each from `input`; `say` prints. An empty line leaves a key
/// out, and the end of the input all that follow. Returns the draft with the answers.
pub(super) fn ask(draft: Draft, input: &mut impl BufRead, say: &mut dyn FnMut(&str)) -> Draft {
    say("Enter leaves a key out; it can be filled in later.");
    let mut asked = Asked { draft, input, say, left_out: Vec::new() };
    for (path, only_with) in QUESTIONS {
        if only_with.is_some_and(|other| asked.draft.value_of(other).is_none()) {
            continue;
        }
        if asked.one(path).is_none() {
            return asked.draft;
        }
        while let Some(needed) = asked.needed() {
            if asked.one(&needed).is_none() {
                return asked.draft;
            }
        }
    }
    asked.draft
}

struct Asked<'a, I> {
    draft: Draft,
    input: &'a mut I,
    say: &'a mut dyn FnMut(&str),
    /// Keys that are needed, and that the person has left out.
    left_out: Vec<String>,
}

impl<I: BufRead> Asked<'_, I> {
    /// Asks for the key at `path` until its value is allowed; `None` at the end of the input.
    fn one(&mut self, path: &str) -> Option<()> {
        let facts = key(path)?;
        loop {
            (self.say)(&format!("{path} (such as {}): {}?", facts.example, facts.meaning));
            let mut answer = String::new();
            // An input that cannot be read is at its end.
            if self.input.read_line(&mut answer).ok()? == 0 {
                return None;
            }
            let answer = answer.trim().to_owned();
            if answer.is_empty() {
                self.left_out.push(path.to_owned());
                return Some(());
            }
            let changed = self.draft.changed(&BTreeMap::from([(path.to_owned(), answer)]));
            let refused = mistakes(&changed).into_iter().find(|mistake| {
                let here = matches!(&mistake.place, Place::Draft { key } if key == path);
                here && !matches!(mistake.problem, Problem::Needs { .. })
            });
            match refused {
                Some(mistake) => (self.say)(&mistake.problem.to_string()),
                None => {
                    self.draft = changed;
                    return Some(());
                }
            }
        }
    }

    /// The next key that a given one needs, unless it was left out.
    fn needed(&self) -> Option<String> {
        mistakes(&self.draft).into_iter().find_map(|mistake| match mistake.problem {
            Problem::Needs { needed, .. } if !self.left_out.contains(&needed) => Some(needed),
            _ => None,
        })
    }
}

pub(super) fn mistakes(draft: &Draft) -> Vec<Mistake> {
    draft.profile().err().map_or(Vec::new(), |error| error.mistakes)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn asked(answers: &str) -> (Draft, String) {
        let mut said = String::new();
        let draft = Draft::read("", "rig.toml", &[]).unwrap();
        let draft = ask(draft, &mut answers.as_bytes(), &mut |line| said = format!("{said}{line}\n"));
        (draft, said)
    }

    #[test]
    fn answers_become_values_and_wrong_ones_are_asked_again() {
        // A focal length in mm needs the width of the sensor; squares need columns and rows, and two bands
        // their distance.
        let (draft, said) = asked(
            "10 mm\n1.5\n1.5 mm\n101\n25 mm\n9 mm\n\n0.2 mm\n7.5 mm\n18\n2\n2\n127.5 mm\n16 mm\n9\n6\n20\n50 Hz\n",
        );
        assert!(said.contains("plan.step = 1.5 has no unit"), "{said}");
        let profile = draft.profile().unwrap();
        assert_eq!((profile.plan.step_mm, profile.plan.frames), (Some(1.5), Some(101)));
        assert_eq!(profile.target.relief_mm, Some(0.2));
        let print = profile.target.print().unwrap();
        assert_eq!((print.board.columns, print.board.rows), (18, 2));
        assert_eq!(profile.optics.distance_mm, None);
        assert!(said.contains("optics.sensor_width") && said.contains("target.band_distance"), "{said}");
    }

    #[test]
    fn what_is_left_out_is_not_asked_again_and_the_end_ends() {
        let (draft, said) = asked("\n\n\n25 mm\n\n");
        assert_eq!(draft.value_of("optics.focal_length").as_deref(), Some("25 mm"));
        assert_eq!(said.matches("optics.sensor_width (").count(), 1, "{said}");
        assert!(!said.contains("target.bands"), "{said}");
        assert_eq!(mistakes(&draft).len(), 1, "the width of the sensor is missing");
    }
}
