//! Against corners rendered by integration over pixel and blur: exact along rows, in 64 steps a pixel across
//! them.

use nalgebra::{SMatrix, SVector};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};

use super::*;

const SIZE: usize = 41;
const STEPS_PER_PX: usize = 64;

/// A chess-board of 4 x 4 squares around its corner (0, 0) under perspective.
#[derive(Debug, Clone, Copy)]
struct Picture {
    centre: [f64; 2],
    /// Images of the board's axes near the corner, in px for a square.
    axes: [[f64; 2]; 2],
    /// Shortening along either axis, per square.
    perspective: [f64; 2],
    blur_px: f64,
    dark: f64,
    bright: f64,
    light: [f64; 2],
}

/// Distribution of pixel (width 1) and blur together, by numerical integration on a grid of 1/500 px.
struct Spread(Vec<f64>, f64);

impl Spread {
    const FINE: f64 = 500.0;

    fn new(blur_px: f64) -> Self {
        let reach = 6.0 * blur_px + 0.5;
        let gauss = |z: f64| (-0.5 * (z / blur_px).powi(2)).exp();
        let count = (2.0 * reach * Self::FINE) as usize;
        let fine: Vec<f64> = (0..=count).map(|k| gauss(k as f64 / Self::FINE - reach)).collect();
        let width = Self::FINE as usize;
        let mut boxed = Vec::with_capacity(count);
        for k in 0..=count {
            let range = k.saturating_sub(width / 2)..(k + width / 2).min(count + 1);
            boxed.push(fine[range].iter().sum::<f64>());
        }
        let total: f64 = boxed.iter().sum();
        let mut sum = 0.0;
        let values = boxed.iter().map(|value| {
            sum += value / total;
            sum - 0.5 * value / total
        });
        Self(values.collect(), reach)
    }

    /// Share of the pixel's light that comes from below `x`, relative to the pixel's centre.
    fn below(&self, x: f64) -> f64 {
        // A box of an even number of grid points lies half a point before its index.
        let at = (x + self.1) * Self::FINE + 0.5;
        if at <= 0.0 {
            return 0.0;
        }
        let k = at as usize;
        if k + 1 >= self.0.len() { 1.0 } else { self.0[k] + (at - k as f64) * (self.0[k + 1] - self.0[k]) }
    }
}

impl Picture {
    fn image(&self, u: f64, v: f64) -> [f64; 2] {
        let w = 1.0 + self.perspective[0] * u + self.perspective[1] * v;
        [0, 1].map(|k| self.centre[k] + (u * self.axes[0][k] + v * self.axes[1][k]) / w)
    }

    /// Board coordinates of a place in the image.
    fn board(&self, x: f64, y: f64) -> (f64, f64) {
        // q w = u a + v b with w linear in u and v: two linear equations.
        let q = [x - self.centre[0], y - self.centre[1]];
        let row = |k: usize| {
            [self.axes[0][k] - q[k] * self.perspective[0], self.axes[1][k] - q[k] * self.perspective[1]]
        };
        let (r, s) = (row(0), row(1));
        let determinant = r[0] * s[1] - r[1] * s[0];
        ((q[0] * s[1] - r[1] * q[1]) / determinant, (r[0] * q[1] - q[0] * s[0]) / determinant)
    }

