//! Files that are none, lead elsewhere, or promise more than there is.

use std::fs;
use std::os::unix::fs::symlink;
use std::process::Command;

use epirig_core::frame::{Frame, Samples};

use super::{change_lines, edit, folder, imported, is_refused, line, make_pipe, within_a_minute};
use crate::support::{epirig, fails, images, names, simulator, succeeds, write_png};

#[test]
fn names_of_images_without_a_file_behind_them_are_named_and_refused() {
    let folder = folder();
    let photos = folder.path().join("photos");
    images(&photos, 9);
    let import = ["import", "photos", "--out", "seq", "--step-mm", "1.5"];
    let refused = |words: &[&str]| {
        let (code, said) = within_a_minute(folder.path(), &import);
        assert_eq!(code, Some(5), "{said}");
        assert!(words.iter().all(|word| said.contains(word)), "{words:?} {said}");
        assert!(!folder.path().join("seq").exists());
    };
    symlink("nowhere.png", photos.join("frame_3b.png")).unwrap();
    refused(&["frame_3b.png"]);
    fs::create_dir(photos.join("frame_4b.png")).unwrap();
    make_pipe(&photos.join("frame_5b.tif"));
    refused(&["frame_3b.png", "frame_4b.png is a folder", "frame_5b.tif is a pipe"]);
    fs::remove_file(photos.join("frame_3b.png")).unwrap();
    fs::remove_dir(photos.join("frame_4b.png")).unwrap();
    fs::remove_file(photos.join("frame_5b.tif")).unwrap();
    // Nor are those of calibration images.
    fs::create_dir(folder.path().join("dark")).unwrap();
    write_png(&folder.path().join("dark/0.png"), &simulator(9).expose(0.0, 0));
    symlink("loop.png", folder.path().join("dark/loop.png")).unwrap();
    fails(folder.path(), &[&import[..], &["--dark", "dark"]].concat(), 5, &["dark", "loop.png"]);
    // A link to a file is one, and what a system hides beside an image is none.
    fs::rename(photos.join("frame_3.png"), folder.path().join("elsewhere.png")).unwrap();
    symlink("../elsewhere.png", photos.join("frame_3.png")).unwrap();
    fs::write(photos.join("._frame_3.png"), "notes of a Macintosh").unwrap();
    let output = epirig(folder.path(), &import);
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success() && said.contains("._frame_3.png"), "{said}");
    assert_eq!(names(&folder.path().join("seq/frames")).len(), 9);
}

#[test]
fn frames_are_files_inside_the_sequence() {
    let folder = folder();
    imported(folder.path());
    let frame = folder.path().join("seq/frames/0004.png");
    let kept = fs::read(&frame).unwrap();
    fs::write(folder.path().join("outside.png"), &kept).unwrap();
    let refused = |words: &[&str]| {
        for verb in ["verify", "match"] {
            let mut command = assert_cmd::cargo::cargo_bin_cmd!("epirig");
            command.current_dir(folder.path()).env("XDG_CONFIG_HOME", folder.path()).args([verb, "seq"]);
            let output = command.timeout(std::time::Duration::from_secs(60)).output().unwrap();
            let said = format!(
                "{}{}",
                String::from_utf8_lossy(&output.stdout),
                String::from_utf8_lossy(&output.stderr)
            );
            assert_eq!(output.status.code(), Some(5), "{said}");
            assert!(words.iter().all(|word| said.contains(word)), "{words:?}: {said}");
        }
    };
    fs::remove_file(&frame).unwrap();
    make_pipe(&frame);
    refused(&["0004.png", "a pipe"]);
    fs::remove_file(&frame).unwrap();
    symlink("../../outside.png", &frame).unwrap();
    refused(&["0004.png", "outside"]);
    fs::remove_file(&frame).unwrap();
    symlink("/dev/zero", &frame).unwrap();
    refused(&["0004.png", "outside"]);
    fs::remove_file(&frame).unwrap();
    fs::write(&frame, &kept).unwrap();
    succeeds(folder.path(), &["verify", "seq"]);
    for name in ["/dev/zero", "../outside.png", "frames/../../outside.png"] {
        let journal = folder.path().join("seq/journal.jsonl");
        let before = fs::read(&journal).unwrap();
        edit(folder.path(), "journal.jsonl", "frames/0004.png", name);
        refused(&[name]);
        fs::write(&journal, before).unwrap();
    }
    // A sparse file of a terabyte.
    fs::File::options().write(true).open(&frame).unwrap().set_len(1 << 40).unwrap();
    refused(&["0004.png", "larger than"]);
}

