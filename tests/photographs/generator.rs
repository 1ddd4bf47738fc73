//! Pictures and truth of one series.

use epirig_core::grid::Grid;
use nalgebra::Vector3;

use epirig_photographs::texture::{BLOB_GROUND, BLOB_PITCH_PX, BLOB_SIGMA_PX};
use epirig_photographs::{Photographs, Relief, Series, Texture};

const RELIEFS: [Relief; 5] = [Relief::Flat, Relief::Hills, Relief::Mounds, Relief::Grooves, Relief::Slope];
const TEXTURES: [Texture; 5] =
    [Texture::Noise, Texture::Patches, Texture::Repeating, Texture::Weak, Texture::Stripes];

/// A small series with everything that can be wrong with a slider.
fn difficult() -> Photographs {
    Photographs {
        roll_deg: 12.0,
        pan_deg: 3.0,
        wobble_deg: 0.3,
        offset_px: 1.0,
        uneven_steps: 0.1,
        k1: -0.05,
        ..Photographs::sized(200, 300, 6)
    }
}

/// Middle of the light over the ground about a place.
fn centroid(light: &Grid<f32>, (x, y): (f64, f64)) -> (f64, f64) {
    /// Far more than the size of a blob, and less than half of the way to the next, in px.
    const REACH: usize = 9;
    let (column, row) = (x.round() as usize, y.round() as usize);
    let mut sums = [0.0; 3];
    for j in row - REACH..=row + REACH {
        for i in column - REACH..=column + REACH {
            let value = f64::from(light.at(i, j) - BLOB_GROUND);
            sums[0] += value;
            sums[1] += value * i as f64;
            sums[2] += value * j as f64;
        }
    }
    (sums[1] / sums[0], sums[2] / sums[0])
}

/// Where the middle of a blob on the surface is seen, over its whole area: the relief bends it a
/// little.
fn true_centroid(series: &Series, frame: usize, (x_mm, y_mm): (f64, f64)) -> (f64, f64) {
    let pixel_mm = series.taken.pixel_mm();
    // The spline between the nodes, which are half a pixel apart, widens a blob.
    let variance = BLOB_SIGMA_PX.powi(2) + 0.25 / 3.0;
    let seen = |dx: f64, dy: f64| {
        series.pixel_in(frame, &series.point_at(x_mm + dx * pixel_mm, y_mm + dy * pixel_mm))
    };
    let mut sums = [0.0; 3];
    for (i, j) in (-10..=10).flat_map(|j| (-10..=10).map(move |i| (i, j))) {
        let (dx, dy) = (0.5 * f64::from(i), 0.5 * f64::from(j));
        let (x, y) = seen(dx, dy);
        let ((ax, ay), (bx, by)) = (seen(dx + 1e-3, dy), seen(dx, dy + 1e-3));
        let area = (ax - x) * (by - y) - (ay - y) * (bx - x);
        let weight = area * (-0.5 * (dx * dx + dy * dy) / variance).exp();
        sums[0] += weight;
        sums[1] += weight * x;
        sums[2] += weight * y;
    }
    (sums[1] / sums[0], sums[2] / sums[0])
}

/// The number of blobs that were looked for, and the largest distance of one from its true place,
/// in px.
fn largest_blob_error(series: &Series) -> (usize, f64) {
    let pitch_mm = BLOB_PITCH_PX * series.taken.pixel_mm();
    let (mut found, mut largest) = (0, 0.0_f64);
    for frame in 0..series.count() {
        let light = series.light(frame);
        for (i, j) in (-10..=10).flat_map(|j| (-10..=10).map(move |i| (i, j))) {
            let at = (f64::from(i) * pitch_mm, f64::from(j) * pitch_mm);
            let (x, y) = series.pixel_in(frame, &series.point_at(at.0, at.1));
            if x > 12.0 && y > 12.0 && x < 287.0 && y < 187.0 {
                let (x, y) = true_centroid(series, frame, at);
                let (cx, cy) = centroid(&light, (x, y));
                found += 1;
                largest = largest.max((cx - x).hypot(cy - y));
            }
        }
    }
    (found, largest)
}

