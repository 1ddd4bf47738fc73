//! Supports: windows that follow the surface.
//!
//! A plane (disparity and slant) is fitted to the observations around a pixel that belong to the pixel's own
//! surface. A map of planes, one for each pixel, tells which do: a neighbour belongs if the disparity of its
//! plane lies on the pixel's plane, within what the sigmas of both allow (propagation and separation; Polzehl
//! and Spokoiny 2006), and if its slants, where known, are those of the pixel. On a plane everything within
//! reach takes part, so no information is lost; at a step or a ridge the support ends.

mod rule;
mod sums;
#[cfg(test)]
mod tests;

use fearless_simd::{Level, Select, Simd, SimdBase, SimdFloat, dispatch, f32x16};

use super::moments::LANES;
use super::padded::{PAD, Padded};
use super::planes::{ObservationMaps, PlaneRow, SurfacePlanes};
use rule::LEAST_SLANT_SPREAD;
pub(super) use rule::SupportRule;
use sums::{Allowances, LONGEST, Sums, WindowSums, load, offset};

/// On a plane, the mean squared distance of the competing windows from the best one is this many of its
/// variances: measured as 5.8 to 6.0 at three noises.
pub(super) const APART_BY_CHANCE: f32 = 6.0;
/// Surfaces slant by about this much, in px of disparity per px; keeps slants finite in windows that do not
/// show them.
const EXPECTED_SLANT: f32 = 0.1;

/// Joins the observations around each pixel of row `y`, as far as the planes of `map` say that they belong to
/// its surface, into the row `after`. With `wanted`, pixels whose variance in `after` is at most that, in
/// px^2, keep what it holds.
pub(super) fn join_row(
    level: Level,
    planes: (&ObservationMaps, &SurfacePlanes),
    rule: SupportRule,
    y: usize,
    wanted: Option<f32>,
    after: PlaneRow<'_>,
) {
    let after = [after];
    dispatch!(level, simd => match rule.reach.0 {
        0 => join_row_simd::<_, 1, 1, false>(simd, planes, rule, y, wanted, after),
        1 => join_row_simd::<_, 3, 1, false>(simd, planes, rule, y, wanted, after),
        2 => join_row_simd::<_, 5, 1, false>(simd, planes, rule, y, wanted, after),
        3 => join_row_simd::<_, 7, 1, false>(simd, planes, rule, y, wanted, after),
        _ => join_row_simd::<_, LONGEST, 1, false>(simd, planes, rule, y, wanted, after),
    });
}

/// Reaches of the windows of [`join_nested_row`] across their length, in px.
const NESTED_REACHES: [usize; 3] = [1, 2, 3];

/// Reaches of the windows that [`join_nested_row`] joins in, of which `widest` holds the others.
pub(super) fn nested_reaches(widest: (usize, usize)) -> [(usize, usize); 3] {
    NESTED_REACHES.map(|narrow| if widest.0 <= widest.1 { (narrow, widest.1) } else { (widest.0, narrow) })
}

