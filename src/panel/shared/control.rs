//! Which of several pages moves and sets things.

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

/// A page that has gone keeps control for so long: it may only have been loaded anew.
const GRACE: Duration = Duration::from_secs(10);

/// The page that has control, if one has, and the pages that are there.
#[derive(Debug, Default)]
pub(in crate::panel) struct Controller {
    holder: Option<Holder>,
    /// How often each page follows the state.
    present: BTreeMap<String, usize>,
}

#[derive(Debug)]
struct Holder {
    client: String,
    /// When it was last there.
    seen: Instant,
}

impl Controller {
    /// Whether `client` has control: the first page that asks, until another takes it or it has gone.
    pub(in crate::panel) fn asks(&mut self, client: &str, now: Instant) -> bool {
        self.release(now);
        match &mut self.holder {
            Some(holder) if holder.client != client => false,
            _ => {
                self.takes(client, now);
                true
            }
        }
    }

    /// Gives control to `client`.
    pub(in crate::panel) fn takes(&mut self, client: &str, now: Instant) {
        self.holder = Some(Holder { client: client.to_owned(), seen: now });
    }

    /// A page follows the state from now on.
    pub(in crate::panel) fn comes(&mut self, client: &str) {
        *self.present.entry(client.to_owned()).or_default() += 1;
    }

    /// It follows it no longer.
    pub(in crate::panel) fn goes(&mut self, client: &str, now: Instant) {
        if let Some(count) = self.present.get_mut(client) {
            *count -= 1;
            if *count == 0 {
                self.present.remove(client);
            }
        }
        if let Some(holder) = self.holder.as_mut().filter(|holder| holder.client == client) {
            holder.seen = now;
        }
    }

    /// Frees the control of a page that has gone.
    pub(in crate::panel) fn release(&mut self, now: Instant) {
        let present = &self.present;
        self.holder.take_if(|holder| {
            !present.contains_key(&holder.client) && now.saturating_duration_since(holder.seen) > GRACE
        });
    }

    /// Who has control.
    pub(in crate::panel) fn holder(&self) -> Option<&str> {
        self.holder.as_ref().map(|holder| holder.client.as_str())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_page_has_control_until_another_takes_it() {
        let (mut controller, now) = (Controller::default(), Instant::now());
        assert!(controller.asks("a", now));
        assert!(!controller.asks("b", now));
        assert_eq!(controller.holder(), Some("a"));
        controller.takes("b", now);
        assert!(!controller.asks("a", now));
        assert_eq!(controller.holder(), Some("b"));
    }

    #[test]
    fn control_of_a_page_that_has_gone_is_free_after_a_while() {
        let (mut controller, began) = (Controller::default(), Instant::now());
        let at = |seconds| began + Duration::from_secs(seconds);
        controller.comes("a");
        assert!(controller.asks("a", at(0)));
        controller.release(at(3600));
        assert_eq!(controller.holder(), Some("a"), "it is there and does nothing");
        // Loaded anew: it comes back in time.
        controller.goes("a", at(3600));
        controller.release(at(3609));
        controller.comes("a");
        controller.release(at(3700));
        assert_eq!(controller.holder(), Some("a"));
        // In two windows: one stays.
        controller.comes("a");
        controller.goes("a", at(3700));
        controller.release(at(3800));
        assert_eq!(controller.holder(), Some("a"));
        controller.goes("a", at(3800));
        assert!(!controller.asks("b", at(3810)));
        controller.release(at(3811));
        assert_eq!(controller.holder(), None);
        assert!(controller.asks("b", at(3811)));
    }

    #[test]
    fn who_only_gives_orders_is_there_while_it_gives_them() {
        let (mut controller, began) = (Controller::default(), Instant::now());
        let at = |seconds| began + Duration::from_secs(seconds);
        for seconds in [0, 9, 18] {
            assert!(controller.asks("script", at(seconds)));
        }
        assert!(!controller.asks("b", at(28)));
        assert!(controller.asks("b", at(29)));
    }
}