#[test]
fn blobs_are_drawn_where_the_truth_says() {
    for relief in RELIEFS {
        let series = Photographs { relief, texture: Texture::Blobs, ..difficult() }.take();
        for series in [series.straightened(), series] {
            let (found, largest) = largest_blob_error(&series);
            assert!(found > 60, "{relief:?}: {found} blobs");
            assert!(largest < 0.003, "{relief:?}: a blob is {largest:.5} px away");
        }
    }
}

#[test]
fn motion_blur_leaves_blobs_in_their_places() {
    let blurred = Photographs { texture: Texture::Blobs, motion_blur_px: 3.0, relief_px: 1.0, ..difficult() };
    let sharp = Photographs { motion_blur_px: 0.0, ..blurred.clone() }.take().light(0);
    let series = blurred.take();
    let (_, largest) = largest_blob_error(&series);
    assert!(largest < 0.003, "a blob is {largest:.4} px away");
    let brightest = |light: &Grid<f32>| light.values().iter().copied().fold(0.0, f32::max);
    assert!(brightest(&series.light(0)) < 0.95 * brightest(&sharp), "nothing is blurred");
}

#[test]
fn the_same_point_has_the_same_grey_value_in_all_frames() {
    for texture in TEXTURES {
        let series = Photographs { texture: texture.clone(), relief: Relief::Grooves, ..difficult() }.take();
        let lights: Vec<_> = (0..series.count()).map(|frame| series.light(frame)).collect();
        let (mut square, mut count, mut contrast) = (0.0, 0, 0.0);
        for (x, y) in (30..270).step_by(3).flat_map(|x| (30..170).step_by(3).map(move |y| (x, y))) {
            let point = series.seen(2, x as f64, y as f64);
            let here = f64::from(lights[2].at(x, y));
            let (i, j) = series.pixel_in(4, &point);
            if series.has_pixel((i - 4.0, j - 4.0)) && series.has_pixel((i + 4.0, j + 4.0)) {
                square += (cubic(&lights[4], i, j) - here).powi(2);
                contrast += (here - 128.0).powi(2);
                count += 1;
            }
        }
        assert!(count > 1000, "{count} places");
        let share = (square / contrast).sqrt();
        // What a cubic between the pixels leaves of the shortest waves.
        assert!(share < 0.04, "{texture:?}: grey values differ by {share:.3} of their contrast");
    }
}

/// A value between pixels by Lagrange's cubic.
fn cubic(light: &Grid<f32>, x: f64, y: f64) -> f64 {
    let weights = |a: f64| {
        [
            -a * (a - 1.0) * (a - 2.0) / 6.0,
            (a + 1.0) * (a - 1.0) * (a - 2.0) / 2.0,
            -(a + 1.0) * a * (a - 2.0) / 2.0,
            (a + 1.0) * a * (a - 1.0) / 6.0,
        ]
    };
    let (i, j) = (x.floor(), y.floor());
    let (wx, wy) = (weights(x - i), weights(y - j));
    let mut sum = 0.0;
    for (row, wy) in wy.into_iter().enumerate() {
        for (column, wx) in wx.into_iter().enumerate() {
            sum += wy * wx * f64::from(light.at(i as usize - 1 + column, j as usize - 1 + row));
        }
    }
    sum
}

#[test]
fn a_pixel_sees_a_point_of_the_surface_that_is_seen_at_the_pixel() {
    for relief in RELIEFS {
        let series = Photographs { relief, ..difficult() }.take();
        for (x, y) in [(0.0, 0.0), (299.0, 199.0), (12.3, 150.7), (149.5, 99.5)] {
            let point = series.seen(1, x, y);
            let (i, j) = series.pixel_in(1, &point);
            assert!((i - x).hypot(j - y) < 1e-8, "{relief:?}: ({x}, {y}) comes back at ({i}, {j})");
            let off = point.0.z - series.point_at(point.0.x, point.0.y).0.z;
            assert!(off.abs() < 1e-10 * series.surface.distance_mm, "{relief:?}: {off} mm off the surface");
        }
    }
}

