//! The worker threads of the program.

use std::io;
use std::sync::mpsc::{Sender, channel};
use std::thread::{Builder, available_parallelism};

use rayon::{ThreadBuilder, ThreadPoolBuilder};

use super::{CliError, Talk};
use epirig_core::fault::Blame;

/// How many workers there are, in place of one for each processor.
const VARIABLE: &str = "RAYON_NUM_THREADS";

/// Starts the worker threads; fewer if the system allows fewer. Without any, the main thread computes alone.
///
/// A pool that lacks a thread cannot be built, and a global pool cannot be built again. So the threads are
/// there before the pool.
pub(super) fn start_threads(talk: &Talk) -> Result<(), CliError> {
    let wanted = wanted();
    let mut threads: Vec<Sender<ThreadBuilder>> = Vec::new();
    while threads.len() < wanted
        && let Some(thread) = waiting_thread()
    {
        threads.push(thread);
    }
    if threads.len() < wanted {
        // One is left for the other work of the program.
        threads.pop();
        let computing = threads.len().max(1);
        talk.say(&format!(
            "note: the system allows no more threads (ulimit -u, or a limit of processes), so {computing} of {wanted} compute"
        ));
    }
    let built = if threads.is_empty() {
        ThreadPoolBuilder::new().num_threads(1).use_current_thread().build_global()
    } else {
        let pool = ThreadPoolBuilder::new().num_threads(threads.len());
        let mut threads = threads.into_iter();
        let gone = || io::Error::other("a thread has ended before its work");
        pool.spawn_handler(move |worker| threads.next().and_then(|t| t.send(worker).ok()).ok_or_else(gone))
            .build_global()
    };
    built.map_err(|error| CliError::new(Blame::System, format!("the system allows no more threads: {error}; end other programs, or raise the limit (ulimit -u)")))
}

/// A thread that waits for its work; `None` if the system allows none.
fn waiting_thread() -> Option<Sender<ThreadBuilder>> {
    let (work, coming) = channel::<ThreadBuilder>();
    let wait = move || {
        // Without work it ends.
        if let Ok(worker) = coming.recv() {
            worker.run();
        }
    };
    Builder::new().spawn(wait).ok().map(|_| work)
}

fn wanted() -> usize {
    let chosen = std::env::var(VARIABLE).ok().and_then(|text| text.parse().ok());
    let each = || available_parallelism().map_or(1, usize::from);
    chosen.filter(|count| *count > 0).unwrap_or_else(each)
}
