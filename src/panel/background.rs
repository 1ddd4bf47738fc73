//! Threads for work that gives way to all other work.

use rayon::{ThreadPool, ThreadPoolBuilder};
use tracing::debug;

/// How much a thread gives way, in steps of `nice`: beside busy ones it gets a tenth of a core.
#[cfg(target_os = "linux")]
const GIVES_WAY: i32 = 10;

/// A pool of `threads` threads; 0 for as many as the machine has cores. Parallel work that is begun in it stays
/// in it. `None` if the system allows no threads.
pub(in crate::panel) fn background(name: &'static str, threads: usize) -> Option<ThreadPool> {
    let builder = ThreadPoolBuilder::new().num_threads(threads).thread_name(move |_| name.to_owned());
    let builder = builder.start_handler(move |_| give_way(name));
    // Without a handler a panic would end the program, and with it a scan.
    let builder = builder.panic_handler(move |_| debug!(name, "a thread in the background has panicked"));
    builder.build().inspect_err(|error| debug!(%error, name, "no threads in the background")).ok()
}

/// Lowers the priority of the calling thread.
fn give_way(name: &str) {
    // On Linux each thread has a priority of its own; elsewhere this would slow the scan, too.
    #[cfg(target_os = "linux")]
    if let Err(error) = rustix::process::nice(GIVES_WAY) {
        debug!(%error, name, "a thread in the background keeps its priority");
    }
    #[cfg(not(target_os = "linux"))]
    let _ = name;
}
