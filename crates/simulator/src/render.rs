//! From scene to irradiance on the sensor: every pixel averages light over its area, spread by the lens.

use rayon::prelude::*;

use super::optics::Optics;
use super::rays::Rays;
use epirig_core::grid::Grid;

/// Samples along each side of a pixel. Texture is band-limited (see [`Texture`](super::Texture)), so three
/// suffice.
const SAMPLES: usize = 3;
/// Rows rendered together by one thread.
const STRIP_ROWS: usize = 32;
/// Reflectance of the featureless ground.
pub(super) const GROUND: f32 = 0.03;

/// Irradiance of every pixel as a share of the sensor's full scale at reflectance 1; rows x columns, in [0,
/// 1]. `shade` is the reflectance at the point that a ray meets.
pub(super) fn irradiance<F: Fn(f64, f64) -> (f64, f64) + Sync>(
    optics: &Optics,
    rays: &Rays<F>,
    shade: impl Fn((f64, f64)) -> f32 + Sync,
) -> Grid<f32> {
    let (rows, columns) = (optics.rows, optics.columns);
    let kernel = aperture(optics.point_spread_sigma_px);
    let mut image = Grid::filled(rows, columns, 0.0);
    image.values_mut().par_chunks_mut(STRIP_ROWS * columns).enumerate().for_each(|(strip, out)| {
        render_strip(columns, rays, &shade, strip * STRIP_ROWS, &kernel, out);
    });
    if optics.vignetting > 0.0 {
        let transmission = optics.transmissions();
        image.values_mut().par_chunks_mut(columns).enumerate().for_each(|(y, row)| {
            row.iter_mut()
                .enumerate()
                .for_each(|(x, value)| *value *= transmission(x as f64, y as f64) as f32);
        });
    }
    image
}

/// Weights of the samples along one axis around a pixel's middle: the pixel's width convolved with the point
/// spread.
fn aperture(sigma_px: f64) -> Vec<f32> {
    let sigma = sigma_px * SAMPLES as f64;
    let reach = (4.0 * sigma).ceil() as i64;
    let inner = (SAMPLES / 2) as i64;
    let gaussian = |offset: i64| {
        if sigma == 0.0 {
            f64::from(u8::from(offset == 0))
        } else {
            (-0.5 * (offset as f64 / sigma).powi(2)).exp()
        }
    };
    let weight = |offset: i64| (-inner..=inner).map(|shift| gaussian(offset - shift)).sum::<f64>();
    let weights: Vec<f64> = (-reach - inner..=reach + inner).map(weight).collect();
    let sum: f64 = weights.iter().sum();
    weights.iter().map(|weight| (weight / sum) as f32).collect()
}

fn render_strip<F: Fn(f64, f64) -> (f64, f64)>(
    columns: usize,
    rays: &Rays<F>,
    shade: &impl Fn((f64, f64)) -> f32,
    first_row: usize,
    kernel: &[f32],
    out: &mut [f32],
) {
    let rows = out.len() / columns;
    let reach = kernel.len() / 2;
    // Sample `reach` lies in the middle of the strip's first pixel.
    let coordinate = |index: usize| (index as f64 - reach as f64) / SAMPLES as f64;
    let wide = (columns - 1) * SAMPLES + 1 + 2 * reach;
    let high = (rows - 1) * SAMPLES + 1 + 2 * reach;
    let mut seen = vec![(0.0, 0.0); wide];
    let mut samples = vec![0.0_f32; wide];
    let mut narrowed = vec![0.0_f32; high * columns];
    for (index, target) in narrowed.chunks_exact_mut(columns).enumerate() {
        let y = first_row as f64 + coordinate(index);
        rays.fill(&mut seen, coordinate, y, SAMPLES as f64);
        for (sample, &ray) in samples.iter_mut().zip(&seen) {
            *sample = shade(ray);
        }
        for (x, value) in target.iter_mut().enumerate() {
            let window = &samples[x * SAMPLES..x * SAMPLES + kernel.len()];
            *value = window.iter().zip(kernel).map(|(sample, weight)| sample * weight).sum();
        }
    }
    for (row, target) in out.chunks_exact_mut(columns).enumerate() {
        target.fill(0.0);
        for (index, weight) in kernel.iter().enumerate() {
            let source = &narrowed[(row * SAMPLES + index) * columns..][..columns];
            target.iter_mut().zip(source).for_each(|(sum, value)| *sum += weight * value);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Simulator, SimulatorConfig};

    #[test]
    fn pixels_average_the_surface_as_direct_integration_does() {
        let mut config = SimulatorConfig::textured_plane(24, 16, 5);
        config.optics.point_spread_sigma_px = 0.6;
        let simulator = Simulator::new(config).unwrap();
        let image = simulator.irradiance_at_offset(1.3);
        let config = simulator.config();
        // 31 x 31 samples per pixel over +-4 px, weighted by the exact integral of the Gaussian over the
        // pixel's width: another kernel, another density, no separation.
        let density = 31;
        let sigma: f64 = 0.6;
        let weight = |distance: f64| {
            let steps = 64;
            (0..steps)
                .map(|step| {
                    let inside = (f64::from(step) + 0.5) / f64::from(steps) - 0.5;
                    (-0.5 * ((distance - inside) / sigma).powi(2)).exp()
                })
                .sum::<f64>()
        };
        for (x, y) in [(5, 4), (12, 8), (17, 11)] {
            let (mut sum, mut total) = (0.0, 0.0);
            for i in -4 * density..=4 * density {
                for j in -4 * density..=4 * density {
                    let (u, v) = (f64::from(i) / f64::from(density), f64::from(j) / f64::from(density));
                    let ray = config.optics.ray(x as f64 + u, y as f64 + v);
                    let hit = config.scene.hit(ray, 1.3).unwrap();
                    let weight = weight(u) * weight(v);
                    sum += weight * f64::from(simulator.paint.reflectance(hit.across_mm, hit.along_mm));
                    total += weight;
                }
            }
            let difference = (f64::from(image.at(x, y)) - sum / total).abs();
            // A third of a grey level of 8 bit, the noise of its quantisation.
            assert!(difference < 0.3 / 255.0, "({x}, {y}): {difference}");
        }
    }

    #[test]
    fn the_aperture_is_symmetric_and_loses_no_light() {
        for sigma in [0.0, 0.5, 1.3] {
            let kernel = aperture(sigma);
            assert_eq!(kernel.len() % 2, 1);
            assert!((kernel.iter().sum::<f32>() - 1.0).abs() < 1e-6);
            assert!(kernel.iter().zip(kernel.iter().rev()).all(|(a, b)| (a - b).abs() < 1e-7));
        }
    }
}
