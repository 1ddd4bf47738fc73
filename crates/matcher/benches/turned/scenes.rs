//! Surfaces with their disparity in closed form.

use super::light::Light;
use super::texture::Paint;

/// A point's disparity in px over the whole baseline, at column and row (in px from the middle of the frame
/// at the middle of the baseline).
pub(super) type Disparity = Box<dyn Fn(f64, f64) -> f64 + Sync>;

pub(super) struct Scene {
    pub(super) name: String,
    pub(super) disparity: Disparity,
    pub(super) paint: Paint,
    /// Standard deviation of the noise, in DN of 8 bit.
    pub(super) noise_dn: f64,
    /// How deep the structure is, in px, if it has two levels.
    pub(super) depth_px: Option<f64>,
    /// Whether the camera is turned, and its frames are rectified.
    pub(super) rectified: bool,
    pub(super) light: Light,
    pub(super) seed: u64,
}

/// Disparity of what lies around the structures, in px.
pub(super) const BASE_PX: f64 = 18.0;
/// Width of hollows, and of the walls between two levels, in px: those of the paper's tile.
const HOLLOW_PX: f64 = 12.6;
const WALL_PX: f64 = 1.6;

/// The coordinate across lines that are turned by `degrees` from the columns.
pub(super) fn across(degrees: f64) -> impl Fn(f64, f64) -> f64 {
    let (sine, cosine) = degrees.to_radians().sin_cos();
    move |x, y| cosine * x + sine * y
}

/// 1 inside, 0 outside, and a wall on the outline; `inside` is the distance from it in px.
pub(super) fn walled(inside: f64) -> f64 {
    (inside / WALL_PX + 0.5).clamp(0.0, 1.0)
}

fn stripes(degrees: f64, depth_px: f64) -> Disparity {
    let across = across(degrees);
    Box::new(move |x, y| {
        let period = 2.0 * HOLLOW_PX;
        let from_middle = (across(x, y) + 3.1).rem_euclid(period) - HOLLOW_PX;
        BASE_PX - depth_px * walled(0.5 * HOLLOW_PX - from_middle.abs())
    })
}

fn roof(degrees: f64) -> Disparity {
    let across = across(degrees);
    Box::new(move |x, y| BASE_PX - 0.06 * (across(x, y) + 3.7).abs())
}

fn step(degrees: f64, depth_px: f64) -> Disparity {
    let across = across(degrees);
    Box::new(move |x, y| BASE_PX - depth_px * walled(across(x, y) + 2.3))
}

/// Round bumps 0.3 px high and 28 px wide, with steep rims, 40 px apart.
fn bumps() -> Disparity {
    Box::new(|x, y| {
        let near = |place: f64| (place + 17.0).rem_euclid(40.0) - 20.0;
        let share = near(x).hypot(near(y)) / 14.0;
        BASE_PX + 0.3 * (1.0 - share.powi(4)).max(0.0)
    })
}

fn checks(degrees: f64) -> Disparity {
    let (one, other) = (across(degrees), across(degrees + 90.0));
    Box::new(move |x, y| {
        let inside = |place: f64| 7.0 - ((place + 2.0).rem_euclid(28.0) - 14.0).abs();
        let (u, v) = (walled(inside(one(x, y))), walled(inside(other(x, y))));
        BASE_PX - 0.1 * (u + v - 2.0 * u * v)
    })
}

/// Grooves 4 px wide, 20 px apart.
fn grooves(degrees: f64) -> Disparity {
    let across = across(degrees);
    Box::new(move |x, y| {
        let from_middle = (across(x, y) + 4.4).rem_euclid(20.0) - 10.0;
        BASE_PX - 0.1 * walled(2.0 - from_middle.abs())
    })
}

/// Grooves 3 px wide, 17 px apart.
fn narrow_grooves(degrees: f64) -> Disparity {
    let across = across(degrees);
    Box::new(move |x, y| {
        let from_middle = (across(x, y) + 6.1).rem_euclid(17.0) - 8.5;
        BASE_PX - 0.1 * walled(1.5 - from_middle.abs())
    })
}

/// Curved alike everywhere, 3e-4 px per px^2.
fn dome() -> Disparity {
    Box::new(|x, y| BASE_PX - 1.5e-4 * (x * x + y * y))
}

fn plane() -> Disparity {
    Box::new(|x, y| BASE_PX + 0.01 * x - 0.006 * y)
}

