//! Points of anchor frames, placed in every frame that shows them.

use rayon::prelude::*;

use super::expected::Expected;
use super::frames::Frames;
use super::point::{Scratch, Template, in_full, squares};
use super::search::{Looked, rho_of, some_of, wider};
use super::track::Track;
use crate::block::Block;

/// Side of a point's square, in px; and in pictures that have less than three times as many rows.
const SIDE: usize = 20;
const SMALL_SIDE: usize = 12;
/// Points of an anchor. 200 to 400 that cover the picture suffice: ten times as many are three times as good.
const FEWEST_POINTS: usize = 24;
const MOST_POINTS: usize = 400;
/// Fewest frames of a point, its anchor included: two tell rho, the third whether they agree.
const FEWEST_FRAMES: usize = 3;

/// A square of an anchor that is to be placed in all frames.
struct Followed {
    anchor: usize,
    rho: f64,
    template: Template,
    track: Track,
}

/// Follows points of all anchors through pictures reduced by `factor`. If the frames are cancelled, some are missing.
pub(super) fn follow(
    frames: &dyn Frames,
    factor: usize,
    expected: &Expected,
    observations: usize,
) -> Vec<Track> {
    let (rows, columns) = frames.size();
    let side = if rows.min(columns) / factor >= 3 * SIDE { SIDE } else { SMALL_SIDE };
    let most = observations / (frames.count() * expected.anchors.len()).max(1);
    let most = most.clamp(FEWEST_POINTS, MOST_POINTS);
    let px = factor as f64;
    let views = expected.views();
    let mut points: Vec<Followed> = Vec::new();
    for &anchor in expected.anchors.iter().take_while(|_| !frames.cancelled()) {
        let picture = frames.picture(anchor, factor);
        let near = expected.near(anchor, rows.max(columns) as f64);
        let pictures: Vec<_> = near.par_iter().map(|&frame| frames.picture(frame, factor)).collect();
        let followed = squares(&picture, side, most, expected.direction());
        points.par_extend(followed.into_par_iter().filter_map(|square| {
            let block = Block::of(&picture, square.1, square.0, side)?;
            let middle =
                [square.0, square.1].map(|first| in_full(first as f64 + 0.5 * (side as f64 - 1.0), factor));
            let moved = |frame: usize, rho: f64| views.moved([anchor, frame], middle, rho);
            let range = wider(expected.rho);
            // Places on straight lines through two points of the range.
            let looked: Option<Vec<Looked>> = near
                .iter()
                .zip(&pictures)
                .map(|(&frame, picture)| {
                    let (least, most) = (moved(frame, range.0)?, moved(frame, range.1)?);
                    let by_rho = [0, 1].map(|axis| (most[axis] - least[axis]) / (px * (range.1 - range.0)));
                    let standing = [0, 1].map(|axis| least[axis] / px - by_rho[axis] * range.0);
                    Some(Looked { picture, standing, by_rho })
                })
                .collect();
            let looked = looked?;
            let rho = rho_of(&block, &looked, range)?;
            let far = looked.last()?.by_rho;
            let length = far[0].hypot(far[1]);
            let direction = far.map(|part| part / length);
            let template = Template::of(&picture, square, side, direction)?;
            let in_scene = moved(expected.anchors[0], rho)?;
            let cell =
                |axis: usize| ((middle[axis] + in_scene[axis]) / (2.0 * px * side as f64)).floor() as i64;
            let track = Track { cell: (cell(0), cell(1)), direction, sights: Vec::new() };
            Some(Followed { anchor, rho, template, track })
        }));
    }
    let placed = (0..frames.count()).into_par_iter().map_init(Scratch::default, |scratch, frame| {
        if frames.cancelled() {
            return Vec::new();
        }
        let picture = frames.picture(frame, factor);
        let place = |point: &Followed| {
            let middle = point.template.middle().map(|part| in_full(part, factor));
            let start = views.moved([point.anchor, frame], middle, point.rho)?.map(|part| part / px);
            point.template.place(&picture, (frame, factor), start, scratch)
        };
        points.iter().map(place).collect::<Vec<_>>()
    });
    let placed: Vec<Vec<_>> = placed.collect();
    for placed in placed {
        points.iter_mut().zip(placed).for_each(|(point, sight)| point.track.sights.extend(sight));
    }
    let tracks = points.into_iter().map(|point| point.track);
    tracks.filter(|track| track.sights.len() >= FEWEST_FRAMES).collect()
}

impl Expected {
    /// Frames in which points of `anchor` are looked for first, the nearest first, in pictures of this width.
    fn near(&self, anchor: usize, width: f64) -> Vec<usize> {
        let position = |frame: usize| self.cameras.frames[frame].position;
        let distance = |frame: usize| (position(frame) - position(anchor)).abs();
        let reach = self.cameras.focal_length_px * self.rho.1;
        let mut frames: Vec<usize> = (0..self.cameras.frames.len())
            .filter(|&frame| frame != anchor && distance(frame) * reach < 0.5 * width)
            .collect();
        frames.sort_by(|&a, &b| distance(a).total_cmp(&distance(b)));
        some_of(frames)
    }
}
