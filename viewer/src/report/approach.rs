//! How near the tip comes to the target, and how fast it is, over a motion.

use nalgebra::Vector3;
use serde::Serialize;

/// The tip over time; both series have one value for each sample.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct TipCurve {
    /// Time of the first sample on the motion's clock (s).
    pub from_s: f64,
    /// Time between samples (s).
    pub period_s: f64,
    /// Distance of tip and target (m).
    pub distance_m: Vec<f64>,
    /// Speed of the tip (m/s).
    pub speed_m_s: Vec<f64>,
    pub closest: Approach,
}

/// The closest approach of tip and target.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub(crate) struct Approach {
    /// When, on the motion's clock (s).
    pub time_s: f64,
    /// Distance (m).
    pub distance_m: f64,
    /// Speed of the tip then (m/s).
    pub speed_m_s: f64,
}

/// Distance and speed of a tip sampled every `period_s` from `from_s` on; none of fewer than
/// two samples. Positions and target in the world (m).
pub(crate) fn tip_curve(
    tip: &[Vector3<f64>],
    [from_s, period_s]: [f64; 2],
    target: &Vector3<f64>,
) -> Option<TipCurve> {
    let last = tip.len().checked_sub(1).filter(|last| *last > 0)?;
    let distance_m = tip.iter().map(|p| (p - target).norm());
    let speed = |i: usize| {
        let (before, after) = (i.saturating_sub(1), (i + 1).min(last));
        (tip[after] - tip[before]).norm() / ((after - before) as f64 * period_s)
    };
    let speeds_m_s: Vec<f64> = (0..tip.len()).map(speed).collect();
    // A tip moves by centimetres from one sample to the next: the approach lies between them.
    let (from, [part, closest_m]) = tip
        .windows(2)
        .map(|pair| nearest(&pair[0], &pair[1], target))
        .enumerate()
        .min_by(|(_, a), (_, b)| a[1].total_cmp(&b[1]))?;
    Some(TipCurve {
        from_s,
        period_s,
        distance_m: distance_m.map(tenth_mm).collect(),
        closest: Approach {
            time_s: from_s + (from as f64 + part) * period_s,
            distance_m: closest_m,
            speed_m_s: speeds_m_s[from] * (1.0 - part) + speeds_m_s[from + 1] * part,
        },
        speed_m_s: speeds_m_s.into_iter().map(tenth_mm).collect(),
    })
}

/// More digits than a plot shows would only make the file larger.
fn tenth_mm(value: f64) -> f64 {
    (value * 1e4).round() / 1e4
}

/// Where on the way from `a` to `b` a point is nearest (0 to 1), and how near (m).
fn nearest(a: &Vector3<f64>, b: &Vector3<f64>, point: &Vector3<f64>) -> [f64; 2] {
    let way = b - a;
    let part = (point - a).dot(&way) / way.norm_squared();
    // A tip at rest has no way.
    let part = if part.is_finite() {
        part.clamp(0.0, 1.0)
    } else {
        0.0
    };
    [part, (a + way * part - point).norm()]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_closest_approach_lies_between_samples() {
        // Along x at 3 m/s, 2 cm beside the target, which it passes at 0.105 s.
        let tip: Vec<_> = (0..20)
            .map(|i| Vector3::new(0.03 * f64::from(i), 0.02, 0.0))
            .collect();
        let target = Vector3::new(0.315 + 0.3, 0.0, 0.0);
        let found = tip_curve(&tip, [-0.1, 0.01], &target).unwrap();
        assert_eq!(found.distance_m.len(), 20);
        // The way ends before it gets there.
        assert!((found.closest.time_s - 0.09).abs() < 1e-12);
        let target = Vector3::new(0.315, 0.0, 0.0);
        let found = tip_curve(&tip, [-0.1, 0.01], &target).unwrap();
        assert!((found.closest.time_s - 0.005).abs() < 1e-9, "{found:?}");
        assert!((found.closest.distance_m - 0.02).abs() < 1e-12);
        assert!(found.distance_m.iter().all(|d| *d > 0.02));
        assert!((found.closest.speed_m_s - 3.0).abs() < 1e-9);
        assert!(found.speed_m_s.iter().all(|v| (v - 3.0).abs() < 1e-3));
    }

    #[test]
    fn a_tip_at_rest_is_as_near_as_it_hangs() {
        let tip = [Vector3::new(0.0, 0.3, 0.4); 3];
        let found = tip_curve(&tip, [0.0, 0.01], &Vector3::zeros()).unwrap();
        assert!((found.closest.distance_m - 0.5).abs() < 1e-12);
        assert_eq!(found.speed_m_s, [0.0; 3]);
        assert!(tip_curve(&tip[..1], [0.0, 0.01], &Vector3::zeros()).is_none());
    }
}
