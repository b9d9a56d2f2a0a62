//! Curves in the picture.

/// Unit tangent at a point, over `reach` points to either side, and their distance (px).
#[inline]
pub(super) fn tangent(points: &[[f64; 2]], at: usize, reach: usize) -> ([f64; 2], f64) {
    let (a, b) = (
        points[at.saturating_sub(reach)],
        points[(at + reach).min(points.len() - 1)],
    );
    let (x, y) = (b[0] - a[0], b[1] - a[1]);
    let length = x.hypot(y).max(1e-9);
    ([x / length, y / length], length)
}

/// Unit normals.
pub(super) fn normals(points: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let normal = |at| {
        let ([x, y], _) = tangent(points, at, 2);
        [-y, x]
    };
    (0..points.len()).map(normal).collect()
}

/// Length (px).
pub(super) fn length_px(points: &[[f64; 2]]) -> f64 {
    let step = |w: &[[f64; 2]]| (w[1][0] - w[0][0]).hypot(w[1][1] - w[0][1]);
    points.windows(2).map(step).sum()
}

/// Place and tangent so far beyond the last point (px); before it where negative.
pub(super) fn from_end(points: &[[f64; 2]], s_px: f64) -> ([f64; 2], [f64; 2]) {
    let last = points.len() - 1;
    if s_px >= 0.0 {
        let (t, _) = tangent(points, last, 3);
        let p = points[last];
        return ([p[0] + t[0] * s_px, p[1] + t[1] * s_px], t);
    }
    let mut left_px = -s_px;
    for i in (1..=last).rev() {
        let (t, step_px) = {
            let (a, b) = (points[i - 1], points[i]);
            let (x, y) = (b[0] - a[0], b[1] - a[1]);
            let length = x.hypot(y).max(1e-9);
            ([x / length, y / length], length)
        };
        if left_px <= step_px || i == 1 {
            let p = points[i];
            let (smooth, _) = tangent(points, i, 2);
            return ([p[0] - t[0] * left_px, p[1] - t[1] * left_px], smooth);
        }
        left_px -= step_px;
    }
    (points[0], [0.0, 1.0])
}

/// A curve whose points lie where they do along another one: at the same parts of its length.
pub(super) fn respaced(points: &[[f64; 2]], like: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let along = |points: &[[f64; 2]]| -> Vec<f64> {
        let mut sums = vec![0.0];
        for w in points.windows(2) {
            let step = (w[1][0] - w[0][0]).hypot(w[1][1] - w[0][1]);
            sums.push(sums[sums.len() - 1] + step);
        }
        sums
    };
    let (here, there) = (along(points), along(like));
    let last = here.len() - 1;
    let scale = here[last] / there[last].max(1e-9);
    let mut i = 0;
    let place = |s: &f64| {
        let s = s * scale;
        while i + 2 < here.len() && here[i + 1] < s {
            i += 1;
        }
        let w = (s - here[i]) / (here[i + 1] - here[i]).max(1e-9);
        let (a, b) = (points[i], points[i + 1]);
        [a[0] + (b[0] - a[0]) * w, a[1] + (b[1] - a[1]) * w]
    };
    there.iter().map(place).collect()
}

/// Place at a part of the points' count, drawn on beyond the last one: 0 first, 1 last.
pub(super) fn at_part(points: &[[f64; 2]], part: f64) -> [f64; 2] {
    let last = points.len() - 1;
    let place = part * last as f64;
    if place >= last as f64 {
        return from_end(points, (part - 1.0) * length_px(points)).0;
    }
    let before = place.max(0.0) as usize;
    let w = place - before as f64;
    let (a, b) = (points[before], points[before + 1]);
    [a[0] + (b[0] - a[0]) * w, a[1] + (b[1] - a[1]) * w]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_lie_where_a_straight_line_has_them() {
        let line: Vec<[f64; 2]> = (0..11).map(|i| [3.0, 2.0 * f64::from(i)]).collect();
        assert_eq!(length_px(&line), 20.0);
        assert_eq!(from_end(&line, 5.0), ([3.0, 25.0], [0.0, 1.0]));
        assert_eq!(from_end(&line, -5.0), ([3.0, 15.0], [0.0, 1.0]));
        assert_eq!(at_part(&line, 0.25), [3.0, 5.0]);
        assert_eq!(at_part(&line, 1.1), [3.0, 22.0]);
        assert_eq!(at_part(&line, -0.1), [3.0, -2.0]);
        assert_eq!(normals(&line)[4], [-1.0, 0.0]);
        // Unevenly spaced, and twice as long.
        let uneven: Vec<[f64; 2]> = (0..11).map(|i| [0.0, 0.4 * f64::from(i * i)]).collect();
        assert_eq!(respaced(&uneven, &line)[5], [0.0, 20.0]);
    }
}
