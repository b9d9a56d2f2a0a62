//! Curves in the picture.

use nalgebra::Vector2;

/// A place or a direction in the picture (px).
pub(super) type Pixel = Vector2<f64>;

/// Unit vector from one place to another, and their distance (px).
fn towards(a: Pixel, b: Pixel) -> (Pixel, f64) {
    let length = distance_px(a, b).max(1e-9);
    ((b - a) / length, length)
}

pub(super) fn distance_px(a: Pixel, b: Pixel) -> f64 {
    (b.x - a.x).hypot(b.y - a.y)
}

/// Place at a part of the way from one to another.
fn between(a: Pixel, b: Pixel, part: f64) -> Pixel {
    a + (b - a) * part
}

/// Unit tangent at a point, over `reach` points to either side, and their distance (px).
#[inline]
pub(super) fn tangent(points: &[Pixel], at: usize, reach: usize) -> (Pixel, f64) {
    let after = (at + reach).min(points.len() - 1);
    towards(points[at.saturating_sub(reach)], points[after])
}

/// Across a direction.
pub(super) fn across(direction: Pixel) -> Pixel {
    Pixel::new(-direction.y, direction.x)
}

/// Unit normals.
pub(super) fn normals(points: &[Pixel]) -> impl Iterator<Item = Pixel> {
    (0..points.len()).map(|at| across(tangent(points, at, 2).0))
}

/// How far along the curve each of its points lies (px).
fn along_px(points: &[Pixel]) -> Vec<f64> {
    let mut sums = vec![0.0];
    for w in points.windows(2) {
        sums.push(sums[sums.len() - 1] + distance_px(w[0], w[1]));
    }
    sums
}

/// In the points' unit.
pub(super) fn length(points: &[Pixel]) -> f64 {
    points.windows(2).map(|w| distance_px(w[0], w[1])).sum()
}

/// Place and tangent so far beyond the last point (px); before it where negative.
pub(super) fn from_end(points: &[Pixel], s_px: f64) -> (Pixel, Pixel) {
    let last = points.len() - 1;
    if s_px >= 0.0 {
        let (t, _) = tangent(points, last, 3);
        return (points[last] + t * s_px, t);
    }
    let mut left_px = -s_px;
    for i in (1..=last).rev() {
        let (t, step_px) = towards(points[i - 1], points[i]);
        if left_px <= step_px || i == 1 {
            return (points[i] - t * left_px, tangent(points, i, 2).0);
        }
        left_px -= step_px;
    }
    (points[0], Pixel::y())
}

/// A curve whose points lie where they do along another one: at the same parts of its length.
pub(super) fn respaced(points: &[Pixel], like: &[Pixel]) -> Vec<Pixel> {
    let (here, there) = (along_px(points), along_px(like));
    let last = here.len() - 1;
    let scale = here[last] / there[last].max(1e-9);
    let mut i = 0;
    let place = |s: &f64| {
        let s = s * scale;
        while i + 2 < here.len() && here[i + 1] < s {
            i += 1;
        }
        let part = (s - here[i]) / (here[i + 1] - here[i]).max(1e-9);
        between(points[i], points[i + 1], part)
    };
    there.iter().map(place).collect()
}

/// Place at a part of the points' count, drawn on beyond the last one: 0 first, 1 last.
pub(super) fn at_fraction(points: &[Pixel], fraction: f64) -> Pixel {
    let last = points.len() - 1;
    let place = fraction * last as f64;
    if place >= last as f64 {
        return from_end(points, (fraction - 1.0) * length(points)).0;
    }
    let before = place.max(0.0) as usize;
    between(points[before], points[before + 1], place - before as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_lie_where_a_straight_line_has_them() {
        let place = |y: f64| Pixel::new(3.0, y);
        let line: Vec<Pixel> = (0..11).map(|i| place(2.0 * f64::from(i))).collect();
        assert_eq!(length(&line), 20.0);
        assert_eq!(from_end(&line, 5.0), (place(25.0), Pixel::y()));
        assert_eq!(from_end(&line, -5.0), (place(15.0), Pixel::y()));
        for (part, y) in [(0.25, 5.0), (1.1, 22.0), (-0.1, -2.0)] {
            assert_eq!(at_fraction(&line, part), place(y));
        }
        assert_eq!(normals(&line).nth(4), Some(-Pixel::x()));
        // Unevenly spaced, and twice as long.
        let uneven = |i: i32| Pixel::new(0.0, 0.4 * f64::from(i * i));
        let uneven: Vec<Pixel> = (0..11).map(uneven).collect();
        assert_eq!(respaced(&uneven, &line)[5], Pixel::new(0.0, 20.0));
    }
}
