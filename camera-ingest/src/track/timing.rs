//! Whether arm and camera tell the same time and place, from the wiggle itself.
//!
//! The arm says where the clamp is. The rope below the clamp is seen, not told:
//! continued upwards it shows where the clamp was. Across the rope, what is seen and what
//! is told differ by a constant where clamp or camera stand elsewhere, and in step with
//! the clamp's speed where the clocks differ. A part
//! in step with its acceleration is let go, for so does the rope bend. Along the rope
//! nothing is known.
//!
//! A rope bends more than its continuation knows, also in step with the speed. So it is
//! continued twice, from its first part and from half of that; what differs between the
//! two counts as error.

use nalgebra::{Matrix3, Vector3};

use super::plane::Point;

/// The rope is continued from these parts of it (of its nodes).
const PARTS: [f64; 2] = [0.12, 0.24];
/// Coverage from which a node is seen well.
const CLEAR: f64 = 0.6;
/// What lies beside the rope may pull it aside by this much in every frame (px).
const STEADY_PX: f64 = 0.25;
/// Nodes and frames needed.
const MIN_NODES: usize = 6;
const MIN_FRAMES: usize = 30;
/// The clamp must move by this much across the rope (m, root mean square).
const MIN_MOTION_M: f64 = 0.005;
/// Difference of times for speeds and accelerations (s).
const STEP_S: f64 = 5e-3;
/// Rounds of the fit, which is nearly linear, with all frames, and as many without
/// those that lie further off than so many deviations.
const ROUNDS: usize = 3;
const FAR: f64 = 4.0;

/// What the film says about the clamp that the arm reports.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ClampFit {
    /// Time of the film minus time of the clamp's path (s): what is seen at `t` is what
    /// the path says for `t` less this.
    pub time_offset_s: f64,
    /// Its standard error (s), what the rope's bend may do to it included.
    pub time_std_s: f64,
    /// Clamp seen minus clamp told, across the rope at the clamp, to the right as the
    /// camera sees it (m).
    pub aside_m: f64,
    /// Its standard error (m), likewise.
    pub aside_std_m: f64,
    /// Frames it rests on.
    pub frames: usize,
}

/// The clamp in one frame, where the rope shows it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct SeenClamp {
    /// By the shorter and the longer part of the rope.
    pub(super) at: [Point; 2],
    /// Unit vector across the rope, to the right.
    pub(super) across: Point,
}

/// Continues the rope's first part, without its hidden nodes before `first`, up to the
/// clamp. Nodes have a place and how evident the rope is there (0 to 1). `None` where too
/// little of it is seen.
pub(super) fn seen_clamp(nodes: &[(Point, f64)], first: usize) -> Option<SeenClamp> {
    let (short, along) = continued(nodes, first, PARTS[0])?;
    let (long, _) = continued(nodes, first, PARTS[1])?;
    let length = along[0].hypot(along[1]);
    if length < 1e-9 {
        return None;
    }
    let turn = if along[1] < 0.0 { -1.0 } else { 1.0 } / length;
    Some(SeenClamp {
        at: [short, long],
        across: [along[1] * turn, -along[0] * turn],
    })
}

/// Place and direction of a parabola through a part of the nodes at the first one.
fn continued(nodes: &[(Point, f64)], first: usize, part: f64) -> Option<(Point, Point)> {
    let end = first + (part * nodes.len() as f64).round() as usize;
    let clear: Vec<(Vector3<f64>, Point)> = (0..)
        .map(f64::from)
        .zip(nodes)
        .take(end)
        .skip(first)
        .filter(|(_, (_, confidence))| *confidence > CLEAR)
        .map(|(i, (point, _))| (Vector3::new(1.0, i, i * i), *point))
        .collect();
    if clear.len() < MIN_NODES {
        return None;
    }
    let inverse = inverse_normal(clear.iter().map(|(powers, _)| powers))?;
    let fit = [0, 1].map(|k| {
        let right: Vector3<f64> = clear.iter().map(|(powers, p)| powers * p[k]).sum();
        inverse * right
    });
    Some((fit.map(|c| c[0]), fit.map(|c| c[1])))
}