#[test]
fn records_that_are_pipes_do_not_hang() {
    for record in ["sequence.json", "journal.jsonl", "stop.json", "calibration.json"] {
        let folder = folder();
        imported(folder.path());
        let path = folder.path().join("seq").join(record);
        let _ = fs::remove_file(&path);
        make_pipe(&path);
        let (code, said) = within_a_minute(folder.path(), &["match", "seq"]);
        assert_eq!(code, Some(5), "{record}: {said}");
        assert!(said.contains(record) && said.contains("a pipe"), "{said}");
    }
}

/// A grey PNG whose head says that it has this size, and little more.
fn png_that_says(columns: u32, rows: u32) -> Vec<u8> {
    let frame = Frame::new(1, 1, 8, Samples::U8(vec![0])).unwrap();
    let mut bytes = epirig_data::sequence::encode_png(&frame).unwrap();
    // Signature, length, "IHDR", then the size; the checksum follows 17 bytes after its length.
    bytes[16..20].copy_from_slice(&columns.to_be_bytes());
    bytes[20..24].copy_from_slice(&rows.to_be_bytes());
    let mut checksum = u32::MAX;
    for &byte in &bytes[12..29] {
        checksum ^= u32::from(byte);
        for _ in 0..8 {
            checksum = (checksum >> 1) ^ (0xedb8_8320 & (checksum & 1).wrapping_neg());
        }
    }
    bytes[29..33].copy_from_slice(&(!checksum).to_be_bytes());
    bytes
}

#[test]
fn a_small_file_that_says_it_is_large_is_not_decoded() {
    let folder = folder();
    imported(folder.path());
    let bomb = png_that_says(60_000, 60_000);
    fs::write(folder.path().join("photos/frame_4.png"), &bomb).unwrap();
    let words = ["frame_4.png", "60000 x 60000"];
    fails(folder.path(), &["import", "photos", "--out", "other"], 5, &words);
    fs::remove_file(folder.path().join("photos/frame_0.png")).unwrap();
    fs::write(folder.path().join("photos/frame_0.png"), &bomb).unwrap();
    fails(folder.path(), &["import", "photos", "--out", "other"], 5, &["frame_0.png", "60000 x 60000"]);
    // Under the hash that the journal has: its head is compared with the record first.
    let bomb = png_that_says(16_000, 16_000);
    fs::write(folder.path().join("seq/frames/0004.png"), &bomb).unwrap();
    let hash = blake3::hash(&bomb).to_hex().to_string();
    change_lines(folder.path(), |lines| {
        lines[4]["blake3"] = hash.clone().into();
        lines[4]["bytes"] = bomb.len().into();
    });
    is_refused(folder.path(), &["0004.png", "16000 x 16000", "64 x 24"]);
}

#[test]
fn many_lines_and_many_keys_are_read_in_one_go() {
    let folder = folder();
    imported(folder.path());
    let sound = line(folder.path(), 0);
    change_lines(folder.path(), |lines| {
        for index in 0..100_000 {
            let mut line = sound.clone();
            line["index"] = index.into();
            lines.push(line);
        }
    });
    let (code, said) = within_a_minute(folder.path(), &["match", "seq"]);
    assert_eq!(code, Some(5), "{said}");
    let keys: String = (0..100_000).map(|index| format!("unknown{index} = 1\n")).collect();
    fs::write(folder.path().join("rig.toml"), format!("[plan]\n{keys}[camera.controls]\n{keys}")).unwrap();
    let (code, said) = within_a_minute(folder.path(), &["plan"]);
    assert_eq!(code, Some(2), "{said}");
    assert!(said.contains("line 2:") && said.contains("ignored"), "{said}");
}

