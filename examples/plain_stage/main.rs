//! epirig with one more driver of stages. `docs/` walks through it in the chapter on writing a driver.
//!
//! ```sh
//! cargo run --release --example plain_stage -- simulate plain --port /tmp/stage &
//! cargo run --release --example plain_stage -- stage home --driver plain --port /tmp/stage
//! ```

mod plain;

use std::process::ExitCode;

fn main() -> ExitCode {
    // The line in the table of drivers: from here on profiles, options, help and records know it.
    epirig_devices::stage::add_drivers(&[&plain::Plain]);
    epirig::cli::main()
}
