//! Points of anchor frames, placed in every frame that shows them.

use rayon::prelude::*;

use super::TextureMotionError;
use super::frames::Frames;
use super::point::{Scratch, Sight, Template, squares};
use super::search::{Found, Looked, rho_of, some_of, turned, wider};
use crate::block::Block;

/// Side of a point's square, in px; and in pictures that have less than three times as many rows.
const SIDE: usize = 20;
const SMALL_SIDE: usize = 12;
/// Points of an anchor. 200 to 400 that cover the picture suffice: ten times as many are three times as good.
const FEWEST_POINTS: usize = 24;
const MOST_POINTS: usize = 400;
/// Fewest frames of a point, its anchor included: two tell rho, the third whether they agree.
const FEWEST_FRAMES: usize = 3;

/// A point in all frames that show it.
#[derive(Debug, Clone)]
pub(super) struct Track {
    /// Where it is in the scene, in steps of two squares: points in one cell may see the same noise.
    pub(super) cell: (i64, i64),
    pub(super) sights: Vec<Sight>,
}

/// Follows points of all anchors through pictures reduced by `factor`.
pub(super) fn follow(
    frames: &dyn Frames,
    factor: usize,
    found: &Found,
    observations: usize,
) -> Result<Vec<Track>, TextureMotionError> {
    let (rows, columns) = frames.size();
    let side = if rows.min(columns) / factor >= 3 * SIDE { SIDE } else { SMALL_SIDE };
    let most = observations / (frames.count() * found.anchors.len()).max(1);
    let most = most.clamp(FEWEST_POINTS, MOST_POINTS);
    let px = factor as f64;
    let mut points: Vec<(usize, f64, Template, Track)> = Vec::new();
    for &anchor in &found.anchors {
        let picture = frames.picture(anchor, factor);
        let near = others(found, anchor, columns as f64);
        let pictures: Vec<_> = near.par_iter().map(|&frame| frames.picture(frame, factor)).collect();
        let looked: Vec<Looked> = near
            .iter()
            .zip(&pictures)
            .map(|(&frame, picture)| Looked {
                picture,
                along: (found.position[frame] - found.position[anchor]) / px,
                across: (found.across[frame] - found.across[anchor]) / px,
            })
            .collect();
        let to_first = found.position[found.anchors[0]] - found.position[anchor];
        let followed = squares(&picture, side, most, found.direction).into_par_iter().filter_map(|square| {
            let block = Block::of(&picture, square.1, square.0, side)?;
            let rho = rho_of(&block, &looked, found.direction, wider(found.rho))?;
            let template = Template::of(&picture, square, side, found.direction)?;
            let in_scene = turned(found.direction, rho * to_first / px, 0.0);
            let cell = |at: usize, moved: f64| ((at as f64 + moved) / (2 * side) as f64).floor() as i64;
            let track = Track {
                cell: (cell(square.0, in_scene[0]), cell(square.1, in_scene[1])),
                sights: Vec::new(),
            };
            Some((anchor, rho, template, track))
        });
        points.par_extend(followed);
    }
    let placed = (0..frames.count()).into_par_iter().map_init(Scratch::default, |scratch, frame| {
        let picture = frames.picture(frame, factor);
        let place = |(anchor, rho, template, _): &(usize, f64, Template, Track)| {
            let start = [
                rho * (found.position[frame] - found.position[*anchor]) / px,
                (found.across[frame] - found.across[*anchor]) / px,
            ];
            template.place(&picture, (frame, px), start, scratch)
        };
        points.iter().map(place).collect::<Vec<_>>()
    });
    let placed: Vec<Vec<_>> = placed.collect();
    for placed in placed {
        points.iter_mut().zip(placed).for_each(|(point, sight)| point.3.sights.extend(sight));
    }
    let tracks = points.into_iter().map(|point| point.3);
    Ok(tracks.filter(|track| track.sights.len() >= FEWEST_FRAMES).collect())
}

/// Frames in which points of `anchor` are looked for first.
fn others(found: &Found, anchor: usize, width: f64) -> Vec<usize> {
    let distance = |frame: usize| (found.position[frame] - found.position[anchor]).abs();
    let mut frames: Vec<usize> = (0..found.position.len())
        .filter(|&frame| frame != anchor && distance(frame) * found.rho.1 < 0.5 * width)
        .collect();
    frames.sort_by(|&a, &b| distance(a).total_cmp(&distance(b)));
    some_of(frames)
}
