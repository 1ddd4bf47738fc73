//! Available memory, checked before work that needs much of it.

use std::fmt;
use std::path::Path;

/// What limits the memory of this program.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Bound {
    /// The free memory of the machine, including swap.
    Machine,
    /// A limit of its control group: of a container, a batch system or a service.
    ControlGroup,
    /// A limit of the process, set by `ulimit -v`.
    Process,
}

impl fmt::Display for Bound {
    fn fmt(&self, to: &mut fmt::Formatter<'_>) -> fmt::Result {
        to.write_str(match self {
            Self::Machine => "is free on this machine",
            Self::ControlGroup => "is left by the limit of the control group (container)",
            Self::Process => "is left by the limit of the process (ulimit)",
        })
    }
}

/// Memory that this program can still allocate.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Available {
    /// Bytes.
    pub bytes: u64,
    /// What limits it.
    pub bound: Bound,
}

/// Memory that this program can still allocate; `None` if the system does not report it.
pub fn available() -> Option<Available> {
    let found = available_in(Path::new("/"));
    found.into_iter().chain(limit_of_process()).min_by_key(|available| available.bytes)
}

/// The same from the files below `root`, laid out as on Linux.
fn available_in(root: &Path) -> Option<Available> {
    let machine = free_on_machine(root).map(|bytes| Available { bytes, bound: Bound::Machine });
    let group = left_by_groups(root).map(|bytes| Available { bytes, bound: Bound::ControlGroup });
    machine.into_iter().chain(group).min_by_key(|available| available.bytes)
}

fn read(path: &Path) -> Option<String> {
    std::fs::read_to_string(path).ok()
}

/// The number after a word at the beginning of a line.
fn entry(text: &str, word: &str) -> Option<u64> {
    let line = text.lines().find_map(|line| line.strip_prefix(word))?;
    line.trim_start_matches(':').split_whitespace().next()?.parse().ok()
}

fn free_on_machine(root: &Path) -> Option<u64> {
    let text = read(&root.join("proc/meminfo"))?;
    let kib = entry(&text, "MemAvailable:")?.saturating_add(entry(&text, "SwapFree:").unwrap_or(0));
    kib.checked_mul(1024)
}

/// Memory left by the control group of this process and its parents: the least of all. The kernel's file
/// cache counts as free.
fn left_by_groups(root: &Path) -> Option<u64> {
    let groups = read(&root.join("proc/self/cgroup"))?;
    let mounted = root.join("sys/fs/cgroup");
    let found = groups.lines().filter_map(|line| {
        let (controllers, path) = line.split_once(':')?.1.split_once(':')?;
        match controllers {
            "" => left_by(&mounted, path, ["memory.max", "memory.current", "inactive_file ", "active_file "]),
            _ if controllers.split(',').any(|name| name == "memory") => left_by(
                &mounted.join("memory"),
                path,
                [
                    "memory.limit_in_bytes",
                    "memory.usage_in_bytes",
                    "total_inactive_file ",
                    "total_active_file ",
                ],
            ),
            _ => None,
        }
    });
    found.min()
}

fn left_by(mounted: &Path, path: &str, [limit, used, kept, kept_too]: [&str; 4]) -> Option<u64> {
    let number = |group: &Path, name: &str| read(&group.join(name))?.trim().parse::<u64>().ok();
    // Inside a name space, a group seen from outside is above the root.
    let innermost = mounted.join(path.trim_start_matches('/').trim_start_matches("../"));
    let left = |group: &Path| {
        let (limit, used) = (number(group, limit)?, number(group, used)?);
        let stat = read(&group.join("memory.stat")).unwrap_or_default();
        let kept = [kept, kept_too].into_iter().filter_map(|word| entry(&stat, word)).sum::<u64>();
        Some(limit.saturating_sub(used.saturating_sub(kept)))
    };
    innermost.ancestors().take_while(|group| group.starts_with(mounted)).filter_map(left).min()
}

/// Memory left by `ulimit -v` and `-d`.
#[cfg(target_os = "linux")]
fn limit_of_process() -> Option<Available> {
    use rustix::process::{Resource, getrlimit};

    let status = read(Path::new("/proc/self/status"))?;
    let used = |word: &str| entry(&status, word).unwrap_or(0).saturating_mul(1024);
    let left = |limit: Option<u64>, used: u64| limit.map(|limit| limit.saturating_sub(used));
    let addresses = left(getrlimit(Resource::As).current, used("VmSize:"));
    let data = left(getrlimit(Resource::Data).current, used("VmData:"));
    let bytes = addresses.into_iter().chain(data).min()?;
    Some(Available { bytes, bound: Bound::Process })
}

#[cfg(not(target_os = "linux"))]
fn limit_of_process() -> Option<Available> {
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    fn machine(files: &[(&str, &str)]) -> tempfile::TempDir {
        let root = tempfile::tempdir().unwrap();
        for (name, text) in files {
            let path = root.path().join(name);
            std::fs::create_dir_all(path.parent().unwrap()).unwrap();
            std::fs::write(path, text).unwrap();
        }
        root
    }

    const MEMINFO: (&str, &str) =
        ("proc/meminfo", "MemTotal: 16000 kB\nMemAvailable:    8000 kB\nSwapFree:  2000 kB\n");

    #[test]
    fn the_machine_has_what_the_kernel_says() {
        let root = machine(&[MEMINFO]);
        let found = Available { bytes: 10_000 * 1024, bound: Bound::Machine };
        assert_eq!(available_in(root.path()), Some(found));
        assert_eq!(available_in(machine(&[]).path()), None);
    }

    #[test]
    fn the_narrowest_control_group_counts() {
        let root = machine(&[
            MEMINFO,
            ("proc/self/cgroup", "0::/lab/scan\n"),
            ("sys/fs/cgroup/lab/scan/memory.max", "max\n"),
            ("sys/fs/cgroup/lab/scan/memory.current", "1000\n"),
            ("sys/fs/cgroup/lab/memory.max", "5000000\n"),
            ("sys/fs/cgroup/lab/memory.current", "4000000\n"),
            ("sys/fs/cgroup/lab/memory.stat", "anon 1\ninactive_file 500000\nactive_file 100000\n"),
        ]);
        let found = Available { bytes: 1_600_000, bound: Bound::ControlGroup };
        assert_eq!(available_in(root.path()), Some(found));
    }

    #[test]
    fn control_groups_of_the_first_kind_count_too() {
        let root = machine(&[
            MEMINFO,
            ("proc/self/cgroup", "5:cpu:/x\n4:memory:/docker/1234\n"),
            ("sys/fs/cgroup/memory/memory.limit_in_bytes", "3000000\n"),
            ("sys/fs/cgroup/memory/memory.usage_in_bytes", "2500000\n"),
            ("sys/fs/cgroup/memory/memory.stat", "total_inactive_file 100000\n"),
        ]);
        let found = Available { bytes: 600_000, bound: Bound::ControlGroup };
        assert_eq!(available_in(root.path()), Some(found));
    }
}