#[test]
fn disparity_is_the_movement_in_an_ideal_rectified_camera() {
    for roll_deg in [12.0, 90.0, 168.0, -90.0] {
        let series = Photographs { roll_deg, ..difficult() }.take();
        let axis = series.motion.rail_axes().row(2).transpose();
        let ideal = series.straightened();
        let last = ideal.count() - 1;
        for (x, y) in [(150.0, 100.0), (40.0, 30.0), (200.0, 160.0)] {
            let point = ideal.seen(last, x, y);
            let first = ideal.pixel_in(0, &point);
            let disparity = series.disparity_px(&point, &axis, series.camera.focal_length_px);
            assert!((first.1 - y).abs() < 1e-9, "rows differ: {first:?}");
            assert!((x - first.0 - disparity).abs() < 1e-9, "{first:?} and {x} are not {disparity}");
        }
    }
}

#[test]
fn relief_has_the_parallax_that_is_asked_for() {
    for relief in [Relief::Hills, Relief::Mounds, Relief::Grooves, Relief::Slope] {
        let asked = Photographs { relief, relief_px: 6.0, ..Photographs::sized(300, 300, 3) };
        let series = asked.take();
        let parallax = series.parallax(1);
        let (low, high) =
            parallax.values().iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| {
                (low.min(*value), high.max(*value))
            });
        assert!(high - low > 2.0 && high - low < 6.6, "{relief:?}: {low} to {high} px");
        let middle = 0.5 * (low + high);
        assert!((middle - asked.baseline_px).abs() < 3.0, "{relief:?}: {middle} px");
    }
}

#[test]
fn the_motion_is_that_which_is_asked_for() {
    let asked = Photographs {
        wobble_deg: 0.02,
        offset_px: 0.5,
        uneven_steps: 0.1,
        missing: vec![7, 8, 20],
        repeated: Some(12),
        step_back: Some(25),
        pan_deg: -3.0,
        roll_deg: 2.0,
        ..Photographs::sized(200, 300, 30)
    };
    let motion = asked.take().motion;
    assert_eq!(motion.numbers.len(), 27);
    assert_eq!(motion.numbers[5..8], [6, 9, 10]);
    let nearest = motion.positions_mm.iter().map(|place| place.abs()).fold(f64::INFINITY, f64::min);
    assert_eq!(motion.positions_mm[motion.middle()].abs(), nearest);
    let (roll, pan) = (motion.direction.y.atan2(motion.direction.x), motion.direction.z.asin());
    assert!((roll.to_degrees() - 2.0).abs() < 1e-9 && (pan.to_degrees() + 3.0).abs() < 1e-9);
    let path_mm = asked.baseline_px * asked.pixel_mm();
    assert!((motion.baseline_mm() - path_mm).abs() < 1e-9 * path_mm);

    let step = |number: usize| {
        let place = |number| motion.numbers.iter().position(|other| *other == number).unwrap();
        motion.positions_mm[place(number)] - motion.positions_mm[place(number - 1)]
    };
    let mean = path_mm / 29.0 / ((29.0 - 2.0 - 0.7) / 29.0);
    assert_eq!(step(12), 0.0);
    assert!((step(25) / mean + 0.7).abs() < 0.05, "{} of a step", step(25) / mean);
    let even = (2..=30).filter(|number| ![7, 8, 9, 12, 20, 21, 25].contains(number));
    let steps: Vec<f64> = even.map(|number| step(number) / mean).collect();
    assert!(steps.iter().all(|step| (step - 1.0).abs() < 0.13), "{steps:?}");
    assert!(steps.iter().any(|step| (step - 1.0).abs() > 0.05), "{steps:?}");

    for axis in 0..3 {
        let angles: Vec<f64> = motion.rotations.iter().map(|w| w[axis].to_degrees()).collect();
        let mean = angles.iter().sum::<f64>() / 27.0;
        let rms = (angles.iter().map(|angle| angle * angle).sum::<f64>() / 27.0).sqrt();
        assert!(mean.abs() < 1e-12 && (rms - 0.02).abs() < 1e-9, "axis {axis}: {mean}, {rms} degrees");
        let follows = angles.windows(2).map(|pair| pair[0] * pair[1]).sum::<f64>() / 26.0 / (rms * rms);
        assert!(follows.abs() < 0.6, "rotations of axis {axis} are not independent: {follows}");
    }
    let across =
        motion.offsets_mm.iter().map(|offset| offset.dot(&motion.direction).abs()).fold(0.0, f64::max);
    assert!(across < 1e-12, "offsets go along the motion");
    let square: f64 = motion.offsets_mm.iter().map(Vector3::norm_squared).sum::<f64>() / 27.0;
    assert!(((0.5 * square).sqrt() / asked.pixel_mm() - 0.5).abs() < 1e-9);
}

