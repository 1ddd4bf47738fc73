//! Seats for connections. When all are taken, a newcomer gets that of who has been idle for longest: whoever comes
//! to stop a machine is heard, however many others hold a connection and say nothing.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use tokio::sync::oneshot;
use tracing::debug;

/// All seats.
pub(super) struct Seats {
    most: usize,
    taken: Taken,
}

#[derive(Clone, Default)]
struct Taken(Arc<Mutex<Book>>);

/// Who sits where.
#[derive(Default)]
struct Book {
    /// Counts what happens.
    moment: u64,
    seated: BTreeMap<u64, Seated>,
}

/// A connection that has a seat.
struct Seated {
    /// Whether a request is being answered, and the moment since when it is so. The smallest gives way first.
    rank: (bool, u64),
    /// Asks it to go.
    leave: oneshot::Sender<()>,
}

impl Taken {
    fn book(&self) -> MutexGuard<'_, Book> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Book {
    fn count(&mut self) -> u64 {
        self.moment += 1;
        self.moment
    }

    fn set_busy(&mut self, number: u64, busy: bool) {
        let moment = self.count();
        // One that was asked to go is no longer here.
        if let Some(seated) = self.seated.get_mut(&number) {
            seated.rank = (busy, moment);
        }
    }
}

impl Seats {
    /// So many seats, at least one.
    pub(super) fn new(most: usize) -> Self {
        Self { most: most.max(1), taken: Taken::default() }
    }

    /// A seat for a newcomer.
    pub(super) fn next(&self) -> Seat {
        let mut book = self.taken.book();
        while book.seated.len() >= self.most
            && let Some(number) =
                book.seated.iter().min_by_key(|(_, seated)| seated.rank).map(|found| *found.0)
        {
            debug!("too many connections; the one that was idle for longest is closed");
            if let Some(seated) = book.seated.remove(&number) {
                // One that ends by itself hears nothing.
                let _ = seated.leave.send(());
            }
        }
        let number = book.count();
        let (leave, asked) = oneshot::channel();
        book.seated.insert(number, Seated { rank: (false, number), leave });
        Seat { number, taken: self.taken.clone(), asked: Some(asked) }
    }
}

/// A seat, given back when it is dropped.
pub(super) struct Seat {
    number: u64,
    taken: Taken,
    asked: Option<oneshot::Receiver<()>>,
}

impl Seat {
    /// What tells that requests of this connection are being answered.
    pub(super) fn desk(&self) -> Desk {
        Desk { number: self.number, taken: self.taken.clone() }
    }

    /// Serves the connection until it ends, or somebody else needs the seat.
    pub(super) async fn hold(mut self, connection: impl Future<Output = ()>) {
        let Some(asked) = self.asked.take() else { return };
        tokio::select! {
            () = connection => {}
            _ = asked => {}
        }
    }
}

impl Drop for Seat {
    fn drop(&mut self) {
        self.taken.book().seated.remove(&self.number);
    }
}

/// Where requests of one connection are answered.
#[derive(Clone)]
pub(super) struct Desk {
    number: u64,
    taken: Taken,
}

impl Desk {
    /// A request is being answered until what is returned is dropped.
    pub(super) fn answering(&self) -> Answering {
        self.taken.book().set_busy(self.number, true);
        Answering(self.clone())
    }
}

/// A request that is being answered.
pub(super) struct Answering(Desk);

impl Drop for Answering {
    fn drop(&mut self) {
        self.0.taken.book().set_busy(self.0.number, false);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Whether each seat was asked for.
    fn asked(seats: &mut [Seat]) -> Vec<bool> {
        seats.iter_mut().map(|seat| seat.asked.as_mut().unwrap().try_recv().is_ok()).collect()
    }

    #[test]
    fn who_is_idle_for_longest_gives_way_and_who_is_answered_does_not() {
        let seats = Seats::new(3);
        let mut taken: Vec<Seat> = (0..3).map(|_| seats.next()).collect();
        let first = taken[0].desk().answering();
        drop(taken[1].desk().answering());
        // The first is being answered, the second was a moment ago.
        let fourth = seats.next();
        assert_eq!(asked(&mut taken), [false, false, true]);
        drop(first);
        taken.truncate(2);
        taken.push(fourth);
        let _fifth = seats.next();
        assert_eq!(asked(&mut taken), [false, true, false]);
    }

    #[test]
    fn a_seat_that_is_given_back_is_free() {
        let seats = Seats::new(1);
        drop(seats.next());
        let mut second = [seats.next()];
        assert_eq!(asked(&mut second), [false]);
        // If all are being answered, the longest one gives way.
        let _answering = second[0].desk().answering();
        let _third = seats.next();
        assert_eq!(asked(&mut second), [true]);
    }
}
