//! Aggregated costs beside their meaning, all ways through all rows, and beside the recursion as it is
//! written.

use super::*;
use proptest::prelude::*;

/// Costs are counts, so that sums are exact.
fn penalties(small: u16, large: u16) -> Penalties {
    Penalties { small, large, count: 1.0 }
}

/// Rows x candidates x columns of costs, of which NaN is unknown.
type Table = Vec<Vec<Vec<f32>>>;

fn aggregated(costs: &Table, answered: Range<usize>, penalties: Penalties) -> Aggregated<'static> {
    let (count, columns) = (costs[0].len(), costs[0][0].len());
    let band = RowBand { searched: 0..costs.len(), answered };
    // What was left there before changes nothing. A test may leak a little.
    let room = vec![12345; 2 * costs.len() * count * columns].leak();
    let mut paths = PathAggregation::new(band, count, columns, Aggregation { penalties, room });
    for row in costs {
        row.iter().enumerate().for_each(|(k, costs)| paths.hold(k, 0, costs));
        paths.row_done();
    }
    paths.aggregated()
}

fn row(aggregated: &Aggregated<'_>, y: usize, k: usize) -> Vec<f32> {
    let mut out = vec![0.0; aggregated.0.columns];
    aggregated.copy(y, k, 0, &mut out);
    out
}

fn step_cost(from: usize, to: usize, penalties: Penalties) -> f64 {
    match from.abs_diff(to) {
        0 => 0.0,
        1 => f64::from(penalties.small.min(penalties.large)),
        _ => f64::from(penalties.large),
    }
}

/// Least sum of costs and penalties of all ways through the rows of a column that lead through (y, k);
/// infinite if there is none.
fn least_way(costs: &Table, x: usize, (y, k): (usize, usize), penalties: Penalties) -> f64 {
    let (rows, count) = (costs.len(), costs[0].len());
    let ways = count.pow(rows as u32);
    (0..ways)
        .map(|way| (0..rows).map(|row| way / count.pow(row as u32) % count).collect::<Vec<_>>())
        .filter(|way| way[y] == k)
        .map(|way| {
            let own = |(row, &k): (usize, &usize)| f64::from(costs[row][k][x]);
            let steps: f64 = way.windows(2).map(|pair| step_cost(pair[0], pair[1], penalties)).sum();
            way.iter().enumerate().map(own).sum::<f64>() + steps
        })
        .filter(|sum| !sum.is_nan())
        .fold(f64::INFINITY, f64::min)
}

/// L of the whole column by its formula, row after row in the order given.
fn recursion(costs: &Table, x: usize, order: &[usize], penalties: Penalties) -> Vec<Vec<f64>> {
    let count = costs[0].len();
    let (small, large) = (f64::from(penalties.small), f64::from(penalties.large));
    let mut sums = vec![vec![0.0; count]; costs.len()];
    let mut last: Option<Vec<f64>> = None;
    for &y in order {
        for k in 0..count {
            let own = f64::from(costs[y][k][x]);
            sums[y][k] = own;
            if let Some(last) = &last {
                let low = last.iter().copied().fold(f64::INFINITY, f64::min);
                let mut best = last[k].min(low + large);
                if k > 0 {
                    best = best.min(last[k - 1] + small);
                }
                if k + 1 < count {
                    best = best.min(last[k + 1] + small);
                }
                sums[y][k] = own + best - low;
            }
        }
        last = Some(sums[y].clone());
    }
    sums
}

fn table(
    rows: Range<usize>,
    candidates: Range<usize>,
    columns: Range<usize>,
    largest: u16,
) -> impl Strategy<Value = Table> {
    (rows, candidates, columns).prop_flat_map(move |(rows, candidates, columns)| {
        let cost = (0..=largest).prop_map(f32::from);
        prop::collection::vec(prop::collection::vec(prop::collection::vec(cost, columns), candidates), rows)
    })
}

