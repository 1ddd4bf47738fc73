//! Asking a person to put something in front of the camera.

use std::io::{BufRead, IsTerminal};

use crate::capture::{Arrangement, Assistant};
use crate::cli::Talk;

/// The person at the terminal.
pub(in crate::cli) struct Hands<'a>(pub(in crate::cli) &'a Talk);

impl Assistant for Hands<'_> {
    fn arrange(&mut self, arrangement: Arrangement) -> bool {
        if !std::io::stdin().is_terminal() {
            self.0.say("note: nobody is at the terminal to be asked for dark and flat frames");
            return false;
        }
        self.0.aside(|| {
            eprintln!("put {}, then press Enter", arrangement.words());
            std::io::stdin().lock().read_line(&mut String::new()).is_ok_and(|bytes| bytes > 0)
        })
    }
}
