use super::super::Profile;
use super::set;

fn refused(text: &str) -> String {
    Profile::read(text, "rig.toml", &[]).unwrap_err().to_string()
}

#[test]
fn messages_name_the_line_and_what_to_write() {
    for (text, message) in [
        (
            "[plan]\nstep = 1.5",
            r#"line 2: plan.step = 1.5 has no unit; write step = "1.5 mm" or step_mm = 1.5"#,
        ),
        (
            "[plan]\nstep = \"1.5\"",
            r#"line 2: plan.step = "1.5" has no unit; write step = "1.5 mm" or step_mm = 1.5"#,
        ),
        (
            "[optics]\nfocal_length = 25",
            r#"line 2: optics.focal_length = 25 has no unit; write focal_length = "25 mm" or focal_length_mm = 25, or focal_length = "25 px""#,
        ),
        (
            "[plan]\nstep = \"3 s\"",
            r#"line 2: plan.step = "3 s": s is the unit of a time, the units of this key are nm, um, mm, cm, m; write for example step = "1.5 mm""#,
        ),
        (
            "[plan]\n\nstep = \"3 furlongs\"",
            r#"line 3: plan.step = "3 furlongs": furlongs is not a unit of this key; its units are nm, um, mm, cm, m; write for example step = "1.5 mm""#,
        ),
        (
            "[plan]\nstep = \"1,5 mm\"",
            r#"line 2: plan.step = "1,5 mm": the value must begin with a number, with a decimal point; write for example step = "1.5 mm""#,
        ),
        (
            "[plan]\nstep_mm = \"1.5 mm\"",
            r#"line 2: plan.step_mm = "1.5 mm" is not a number; the unit is in the key; write step_mm = 1.5, or step = "1.5 mm""#,
        ),
        (
            "[plan]\nstep = \"1.5 mm\"\nstep_um = 1500",
            "line 3: plan.step is given twice, first at rig.toml, line 2; remove one",
        ),
        (
            "[plan]\nstep = \"-1 mm\"",
            r#"line 2: plan.step = "-1 mm" is not possible; it must be a length greater than 0"#,
        ),
        (
            "[plan]\nframes = 1",
            "line 2: plan.frames = 1 is not possible; it must be a whole number from 2 to 100000",
        ),
        (
            "[plan]\nframes = 101.0",
            "line 2: plan.frames = 101.0 is not possible; it must be a whole number from 2 to 100000",
        ),
        ("[plan]\nstpe_mm = 1", "line 2: there is no key plan.stpe_mm; did you mean step_mm?"),
        (
            "[plan]\nstep_inch = 1",
            "line 2: there is no key plan.step_inch: inch is not a unit of it; write step_mm, or another of nm, um, mm, cm, m",
        ),
        (
            "[plan]\nexposure_us = 8",
            "line 2: there is no key plan.exposure_us; did you mean camera.exposure_us?",
        ),
        ("\n[plna]\nstep_mm = 1", "line 2: there is no section plna; did you mean plan?"),
        ("step_mm = 1", "line 1: step_mm is outside all sections; write it below [plan]"),
        ("plan = 1", "line 1: plan is a section; write [plan] and its keys in the lines below it"),
        (
            "[[plan]]\nstep_mm = 1",
            "line 1: plan is a section; write [plan] and its keys in the lines below it",
        ),
        (
            "[camera]\ncontrols = 1",
            "line 2: camera.controls is a section; write [camera.controls] and its keys in the lines below it",
        ),
        (
            "[camera.controls]\ngain = [1]",
            "line 2: camera.controls.gain = (a list) is not possible; it must be a whole number, true, false or text",
        ),
        (
            "[camera.controls]\ngain = 1\nGain = 2",
            "line 3: camera.controls.gain is given twice, first at rig.toml, line 2; remove one",
        ),
        (
            "[camera]\nmains = \"55 Hz\"",
            r#"line 2: camera.mains = "55 Hz" is not possible; it must be 50 Hz or 60 Hz"#,
        ),
        (
            "[limits]\nsaturated = \"101 %\"",
            r#"line 2: limits.saturated = "101 %" is not possible; it must be a share from 0 % to 100 %"#,
        ),
        (
            "[camera]\npatience = \"0 s\"",
            r#"line 2: camera.patience = "0 s" is not possible; it must be a time from 1 ns to 24 h"#,
        ),
        (
            "[camera]\npatience = \"25 h\"",
            r#"line 2: camera.patience = "25 h" is not possible; it must be a time from 1 ns to 24 h"#,
        ),
        (
            "[stage]\ndriver = \"gbrl\"",
            r#"line 2: stage.driver = "gbrl" is not possible; it must be one of native, grbl, zaber, sim"#,
        ),
        (
            "[stage]\ndriver = \"zaber\"\naxis = \"x\"\nmicrostep_um = 1",
            r#"line 3: stage.axis has no effect with driver = "zaber"; remove it"#,
        ),
        (
            "[stage]\ndriver = \"zaber\"",
            "line 2: stage.driver (zaber) needs stage.microstep; it is in the stage's data sheet",
        ),
        (
            "[stage]\ndriver = \"sim\"\nmicrostep_um = 0.1",
            r#"line 3: stage.microstep has no effect with driver = "sim"; remove it"#,
        ),
        (
            "[sim]\nnoise = \"1 DN\"",
            r#"line 2: sim.noise has no effect without driver = "sim" or port = "sim" of the stage, or device = "sim" of the camera; remove it"#,
        ),
        (
            "[optics]\nfocal_length = \"25 m\"\nsensor_width = \"9 mm\"",
            r#"line 2: optics.focal_length = "25 m" is not possible: it is 2777.7778 times the width of the sensor, and the camera would see 0.021 deg; 0.1 to 100 times are allowed: check focal length, width of the sensor and their units"#,
        ),
        (
            "[camera]\nsize = \"640x480\"\n[optics]\nfocal_length_px = 25",
            r#"line 4: optics.focal_length = 25 px is not possible: it is 0.0391 times the width of the sensor, and the camera would see 171.066 deg; 0.1 to 100 times are allowed: check focal length, width of the sensor and their units"#,
        ),
        (
            "[optics]\nfocal_length = \"25 mm\"\nsensor_width = \"9 mm\"\ndistance = \"10 mm\"",
            r#"line 4: optics.distance = "10 mm" is not possible: a lens of 25 mm shows only what is farther away than its focal length; check both lengths and their units"#,
        ),
        (
            "[optics]\nfocal_length = \"25 mm\"\nsensor_width = \"9 mm\"\ndistance = \"26 mm\"",
            r#"line 4: optics.distance = "26 mm" is not possible: a lens of 25 mm would show the object 25.0 times as large as it is; 10 times are allowed: check both lengths and their units"#,
        ),
        (
            "[optics]\ndistance = \"90 mm\"\n[target]\nrelief = \"0.2 m\"",
            r#"line 4: target.relief = "0.2 m" is not possible: it must be less than the distance of the object, 90 mm"#,
        ),
        (
            "[optics]\nfocal_length = \"25 mm\"",
            "line 2: optics.focal_length (a length) needs optics.sensor_width; add it, or give the focal length in px",
        ),
        (
            "[optics]\nk1 = -0.1",
            "line 2: optics.k1 (given) needs optics.focal_length; give the focal length, too",
        ),
        (
            "[optics]\nfocal_length_px = 900\nk1 = \"-0.1\"",
            r#"line 3: optics.k1 = "-0.1" is not possible; it must be a number"#,
        ),
        (
            "[optics]\nfocal_length_sigma_mm = 1",
            "line 2: there is no key optics.focal_length_sigma_mm: mm is not a unit of it; write focal_length_sigma_percent, or another of %",
        ),
        (
            "[target]\nsquare_mm = 7.5\nrows = 2",
            "line 2: target.square (given) needs target.columns; give square, columns and rows, or none",
        ),
        (
            "[target]\nbands = 1",
            "line 2: target.bands (given) needs target.square; give square, columns and rows, or none\n\
             rig.toml, line 2: target.bands (given) needs target.columns; give square, columns and rows, or none\n\
             rig.toml, line 2: target.bands (given) needs target.rows; give square, columns and rows, or none",
        ),
        (
            "[target]\nsquare_mm = 7.5\nrows = 2\ncolumns = 9\nbands = 2",
            "line 5: target.bands (2) needs target.band_distance; measure it with a ruler, or give one band",
        ),
        (
            "[target]\nsquare_mm = 7.5\nrows = 2\ncolumns = 9\nband_distance_mm = 90",
            "line 5: target.band_distance has no effect without bands = 2; remove it",
        ),
        (
            "[board]\ncolumns = 1\n",
            "line 2: board.columns = 1 is not possible; it must be a whole number from 2 to 1000",
        ),
        (
            "[camera]\ndevice = \"sim\"\n[sim]\nbow_mm = 1\nscene = \"plane\"",
            "line 4: sim.bow has no effect without scene = \"tile\"; remove it",
        ),
        (
            "[camera]\ndevice = \"sim\"\n[sim]\nroll = 1",
            r#"line 4: sim.roll = 1 has no unit; write roll = "1 deg" or roll_deg = 1"#,
        ),
        (
            "[camera]\ndevice = \"sim\"\n[sim]\npan = \"0.5 rad\"",
            r#"line 4: sim.pan = "0.5 rad" is not possible; it must be an angle from -28 deg to 28 deg"#,
        ),
        (
            "[optics]\nprincipal_point_y = \"25 px\"",
            "line 2: optics.principal_point_y (given) needs optics.principal_point_x; give both or none",
        ),
    ] {
        assert_eq!(refused(text), format!("rig.toml, {message}"));
    }
    let error = refused("[plan]\nstep = \n");
    assert!(error.starts_with("rig.toml, line 2: this is not valid TOML: "), "{error}");
    let error = refused("[plan]\nstep_mm = 1\nstep_mm = 2\n");
    assert!(error.starts_with("rig.toml, line 3: this is not valid TOML: "), "{error}");
}

