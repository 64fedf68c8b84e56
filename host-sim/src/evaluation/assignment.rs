//! Optimal assignment of rows to columns: the Hungarian method with potentials, O(rows^2 columns).

/// Assigns rows to columns so that as many pairs as possible are made, and among those choices the sum of costs is least.
/// `cost(row, column)` is `None` where the two must not be paired, else a finite number in 0..=`greatest`. Returns the
/// column of each row.
pub(super) fn assign(
    rows: usize,
    columns: usize,
    greatest: f64,
    cost: impl Fn(usize, usize) -> Option<f64>,
) -> Vec<Option<usize>> {
    // One forbidden pair costs more than any set of allowed ones; a dummy column per row keeps the problem solvable.
    let forbidden = (greatest + 1.0) * (rows + 1) as f64;
    let width = columns + rows;
    let price = |row: usize, column: usize| {
        if column < columns {
            cost(row, column).unwrap_or(2.0 * forbidden)
        } else {
            forbidden
        }
    };
    // Rows and columns count from 1 here; 0 stands for "none".
    let (mut of_row, mut of_column) = (vec![0.0; rows + 1], vec![0.0; width + 1]);
    let mut row_at = vec![0_usize; width + 1];
    for row in 1..=rows {
        row_at[0] = row;
        let mut least = vec![f64::INFINITY; width + 1];
        let mut came_from = vec![0_usize; width + 1];
        let mut done = vec![false; width + 1];
        let mut column = 0;
        loop {
            done[column] = true;
            let (here, mut delta, mut next) = (row_at[column], f64::INFINITY, 0);
            for c in (1..=width).filter(|&c| !done[c]) {
                let reduced = price(here - 1, c - 1) - of_row[here] - of_column[c];
                if reduced < least[c] {
                    (least[c], came_from[c]) = (reduced, column);
                }
                if least[c] < delta {
                    (delta, next) = (least[c], c);
                }
            }
            for c in 0..=width {
                if done[c] {
                    of_row[row_at[c]] += delta;
                    of_column[c] -= delta;
                } else {
                    least[c] -= delta;
                }
            }
            column = next;
            if row_at[column] == 0 {
                break;
            }
        }
        while column != 0 {
            let before = came_from[column];
            row_at[column] = row_at[before];
            column = before;
        }
    }
    let mut result = vec![None; rows];
    for (column, &row) in row_at.iter().enumerate().skip(1) {
        if row > 0 && column <= columns && cost(row - 1, column - 1).is_some() {
            result[row - 1] = Some(column - 1);
        }
    }
    result
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Stream;

    /// Number of pairs and sum of costs.
    fn value(pairs: &[Option<usize>], table: &[Vec<Option<f64>>]) -> (usize, f64) {
        let costs = pairs
            .iter()
            .enumerate()
            .filter_map(|(r, c)| c.map(|c| table[r][c].expect("allowed")));
        (costs.clone().count(), costs.sum())
    }

    /// The best there is, by trying everything.
    fn exhaustive(table: &[Vec<Option<f64>>], row: usize, taken: &mut Vec<usize>) -> (usize, f64) {
        let Some(costs) = table.get(row) else {
            return (0, 0.0);
        };
        let mut best = exhaustive(table, row + 1, taken);
        for (column, cost) in costs.iter().enumerate() {
            let Some(cost) = cost.filter(|_| !taken.contains(&column)) else {
                continue;
            };
            taken.push(column);
            let (pairs, sum) = exhaustive(table, row + 1, taken);
            taken.pop();
            let here = (pairs + 1, sum + cost);
            if here.0 > best.0 || (here.0 == best.0 && here.1 < best.1) {
                best = here;
            }
        }
        best
    }

    #[test]
    fn greed_would_lose_a_pair() {
        // Row 0 likes column 0 best, but row 1 has no other.
        let table = [vec![Some(0.1), Some(0.9)], vec![Some(0.2), None]];
        assert_eq!(assign(2, 2, 1.0, |r, c| table[r][c]), [Some(1), Some(0)]);
        assert_eq!(assign(0, 3, 1.0, |_, _| Some(0.0)), []);
        assert_eq!(assign(2, 0, 1.0, |_, _| Some(0.0)), [None, None]);
        assert_eq!(assign(2, 2, 1.0, |_, _| None), [None, None]);
    }

    #[test]
    fn it_is_the_best_of_all_assignments() {
        let mut stream = Stream::new(4, 0);
        for _ in 0..400 {
            let mut size = || (stream.uniform() * 6.0) as usize;
            let (rows, columns) = (size(), size());
            let table: Vec<Vec<Option<f64>>> = (0..rows)
                .map(|_| {
                    (0..columns)
                        .map(|_| Some(2.0 * stream.uniform()).filter(|&c| c < 1.3))
                        .collect()
                })
                .collect();
            let pairs = assign(rows, columns, 2.0, |r, c| table[r][c]);
            let mut used: Vec<usize> = pairs.iter().flatten().copied().collect();
            used.sort_unstable();
            used.dedup();
            assert_eq!(
                used.len(),
                pairs.iter().flatten().count(),
                "a column twice: {pairs:?}"
            );
            let (found, best) = (value(&pairs, &table), exhaustive(&table, 0, &mut Vec::new()));
            assert!(
                found.0 == best.0 && (found.1 - best.1).abs() < 1e-9,
                "{found:?} {best:?} {table:?}"
            );
        }
    }
}
