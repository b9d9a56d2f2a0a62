//! How far apart two engines are in one scene.

use super::engines::{Course, DominoCourse, PERIOD_S};
use crate::report::Column;
use crate::results::experiment::number;
use anyhow::{Context, ensure};
use serde::Serialize;

/// Time after the first contact at which tips are compared (s).
pub(super) const AFTER_S: f64 = 1.0;
/// Distances of the tips that are allowed before the first contact, and then (m).
pub(super) const WITHIN_M: [f64; 2] = [0.005, 0.015];

/// Distances of the tips in two runs (m).
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub(super) struct Apart {
    /// Greatest before the first contact.
    pub before_m: f64,
    /// [`AFTER_S`] after it.
    pub after_m: f64,
    /// Greatest in between.
    pub between_m: f64,
}

/// Whether the engines agree.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub(super) enum Verdict {
    Met,
    Missed,
    /// They do not, but neither does MuJoCo with itself at half the step.
    Undecided,
}

/// One scene.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct Row {
    pub name: &'static str,
    /// First contact (s): `rope-sim`, MuJoCo.
    pub first_s: [f64; 2],
    /// Between the engines.
    pub apart: Apart,
    /// Of each engine from itself at half the step: `rope-sim`, MuJoCo.
    pub own: [Apart; 2],
    /// In `rope-sim`, in MuJoCo.
    pub domino: Option<[DominoCourse; 2]>,
    /// Between the engines where a domino that has fallen lies in the rope's way in MuJoCo.
    pub domino_stays: Option<Apart>,
    pub verdict: Verdict,
}

impl Apart {
    /// The first contact is at `first_s`.
    fn of(a: &Course, b: &Course, first_s: f64) -> Self {
        let apart_m: Vec<f64> = (a.tip_m.iter().zip(&b.tip_m))
            .map(|(a, b)| (a - b).norm())
            .collect();
        let first = (first_s / PERIOD_S).floor() as usize;
        let after = ((first_s + AFTER_S) / PERIOD_S).round() as usize;
        let greatest = |of: &[f64]| of.iter().copied().fold(0.0, f64::max);
        Self {
            before_m: greatest(&apart_m[..first]),
            after_m: apart_m[after],
            between_m: greatest(&apart_m[first..=after]),
        }
    }
}

impl Row {
    /// From each engine's run at its step and at half of it, `rope-sim`'s first. MuJoCo's finer
    /// one is the reference.
    pub fn of(
        name: &'static str,
        ours: &[Course; 2],
        theirs: &[Course; 2],
        stays: Option<&Course>,
    ) -> anyhow::Result<Self> {
        let first_s = |course: &Course, engine: &str| {
            let first_s = course.first_s;
            first_s.with_context(|| format!("`{name}` touches nothing in {engine}"))
        };
        let first_s = [
            first_s(&ours[0], "rope-sim")?,
            first_s(&theirs[1], "MuJoCo")?,
        ];
        let from_s = first_s[0].min(first_s[1]);
        let needed = ((from_s + AFTER_S) / PERIOD_S).round() as usize;
        for course in ours.iter().chain(theirs).chain(stays) {
            ensure!(
                course.tip_m.len() > needed,
                "`{name}` ends less than {AFTER_S} s after its first contact: simulate it longer"
            );
        }
        let apart = Apart::of(&ours[0], &theirs[1], from_s);
        let own = [ours, theirs].map(|runs| Apart::of(&runs[0], &runs[1], from_s));
        let domino = ours[0].domino.zip(theirs[1].domino).map(|(a, b)| [a, b]);
        let fell = |course: &Course| course.domino.is_some_and(|d| d.down_at_s.is_some());
        let agree = |a: &Apart| a.before_m < WITHIN_M[0] && a.after_m < WITHIN_M[1];
        let alike = |a: &Course, b: &Course| fell(a) == fell(b);
        let verdict = if agree(&apart) && alike(&ours[0], &theirs[1]) {
            Verdict::Met
        } else if agree(&own[1]) && alike(&theirs[0], &theirs[1]) {
            Verdict::Missed
        } else {
            Verdict::Undecided
        };
        Ok(Self {
            name,
            first_s,
            apart,
            own,
            domino,
            domino_stays: stays.map(|stays| Apart::of(&ours[0], stays, from_s)),
            verdict,
        })
    }
}

