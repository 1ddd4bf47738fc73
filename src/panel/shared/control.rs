//! Which of several pages moves and sets things.

/// The page that has control, if one has.
#[derive(Debug, Default)]
pub(in crate::panel) struct Controller(Option<String>);

impl Controller {
    /// Whether `client` has control, and who has it now: the first page that asks, until another takes it.
    pub(in crate::panel) fn asks(&mut self, client: &str) -> (bool, String) {
        let holder = self.0.get_or_insert_with(|| client.to_owned());
        (holder == client, holder.clone())
    }

    /// Gives control to `client`.
    pub(in crate::panel) fn takes(&mut self, client: &str) -> String {
        self.0.insert(client.to_owned()).clone()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_page_has_control_until_another_takes_it() {
        let mut controller = Controller::default();
        assert_eq!(controller.asks("a"), (true, "a".to_owned()));
        assert_eq!(controller.asks("b"), (false, "a".to_owned()));
        assert_eq!(controller.takes("b"), "b");
        assert_eq!(controller.asks("a"), (false, "b".to_owned()));
    }
}