proptest! {
    #[test]
    fn aggregated_costs_are_those_of_the_best_way_through_all_rows(
        mut costs in table(1..5, 1..5, 1..4, 40), small in 0_u16..15, more in 0_u16..30,
        unknown in prop::collection::vec((0_usize..5, 0_usize..4), 0..4),
    ) {
        let penalties = penalties(small, small + more);
        // A candidate has a cost in all rows of a column or in none.
        for (k, x) in unknown {
            costs.iter_mut().for_each(|row| if let Some(cost) = row.get_mut(k).and_then(|costs| costs.get_mut(x)) { *cost = f32::NAN; });
        }
        let (rows, count, columns) = (costs.len(), costs[0].len(), costs[0][0].len());
        let found = aggregated(&costs, 0..rows, penalties);
        for (y, x) in (0..rows).flat_map(|y| (0..columns).map(move |x| (y, x))) {
            let ways: Vec<f64> = (0..count).map(|k| least_way(&costs, x, (y, k), penalties)).collect();
            let values: Vec<f64> = (0..count).map(|k| f64::from(row(&found, y, k)[x])).collect();
            let least = |values: &[f64]| values.iter().copied().fold(f64::INFINITY, f64::min);
            for k in 0..count {
                if costs[y][k][x].is_nan() {
                    prop_assert!(values[k].is_nan());
                } else {
                    prop_assert_eq!(values[k] - least(&values), ways[k] - least(&ways), "{} {} {}", y, k, x);
                    prop_assert_eq!(found.own(y, k, x), costs[y][k][x]);
                }
            }
        }
    }

    #[test]
    fn many_columns_are_aggregated_as_the_formula_has_it(
        costs in table(1..9, 1..20, 1..80, 3000), small in 0_u16..200, more in 0_u16..2000,
    ) {
        let penalties = penalties(small, small + more);
        let (rows, count, columns) = (costs.len(), costs[0].len(), costs[0][0].len());
        let found = aggregated(&costs, 0..rows, penalties);
        let found: Table = (0..rows).map(|y| (0..count).map(|k| row(&found, y, k)).collect()).collect();
        for x in 0..columns {
            let down = recursion(&costs, x, &(0..rows).collect::<Vec<_>>(), penalties);
            let up = recursion(&costs, x, &(0..rows).rev().collect::<Vec<_>>(), penalties);
            for (y, k) in (0..rows).flat_map(|y| (0..count).map(move |k| (y, k))) {
                let expected = down[y][k] + up[y][k] - f64::from(costs[y][k][x]);
                prop_assert_eq!(f64::from(found[y][k][x]), expected);
            }
        }
    }

    #[test]
    fn margins_help_the_rows_between_them_and_are_not_answered(
        costs in table(3..12, 2..6, 1..4, 500), cut in (0_usize..4, 0_usize..4),
    ) {
        let rows = costs.len();
        let first = cut.0.min(rows - 1);
        let answered = first..(rows - cut.1.min(rows - 1)).max(first + 1);
        let whole = aggregated(&costs, 0..rows, penalties(20, 90));
        let part = aggregated(&costs, answered.clone(), penalties(20, 90));
        prop_assert_eq!(part.rows(), answered.clone());
        for (y, k) in answered.flat_map(|y| (0..costs[0].len()).map(move |k| (y, k))) {
            prop_assert_eq!(row(&part, y, k), row(&whole, y, k));
        }
    }

    #[test]
    fn free_steps_and_single_rows_change_nothing(costs in table(1..6, 1..7, 1..9, 5000)) {
        let same = |found: &Aggregated<'_>, costs: &Table| {
            costs.iter().enumerate().all(|(y, of_row)| of_row.iter().enumerate().all(|(k, costs)| row(found, y, k) == *costs))
        };
        prop_assert!(same(&aggregated(&costs, 0..costs.len(), penalties(0, 0)), &costs));
        let single = vec![costs[0].clone()];
        prop_assert!(same(&aggregated(&single, 0..1, penalties(16, 96)), &single));
    }

    #[test]
    fn steps_that_cost_too_much_leave_one_disparity_to_a_column(costs in table(1..6, 2..7, 1..9, 100)) {
        let found = aggregated(&costs, 0..costs.len(), penalties(3000, 3000));
        for (y, x) in (0..costs.len()).flat_map(|y| (0..costs[0][0].len()).map(move |x| (y, x))) {
            let sum = |k: usize| costs.iter().map(|row| row[k][x]).sum::<f32>();
            let least = (0..costs[0].len()).map(sum).fold(f32::INFINITY, f32::min);
            let best = (0..costs[0].len()).map(|k| row(&found, y, k)[x]).fold(f32::INFINITY, f32::min);
            for k in 0..costs[0].len() {
                prop_assert_eq!(row(&found, y, k)[x] - best, sum(k) - least);
            }
        }
    }
}

