//! Jobs of Slurm: the script of a job, and sending it by `sbatch`.

use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use super::CliError;
use epirig_core::fault::Blame;
use epirig_core::shell::{quoted, quoted_word};

/// Most elements of an array: Slurm's own limit, unless its administrator has changed it. Each does several tasks if
/// there are more.
const MOST_ELEMENTS: usize = 1000;

/// The options by which this program divides and joins the work.
const OWN: [&str; 4] = ["array", "dependency", "wrap", "parsable"];
/// Options that ask for memory in other ways: sbatch takes one of them.
const MEMORY: [&str; 3] = ["mem", "mem-per-cpu", "mem-per-gpu"];

/// An option of sbatch.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct SlurmOption {
    name: String,
    value: Option<String>,
}

/// The options of a text such as `partition=lab,time=1:00:00`. A comma without a name and `=` after it belongs to a value,
/// as in `nodelist=a,b`.
pub(super) fn parse_option(text: &str) -> Result<Vec<SlurmOption>, String> {
    let wrong = || {
        format!(
            "\"{text}\" is no list of sbatch's options; write names and values such as partition=lab,time=1:00:00"
        )
    };
    let is_name = |name: &str| {
        !name.is_empty() && name.chars().all(|letter| letter.is_ascii_lowercase() || letter == '-')
    };
    let mut options: Vec<SlurmOption> = Vec::new();
    for piece in text.split(',') {
        match (piece.split_once('='), options.last_mut()) {
            (Some((name, value)), _) if is_name(name) && !value.is_empty() => {
                options.push(SlurmOption { name: name.to_owned(), value: Some(value.to_owned()) });
            }
            (None, Some(SlurmOption { value: Some(value), .. })) => *value = format!("{value},{piece}"),
            (None, None) if is_name(piece) => {
                options.push(SlurmOption { name: piece.to_owned(), value: None });
            }
            _ => return Err(wrong()),
        }
    }
    if let Some(own) = options.iter().find(|option| OWN.contains(&option.name.as_str())) {
        return Err(format!("{} is this program's own option of sbatch; leave it out", own.name));
    }
    // A line of the script must stay a line.
    match text.chars().any(char::is_control) {
        true => Err(wrong()),
        false => Ok(options),
    }
}

/// A job: one call of the program, or an array of them.
#[derive(Debug, Clone, Default)]
pub(super) struct Job {
    pub(super) name: String,
    /// The last argument of each call; none: one call, without it.
    pub(super) tasks: Vec<String>,
    /// The arguments of all calls.
    pub(super) arguments: Vec<String>,
    /// Most elements that run at once.
    pub(super) at_once: Option<u32>,
    /// Bytes of memory.
    pub(super) memory: u64,
    /// Seconds that a task takes.
    pub(super) seconds: f64,
    /// Minutes after which Slurm ends an element.
    pub(super) minutes: u64,
    /// File for what a call prints.
    pub(super) log: String,
    /// Options of a person, which replace those of this program.
    pub(super) options: Vec<SlurmOption>,
}

impl Job {
    /// The script for sbatch. Every element does its tasks, also if one of them fails, and then fails.
    pub(super) fn script(&self) -> Result<String, CliError> {
        let elements = self.tasks.len().min(MOST_ELEMENTS);
        let per_element = self.tasks.len().div_ceil(elements.max(1)).max(1) as u64;
        let mut own = vec![
            ("job-name", self.name.replace(char::is_whitespace, "-")),
            ("output", self.log.clone()),
            ("mem", format!("{}M", self.memory.div_ceil(1 << 20))),
            ("time", self.minutes.saturating_mul(per_element).to_string()),
        ];
        if elements > 0 {
            let at_once = self.at_once.map_or(String::new(), |count| format!("%{count}"));
            own.push(("array", format!("0-{}{at_once}", elements - 1)));
        }
        let has_memory = self.options.iter().any(|option| MEMORY.contains(&option.name.as_str()));
        own.retain(|(name, _)| {
            let is_replaced = self.options.iter().any(|option| option.name == *name);
            !is_replaced && (*name != "mem" || !has_memory)
        });
        let own =
            own.into_iter().map(|(name, value)| SlurmOption { name: name.to_owned(), value: Some(value) });
        let line = |SlurmOption { name, value }: SlurmOption| match value {
            Some(value) => format!("#SBATCH --{name}={}\n", in_line(&value)),
            None => format!("#SBATCH --{name}\n"),
        };
        let options: String = own.chain(self.options.iter().cloned()).map(line).collect();
        let words =
            |words: &[String]| words.iter().map(|word| quoted_word(word)).collect::<Vec<_>>().join(" ");
        let call = format!("{} {}", quoted(&program()?), words(&self.arguments));
        let calls = match elements {
            0 => format!("exec {call}\n"),
            _ => format!(
                "tasks=({})\nfailed=0\nfor ((task = SLURM_ARRAY_TASK_ID; task < ${{#tasks[@]}}; task += {elements})); do\n  \
                 {call} \"${{tasks[task]}}\" || failed=$?\ndone\nexit \"$failed\"\n",
                words(&self.tasks)
            ),
        };
        Ok(format!(
            "#!/bin/bash\n{options}set -eu\nexport RAYON_NUM_THREADS=\"${{SLURM_CPUS_PER_TASK:-1}}\"\n{calls}"
        ))
    }
}

/// A value as sbatch reads it in a line: blanks part options, unless it is quoted.
fn in_line(value: &str) -> String {
    let is_plain = |letter: char| !letter.is_whitespace() && !"\"'\\#".contains(letter);
    if value.chars().all(is_plain) { value.to_owned() } else { format!("\"{}\"", value.replace('"', "\\\"")) }
}