#[test]
fn files_that_nest_or_promise_too_much_end_with_an_error() {
    let folder = folder();
    imported(folder.path());
    for (name, text) in [
        ("list.yml", "- ".repeat(50_000)),
        ("map.yml", (0..5_000).map(|depth| format!("{}a:\n", " ".repeat(depth))).collect()),
        ("flow.yml", "[".repeat(50_000)),
    ] {
        fs::write(folder.path().join(name), text).unwrap();
        let (code, said) = within_a_minute(folder.path(), &["calibrate", "seq", "--lens", name]);
        assert_eq!(code, Some(5), "{name}: {said}");
        assert!(said.contains(name), "{said}");
    }
    succeeds(folder.path(), &["match", "seq"]);
    let npy = |header: &str, length: u32| {
        let mut bytes = b"\x93NUMPY\x02\0".to_vec();
        bytes.extend(length.to_le_bytes());
        bytes.extend(header.bytes());
        bytes
    };
    for (name, bytes) in [
        ("overflow.pfm", format!("Pf\n{} 0\n-1.0\n", 1_u64 << 62).into_bytes()),
        ("deep.npy", npy(&"(".repeat(60), 60)),
        ("long.npy", npy("{", u32::MAX)),
        (
            "huge.npy",
            npy("{'descr': '<f4', 'fortran_order': False, 'shape': (4611686018427387904, 4), }", 78),
        ),
    ] {
        fs::write(folder.path().join(name), bytes).unwrap();
        let (code, said) = within_a_minute(folder.path(), &["evaluate", "seq", "--truth", name]);
        assert_eq!(code, Some(5), "{name}: {said}");
        assert!(said.contains(name), "{said}");
    }
}

#[test]
#[cfg(target_os = "linux")]
fn what_does_not_fit_into_memory_is_refused_before_it_begins() {
    let folder = folder();
    let photos = folder.path().join("photos");
    fs::create_dir(&photos).unwrap();
    // Maps of 2.25 million pixels take some 400 MB.
    let samples: Vec<u8> =
        (0..1500 * 1500_u32).map(|pixel| (pixel.wrapping_mul(2_654_435_761) >> 24) as u8).collect();
    for index in 0..3 {
        let frame = Frame::new(1500, 1500, 8, Samples::U8(samples.clone())).unwrap();
        write_png(&photos.join(format!("{index}.png")), &frame);
    }
    succeeds(folder.path(), &["import", "photos", "--out", "seq"]);
    let limited = |kib: u32, arguments: &str| {
        let script = format!("ulimit -v {kib}; exec {} {arguments}", env!("CARGO_BIN_EXE_epirig"));
        let mut command = Command::new("sh");
        command.args(["-c", &script]).current_dir(folder.path()).env("XDG_CONFIG_HOME", folder.path());
        let output = command.output().unwrap();
        (output.status.code(), String::from_utf8_lossy(&output.stderr).into_owned())
    };
    for arguments in
        ["match seq --range 0..9", "calibrate seq --positions texture", "evaluate seq --both-ways"]
    {
        let (code, said) = limited(180_000, arguments);
        assert_eq!(code, Some(1), "{arguments}: {said}");
        assert!(said.contains("of memory") && said.contains("ulimit"), "{arguments}: {said}");
    }
    assert_eq!(names(&folder.path().join("seq")), ["frames", "journal.jsonl", "sequence.json", "stop.json"]);
    for (kib, arguments, words) in [
        (300_000, "demo --out demo", "would fit; or"),
        (200_000, "capture --out scan --rig sim --size 4096x4096", "camera.size"),
        (100_000, "import photos --out other", "raise the limit"),
    ] {
        let (code, said) = limited(kib, arguments);
        assert_eq!(code, Some(1), "{arguments}: {said}");
        assert!(said.contains(words) && said.contains("raise the limit"), "{arguments}: {said}");
    }
    assert_eq!(names(folder.path()), ["photos", "seq"]);
    // A higher limit leaves more.
    let left = |kib: u32| {
        let said = limited(kib, "match seq --range 0..9").1;
        let before = said.split(" MB is left").next().unwrap_or_default();
        before.rsplit(' ').next().unwrap().parse::<f64>().unwrap_or_else(|_| panic!("{said}"))
    };
    let left: Vec<f64> = [120_000, 200_000, 250_000, 300_000].into_iter().map(left).collect();
    assert!(left.windows(2).all(|pair| pair[0] + 30.0 < pair[1]), "{left:?}");
}