#[test]
fn costs_beyond_what_can_be_held_stay_the_largest() {
    let costs: Table = vec![vec![vec![1e9], vec![3.0], vec![f32::NAN]]; 3];
    let found = aggregated(&costs, 0..3, penalties(16, 96));
    // 16 bit, less the mark of the unknown and the large penalty.
    assert_eq!((found.own(1, 0, 0), found.own(1, 1, 0)), (65438.0, 3.0));
    assert_eq!(row(&found, 1, 1)[0], 3.0);
    assert_eq!(row(&found, 1, 0)[0], 65438.0 + 2.0 * 16.0);
    assert!(row(&found, 1, 2)[0].is_nan());
}

#[test]
fn penalties_follow_the_chance_of_a_variance() {
    // The variance of 396 deviations of 2 DN varies by 2^2 sqrt(2 / 396), the difference of two by sqrt(2)
    // times that: 0.402 DN^2.
    let penalties = Penalties::of_typical(4.0, 396);
    assert!((f32::from(penalties.small) * penalties.count - 0.402).abs() < 0.001);
    assert!((f32::from(penalties.large) * penalties.count - 6.0 * 0.402).abs() < 0.006);
    // However small chance is, costs are told apart up to many times the typical one.
    for samples in [8, 396, 1_000_000, 100_000_000] {
        let penalties = Penalties::of_typical(4.0, samples);
        assert!(f32::from(penalties.largest_cost()) * penalties.count >= 60.0 * 4.0, "{samples}");
    }
}

#[test]
fn bands_hold_no_more_than_they_may() {
    let tau = epirig_core::tau::Tau::equidistant(100).unwrap();
    let volume = Volume::new(200, 640, 8, tau);
    let frames = 200 * 640 * 100_usize;
    let mut largest = 0;
    for candidates in (1..4000).step_by(7) {
        match Bands::of(&volume, candidates) {
            Ok(bands) => {
                let groups = bands.groups();
                assert!(2 * bands.at_once * bands.band_counts <= (frames / 2).max(32 << 20));
                for group in &groups {
                    let rows = |band: &RowBand| band.searched.end - band.answered.start + band.answered.len();
                    let paths: usize = group.iter().map(|band| 2 * rows(band) * 640 * candidates).sum();
                    assert!(paths <= 2 * bands.at_once * bands.band_counts);
                    assert!(paths <= (frames / 2).max(32 << 20), "{candidates}: {paths}");
                }
                let answered: Vec<usize> =
                    groups.iter().flatten().flat_map(|band| band.answered.clone()).collect();
                assert_eq!(answered, (0..200).collect::<Vec<_>>());
                largest = candidates;
            }
            Err(MatchError::TooManyToAggregate { candidates, limit }) => {
                assert_eq!(candidates, candidates);
                assert!(limit < candidates && limit >= largest && Bands::of(&volume, limit).is_ok());
                assert!(Bands::of(&volume, limit + 1).is_err());
            }
            Err(other) => panic!("{other}"),
        }
    }
    // 32 MiB over 2 x 8 + 16 rows of 640 columns and 2 bytes.
    assert!((812..820).contains(&largest), "{largest}");
}
