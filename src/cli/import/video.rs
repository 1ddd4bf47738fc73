//! Frames of a video, by the program ffmpeg.

use std::ffi::{OsStr, OsString};
use std::io::ErrorKind;
use std::path::Path;
use std::process::{Command, Output, Stdio};

use super::super::{CliError, Talk};
use epirig_core::shell::quoted;
use epirig_data::storage::Scratch;

/// How names of videos end.
const ENDINGS: [&str; 14] =
    ["mp4", "m4v", "mov", "avi", "mkv", "webm", "mpg", "mpeg", "wmv", "mts", "m2ts", "mjpg", "mjpeg", "y4m"];
/// Parts of names of pixel formats whose samples have more than 8 bit.
const WIDE: [&str; 10] = ["9le", "9be", "10le", "10be", "12le", "12be", "14le", "16le", "16be", "p010"];
/// How frames keep their number: none is repeated or left out to keep a rate. The second is that of ffmpeg
/// before version 5.1.
const ALL_FRAMES: [[&str; 2]; 2] = [["-fps_mode", "passthrough"], ["-vsync", "0"]];
/// A video of more frames than this is said to have many ...
const MANY: f64 = 400.0;
/// ... of which about this number is enough: twice as many make a map less than 1.5 times as good.
const ENOUGH: f64 = 100.0;
const NAMES: &str = "frame_%06d.png";

/// Whether the name ends as that of a video.
pub(super) fn is_video_name(path: &Path) -> bool {
    let ending = path.extension().map(|ending| ending.to_string_lossy().to_ascii_lowercase());
    ending.is_some_and(|ending| ENDINGS.contains(&&*ending))
}

/// The frames of a video as grey PNG files: every `every`-th, the first `most` of them if it is given. They are in
/// a hidden folder beside `out`, which goes when it is dropped.
pub(super) fn extract(
    path: &Path,
    out: &Path,
    (every, most): (usize, Option<usize>),
    talk: &Talk,
) -> Result<Scratch, CliError> {
    let (wide, frames) = describe(path)?;
    let taken = frames.map(|frames| frames / every as f64).filter(|_| most.is_none());
    if let Some(taken) = taken.filter(|taken| *taken > MANY) {
        talk.say(&format!(
            "hint: these are about {taken:.0} frames, and about {ENOUGH:.0} are enough for most scans: --every {:.0} takes that number",
            (every as f64 * taken / ENOUGH).round()
        ));
    }
    let scratch =
        Scratch::beside(out).map_err(|(path, source)| CliError::file("make a folder in", &path)(source))?;
    talk.say(&format!("extracting the frames of {} with ffmpeg", path.display()));
    for all_frames in ALL_FRAMES {
        let mut command = ffmpeg("error", path)?;
        // Not by its path, in which a % would stand for a number.
        command.current_dir(scratch.path());
        command.args(["-map", "0:v:0", "-pix_fmt", if wide { "gray16be" } else { "gray" }]).args(all_frames);
        if every > 1 {
            command.args(["-vf", &format!("select=not(mod(n\\,{every}))")]);
        }
        if let Some(most) = most {
            command.args(["-frames:v", &most.to_string()]);
        }
        command.args(["-start_number", "0", NAMES]);
        let output = run(command, path)?;
        let said = String::from_utf8_lossy(&output.stderr).trim().to_owned();
        let knows_option = !said.contains("Unrecognized option");
        if output.status.success() {
            talk.say(
                "note: most videos are compressed with loss, which limits accuracy; single images are better",
            );
            if !said.is_empty() {
                talk.say(&format!("note: ffmpeg says: {}", last_line(&said)));
            }
            return Ok(scratch);
        } else if knows_option {
            return Err(refused(path, &said));
        }
    }
    Err(refused(path, "it knows none of our options"))
}