#[test]
fn nothing_is_written_through_links_of_a_sequence() {
    let folder = folder();
    imported(folder.path());
    let outside = folder.path().join("outside");
    fs::create_dir(&outside).unwrap();
    fs::write(outside.join("kept"), "kept").unwrap();
    symlink("../outside/kept", folder.path().join("seq/.calibration.json.part")).unwrap();
    symlink("../outside", folder.path().join("seq/calibration")).unwrap();
    let camera = epirig_calibration::lens::opencv_yaml::write(
        24,
        64,
        &epirig_calibration::lens::Lens::pinhole(100.0, 31.5, 11.5),
    );
    fs::write(folder.path().join("lens.yml"), camera).unwrap();
    fails(folder.path(), &["calibrate", "seq", "--lens", "lens.yml"], 1, &["calibration"]);
    fs::remove_file(folder.path().join("seq/calibration")).unwrap();
    succeeds(folder.path(), &["calibrate", "seq", "--lens", "lens.yml"]);
    assert_eq!(fs::read_to_string(outside.join("kept")).unwrap(), "kept");
    assert_eq!(names(&outside), ["kept"]);
}

#[test]
fn images_that_are_half_or_twice_there_are_refused() {
    let folder = folder();
    let photos = folder.path().join("photos");
    fs::create_dir(&photos).unwrap();
    let jpeg = |index: usize| {
        let pixel = |x: u32, y: u32| image::Luma([((x * 7 + y * 13 + index as u32 * 5) % 251) as u8]);
        let mut bytes = std::io::Cursor::new(Vec::new());
        let grey = image::GrayImage::from_fn(64, 48, pixel);
        grey.write_to(&mut bytes, image::ImageFormat::Jpeg).unwrap();
        bytes.into_inner()
    };
    for index in 0..4 {
        fs::write(photos.join(format!("{index}.jpg")), jpeg(index)).unwrap();
    }
    let import = ["import", "photos", "--out", "seq"];
    let whole = jpeg(2);
    for length in [whole.len() / 2, whole.len() - 2] {
        fs::write(photos.join("2.jpg"), &whole[..length]).unwrap();
        fails(folder.path(), &import, 5, &["2.jpg", "damaged", "before its last pixel"]);
    }
    // What a camera appends after the image does no harm.
    fs::write(photos.join("2.jpg"), [&whole[..], b"a small preview"].concat()).unwrap();
    succeeds(folder.path(), &import);
    fs::remove_dir_all(folder.path().join("seq")).unwrap();
    // The same frame as raw image and as JPEG.
    write_png(&photos.join("2.png"), &Frame::new(48, 64, 8, Samples::U8(vec![9; 48 * 64])).unwrap());
    fails(folder.path(), &import, 5, &["2.jpg and 2.png", "one name"]);
    fs::remove_file(photos.join("2.png")).unwrap();
    // A stack of images in one file.
    let mut stack = std::io::Cursor::new(Vec::new());
    let mut encoder = tiff::encoder::TiffEncoder::new(&mut stack).unwrap();
    for _ in 0..2 {
        encoder.write_image::<tiff::encoder::colortype::Gray8>(64, 48, &[7; 48 * 64]).unwrap();
    }
    fs::write(photos.join("4.tif"), stack.into_inner()).unwrap();
    fails(folder.path(), &import, 5, &["4.tif", "several images"]);
    assert!(!folder.path().join("seq").exists());
}

#[test]
fn what_systems_leave_in_folders_does_no_harm() {
    let folder = folder();
    imported(folder.path());
    succeeds(folder.path(), &["match", "seq"]);
    for place in ["seq/frames/.DS_Store", "seq/results/.DS_Store", "seq/results/Thumbs.db"] {
        fs::write(folder.path().join(place), "notes of a system").unwrap();
    }
    succeeds(folder.path(), &["verify", "seq"]);
    succeeds(folder.path(), &["match", "seq", "--overwrite"]);
    // A place that is no name cannot change places with another.
    for arguments in [["match", "seq", "--out", "."], ["import", "photos", "--out", "."]] {
        fails(folder.path(), &arguments, 2, &["by its name"]);
    }
}