/// This program, or the one in the search path if it runs within another one, such as Python.
fn program() -> Result<PathBuf, CliError> {
    let own = std::env::current_exe().map_err(CliError::file("find this program", Path::new("epirig")))?;
    let is_own = own.file_stem().is_some_and(|name| name == "epirig");
    Ok(if is_own { own } else { PathBuf::from("epirig") })
}

/// Sends a script, whose job begins when the job `after` has succeeded; returns its number.
pub(super) fn sent(script: &str, after: Option<&str>) -> Result<String, CliError> {
    let failed = |reason: String| {
        CliError::new(
            Blame::System,
            format!(
                "sbatch has not taken the job: {reason}; see the script with --dry-run, and `sinfo` for the partitions"
            ),
        )
    };
    let mut command = Command::new("sbatch");
    command.arg("--parsable");
    if let Some(job) = after {
        command.arg(format!("--dependency=afterok:{job}")).arg("--kill-on-invalid-dep=yes");
    }
    let run = command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn();
    let mut run = run.map_err(|error| match error.kind() {
        std::io::ErrorKind::NotFound => CliError::new(
            Blame::System,
            "there is no sbatch here; run this on a machine of the cluster, or look at the scripts with --dry-run",
        ),
        _ => failed(error.to_string()),
    })?;
    // If sbatch ends before it has read all, what it says is the reason.
    let written = run.stdin.take().map_or(Ok(()), |mut input| input.write_all(script.as_bytes()));
    let output = run.wait_with_output().map_err(|error| failed(error.to_string()))?;
    let said = |bytes: &[u8]| String::from_utf8_lossy(bytes).trim().to_owned();
    if output.status.success() {
        written.map_err(|error| failed(error.to_string()))?;
    }
    // With several clusters their name follows.
    let lines = said(&output.stdout);
    let number = lines.lines().last().unwrap_or_default().split(';').next().unwrap_or_default().to_owned();
    let is_number = !number.is_empty() && number.bytes().all(|byte| byte.is_ascii_digit());
    match output.status.success() && is_number {
        true => Ok(number),
        false => Err(failed(said(&output.stderr))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn options_have_names_and_values() {
        let options = |text: &str| {
            let options = parse_option(text)?;
            Ok::<_, String>(
                options.into_iter().map(|SlurmOption { name, value }| (name, value)).collect::<Vec<_>>(),
            )
        };
        let pair = |name: &str, value: &str| (name.to_owned(), Some(value.to_owned()));
        assert_eq!(
            options("partition=lab,time=1:00"),
            Ok(vec![pair("partition", "lab"), pair("time", "1:00")])
        );
        assert_eq!(options("nodelist=a,b,mem=1G"), Ok(vec![pair("nodelist", "a,b"), pair("mem", "1G")]));
        assert_eq!(options("exclusive"), Ok(vec![("exclusive".to_owned(), None)]));
        for text in [
            "array=0-3",
            "mem=1G,wrap=x",
            "",
            "=lab",
            "partition=",
            "Part=lab",
            "a b",
            "partition=lab\n#SBATCH --uid=0",
        ] {
            assert!(options(text).is_err(), "{text}");
        }
    }

    #[test]
    fn a_script_does_all_tasks_in_at_most_a_thousand_elements() {
        let job = Job {
            name: "epirig-bands-a tile".to_owned(),
            tasks: (0..2500).map(|task| task.to_string()).collect(),
            arguments: ["match", "/data/a tile", "--band"].map(str::to_owned).to_vec(),
            at_once: Some(8),
            memory: 3 << 20,
            minutes: 15,
            log: "/data/a tile/slurm.log".to_owned(),
            options: parse_option("mem=9G,partition=lab").unwrap(),
            ..Job::default()
        };
        let script = job.script().unwrap();
        for line in [
            "#SBATCH --job-name=epirig-bands-a-tile",
            "#SBATCH --output=\"/data/a tile/slurm.log\"",
            "#SBATCH --time=45",
            "#SBATCH --array=0-999%8",
            "#SBATCH --mem=9G",
            "#SBATCH --partition=lab",
        ] {
            assert!(script.lines().any(|found| found == line), "{line}: {}", &script[..400]);
        }
        assert!(!script.contains("--mem=3M"));
        let per_cpu =
            Job { options: parse_option("mem-per-cpu=2G").unwrap(), ..job.clone() }.script().unwrap();
        assert!(!per_cpu.contains("--mem=") && per_cpu.contains("#SBATCH --mem-per-cpu=2G"), "{per_cpu}");
        // Its tasks, as bash does them for one element, with a program that fails at one of them.
        let end = script.find("tasks=(").unwrap();
        let body = script[end..].replace(&quoted(&program().unwrap()), "call");
        let bash = format!("call() {{ echo \"$@\"; [ \"$4\" != 1007 ]; }}\nSLURM_ARRAY_TASK_ID=7\n{body}");
        let output = Command::new("bash").arg("-c").arg(bash).output().unwrap();
        let said = String::from_utf8(output.stdout).unwrap();
        let calls: Vec<&str> = said.lines().collect();
        let call = |task: usize| format!("match /data/a tile --band {task}");
        assert_eq!(calls, [call(7), call(1007), call(2007)]);
        assert_eq!(output.status.code(), Some(1));
        // Without tasks it is one call.
        let merge = Job { tasks: Vec::new(), ..job }.script().unwrap();
        assert!(!merge.contains("--array") && merge.contains("\nexec "), "{merge}");
    }
}
