//! From the scene to grey values.

use epirig_core::grid::Grid;
use nalgebra::Vector3;
use rand::RngExt;
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;

use super::Series;
use super::files::jpeg_decoded;
use super::motion::View;
use super::random::{Purpose, random};

impl Series {
    /// What a frame sees in grey values, under the mean light, without noise and rounding.
    pub fn light(&self, frame: usize) -> Grid<f32> {
        let view = &self.motion.views[frame];
        let blur_px = self.taken.motion_blur_px;
        if blur_px == 0.0 {
            return self.light_from(view);
        }
        // Places during the exposure, at most half a pixel apart; their middle is the place of the
        // frame.
        let count = (2.0 * blur_px).ceil() as usize + 1;
        let blur_mm = blur_px * self.taken.pixel_mm();
        let mut sum = Grid::filled(self.camera.rows, self.camera.columns, 0.0_f32);
        for part in 0..count {
            let moved = blur_mm * ((part as f64 + 0.5) / count as f64 - 0.5);
            let view = View { centre: view.centre + moved * self.motion.direction, ..view.clone() };
            let light = self.light_from(&view);
            sum.values_mut().iter_mut().zip(light.values()).for_each(|(sum, value)| *sum += value);
        }
        sum.map(|sum| sum / count as f32)
    }

    fn light_from(&self, view: &View) -> Grid<f32> {
        let camera = &self.camera;
        let mut light = Grid::filled(camera.rows, camera.columns, 0.0_f32);
        let turned_back = view.rotation.transpose();
        light.values_mut().par_chunks_mut(camera.columns).enumerate().for_each(|(y, row)| {
            // A ray ends about where its neighbours in the row have shown.
            let (mut last, mut before) = (self.surface.distance_mm, self.surface.distance_mm);
            for (x, value) in row.iter_mut().enumerate() {
                let direction: Vector3<f64> = turned_back * camera.direction(x as f64, y as f64);
                let along = self.surface.hit(&view.centre, &direction, 2.0 * last - before);
                let at = view.centre + along * direction;
                *value = self.painting.at(at.x, at.y);
                (before, last) = (if x == 0 { along } else { last }, along);
            }
        });
        light
    }

    /// The light of a frame, as a factor.
    pub fn gain(&self, frame: usize) -> f64 {
        let number = self.motion.numbers[frame] as u64;
        let share: f64 = random(self.taken.seed, Purpose::Light, number).random_range(-1.0..=1.0);
        1.0 + self.taken.light * share
    }

    /// A frame as the sensor has it, before it is compressed.
    pub fn exposed(&self, frame: usize) -> Grid<u8> {
        let light = self.light(frame);
        let (gain, noise) = (self.gain(frame) as f32, self.taken.noise as f32);
        let (rows, columns) = (light.rows(), light.columns());
        let mut exposed = Grid::filled(rows, columns, 0_u8);
        exposed.values_mut().par_chunks_mut(columns).enumerate().for_each(|(y, row)| {
            // Rows have random numbers of their own, so that it does not matter who draws them.
            let part = (self.motion.numbers[frame] * rows + y) as u64;
            let mut random = random(self.taken.seed, Purpose::Noise, part);
            for (grey, light) in row.iter_mut().zip(light.row(y)) {
                let error: f32 = if noise > 0.0 { StandardNormal.sample(&mut random) } else { 0.0 };
                *grey = (gain * light + noise * error).round().clamp(0.0, 255.0) as u8;
            }
        });
        exposed
    }

    /// A frame as a reader of its file gets it, upright.
    pub fn frame(&self, frame: usize) -> Grid<u8> {
        let exposed = self.exposed(frame);
        match self.taken.jpeg_quality {
            Some(quality) => jpeg_decoded(&exposed, quality, self.taken.orientation),
            None => exposed,
        }
    }

    /// All frames, in their order.
    pub fn frames(&self) -> Vec<Grid<u8>> {
        (0..self.count()).into_par_iter().map(|frame| self.frame(frame)).collect()
    }
}
