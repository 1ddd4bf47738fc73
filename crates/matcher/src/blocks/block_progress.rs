//! Progress of a match of several blocks, told as one.

use std::ops::Range;
use std::sync::{Mutex, PoisonError};

use super::Blocks;
use epirig_core::progress::Progress;

/// Passes over the rows of a block that are told: the search and the fit.
const PASSES: u64 = 2;

/// Progress of the blocks of a match, told to a listener as one piece of work.
///
/// It begins when it is made, and ends with [`finish`](Self::finish).
pub(crate) struct BlockProgress<'a> {
    all: &'a dyn Progress,
    blocks: &'a Blocks,
    state: Mutex<State>,
}

#[derive(Debug, Default)]
struct State {
    /// The block that is matched next, and the rows of the one that is matched.
    next: usize,
    rows: u64,
    /// Parts of its pass, and how many of them are done.
    parts: u64,
    done: u64,
    /// Rows of the pass that were told.
    told: u64,
}

impl<'a> BlockProgress<'a> {
    /// Begins to tell `all` of the match of these `blocks`.
    pub(crate) fn begin(all: &'a dyn Progress, blocks: &'a Blocks, matched: Range<usize>) -> Self {
        let rows: usize = matched.clone().map(|block| blocks.needed_rows(block).len()).sum();
        all.begin(&format!("matching {} blocks of rows", matched.len()), PASSES * rows as u64);
        Self { all, blocks, state: Mutex::new(State { next: matched.start, ..State::default() }) }
    }

    /// The next block is matched.
    pub(crate) fn next_block(&self) {
        self.change(|state| {
            let rows = self.blocks.needed_rows(state.next).len() as u64;
            *state = State { next: state.next + 1, rows, ..State::default() };
        });
    }

    /// All blocks are matched.
    pub(crate) fn finish(self) {
        self.all.end();
    }

    fn change<T>(&self, change: impl FnOnce(&mut State) -> T) -> T {
        // A thread that panicked has left counts, which are no more than wrong.
        change(&mut self.state.lock().unwrap_or_else(PoisonError::into_inner))
    }
}

impl State {
    /// Rows that are done and were not told yet.
    fn untold(&mut self) -> u64 {
        let done = self.rows * self.done.min(self.parts) / self.parts.max(1);
        let untold = done.saturating_sub(self.told);
        self.told += untold;
        untold
    }
}

impl Progress for BlockProgress<'_> {
    fn begin(&self, _what: &str, total: u64) {
        self.change(|state| (state.parts, state.done, state.told) = (total, 0, 0));
    }
    fn advance(&self, count: u64) {
        let rows = self.change(|state| {
            state.done += count;
            state.untold()
        });
        if rows > 0 {
            self.all.advance(rows);
        }
    }
    fn end(&self) {
        let rows = self.change(|state| {
            state.done = state.parts;
            state.untold()
        });
        self.all.advance(rows);
    }
    fn note(&self, words: &str) {
        self.all.note(words);
    }
    fn cancelled(&self) -> bool {
        self.all.cancelled()
    }
}