/// Inverse of the normal matrix of a least-squares fit.
fn inverse_normal<'a>(rows: impl Iterator<Item = &'a Vector3<f64>>) -> Option<Matrix3<f64>> {
    rows.map(|row| row * row.transpose())
        .sum::<Matrix3<f64>>()
        .try_inverse()
}

/// Fits offset and place to the clamps seen at their times (s). `reported` is the clamp's
/// place on the plane by the arm for a frame that starts at a time, `pixel_m` how large
/// a pixel is there.
///
/// `None` where the clamp moves too little, or is seen in too few frames.
pub(super) fn fit(
    seen: &[(f64, SeenClamp)],
    pixel_m: f64,
    reported: impl Fn(f64) -> Point,
) -> Option<ClampFit> {
    let [short, long] = [0, 1].map(|part| fit_part(seen, part, &reported));
    let (short, long) = (short?, long?);
    Some(ClampFit {
        time_std_s: long
            .time_std_s
            .hypot(long.time_offset_s - short.time_offset_s),
        aside_std_m: long
            .aside_std_m
            .hypot(long.aside_m - short.aside_m)
            .hypot(STEADY_PX * pixel_m),
        ..long
    })
}

/// The fit to one of the two continuations.
fn fit_part(
    seen: &[(f64, SeenClamp)],
    part: usize,
    reported: &impl Fn(f64) -> Point,
) -> Option<ClampFit> {
    let mut kept: Vec<(f64, SeenClamp)> = seen.to_vec();
    let mut x = Vector3::zeros();
    let mut found = None;
    for round in 0..2 * ROUNDS {
        if kept.len() < MIN_FRAMES {
            return None;
        }
        let rows: Vec<(Vector3<f64>, f64)> = kept
            .iter()
            .map(|(t, s)| row(*t, s, part, &x, reported))
            .collect();
        let inverse = inverse_normal(rows.iter().map(|(j, _)| j))?;
        let step: Vector3<f64> = inverse * rows.iter().map(|(j, r)| j * *r).sum::<Vector3<f64>>();
        let left: Vec<f64> = rows.iter().map(|(j, r)| r - j.dot(&step)).collect();
        x += step;
        let variance = left.iter().map(|r| r * r).sum::<f64>() / (left.len() - 3) as f64;
        found = Some(inverse * variance * repeats(&left));
        if round + 1 == ROUNDS {
            let limit = FAR * variance.sqrt();
            let mut off = left.iter();
            kept.retain(|_| off.next().is_some_and(|r| r.abs() <= limit));
        }
    }
    let covariance = found?;
    if motion_m(&kept, reported) < MIN_MOTION_M {
        return None;
    }
    Some(ClampFit {
        time_offset_s: x[0],
        time_std_s: covariance[(0, 0)].max(0.0).sqrt(),
        aside_m: x[1],
        aside_std_m: covariance[(1, 1)].max(0.0).sqrt(),
        frames: kept.len(),
    })
}

/// Slopes over offset, place and acceleration, and what is left, across the rope.
fn row(
    t_s: f64,
    seen: &SeenClamp,
    part: usize,
    x: &Vector3<f64>,
    reported: &impl Fn(f64) -> Point,
) -> (Vector3<f64>, f64) {
    let across = |p: Point| p[0] * seen.across[0] + p[1] * seen.across[1];
    let at = |shift_s: f64| across(reported(t_s - x[0] + shift_s));
    let (before, here, after) = (at(-STEP_S), at(0.0), at(STEP_S));
    let speed = (after - before) / (2.0 * STEP_S);
    let acceleration = (after - 2.0 * here + before) / (STEP_S * STEP_S);
    let left = across(seen.at[part]) - here - x[1] - x[2] * acceleration;
    (Vector3::new(-speed, 1.0, acceleration), left)
}

/// How many times a frame's error is repeated by those after it: for a correlation `c`
/// from frame to frame, `(1 + c) / (1 - c)`.
fn repeats(errors: &[f64]) -> f64 {
    let square: f64 = errors.iter().map(|e| e * e).sum();
    let product: f64 = errors.windows(2).map(|w| w[0] * w[1]).sum();
    let c = (product / square.max(1e-30)).clamp(0.0, 0.98);
    (1.0 + c) / (1.0 - c)
}

