//! Polylines on the rope's plane.

use super::plane::Point;

pub(super) fn add(a: Point, b: Point) -> Point {
    [a[0] + b[0], a[1] + b[1]]
}

pub(super) fn sub(a: Point, b: Point) -> Point {
    [a[0] - b[0], a[1] - b[1]]
}

pub(super) fn scale(a: Point, k: f64) -> Point {
    [a[0] * k, a[1] * k]
}

pub(super) fn norm(a: Point) -> f64 {
    a[0].hypot(a[1])
}

/// Length of a polyline.
pub(super) fn length(points: &[Point]) -> f64 {
    points.windows(2).map(|w| norm(sub(w[1], w[0]))).sum()
}

/// Whether it turns back on itself from one point to the next.
pub(super) fn folds(points: &[Point]) -> bool {
    points.windows(3).any(|w| {
        let (a, b) = (sub(w[1], w[0]), sub(w[2], w[1]));
        a[0] * b[0] + a[1] * b[1] < 0.0
    })
}

/// `count` points equally spaced in arc length over the first `total` of the
/// polyline; beyond its end it goes on straight.
pub(super) fn resample(points: &[Point], total: f64, count: usize) -> Vec<Point> {
    let mut out = Vec::with_capacity(count);
    let (mut segment, mut start) = (0, 0.0);
    for i in 0..count {
        let at = total * i as f64 / (count - 1) as f64;
        loop {
            let (a, b) = (points[segment], points[segment + 1]);
            let long = norm(sub(b, a));
            if at <= start + long || segment + 2 == points.len() {
                let part = if long > 0.0 { (at - start) / long } else { 0.0 };
                out.push(add(a, scale(sub(b, a), part)));
                break;
            }
            start += long;
            segment += 1;
        }
    }
    out
}

/// Unit normals (tangent turned by +90 degrees) by central differences.
pub(super) fn normals(points: &[Point]) -> Vec<Point> {
    let last = points.len() - 1;
    (0..points.len())
        .map(|i| {
            let t = sub(points[(i + 1).min(last)], points[i.saturating_sub(1)]);
            let n = norm(t).max(1e-12);
            [-t[1] / n, t[0] / n]
        })
        .collect()
}

/// Curve nearest to measured points: minimises
/// `sum w_i |x_i - m_i|^2 + lambda sum |x_{i-1} - 2 x_i + x_{i+1}|^2`.
///
/// The normal equations are pentadiagonal and positive definite as long as two
/// weights are; they are solved by banded `L D L^T`.
pub(super) fn smooth(measured: &[Point], weights: &[f64], lambda: f64) -> Vec<Point> {
    let n = measured.len();
    let (mut main, mut one, mut two) = (weights.to_vec(), vec![0.0; n], vec![0.0; n]);
    for k in 0..n.saturating_sub(2) {
        // Stencil (1, -2, 1) on k, k+1, k+2.
        for (offset, value) in [1.0, 4.0, 1.0].into_iter().enumerate() {
            main[k + offset] += lambda * value;
        }
        one[k] -= 2.0 * lambda;
        one[k + 1] -= 2.0 * lambda;
        two[k] += lambda;
    }
    // In place: main becomes D, one and two the subdiagonals of L.
    for i in 0..n {
        let mut d = main[i];
        if i >= 1 {
            d -= one[i - 1] * one[i - 1] * main[i - 1];
        }
        if i >= 2 {
            d -= two[i - 2] * two[i - 2] * main[i - 2];
        }
        main[i] = d.max(1e-12);
        if i + 1 < n {
            let fill = if i >= 1 {
                one[i - 1] * two[i - 1] * main[i - 1]
            } else {
                0.0
            };
            one[i] = (one[i] - fill) / main[i];
        }
        two[i] /= main[i];
    }
    let mut x: Vec<Point> = measured
        .iter()
        .zip(weights)
        .map(|(m, &w)| scale(*m, w))
        .collect();
    for i in 0..n {
        if i >= 1 {
            x[i] = sub(x[i], scale(x[i - 1], one[i - 1]));
        }
        if i >= 2 {
            x[i] = sub(x[i], scale(x[i - 2], two[i - 2]));
        }
    }
    for i in 0..n {
        x[i] = scale(x[i], 1.0 / main[i]);
    }
    for i in (0..n).rev() {
        if i + 1 < n {
            x[i] = sub(x[i], scale(x[i + 1], one[i]));
        }
        if i + 2 < n {
            x[i] = sub(x[i], scale(x[i + 2], two[i]));
        }
    }
    x
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn resampling_is_uniform_and_goes_on_straight() {
        let bent = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]];
        assert_eq!(resample(&bent, 2.0, 5)[3], [1.0, 0.5]);
        assert_eq!(resample(&bent, 3.0, 4)[3], [1.0, 2.0]);
        assert!((length(&bent) - 2.0).abs() < 1e-15);
    }

    #[test]
    fn a_fold_turns_by_more_than_a_right_angle() {
        let turned = |by_deg: f64| {
            let (s, c) = by_deg.to_radians().sin_cos();
            [[-1.0, 0.0], [0.0, 0.0], [c, s], [2.0 * c, 2.0 * s]]
        };
        assert!(!folds(&turned(89.0)) && !folds(&turned(-89.0)));
        assert!(folds(&turned(91.0)) && folds(&turned(180.0)));
    }

    #[test]
    fn smoothing_solves_its_normal_equations() {
        let n = 9;
        let m: Vec<Point> = (0..n)
            .map(|i| [f64::from(i * i % 5), f64::from(i)])
            .collect();
        let w: Vec<f64> = (0..n).map(|i| 0.3 + f64::from(i % 3)).collect();
        let x = smooth(&m, &w, 2.5);
        // Gradient of the objective must vanish in every coordinate.
        for i in 0..m.len() {
            for c in 0..2 {
                let mut g = w[i] * (x[i][c] - m[i][c]);
                for k in 1..m.len() - 1 {
                    let bend = x[k - 1][c] - 2.0 * x[k][c] + x[k + 1][c];
                    let share = match i.abs_diff(k) {
                        0 => -2.0,
                        1 => 1.0,
                        _ => 0.0,
                    };
                    g += 2.5 * share * bend;
                }
                assert!(g.abs() < 1e-9, "{i} {c} {g}");
            }
        }
    }

    #[test]
    fn a_straight_line_stays_where_it_is() {
        let m: Vec<Point> = (0..20).map(|i| [f64::from(i), 3.0]).collect();
        for (a, b) in smooth(&m, &[0.5; 20], 100.0).iter().zip(&m) {
            assert!(norm(sub(*a, *b)) < 1e-9);
        }
    }
}
