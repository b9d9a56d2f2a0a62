//! Tables of misses in MuJoCo.

use super::throwing::Fate;
use crate::report::Column;
use crate::results::experiment::{cm, number};
use crate::results::picture::Curve;
use experiments::trials::quantile;
use serde::Serialize;

/// What became of some ropes.
#[derive(Debug, Serialize)]
pub(super) struct Row {
    pub name: String,
    ropes: usize,
    refused: usize,
    /// Each refusal once.
    pub refusals: Vec<String>,
    mean_m: f64,
    median_m: f64,
    p90_m: f64,
    max_m: f64,
    /// Mean and greatest absolute error of the length (m).
    length_error_mean_m: f64,
    length_error_max_m: f64,
    /// Medians.
    residual_px: f64,
    out_of_distribution: f64,
    /// Fraction of the ropes that were flagged as out of distribution.
    flagged: f64,
    /// Fraction of the misses within their forecasts' 90 % intervals.
    covered: f64,
    /// Median of those intervals' upper ends (m).
    forecast_high_m: f64,
    /// Throws that missed by more than [`FAR_M`], and the others: how many, and how many of them
    /// were warned of.
    far: [usize; 2],
    near: [usize; 2],
}

/// A miss that should have been warned of (m).
const FAR_M: f64 = 0.015;

/// Not a number for none.
fn mean(values: impl Iterator<Item = f64>) -> f64 {
    let values: Vec<f64> = values.collect();
    if values.is_empty() {
        return f64::NAN;
    }
    experiments::trials::mean(values)
}

pub(super) const TABLE: [Column<Row>; 13] = [
    ("miss (cm)", |row| row.name.clone()),
    ("ropes", |row| row.ropes.to_string()),
    ("refused", |row| row.refused.to_string()),
    ("mean", |row| cm(row.mean_m)),
    ("median", |row| cm(row.median_m)),
    ("p90", |row| cm(row.p90_m)),
    ("max", |row| cm(row.max_m)),
    ("length error mean, max (mm)", |row| {
        let [mean, max] = [row.length_error_mean_m, row.length_error_max_m].map(|m| 1e3 * m);
        format!("{}, {}", number(mean, 1), number(max, 1))
    }),
    ("residual (px)", |row| number(row.residual_px, 2)),
    ("out of distribution, score", |row| {
        number(row.out_of_distribution, 2)
    }),
    ("out of distribution (%)", |row| {
        number(100.0 * row.flagged, 0)
    }),
    ("within its 90 % interval (%), up to (cm)", |row| {
        let held = number(100.0 * row.covered, 0);
        format!("{held}, {}", cm(row.forecast_high_m))
    }),
    ("warned of misses over 1.5 cm, of others", |row| {
        let ([far, far_warned], [near, near_warned]) = (row.far, row.near);
        format!("{far_warned} of {far}, {near_warned} of {near}")
    }),
];

/// A row, with its misses as a curve.
pub(super) fn row(name: &str, fates: &[&Fate]) -> (Row, Curve) {
    let thrown = || fates.iter().filter_map(|fate| fate.thrown());
    let fits = || thrown().filter_map(|t| t.fit);
    let misses_m = || thrown().map(|t| t.miss_m);
    let lengths_m = || thrown().map(|t| t.length_error_m.abs());
    let forecasts = || thrown().filter_map(|t| Some((t.miss_m, t.forecast?.interval_90_m)));
    let one = |is: bool| f64::from(u8::from(is));
    let covered = |(miss_m, [low, high]): (f64, [f64; 2])| one((low..=high).contains(&miss_m));
    let warned = |is_far: bool| {
        let of = || thrown().filter(|t| (t.miss_m > FAR_M) == is_far);
        [of().count(), of().filter(|t| t.warned).count()]
    };
    let mut refusals: Vec<String> = fates
        .iter()
        .filter_map(|fate| match fate {
            Fate::Refused(why) => Some(why.clone()),
            Fate::Thrown(_) => None,
        })
        .collect();
    let refused = refusals.len();
    refusals.sort();
    refusals.dedup();
    let row = Row {
        name: name.to_owned(),
        ropes: fates.len(),
        refused,
        refusals,
        mean_m: mean(misses_m()),
        median_m: quantile(misses_m(), 0.5),
        p90_m: quantile(misses_m(), 0.9),
        max_m: quantile(misses_m(), 1.0),
        length_error_mean_m: mean(lengths_m()),
        length_error_max_m: quantile(lengths_m(), 1.0),
        residual_px: quantile(fits().map(|f| f.residual_px), 0.5),
        out_of_distribution: quantile(fits().map(|f| f.out_of_distribution), 0.5),
        flagged: mean(fits().map(|f| one(f.flagged))),
        covered: mean(forecasts().map(covered)),
        forecast_high_m: quantile(forecasts().map(|(_, [_, high])| high), 0.5),
        far: warned(true),
        near: warned(false),
    };
    (row, Curve::cm(name, misses_m(), None))
}

/// Rows and curves; prints what was refused.
pub(super) fn with_refusals(rows: Vec<(Row, Curve)>) -> (Vec<Row>, Vec<Curve>) {
    for (row, _) in &rows {
        for why in &row.refusals {
            println!("{}: refused: {why}", row.name);
        }
    }
    rows.into_iter().unzip()
}