    fn render(&self) -> Grid<f32> {
        let spread = Spread::new(self.blur_px);
        let reach = spread.1.ceil() as i64;
        let mut exact = vec![0.0_f64; SIZE * SIZE];
        let lines: Vec<([f64; 2], [f64; 2])> = [-1.0, 0.0, 1.0]
            .into_iter()
            .flat_map(|k| {
                [(self.image(k, -2.0), self.image(k, 2.0)), (self.image(-2.0, k), self.image(2.0, k))]
            })
            .collect();
        let first = -reach * STEPS_PER_PX as i64;
        for step in first..(SIZE as i64 + reach) * STEPS_PER_PX as i64 {
            let y = (step as f64 + 0.5) / STEPS_PER_PX as f64;
            let mut edges: Vec<f64> = lines
                .iter()
                .map(|(a, b)| a[0] + (y - a[1]) / (b[1] - a[1]) * (b[0] - a[0]))
                .filter(|x| (-20.0..SIZE as f64 + 20.0).contains(x))
                .collect();
            edges.sort_by(f64::total_cmp);
            edges.insert(0, -30.0);
            edges.push(SIZE as f64 + 30.0);
            let bright: Vec<bool> = edges
                .windows(2)
                .map(|pair| {
                    let (u, v) = self.board(0.5 * (pair[0] + pair[1]), y);
                    (u.floor() + v.floor()).rem_euclid(2.0) < 0.5
                })
                .collect();
            let rows =
                ((y - reach as f64).ceil() as i64).max(0)..=((y + reach as f64) as i64).min(SIZE as i64 - 1);
            for column in 0..SIZE {
                let share: f64 = edges
                    .windows(2)
                    .zip(&bright)
                    .filter(|(_, bright)| **bright)
                    .map(|(pair, _)| {
                        spread.below(pair[1] - column as f64) - spread.below(pair[0] - column as f64)
                    })
                    .sum();
                for row in rows.clone() {
                    let half = 0.5 / STEPS_PER_PX as f64;
                    let away = y - row as f64;
                    let weight = spread.below(away + half) - spread.below(away - half);
                    exact[row as usize * SIZE + column] += weight * share;
                }
            }
        }
        let level = |(index, share): (usize, &f64)| {
            let (x, y) = ((index % SIZE) as f64 - self.centre[0], (index / SIZE) as f64 - self.centre[1]);
            let light = 1.0 + self.light[0] * x + self.light[1] * y;
            (light * (self.dark + (self.bright - self.dark) * share)) as f32
        };
        Grid::from_values(SIZE, SIZE, exact.iter().enumerate().map(level).collect()).unwrap()
    }

    fn start(&self) -> EdgeCross {
        EdgeCross {
            x_px: self.centre[0] + 0.4,
            y_px: self.centre[1] - 0.3,
            before_bright_rad: self.axes[0][1].atan2(self.axes[0][0]) + 0.04,
            before_dark_rad: self.axes[1][1].atan2(self.axes[1][0]) - 0.03,
        }
    }

    /// Rotated by `angle_rad`, shortened across by `tilt`.
    fn turned(angle_rad: f64, tilt: f64, blur_px: f64, centre: [f64; 2]) -> Self {
        let (sin, cos) = angle_rad.sin_cos();
        let axes = [[20.0 * tilt * cos, 20.0 * sin], [-20.0 * tilt * sin, 20.0 * cos]];
        let (dark, bright) = (40.0, 200.0);
        Self { centre, axes, perspective: [0.0; 2], blur_px, dark, bright, light: [0.0; 2] }
    }

    fn parameters(&self) -> [f64; UNKNOWNS] {
        let angle = |k: usize| self.axes[k][1].atan2(self.axes[k][0]);
        let [x, y] = self.centre;
        [x, y, angle(0), angle(1), self.blur_px, self.dark, self.bright, self.light[0], self.light[1]]
    }

    fn with_parameters(&self, p: [f64; UNKNOWNS]) -> Self {
        let length = |k: usize| self.axes[k][0].hypot(self.axes[k][1]);
        let axis = |k: usize, angle: f64| [length(k) * angle.cos(), length(k) * angle.sin()];
        let axes = [axis(0, p[2]), axis(1, p[3])];
        Self {
            centre: [p[0], p[1]],
            axes,
            blur_px: p[4],
            dark: p[5],
            bright: p[6],
            light: [p[7], p[8]],
            ..*self
        }
    }
}

/// Least standard deviations of x and y for noise of 1 DN, by the Cramer-Rao bound, from differences of
/// renderings.
fn least_sigma(picture: &Picture, radius_px: f64) -> [f64; 2] {
    let at = picture.parameters();
    let derivatives: Vec<Grid<f32>> = (0..UNKNOWNS)
        .map(|k| {
            let h = [0.05, 0.05, 0.01, 0.01, 0.02, 1.0, 1.0, 1e-3, 1e-3][k];
            let [low, high] = [-h, h].map(|h| {
                let mut moved = at;
                moved[k] += h;
                // Light grows about the centre of the frame for this, so that it does not move with the
                // corner.
                picture.with_parameters(moved).render()
            });
            let values = high.values().iter().zip(low.values()).map(|(b, a)| (b - a) / (2.0 * h as f32));
            Grid::from_values(SIZE, SIZE, values.collect()).unwrap()
        })
        .collect();
    let middle = at[..2].iter().map(|value| value.round()).collect::<Vec<_>>();
    let mut information = SMatrix::<f64, UNKNOWNS, UNKNOWNS>::zeros();
    for y in 0..SIZE {
        for x in 0..SIZE {
            if (x as f64 - middle[0]).hypot(y as f64 - middle[1]) <= radius_px {
                let row = SVector::<f64, UNKNOWNS>::from_fn(|k, _| f64::from(derivatives[k].at(x, y)));
                information += row * row.transpose();
            }
        }
    }
    let covariance = information.try_inverse().unwrap();
    [covariance[(0, 0)].sqrt(), covariance[(1, 1)].sqrt()]
}