/// What ffmpeg says of a video: whether its samples have more than 8 bit; about how many frames it has, if its length
/// and its rate are told.
fn describe(path: &Path) -> Result<(bool, Option<f64>), CliError> {
    // Without an output it ends with an error, after it has described the input.
    let said = run(ffmpeg("info", path)?, path)?;
    let said = String::from_utf8_lossy(&said.stderr).into_owned();
    let video = said.lines().find(|line| line.contains("Video:"));
    let video = video.ok_or_else(|| refused(path, &said))?;
    let words = video.split(|letter: char| !letter.is_ascii_alphanumeric());
    let wide = words.into_iter().any(|word| WIDE.iter().any(|wide| word.ends_with(wide)));
    Ok((wide, frames_of(&said, video)))
}

/// Length times rate: `Duration: 00:01:00.50, ...` and `..., 29.97 fps, ...`.
fn frames_of(said: &str, video: &str) -> Option<f64> {
    let length = said.split_once("Duration: ")?.1.split(',').next()?;
    let parts: Option<Vec<f64>> = length.split(':').map(|part| part.trim().parse().ok()).collect();
    let seconds = parts?.iter().fold(0.0, |sum, part| 60.0 * sum + part);
    let rate = video.split(',').find_map(|part| part.trim().strip_suffix(" fps")?.parse::<f64>().ok())?;
    Some(seconds * rate)
}

/// ffmpeg, which reads the video and says as much as `level`.
fn ffmpeg(level: &str, path: &Path) -> Result<Command, CliError> {
    let whole = std::path::absolute(path).map_err(CliError::file("find", path))?;
    // With "file:" a colon in the name means nothing.
    let mut input = OsString::from("file:");
    input.push(whole);
    let mut command = Command::new("ffmpeg");
    command.args(["-nostdin", "-hide_banner", "-loglevel", level, "-i"]).arg(input);
    Ok(command)
}

fn run(mut command: Command, path: &Path) -> Result<Output, CliError> {
    let output = command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::piped()).output();
    output.map_err(|error| match error.kind() {
        ErrorKind::NotFound => CliError::usage(without_ffmpeg(path)),
        _ => CliError::file("run", Path::new("ffmpeg"))(error),
    })
}

/// What to do where there is no ffmpeg.
fn without_ffmpeg(path: &Path) -> String {
    let folder = path.file_stem().unwrap_or(OsStr::new("video")).to_string_lossy().into_owned() + "-frames";
    format!(
        "{0} is a video, and the program ffmpeg, which reads videos, is not installed; install it, or run where it is: \
         mkdir {1} && ffmpeg -i {0} -fps_mode passthrough -pix_fmt gray {1}/{NAMES}   and then: epirig import {1} --out SEQ",
        quoted(path),
        quoted(folder.as_ref()),
    )
}

fn refused(path: &Path, said: &str) -> CliError {
    let reason = last_line(said);
    CliError::data(format!(
        "{}: ffmpeg cannot read it as a video ({reason}); play it to see whether it is whole, or convert it",
        path.display()
    ))
}

fn last_line(said: &str) -> &str {
    said.lines().rev().find(|line| !line.trim().is_empty()).unwrap_or("it says nothing").trim()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_number_of_frames_is_told_by_length_and_rate() {
        let said = "  Duration: 00:01:00.50, start: 0.000000, bitrate: 12 kb/s\n";
        let video = "  Stream #0:0: Video: h264 (High), yuv420p, 1280x720, 29.97 fps, 30 tbr";
        assert!((frames_of(said, video).unwrap() - 60.5 * 29.97).abs() < 1e-9);
        assert_eq!(frames_of("  Duration: N/A, bitrate: N/A", video), None);
    }

    #[test]
    fn names_of_videos_and_names_for_shells() {
        assert!(is_video_name(Path::new("a/Scan.MP4")) && !is_video_name(Path::new("a.png")));
        let words = without_ffmpeg(Path::new("my scan.mov"));
        assert!(
            words.contains("ffmpeg -i 'my scan.mov'") && words.contains("'my scan-frames'/frame_%06d.png")
        );
    }
}
