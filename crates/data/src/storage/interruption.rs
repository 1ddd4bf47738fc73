//! The end of the program by a signal, which waits for the step of the disk that is under way.

use std::time::Duration;

use super::scratch::Scratch;
use super::step::close;

/// For a program that ends now: lets no further step begin, waits for those under way, and removes all
/// scratch folders. Other threads that want to write wait from now on.
///
/// `false`: after `patience` the disk had not answered, and everything was left as it is.
pub fn abandon(patience: Duration) -> bool {
    let quiet = close(patience);
    if quiet {
        Scratch::remove_all();
    }
    quiet
}