#[test]
fn rendered_corners_are_met_without_bias() {
    let mut largest = 0.0_f64;
    for (index, angle_deg) in [4.0_f64, 17.0, 30.0, 45.0, 62.0, 86.0, 100.0, 155.0].into_iter().enumerate() {
        for blur_px in [0.4, 0.8, 1.5] {
            let phase = index as f64 * 0.37 + blur_px;
            let centre = [20.0 + phase.fract() - 0.5, 20.0 + (3.1 * phase).fract() - 0.5];
            let tilt = if index % 2 == 0 { 1.0 } else { 0.77 };
            let mut picture = Picture::turned(angle_deg.to_radians(), tilt, blur_px, centre);
            // From square to square lengths change by 4 %, light by 4 %.
            picture.perspective = [0.03, -0.02];
            picture.light = [0.002, -0.001];
            let corner = refine_corner(&picture.render(), &picture.start(), 7.0).unwrap();
            let error = (corner.x_px - centre[0]).hypot(corner.y_px - centre[1]);
            println!(
                "{angle_deg} {blur_px} {error:.5} blur {} contrast {}",
                corner.blur_px, corner.contrast_dn
            );
            largest = largest.max(error);
        }
    }
    assert!(largest < 0.003, "{largest} px");
}

#[test]
fn scatter_is_the_least_possible_and_is_told() {
    let noise_dn = 3.0;
    let normal = Normal::new(0.0, noise_dn).unwrap();
    let mut random = ChaCha8Rng::seed_from_u64(5);
    for (angle_deg, tilt, blur_px) in [(12.0_f64, 1.0, 0.6), (40.0, 0.8, 1.0), (70.0, 1.0, 1.5)] {
        let picture = Picture::turned(angle_deg.to_radians(), tilt, blur_px, [20.2, 19.9]);
        let clean = picture.render();
        let least = least_sigma(&picture, 7.0);
        let trials = 600;
        let (mut errors, mut normalised) = ([0.0; 2], 0.0);
        for _ in 0..trials {
            let noisy = clean.map(|value| (f64::from(value) + normal.sample(&mut random)).round() as f32);
            let corner = refine_corner(&noisy, &picture.start(), 7.0).unwrap();
            let error = [corner.x_px - picture.centre[0], corner.y_px - picture.centre[1]];
            for axis in 0..2 {
                errors[axis] += error[axis] * error[axis] / f64::from(trials);
                normalised += (error[axis] / corner.sigma_px).powi(2) / f64::from(2 * trials);
            }
        }
        for axis in 0..2 {
            // 600 trials know the ratio to 3 %.
            let ratio = errors[axis].sqrt() / (noise_dn * least[axis]);
            assert!((0.9..1.1).contains(&ratio), "{angle_deg} deg, axis {axis}: {ratio}");
        }
        assert!((0.9..1.1).contains(&normalised.sqrt()), "{angle_deg} deg: {}", normalised.sqrt());
    }
}

#[test]
fn what_is_no_corner_is_refused() {
    let plane = |level: fn(usize, usize) -> f32| {
        let values = (0..SIZE * SIZE).map(|index| level(index % SIZE, index / SIZE)).collect();
        Grid::from_values(SIZE, SIZE, values).unwrap()
    };
    let start = EdgeCross {
        x_px: 20.0,
        y_px: 20.0,
        before_bright_rad: 0.0,
        before_dark_rad: std::f64::consts::FRAC_PI_2,
    };
    let refused = |image: &Grid<f32>, what: &str| {
        assert_eq!(refine_corner(image, &start, 7.0), None, "{what}");
    };
    refused(&plane(|_, _| 100.0), "one level");
    refused(&plane(|x, _| if x < 20 { 30.0 } else { 200.0 }), "an edge");
    refused(&plane(|x, y| if x < 20 && y < 20 { 30.0 } else { 200.0 }), "the outer corner of a square");
    refused(&plane(|x, y| if (x < 20) != (y < 20) { 200.0 } else { 30.0 }), "a corner of the other colours");
    let border = EdgeCross { x_px: 1.0, ..start };
    assert_eq!(
        refine_corner(&plane(|x, y| if (x < 1) == (y < 20) { 200.0 } else { 30.0 }), &border, 7.0),
        None
    );
}