#[test]
fn all_mistakes_are_told_one_a_line() {
    let error = refused("[plan]\nstep = 1\nframes = 1\n[stage]\nprot = \"x\"\n");
    assert_eq!(error.lines().count(), 3, "{error}");
    assert!(error.lines().all(|line| line.starts_with("rig.toml, line ")), "{error}");
    let error = refused("[plan]\n\"a\\nb\" = 1\n");
    assert!(error.starts_with("rig.toml, line 2: there is no key plan.a b; there are start, "), "{error}");
}

#[test]
fn messages_name_the_override() {
    for (setting, message) in [
        ("plan.step=1.5", "--set: plan.step = 1.5 has no unit; write 1.5 mm"),
        ("optics.focal_length=1.5", "--set: optics.focal_length = 1.5 has no unit; write 1.5 mm or 1.5 px"),
        ("plan.stpe=1.5 mm", "--set: there is no key plan.stpe; did you mean step?"),
        ("pln.step=1.5 mm", "--set: there is no section pln; did you mean plan?"),
        (
            "plan.frames=1",
            "--set: plan.frames = 1 is not possible; it must be a whole number from 2 to 100000",
        ),
        (
            "camera.controls.=x",
            "--set: there is no key camera.controls.; `epirig camera get` lists the names of the camera's controls",
        ),
        ("stage.axis=x", "--set: stage.axis has no effect with driver = \"native\"; remove it"),
    ] {
        assert_eq!(Profile::of(&set(&[setting])).unwrap_err().to_string(), message);
    }
}