#[test]
fn seeds_differ_and_repeat() {
    let asked = Photographs { light: 0.05, wobble_deg: 0.1, ..Photographs::sized(60, 90, 3) };
    let other = Photographs { seed: 2, ..asked.clone() };
    let (first, again, second) = (asked.take(), asked.take(), other.take());
    assert!(first.frames() == again.frames(), "one seed gives one series");
    assert!(first.frame(1) != second.frame(1));
    assert!(first.motion.rotations != second.motion.rotations && first.gain(1) != second.gain(1));
    assert!(first.seen(1, 40.0, 30.0) != second.seen(1, 40.0, 30.0), "the reliefs are the same");
}

#[test]
fn noise_and_light_are_those_that_are_asked_for() {
    let quiet = Photographs { noise: 0.0, jpeg_quality: None, ..Photographs::sized(200, 300, 3) };
    let loud = Photographs { noise: 5.0, light: 0.05, ..quiet.clone() }.take();
    let quiet = quiet.take();
    for frame in 0..3 {
        let gain = loud.gain(frame);
        assert!((gain - 1.0).abs() <= 0.05 && gain != 1.0);
        let (light, noisy) = (quiet.light(frame), loud.frame(frame));
        let differences = light.values().iter().zip(noisy.values());
        let squares = differences.map(|(light, grey)| (f64::from(*grey) - gain * f64::from(*light)).powi(2));
        let rms = (squares.sum::<f64>() / 60_000.0).sqrt();
        assert!((rms - 5.0).abs() < 0.1, "noise of {rms}");
    }
    assert!(loud.frame(0) != loud.frame(1), "frames have noise of their own");
}

#[test]
fn frames_rectified_by_the_truth_are_those_of_an_ideal_camera() {
    let asked = Photographs {
        texture: Texture::Blobs,
        noise: 0.0,
        jpeg_quality: None,
        // An offset moves points of different depth differently, which no rectification can undo.
        offset_px: 0.0,
        ..difficult()
    };
    let series = asked.take();
    let region = series.region();
    assert!(region.columns > 150 && region.rows > 80, "{region:?}");
    let ideal = series.straightened();
    let (left, top) = (region.left + ideal.camera.centre().0, region.top + ideal.camera.centre().1);
    assert!(left.fract() == 0.0 && top.fract() == 0.0, "pixels do not lie on pixels");
    for frame in [0, series.count() - 1] {
        let rectified = series.rectified_by_truth(frame, &series.frame(frame), &region);
        let light = ideal.light(frame);
        let (mut square, mut count) = (0.0, 0);
        for (y, x) in (0..region.rows).flat_map(|y| (0..region.columns).map(move |x| (y, x))) {
            let (i, j) = (x as f64 + left, y as f64 + top);
            if ideal.has_pixel((i, j)) {
                square += f64::from(rectified.at(x, y) - light.at(i as usize, j as usize)).powi(2);
                count += 1;
            }
        }
        let rms = (square / f64::from(count)).sqrt();
        // A shift by a tenth of a pixel makes 0.6.
        assert!(count > 10_000 && rms < 0.12, "{rms} grey values over {count} pixels");
    }
}
