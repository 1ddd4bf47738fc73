//! The order of pictures by what they show: a short path through all of them, each to one that is like it.

use rayon::prelude::*;

use super::reduced::Reduced;
use epirig_core::grid::Grid;
use epirig_core::image::reduced;

/// Longest side of the pictures that are compared all with all; and how often they are halved.
const LONGEST: usize = 64;
const HALVINGS: usize = 2;
/// Passes over all pairs of steps of the path, at most.
const MOST_PASSES: usize = 30;

/// How unlike any two pictures are: 0 for the same, about 1 where they have nothing in common.
#[derive(Debug)]
pub(super) struct Distances {
    count: usize,
    values: Vec<f32>,
}

impl Distances {
    pub(super) fn of(pictures: &[&Reduced]) -> Self {
        let count = pictures.len();
        let mut small: Vec<Grid<f32>> = pictures
            .par_iter()
            .map(|picture| {
                let longest = picture.coarse.rows().max(picture.coarse.columns());
                reduced(&picture.coarse, longest.div_ceil(LONGEST).max(1))
            })
            .collect();
        let mut values = vec![0.0; count * count];
        for level in 0..=HALVINGS {
            if level > 0 {
                small.par_iter_mut().for_each(|picture| *picture = reduced(picture, 2));
            }
            add_distances(&small, &mut values);
        }
        let share = 1.0 / (HALVINGS + 1) as f32;
        values.iter_mut().for_each(|value| *value *= share);
        Self { count, values }
    }

    pub(super) fn between(&self, a: usize, b: usize) -> f32 {
        self.values[a * self.count + b]
    }

    /// The length of a path.
    pub(super) fn length(&self, path: &[usize]) -> f32 {
        path.windows(2).map(|pair| self.between(pair[0], pair[1])).sum()
    }

    /// A short path through all pictures, from an end of it.
    pub(super) fn short_path(&self) -> Vec<usize> {
        let farthest = |from: usize| {
            let far = |a: &usize, b: &usize| self.between(from, *a).total_cmp(&self.between(from, *b));
            (0..self.count).max_by(far).unwrap_or(0)
        };
        let mut path = vec![farthest(farthest(0))];
        let mut left: Vec<usize> = (0..self.count).filter(|&picture| picture != path[0]).collect();
        while let Some(&last) = path.last() {
            let near =
                |a: &usize, b: &usize| self.between(last, left[*a]).total_cmp(&self.between(last, left[*b]));
            let Some(nearest) = (0..left.len()).min_by(near) else { break };
            path.push(left.swap_remove(nearest));
        }
        self.shorten(&mut path);
        self.cut_at_longest(&mut path);
        self.shorten(&mut path);
        // Either direction is as good: the one in which the first picture comes early.
        if path.iter().position(|&picture| picture == 0).is_some_and(|place| place > self.count / 2) {
            path.reverse();
        }
        path
    }

    /// Joins the ends of the path, and cuts the ring at its longest step: a walk that began in the middle has come
    /// to an end, and jumped to the other.
    fn cut_at_longest(&self, path: &mut [usize]) {
        let step = |place: &usize| self.between(path[*place], path[(*place + 1) % path.len()]);
        let longest = (0..path.len()).max_by(|a, b| step(a).total_cmp(&step(b)));
        if let Some(place) = longest {
            path.rotate_left((place + 1) % path.len());
        }
    }

    /// Turns parts of the path round as long as that makes it shorter.
    fn shorten(&self, path: &mut [usize]) {
        let step = |a: Option<&usize>, b: Option<&usize>| match (a, b) {
            (Some(&a), Some(&b)) => self.between(a, b),
            _ => 0.0,
        };
        for _ in 0..MOST_PASSES {
            let mut is_shorter = false;
            for first in 0..path.len() {
                for last in first + 1..path.len() {
                    let before = first.checked_sub(1).and_then(|place| path.get(place));
                    let after = path.get(last + 1);
                    let (head, tail) = (path.get(first), path.get(last));
                    let gain =
                        step(before, head) + step(tail, after) - step(before, tail) - step(head, after);
                    if gain > 1e-6 {
                        path[first..=last].reverse();
                        is_shorter = true;
                    }
                }
            }
            if !is_shorter {
                return;
            }
        }
    }
}

/// Adds the mean squared differences of pictures without the mean of all, over twice their mean square.
fn add_distances(pictures: &[Grid<f32>], sums: &mut [f32]) {
    let count = pictures.len();
    let pixels = pictures.first().map_or(0, |picture| picture.values().len());
    let mut changes: Vec<Vec<f32>> = pictures.iter().map(|picture| without_light(picture.values())).collect();
    // What stays in all of them, such as a background, tells nothing.
    let mut mean = vec![0.0_f32; pixels];
    changes.iter().for_each(|values| mean.iter_mut().zip(values).for_each(|(sum, value)| *sum += value));
    mean.iter_mut().for_each(|sum| *sum /= count.max(1) as f32);
    changes
        .iter_mut()
        .for_each(|values| values.iter_mut().zip(&mean).for_each(|(value, mean)| *value -= mean));
    let energy = |values: &[f32]| values.iter().map(|value| value * value).sum::<f32>();
    let whole: f32 = changes.iter().map(|values| energy(values)).sum::<f32>() / count.max(1) as f32;
    if whole <= 0.0 {
        return;
    }
    sums.par_chunks_mut(count).enumerate().for_each(|(first, sums)| {
        for (sum, other) in sums.iter_mut().zip(&changes) {
            let difference: f32 = changes[first].iter().zip(other).map(|(a, b)| (a - b) * (a - b)).sum();
            *sum += difference / (2.0 * whole);
        }
    });
}

/// Values with a mean of 0 and a variance of 1: lamps drift.
fn without_light(values: &[f32]) -> Vec<f32> {
    let mean = values.iter().sum::<f32>() / values.len().max(1) as f32;
    let variance =
        values.iter().map(|value| (value - mean).powi(2)).sum::<f32>() / values.len().max(1) as f32;
    let scale = if variance > 0.0 { variance.sqrt().recip() } else { 0.0 };
    values.iter().map(|value| (value - mean) * scale).collect()
}
