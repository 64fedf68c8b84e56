//! Summary figures of error lists.

/// Root mean square; `None` of nothing.
pub fn rms(values: &[f64]) -> Option<f64> {
    (!values.is_empty()).then(|| (values.iter().map(|v| v * v).sum::<f64>() / values.len() as f64).sqrt())
}

/// Arithmetic mean; `None` of nothing.
pub fn mean(values: impl IntoIterator<Item = f64>) -> Option<f64> {
    let add = |(count, sum), value| (count + 1_usize, sum + value);
    let (count, sum) = values.into_iter().fold((0, 0.0), add);
    (count > 0).then(|| sum / count as f64)
}

/// Median; `None` of nothing.
pub fn median(values: &[f64]) -> Option<f64> {
    quantile(values, 0.5)
}

/// Quantile `q` in 0..=1, linear between order statistics; `None` of nothing.
pub fn quantile(values: &[f64], q: f64) -> Option<f64> {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let place = q.clamp(0.0, 1.0) * sorted.len().checked_sub(1)? as f64;
    let (low, part) = (place.floor() as usize, place.fract());
    let next = sorted.get(low + 1).unwrap_or(&sorted[low]);
    // Between two that are alike lies nothing else, not even where both are infinite.
    let step = if *next == sorted[low] {
        0.0
    } else {
        next - sorted[low]
    };
    Some(sorted[low] + step * part)
}

/// Wilson interval of a share, 95 %: where the true share lies when `hits` of `trials` are counted.
pub fn wilson(hits: usize, trials: usize) -> [f64; 2] {
    let (n, z) = (trials.max(1) as f64, 1.959_964);
    let share = hits as f64 / n;
    let (bottom, middle) = (1.0 + z * z / n, share + z * z / (2.0 * n));
    let half = z * (share * (1.0 - share) / n + z * z / (4.0 * n * n)).sqrt();
    [(middle - half) / bottom, (middle + half) / bottom]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wilson_interval_of_a_textbook_case() {
        // 81 of 263 (Newcombe 1998): 0.2553 to 0.3662.
        let [low, high] = wilson(81, 263);
        assert!(
            (low - 0.2553).abs() < 1e-4 && (high - 0.3662).abs() < 1e-4,
            "{low} {high}"
        );
        assert!(wilson(0, 20)[0].abs() < 1e-12 && wilson(0, 20)[1] > 0.1);
    }

    #[test]
    fn figures_of_a_small_list() {
        let values = [3.0, -1.0, 2.0, 0.0];
        assert_eq!(median(&values), Some(1.0));
        assert_eq!(quantile(&values, 1.0), Some(3.0));
        assert_eq!(quantile(&values, 0.5), Some(1.0));
        assert!((rms(&values).expect("not empty") - 3.5_f64.sqrt()).abs() < 1e-15);
        assert_eq!(median(&[f64::INFINITY; 2]), Some(f64::INFINITY));
        assert_eq!((mean(values), mean([])), (Some(1.0), None));
        assert_eq!((median(&[]), rms(&[]), quantile(&[], 0.9)), (None, None, None));
    }
}
