//! The places of the samples of every candidate, which are the same for all rows.

use std::ops::Range;

use super::groups::Groups;
use crate::candidates::Candidates;
use crate::lines::{EpiLines, SeenRule, Shift, Sightings};
use crate::options::Occlusion;

/// Pixels that rows are continued by beyond each border. A sample at the border is interpolated between a
/// line in view and its neighbour, less than a pixel farther, which misalignment may take a little beyond
/// that.
pub(crate) const PAD: usize = 2;

/// Candidates that are made of the same sums over groups.
#[derive(Debug)]
pub(crate) struct DisparityBlock {
    /// The candidates.
    pub(crate) candidates: Range<usize>,
    /// Of each frame, relative to the middle of its group.
    pub(crate) shifts: Vec<Shift>,
    /// Of each group: the columns that all of its frames see, pads included, at the group's middle.
    pub(crate) seen: Vec<Range<usize>>,
}

/// How a group's sums are shifted under one candidate.
#[derive(Debug, Clone, Copy)]
pub(crate) struct GroupShift {
    /// Whole pixels, towards the smaller.
    pub(crate) whole: isize,
    /// Rest of the shift, in [0, 1) px.
    pub(crate) fraction: f32,
    /// Whole pixels, to the nearest.
    pub(crate) nearest: isize,
}

/// Columns whose candidates are made of the same groups.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Segment {
    pub(crate) columns: Range<usize>,
    /// Groups that count: those on both sides of the reference frame that see the candidate in all of their
    /// frames.
    pub(crate) groups: Range<usize>,
    /// Whether all frames together, those up to the reference and those from it on may make the cost.
    pub(crate) allowed: [bool; 3],
}

/// Where a candidate is visible: the columns, with the groups of frames that see them.
#[derive(Debug)]
pub(crate) struct VisibleRuns {
    /// Of each group.
    pub(crate) shifts: Vec<GroupShift>,
    /// In the order of the columns; those without a cost are in none.
    pub(crate) segments: Vec<Segment>,
    /// The same columns, as few ranges as possible.
    pub(crate) runs: Vec<Range<usize>>,
}

/// Geometry of a search.
#[derive(Debug)]
pub(crate) struct Plan {
    pub(crate) columns: usize,
    pub(crate) reference: usize,
    /// Greatest distance of a frame from the reference frame, in baselines.
    pub(crate) farthest: f64,
    pub(crate) groups: Groups,
    pub(crate) candidates: Candidates,
    pub(crate) blocks: Vec<DisparityBlock>,
    pub(crate) coverage: Vec<VisibleRuns>,
}

impl Plan {
    pub(crate) fn new(lines: &EpiLines, candidates: Candidates, rule: SeenRule) -> Self {
        let groups = Groups::new(lines);
        let size = groups.block(&candidates);
        let starts = (0..candidates.count()).step_by(size);
        let mut blocks: Vec<DisparityBlock> = starts
            .map(|first| block(lines, &groups, &candidates, first..(first + size).min(candidates.count())))
            .collect();
        let coverage: Vec<VisibleRuns> = blocks
            .iter()
            .flat_map(|block| block.candidates.clone().map(move |k| (block, k)))
            .map(|(block, k)| candidate(lines, &groups, block, candidates.disparity_px(k as f64), rule))
            .collect();
        blocks.iter_mut().for_each(|block| block.keep_needed(&coverage));
        Self {
            columns: lines.columns(),
            reference: lines.reference(),
            farthest: lines.tau_before().max(lines.tau_after()),
            groups,
            candidates,
            blocks,
            coverage,
        }
    }

    /// Whether candidate `k` has a cost at column `x`.
    pub(crate) fn knows(&self, k: usize, x: usize) -> bool {
        self.coverage[k].runs.iter().any(|run| run.contains(&x))
    }
}

impl DisparityBlock {
    /// Leaves out the columns of groups that no candidate of the block asks for.
    fn keep_needed(&mut self, coverage: &[VisibleRuns]) {
        for (g, seen) in self.seen.iter_mut().enumerate() {
            let of_group = |candidate: &'_ VisibleRuns| {
                let whole = candidate.shifts[g].whole;
                let place = move |x: usize| (x as isize + whole) as usize;
                let used = candidate.segments.iter().filter(move |segment| segment.groups.contains(&g));
                // The last sample lies between the last column and the next.
                let ends = used.map(move |used| (place(used.columns.start), place(used.columns.end) + 1));
                ends.collect::<Vec<_>>()
            };
            let needed = coverage[self.candidates.clone()].iter().flat_map(of_group);
            let whole = needed.reduce(|a, b| (a.0.min(b.0), a.1.max(b.1))).unwrap_or((0, 0));
            *seen = whole.0.max(seen.start)..whole.1.min(seen.end).max(whole.0.max(seen.start));
        }
    }
}