/// Root mean square of the clamp's way across the rope (m).
fn motion_m(seen: &[(f64, SeenClamp)], reported: &impl Fn(f64) -> Point) -> f64 {
    let places: Vec<f64> = seen.iter().map(|(t, _)| reported(*t)[0]).collect();
    let count = places.len() as f64;
    let mean = places.iter().sum::<f64>() / count;
    (places.iter().map(|p| (p - mean).powi(2)).sum::<f64>() / count).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn reported(t_s: f64) -> Point {
        [0.12 * (5.0 * t_s).sin() + 0.03 * (11.0 * t_s).sin(), 0.0]
    }

    /// The clamp seen `late_s` late and `aside_m` to the right, the rope bent in step
    /// with the acceleration, and errors that last for some frames.
    fn film(late_s: f64, aside_m: f64, noise_m: f64) -> Vec<(f64, SeenClamp)> {
        let mut error = 0.0;
        (0..400)
            .map(|i| {
                let t = f64::from(i) / 60.0;
                let chance = f64::from(i * 7919 % 1000) / 500.0 - 1.0;
                error = 0.8 * error + noise_m * chance;
                let bend = 1e-4
                    * (reported(t - late_s + 1e-3)[0] + reported(t - late_s - 1e-3)[0]
                        - 2.0 * reported(t - late_s)[0])
                    / 1e-6;
                let seen = SeenClamp {
                    at: [[reported(t - late_s)[0] + aside_m + bend + error, 0.3]; 2],
                    across: [1.0, 0.0],
                };
                (t, seen)
            })
            .collect()
    }

    #[test]
    fn offset_and_place_are_found_within_what_is_said() {
        for (late_s, aside_m) in [(0.0, 0.0), (0.012, 0.003), (-0.035, -0.008)] {
            let found = fit(&film(late_s, aside_m, 5e-4), 0.0, reported).unwrap();
            assert!(
                found.time_std_s < 1e-3 && found.aside_std_m < 1e-3,
                "{found:?}"
            );
            let time = (found.time_offset_s - late_s).abs();
            let aside = (found.aside_m - aside_m).abs();
            assert!(time < 3.0 * found.time_std_s + 1e-5, "{late_s}: {found:?}");
            assert!(
                aside < 3.0 * found.aside_std_m + 1e-5,
                "{aside_m}: {found:?}"
            );
        }
    }

    #[test]
    fn stray_frames_do_not_count_and_a_still_clamp_tells_nothing() {
        let mut seen = film(0.012, 0.003, 5e-4);
        for frame in &mut seen[100..110] {
            frame.1.at[0][0] += 0.1;
            frame.1.at[1][0] += 0.1;
        }
        let found = fit(&seen, 0.0, reported).unwrap();
        assert!((found.time_offset_s - 0.012).abs() < 1.5e-3, "{found:?}");
        assert_eq!(found.frames, 390);
        assert_eq!(fit(&film(0.0, 0.0, 5e-4), 0.0, |_| [0.1, 0.0]), None);
        assert_eq!(fit(&seen[..20], 0.0, reported), None);
    }

    #[test]
    fn the_rope_is_continued_to_the_clamp() {
        let point = |s: f64| [0.3 + 0.002 * s + 1e-5 * s * s, 0.1 + 0.008 * s];
        let node = |i: usize| (point(i as f64), f64::from(i > 1));
        let nodes: Vec<(Point, f64)> = (0..64).map(node).collect();
        let seen = seen_clamp(&nodes, 2).unwrap();
        for at in seen.at {
            assert!((at[0] - 0.3).abs() < 1e-9 && (at[1] - 0.1).abs() < 1e-9);
        }
        assert!((seen.across[0] * 0.002 + seen.across[1] * 0.008).abs() < 1e-9);
        assert!(seen.across[0] > 0.0);
        let hidden: Vec<(Point, f64)> = (0..64).map(|i| (node(i).0, 0.2)).collect();
        assert_eq!(seen_clamp(&hidden, 2), None);
    }
}