/// All scenes; each has a texture and noise of its own, from `seed`.
pub(super) fn scenes(seed: u64) -> Vec<Scene> {
    let mut all: Vec<Scene> = Vec::new();
    let mut add = |name: String, disparity: Disparity, paint: Paint, noise_dn: f64, depth_px: Option<f64>| {
        let seed = seed.wrapping_mul(1000) + all.len() as u64;
        let rectified = name.ends_with("rectified");
        all.push(Scene { name, disparity, paint, noise_dn, depth_px, rectified, light: Light::Steady, seed });
    };
    for degrees in [0.0, 17.0, 33.0, 45.0, 60.0, 90.0] {
        add(format!("stripes 0.1 px, {degrees} deg"), stripes(degrees, 0.1), Paint::Grains, 1.0, Some(0.1));
    }
    for (degrees, noise_dn) in [(33.0, 0.5), (33.0, 3.0), (0.0, 3.0)] {
        let name = format!("stripes 0.1 px, {degrees} deg, noise {noise_dn} DN");
        add(name, stripes(degrees, 0.1), Paint::Grains, noise_dn, Some(0.1));
    }
    add("stripes 0.03 px, 17 deg".to_owned(), stripes(17.0, 0.03), Paint::Grains, 1.0, Some(0.03));
    add("stripes 0.3 px, 60 deg".to_owned(), stripes(60.0, 0.3), Paint::Grains, 1.0, Some(0.3));
    for (name, paint) in [("clouds", Paint::Clouds), ("cells", Paint::Cells), ("uneven", Paint::Uneven)] {
        add(format!("stripes 0.1 px, 33 deg, {name}"), stripes(33.0, 0.1), paint, 1.0, Some(0.1));
    }
    for degrees in [0.0, 33.0, 90.0] {
        add(format!("roof, {degrees} deg"), roof(degrees), Paint::Grains, 1.0, None);
    }
    for degrees in [0.0, 33.0] {
        add(format!("step 0.3 px, {degrees} deg"), step(degrees, 0.3), Paint::Clouds, 1.0, Some(0.3));
    }
    add("bumps".to_owned(), bumps(), Paint::Grains, 1.0, None);
    add("checks 14 px, 33 deg".to_owned(), checks(33.0), Paint::Grains, 1.0, Some(0.1));
    add("grooves 4 px, 33 deg".to_owned(), grooves(33.0), Paint::Grains, 1.0, Some(0.1));
    add("grooves 3 px, 30 deg".to_owned(), narrow_grooves(30.0), Paint::Grains, 1.0, Some(0.1));
    add("grooves 3 px, 30 deg, noise 0.3 DN".to_owned(), narrow_grooves(30.0), Paint::Grains, 0.3, Some(0.1));
    for noise_dn in [1.0, 3.0] {
        add(format!("dome, noise {noise_dn} DN"), dome(), Paint::Grains, noise_dn, None);
    }
    for (noise_dn, paint) in [(1.0, Paint::Grains), (3.0, Paint::Grains), (1.0, Paint::Cells)] {
        let texture = if paint == Paint::Cells { ", cells" } else { "" };
        add(format!("plane, noise {noise_dn} DN{texture}"), plane(), paint, noise_dn, None);
    }
    for noise_dn in [1.0, 3.0] {
        add(format!("plane, noise {noise_dn} DN, rectified"), plane(), Paint::Grains, noise_dn, None);
    }
    let name = "stripes 0.1 px, 33 deg, rectified".to_owned();
    add(name, stripes(33.0, 0.1), Paint::Grains, 1.0, Some(0.1));
    all.extend(in_changing_light(seed));
    all
}

/// A plane, and stripes, with one texture in all kinds of light.
fn in_changing_light(seed: u64) -> Vec<Scene> {
    let lights = [
        ("steady light", Light::Steady),
        ("ramp 2 %", Light::Ramp(0.02)),
        ("ramp 20 %", Light::Ramp(0.2)),
        ("ramp 50 %", Light::Ramp(0.5)),
        ("walk 1 %", Light::Walk(0.01)),
        ("flicker 1 %", Light::Flicker(0.01)),
        ("shading 5 %", Light::Shading(0.05)),
        ("highlight 2 DN", Light::Highlight(2.0)),
        ("highlight 12 DN", Light::Highlight(12.0)),
    ];
    let scene = |(name, light): (&str, Light), structure: &str, disparity: Disparity, depth_px| Scene {
        name: format!("{structure}, {name}"),
        disparity,
        paint: Paint::Grains,
        noise_dn: 1.0,
        depth_px,
        rectified: false,
        light,
        seed: seed.wrapping_mul(1000) + 500,
    };
    let planes = lights.map(|light| scene(light, "plane", plane(), None));
    let striped = lights.map(|light| scene(light, "stripes 0.1 px, 33 deg", stripes(33.0, 0.1), Some(0.1)));
    planes.into_iter().chain(striped).collect()
}