fn block(lines: &EpiLines, groups: &Groups, candidates: &Candidates, range: Range<usize>) -> DisparityBlock {
    let middle = candidates.disparity_px(0.5 * (range.start + range.end - 1) as f64);
    let whole = 0..lines.columns();
    let mut shifts = vec![Shift::by(0.0, &whole); lines.frames()];
    let mut seen = Vec::with_capacity(groups.groups.len());
    for group in &groups.groups {
        // One column more, for the interpolation.
        let (pad, mut first, mut end) = (PAD as isize, 0, lines.columns() as isize + 1);
        for t in group.frames.clone() {
            shifts[t] = Shift::by(middle * (lines.offsets()[t] - group.offset), &whole);
            first = first.max(-pad - shifts[t].whole);
            end = end.min(lines.columns() as isize + pad - 1 - shifts[t].whole);
        }
        seen.push(first as usize..end.max(first) as usize);
    }
    DisparityBlock { candidates: range, shifts, seen }
}

fn candidate(
    lines: &EpiLines,
    groups: &Groups,
    block: &DisparityBlock,
    disparity_px: f64,
    rule: SeenRule,
) -> VisibleRuns {
    let whole = 0..lines.columns();
    let exact: Vec<Shift> =
        groups.groups.iter().map(|group| Shift::by(disparity_px * group.offset, &whole)).collect();
    let shifts: Vec<GroupShift> = exact
        .iter()
        .map(|shift| GroupShift {
            whole: shift.whole,
            fraction: shift.fraction as f32,
            nearest: shift.whole + isize::from(shift.fraction >= 0.5),
        })
        .collect();
    // Columns of the reference frame whose line all frames of a group see, and for which sums exist.
    let visible: Vec<Range<isize>> = groups
        .groups
        .iter()
        .zip(exact.iter().zip(&block.seen))
        .map(|(group, (shift, seen))| {
            let ends = [group.frames.start, group.frames.end - 1].map(|t| lines.shift(disparity_px, t));
            let [first, end] = [seen.start as isize - shift.whole, seen.end as isize - shift.whole - 1];
            let (first, end) = ends.iter().fold((first, end), |(first, end), frame| {
                (first.max(frame.first as isize), end.min(frame.end as isize))
            });
            first..end
        })
        .collect();
    let sightings = Sightings::count(lines, disparity_px);
    let mut segments: Vec<Segment> = Vec::new();
    for x in lines.asked() {
        let sees = |g: &usize| visible[*g].contains(&(x as isize));
        // A candidate leaves the image once: the groups that see it follow each other on each side.
        let first = (0..groups.before).rev().take_while(sees).last().unwrap_or(groups.before);
        let end = (groups.before..visible.len()).take_while(sees).last().map_or(groups.before, |g| g + 1);
        let counts = [sightings.before[x], sightings.after[x]].map(usize::from);
        let allowed = allowed(groups, first..end, counts, rule);
        if !allowed.contains(&true) {
            continue;
        }
        match segments.last_mut() {
            Some(last) if last.columns.end == x && last.groups == (first..end) && last.allowed == allowed => {
                last.columns.end = x + 1;
            }
            _ => segments.push(Segment { columns: x..x + 1, groups: first..end, allowed }),
        }
    }
    let mut runs: Vec<Range<usize>> = Vec::new();
    for Segment { columns, .. } in &segments {
        match runs.last_mut() {
            Some(run) if run.end == columns.start => run.end = columns.end,
            _ => runs.push(columns.clone()),
        }
    }
    VisibleRuns { shifts, segments, runs }
}

/// The costs that count where `groups` do. Whether enough frames see a point is counted in frames, `counts`
/// of them up to the reference and from it on; at least three frames must see it, since two always lie on a
/// line.
fn allowed(all: &Groups, groups: Range<usize>, counts: [usize; 2], rule: SeenRule) -> [bool; 3] {
    let frames = |range: Range<usize>| -> usize {
        1 + all.groups[range].iter().map(|group| group.frames.len()).sum::<usize>()
    };
    let [seen_before, seen_after] = counts;
    let one_side = rule.occlusion == Occlusion::OneSide;
    [
        rule.suffices((seen_before + seen_after).saturating_sub(1)) && frames(groups.clone()) >= 3,
        one_side && rule.suffices(seen_before) && frames(groups.start..all.before) >= 3,
        one_side && rule.suffices(seen_after) && frames(all.before..groups.end) >= 3,
    ]
}
