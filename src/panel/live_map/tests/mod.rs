//! Live maps against the simulator's truth, and the behaviour of their thread.

mod accuracy;
mod binning;
mod scans;
mod thread;