fn mm(m: f64) -> String {
    number(1e3 * m, 2)
}

fn domino(domino: DominoCourse) -> String {
    match domino.down_at_s {
        Some(at_s) => format!("down at {at_s:.3} s"),
        None => format!("stands, tilted {:.1}°", domino.peak_tilt_rad.to_degrees()),
    }
}

pub(super) const TABLE: [Column<Row>; 10] = [
    ("mm", |row| row.name.to_owned()),
    ("contact (s)", |row| format!("{:.4}", row.first_s[0])),
    ("MuJoCo's (s)", |row| format!("{:.4}", row.first_s[1])),
    ("before", |row| mm(row.apart.before_m)),
    ("1 s after", |row| mm(row.apart.after_m)),
    ("most in it", |row| mm(row.apart.between_m)),
    ("own 1 s after", |row| mm(row.own[0].after_m)),
    ("MuJoCo's own", |row| mm(row.own[1].after_m)),
    ("domino, MuJoCo's", |row| {
        row.domino.map_or_else(
            || "-".to_owned(),
            |[a, b]| format!("{}, {}", domino(a), domino(b)),
        )
    }),
    ("verdict", |row| format!("{:?}", row.verdict).to_lowercase()),
];

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector3;

    /// A tip that from the contact at 0.1 s on is off by so much, and a domino.
    fn course(off_m: f64, down_at_s: Option<f64>) -> Course {
        let tip_m = |i: u32| Vector3::x() * if i < 100 { 0.0 } else { off_m };
        Course {
            tip_m: (0..1200).map(tip_m).collect(),
            first_s: Some(0.1),
            domino: Some(DominoCourse {
                down_at_s,
                peak_tilt_rad: 0.8,
            }),
        }
    }

    #[test]
    fn what_the_reference_does_not_know_is_undecided() {
        let down = Some(0.2);
        let verdict = |ours: Course, theirs: [Course; 2]| {
            let row = Row::of("lob", &[ours.clone(), ours], &theirs, None).unwrap();
            (row.apart, row.verdict)
        };
        let at = |off_m| course(off_m, down);
        let (apart, met) = verdict(at(0.014), [at(0.0), at(0.0)]);
        assert_eq!(
            [apart.before_m, apart.after_m, apart.between_m],
            [0.0, 0.014, 0.014]
        );
        assert_eq!(met, Verdict::Met);
        assert_eq!(verdict(at(0.016), [at(0.0), at(0.0)]).1, Verdict::Missed);
        assert_eq!(
            verdict(at(0.016), [at(0.03), at(0.0)]).1,
            Verdict::Undecided
        );
        let stands = || course(0.0, None);
        assert_eq!(verdict(stands(), [at(0.0), at(0.0)]).1, Verdict::Missed);
        assert_eq!(verdict(stands(), [stands(), at(0.0)]).1, Verdict::Undecided);
    }

    #[test]
    fn a_scene_without_contact_or_too_short_is_refused() {
        let refused = |course: Course| {
            let pair = [course.clone(), course];
            Row::of("lob", &pair, &pair, None).unwrap_err().to_string()
        };
        let mut short = course(0.0, None);
        short.tip_m.truncate(1100);
        assert!(refused(short).contains("simulate it longer"));
        let untouched = Course {
            first_s: None,
            ..course(0.0, None)
        };
        assert!(refused(untouched).contains("touches nothing in rope-sim"));
    }
}
