//! A motion that goes on only while somebody holds it.

use std::time::{Duration, Instant};

/// Without a word from the page for this long, the motion ends.
const PATIENCE: Duration = Duration::from_millis(300);

/// The button that is held.
#[derive(Debug, Clone, Copy)]
struct Held {
    id: u64,
    heard: Instant,
}

/// The button that is held, if one is.
#[derive(Debug, Default)]
pub(in crate::panel) struct Jog(Option<Held>);

impl Jog {
    /// A button is pressed; another one counts as released.
    pub(in crate::panel) fn press(&mut self, id: u64, now: Instant) {
        self.0 = Some(Held { id, heard: now });
    }

    /// The button is still held; returns whether that counts. One that was released or forgotten stays so.
    pub(in crate::panel) fn keep(&mut self, id: u64, now: Instant) -> bool {
        self.0.as_mut().filter(|held| held.is(id, now)).map(|held| held.heard = now).is_some()
    }

    pub(in crate::panel) fn release(&mut self, id: u64) {
        self.0.take_if(|held| held.id == id);
    }

    pub(in crate::panel) fn release_all(&mut self) {
        self.0 = None;
    }

    /// Whether the button is held, as far as one can know.
    pub(in crate::panel) fn is_held(&self, id: u64, now: Instant) -> bool {
        self.0.is_some_and(|held| held.is(id, now))
    }
}

impl Held {
    fn is(&self, id: u64, now: Instant) -> bool {
        self.id == id && now.saturating_duration_since(self.heard) <= PATIENCE
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_jog_lives_by_words_of_the_page_and_never_comes_back() {
        let (mut jog, began) = (Jog::default(), Instant::now());
        let at = |milliseconds| began + Duration::from_millis(milliseconds);
        assert!(!jog.keep(1, at(0)));
        assert!(!jog.is_held(1, at(0)), "nobody pressed it");
        jog.press(1, at(0));
        assert!(jog.is_held(1, at(300)) && !jog.is_held(1, at(301)));
        assert!(jog.keep(1, at(200)));
        assert!(jog.is_held(1, at(500)) && !jog.is_held(1, at(501)));
        assert!(!jog.keep(1, at(600)));
        assert!(!jog.is_held(1, at(600)), "it was silent for too long");
        jog.press(2, at(600));
        jog.release(1);
        assert!(jog.is_held(2, at(700)), "another button was released");
        jog.release(2);
        assert!(!jog.keep(2, at(710)));
        assert!(!jog.is_held(2, at(710)));
    }
}
