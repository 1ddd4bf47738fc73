//! Orders to the thread that owns the rig.

use std::collections::VecDeque;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use crate::profile::Draft;
use epirig_devices::camera::SimView;

/// Where the owner of the rig answers an order.
#[derive(Debug, Clone)]
pub(in crate::panel) struct Reply(SyncSender<Result<(), String>>);

impl Reply {
    /// A reply, and where it arrives.
    pub(in crate::panel) fn new() -> (Self, Receiver<Result<(), String>>) {
        let (sender, receiver) = sync_channel(1);
        (Self(sender), receiver)
    }

    /// Answers; who asked may have given up waiting.
    pub(in crate::panel) fn give(&self, answer: Result<(), String>) {
        let _ = self.0.try_send(answer);
    }
}

/// What the owner of the rig is to do.
#[derive(Debug, Clone)]
pub(in crate::panel) enum Order {
    /// Open stage and camera anew.
    Connect,
    /// Use another profile from now on: it comes with the order, so that no other thread can see the one without
    /// the other.
    Use { draft: Box<Draft>, reply: Reply },
    /// Home the stage.
    Home,
    /// Move to a position, in mm from home.
    Go { mm: f64 },
    /// Move by a distance, in mm.
    Step { mm: f64 },
    /// Move while the jog is held.
    Jog { id: u64, up: bool, fast: bool },
    /// The stop switch was pressed: make sure that the stage stands, and release the switch.
    Stopped,
    /// Set a control of the camera.
    SetControl { name: String, value: String, reply: Reply },
    /// Show something else to a simulated camera.
    Show(SimView),
    /// Examine the rig.
    Examine { short: bool },
    /// Take the frames of a sequence in this folder of the panel.
    Scan { name: String, resumed: bool },
    /// End.
    End,
}

/// Orders in their sequence.
#[derive(Debug, Default)]
pub(in crate::panel) struct Mailbox {
    orders: Mutex<VecDeque<Order>>,
    arrived: Condvar,
}

impl Mailbox {
    fn held(&self) -> MutexGuard<'_, VecDeque<Order>> {
        self.orders.lock().unwrap_or_else(PoisonError::into_inner)
    }

    pub(in crate::panel) fn put(&self, order: Order) {
        self.held().push_back(order);
        self.arrived.notify_all();
    }

    /// Forgets all orders but that to end.
    pub(in crate::panel) fn clear(&self) {
        self.held().retain(|order| matches!(order, Order::End));
    }

    /// The next order, if one comes within `patience`.
    pub(in crate::panel) fn take(&self, patience: Duration) -> Option<Order> {
        let orders = self.held();
        let waited = self.arrived.wait_timeout_while(orders, patience, |orders| orders.is_empty());
        let (mut orders, _) = waited.unwrap_or_else(PoisonError::into_inner);
        orders.pop_front()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn orders_come_in_their_sequence_and_the_end_is_not_forgotten() {
        let mailbox = Mailbox::default();
        assert!(mailbox.take(Duration::ZERO).is_none());
        for order in [Order::Home, Order::Go { mm: 3.0 }, Order::End] {
            mailbox.put(order);
        }
        assert!(matches!(mailbox.take(Duration::ZERO), Some(Order::Home)));
        mailbox.clear();
        assert!(matches!(mailbox.take(Duration::ZERO), Some(Order::End)));
    }
}