/// The same for three nested windows, at little more than the cost of the widest one. `rule` has the reach of
/// the widest, which is 3 px along rows or columns and longer across; [`nested_reaches`] gives those of all,
/// in the order of `after`.
pub(super) fn join_nested_row(
    level: Level,
    planes: (&ObservationMaps, &SurfacePlanes),
    rule: SupportRule,
    y: usize,
    after: [PlaneRow<'_>; 3],
) {
    dispatch!(level, simd => if rule.reach.0 <= rule.reach.1 {
        join_row_simd::<_, 7, 3, false>(simd, planes, rule, y, None, after);
    } else {
        join_row_simd::<_, 7, 3, true>(simd, planes, rule, y, None, after);
    });
}

/// Joins in `WINDOWS` windows that lie in each other, see [`Sums`].
#[inline(always)]
fn join_row_simd<S: Simd, const N: usize, const WINDOWS: usize, const TURNED: bool>(
    simd: S,
    planes: (&ObservationMaps, &SurfacePlanes),
    rule: SupportRule,
    y: usize,
    wanted: Option<f32>,
    after: [PlaneRow<'_>; WINDOWS],
) {
    let allowances = Allowances::of(rule);
    let mut sums = Sums::<S, N, WINDOWS>::none(simd);
    let mut after = after.map(|row| {
        let PlaneRow { disparity, slant_x, slant_y, variance, misfit, texture, slant_variance } = row;
        [disparity, slant_x, slant_y, variance, misfit, texture, slant_variance]
    });
    let mut start = PAD;
    while start + PAD < after[0][0].len() {
        let block = start..start + LANES;
        let wanting = |variance: &f32| wanted.is_none_or(|wanted| *variance > wanted);
        if after[0][3][block.clone()].iter().any(wanting) {
            sums.take::<TURNED>(simd, planes, &allowances, y, start);
            for (window, out) in after.iter_mut().enumerate() {
                let slants_known = rule.slants_known;
                let joined = solve(simd, &sums.of_window::<TURNED>(window), planes, slants_known, (y, start));
                let variances = f32x16::from_slice(simd, &out[3][block.clone()]);
                let kept = wanted.map(|wanted| variances.simd_le(f32x16::splat(simd, wanted)));
                for (plane, value) in out.iter_mut().zip(joined).filter(|(plane, _)| !plane.is_empty()) {
                    let place = &mut plane[block.clone()];
                    let old = f32x16::from_slice(simd, place);
                    kept.map_or(value, |kept| kept.select(old, value)).store_slice(place);
                }
            }
        }
        start += LANES;
    }
}

/// Disparity, slants, variance, misfit, texture and the variance of the slants of the plane through the
/// observations.
#[inline(always)]
fn solve<S: Simd>(
    simd: S,
    sums: &WindowSums<'_, S>,
    (observations, map): (&ObservationMaps, &SurfacePlanes),
    slants_known: bool,
    (y, start): (usize, usize),
) -> [f32x16<S>; 7] {
    let own = |plane: &Padded| load(simd, plane, y, start);
    let (d, p, q) = (own(&map.disparity), own(&map.slant_x), own(&map.slant_y));
    let noise = own(&observations.noise);
    let splat = |value| f32x16::splat(simd, value);
    let zero = splat(0.0);
    let (columns, rows) = (sums.columns, sums.rows);
    let (reach_u, reach_v) = (columns.len() / 2, rows.len() / 2);
    let [mut s0, mut su, mut sv, mut suu, mut suv, mut svv] = [zero; 6];
    let [mut t0, mut tu, mut tv] = [zero; 3];
    for (index, [weight, moment, crossed]) in columns.iter().enumerate() {
        let u = offset(index, reach_u);
        s0 += *weight;
        su = weight.mul_add(u, su);
        suu = weight.mul_add(u * u, suu);
        suv = crossed.mul_add(u, suv);
        t0 += *moment;
        tu = moment.mul_add(u, tu);
    }
    for (index, [weight, moment, _]) in rows.iter().enumerate() {
        let v = offset(index, reach_v);
        sv = weight.mul_add(v, sv);
        svv = weight.mul_add(v * v, svv);
        tv = moment.mul_add(v, tv);
    }
    // A slant of zero is a weak observation that keeps the system regular.
    let prior = noise * (1.0 / (EXPECTED_SLANT * EXPECTED_SLANT));
    (suu, svv) = (suu + prior, svv + prior);
    if slants_known {
        let apart = own(&map.texture) / APART_BY_CHANCE;
        let weight = noise * LEAST_SLANT_SPREAD / (own(&map.variance) + apart);
        (suu, svv) = (suu + weight, svv + weight);
        (tu, tv) = (weight.mul_add(p, tu), weight.mul_add(q, tv));
    }
    let minor_dd = suu * svv - suv * suv;
    let minor_dp = sv * suv - su * svv;
    let minor_dq = su * suv - sv * suu;
    let determinant = s0 * minor_dd + su * minor_dp + sv * minor_dq;
    let one_over = splat(1.0) / determinant;
    let step = (minor_dd * t0 + minor_dp * tu + minor_dq * tv) * one_over;
    let slant_x = (minor_dp * t0 + (s0 * svv - sv * sv) * tu + (su * sv - s0 * suv) * tv) * one_over;
    let slant_y = (minor_dq * t0 + (su * sv - s0 * suv) * tu + (s0 * suu - su * su) * tv) * one_over;

    // Means of columns and of rows about the plane: a step or a crease moves these most. Steps show in one of
    // the two.
    let mut ratio = zero;
    let mut inflation = splat(1.0);
    for (lines, reach, along, across) in
        [(columns, reach_u, slant_x, slant_y), (rows, reach_v, slant_y, slant_x)]
    {
        let (mut misfit, mut number) = (zero, zero);
        for (index, [weight, moment, crossed]) in lines.iter().enumerate() {
            let expected = *weight * along.mul_add(offset(index, reach), step) + *crossed * across;
            let deviation = *moment - expected;
            let there = weight.simd_gt(zero);
            misfit += there.select(deviation * deviation / *weight, zero);
            number += there.select(splat(1.0), zero);
        }
        // A line through the means takes two degrees of freedom.
        let spare = (number - 2.0).max(splat(1.0));
        let own = number.simd_gt(splat(2.5)).select(misfit / (noise * spare), zero);
        // Up to this the ratio may exceed one by chance: thrice its standard deviation.
        let chance = (splat(2.0) / spare).sqrt() * 3.0 + 1.0;
        inflation = own.simd_gt(chance).select(own, splat(1.0)).max(inflation);
        ratio = ratio.max(own);
    }
    // Observations that belong in part have less noise than their weights say.
    let partly = sums.belonging / s0;
    let unit = noise * one_over * partly * inflation;
    let variance = minor_dd * unit;
    let slant_variance = (s0 * (suu + svv) - su * su - sv * sv) * unit;
    let known = determinant.simd_gt(zero);
    [
        known.select(d + step, d),
        known.select(slant_x, p),
        known.select(slant_y, q),
        known.select(variance, splat(f32::INFINITY)),
        known.select(ratio, splat(f32::INFINITY)),
        known.select(s0 / (noise * sums.count.max(splat(1.0))), zero),
        known.select(slant_variance, splat(f32::INFINITY)),
    ]
}

/// Takes, for each pixel of row `y`, the most credible plane: among those of `windows` that contain the pixel
/// (centred on it, or with it in the middle of a side or in a corner; after Nagao and Matsuyama 1979),
/// carried to it, and the one that `map` has already. A plane is credible if its variance is small and its
/// observations fit.
///
/// The map's `misfit` gets the score, less is better. Its `texture` gets the mean squared distance of the
/// windows' planes from the best one's at the pixel, in px^2, of the shape of windows that disagrees most.
/// Windows count by their credibility against the best one's, so a shape that does not fit counts little.
/// Planes farther than a pixel from the pixel's guess belong to another surface.
pub(super) fn take_best_window(
    level: Level,
    (windows, guesses): (&SurfacePlanes, &SurfacePlanes),
    reach: (usize, usize),
    y: usize,
    map: PlaneRow<'_>,
) {
    dispatch!(level, simd => take_best_window_simd(simd, (windows, guesses), reach, y, map));
}

#[inline(always)]
fn take_best_window_simd<S: Simd>(
    simd: S,
    (windows, guesses): (&SurfacePlanes, &SurfacePlanes),
    (reach_u, reach_v): (usize, usize),
    y: usize,
    map: PlaneRow<'_>,
) {
    let one = f32x16::splat(simd, 1.0);
    let (reach_u, reach_v) = (reach_u as isize, reach_v as isize);
    // The variance of an evenly filled window's plane grows from its middle by u^2 / mean(u^2).
    let spread = |reach: isize| ((reach * (reach + 1)) as f32 / 3.0).max(1.0);
    let PlaneRow { disparity, slant_x, slant_y, variance, misfit, texture, slant_variance } = map;
    let mut kept = [disparity, slant_x, slant_y, variance, misfit, texture, slant_variance];
    let mut start = PAD;
    while start + PAD < kept[0].len() {
        let block = start..start + LANES;
        let mut best: [f32x16<S>; 7] =
            std::array::from_fn(|index| f32x16::from_slice(simd, &kept[index][block.clone()]));
        let mut candidates = [(f32x16::splat(simd, 0.0), f32x16::splat(simd, f32::INFINITY)); 9];
        let mut candidate = candidates.iter_mut();
        let guess = f32x16::from_slice(simd, &guesses.disparity.row(y)[block.clone()]);
        for v in [0, -reach_v, reach_v] {
            let row = y as isize + v;
            if row < 0 || row >= windows.rows() as isize {
                continue;
            }
            for u in [0, -reach_u, reach_u] {
                let place = (start as isize + u) as usize;
                let load =
                    |plane: &Padded| f32x16::from_slice(simd, &plane.row(row as usize)[place..place + LANES]);
                let growth = 1.0 + (u * u) as f32 / spread(reach_u) + (v * v) as f32 / spread(reach_v);
                let variance = load(&windows.variance) * growth;
                let misfit = load(&windows.misfit).max(one);
                // Means scatter about a plane by chance, too, but a window that a step crosses is the worse
                // the longer it is.
                let score = variance * misfit * (misfit * misfit) * (misfit * misfit);
                let (p, q) = (load(&windows.slant_x), load(&windows.slant_y));
                let disparity = load(&windows.disparity) - p * u as f32 - q * v as f32;
                let away = disparity - guess;
                let near = (away * away).simd_le(one);
                let better = score.simd_lt(best[4]) & near;
                if let Some(candidate) = candidate.next() {
                    let known = near & score.simd_gt(f32x16::splat(simd, 0.0));
                    *candidate = (
                        known.select(away, f32x16::splat(simd, 0.0)),
                        known.select(score, f32x16::splat(simd, f32::INFINITY)),
                    );
                }
                best[6] = better.select(load(&windows.slant_variance), best[6]);
                for (best, value) in best.iter_mut().zip([disparity, p, q, variance, score]) {
                    *best = better.select(value, *best);
                }
            }
        }
        // Weights are relative to the best window's, which is 1, whichever shape it has.
        let score_before = f32x16::from_slice(simd, &kept[4][block.clone()]);
        let away_best = best[0] - guess;
        let mut sums = [f32x16::splat(simd, 0.0); 2];
        for (away, score) in candidates {
            let weight = best[4] / score;
            let apart = away - away_best;
            sums[0] += weight;
            sums[1] = (weight * apart).mul_add(apart, sums[1]);
        }
        let faded = best[5] * score_before.simd_gt(best[4]).select(best[4] / score_before, one);
        // Where no window comes near the guess, none disagrees.
        let some = sums[0].simd_gt(f32x16::splat(simd, 0.0));
        best[5] = some.select((sums[1] / sums[0].max(one)).max(faded), best[5]);
        for (kept, best) in kept.iter_mut().zip(best) {
            best.store_slice(&mut kept[block.clone()]);
        }
        start += LANES;
    }
}
