//! What the rows of a study add up to, with confidence limits.

use experiments::trials::{Rate, mean, quantile};
use serde_json::{Map, Value, json};

/// Of `n` rows, by field: of numbers their spread, with 95 % limits of the median; of truths how
/// often they are true, with 95 % limits of the rate. A row that lacks a field does not count.
#[must_use]
pub fn of_rows(rows: &[Value]) -> Map<String, Value> {
    let mut all = Map::new();
    all.insert("n".to_owned(), json!(rows.len()));
    let names = rows.iter().filter_map(Value::as_object).flat_map(Map::keys);
    for name in names {
        if all.contains_key(name) {
            continue;
        }
        let of = |row: &Value| row.get(name).cloned();
        let values: Vec<Value> = rows.iter().filter_map(of).collect();
        let numbers: Vec<f64> = values.iter().filter_map(Value::as_f64).collect();
        let truths: Vec<bool> = values.iter().filter_map(Value::as_bool).collect();
        if !numbers.is_empty() {
            all.insert(name.clone(), spread(&numbers));
        } else if !truths.is_empty() {
            all.insert(name.clone(), json!(Rate::of(truths)));
        }
    }
    all
}

fn spread(numbers: &[f64]) -> Value {
    let mut sorted = numbers.to_vec();
    sorted.sort_by(f64::total_cmp);
    let at = |fraction| quantile(sorted.iter().copied(), fraction);
    let (low, high) = median_ranks(sorted.len());
    json!({
        "n": sorted.len(), "mean": mean(sorted.iter().copied()), "min": sorted.first(),
        "median": f64::midpoint(sorted[(sorted.len() - 1) / 2], sorted[sorted.len() / 2]), "p95": at(0.95), "max": sorted.last(),
        "low": sorted[low], "high": sorted[high],
    })
}

/// Ranks, from zero, between which the median lies with 95 %: from the binomial distribution of
/// how many of `n` values are below it. With fewer than six the whole range says less than that.
fn median_ranks(n: usize) -> (usize, usize) {
    let mut probability = 0.5_f64.powi(i32::try_from(n).unwrap_or(i32::MAX));
    let mut below = 0.0;
    for rank in 0..n / 2 {
        below += probability;
        if below > 0.025 {
            return (rank.saturating_sub(1), n - rank.max(1));
        }
        probability *= (n - rank) as f64 / (rank + 1) as f64;
    }
    (0, n.saturating_sub(1))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Ranks from one of tables of the sign test's interval: 6: 1 and 6, 10: 2 and 9, 20: 6 and
    /// 15, 30: 10 and 21, 100: 40 and 61.
    #[test]
    fn limits_of_a_median_are_the_sign_test_s() {
        for (n, low, high) in [
            (6, 1, 6),
            (10, 2, 9),
            (20, 6, 15),
            (30, 10, 21),
            (100, 40, 61),
        ] {
            assert_eq!(median_ranks(n), (low - 1, high - 1), "{n}");
        }
    }

    #[test]
    fn rows_add_up_by_field_and_what_a_row_lacks_does_not_count() {
        let rows = [
            json!({"ok": true, "miss_m": 0.25}),
            json!({"ok": false, "error": "stopped"}),
            json!({"ok": true, "miss_m": 0.75}),
        ];
        let found = of_rows(&rows);
        assert_eq!(found["n"], 3);
        assert_eq!(found["ok"]["true"], 2);
        assert_eq!(
            (&found["miss_m"]["n"], &found["miss_m"]["mean"]),
            (&json!(2), &json!(0.5))
        );
        assert!(!found.contains_key("error"));
    }
}
