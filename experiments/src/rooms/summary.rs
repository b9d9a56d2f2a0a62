//! Films counted by what they show.

use super::fate::{Fate, Tracked};
use super::score::CONFIDENCES;
use serde::Serialize;
use std::collections::BTreeMap;

/// Normal quantile of 95 % limits.
const Z: f64 = 1.959_964;

/// Films that have something in common.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct Row {
    /// What they have in common.
    pub(super) films: String,
    pub(super) n: usize,
    pub(super) followed: usize,
    pub(super) refused: usize,
    /// Films whose track the tracker would not rely on.
    pub(super) flagged: usize,
    /// Films in which the tracker was sure of what is not so.
    pub(super) wrong: usize,
    /// Part followed, and its 95 % limits.
    pub(super) followed_fraction: [f64; 3],
    /// Part wrong, and its 95 % limits.
    pub(super) wrong_fraction: [f64; 3],
}

impl Row {
    fn of<'a>(films: String, members: impl IntoIterator<Item = &'a Tracked>) -> Self {
        let (mut n, mut followed, mut refused, mut flagged, mut wrong) = (0, 0, 0, 0, 0);
        for film in members {
            n += 1;
            followed += usize::from(film.is_followed());
            match &film.fate {
                Fate::Refused(_) => refused += 1,
                Fate::Tracked(score) if score.misleads() => wrong += 1,
                Fate::Tracked(_) => flagged += usize::from(!film.unconfirmed.is_empty()),
            }
        }
        Self {
            films,
            n,
            followed,
            refused,
            flagged,
            wrong,
            followed_fraction: wilson(followed, n),
            wrong_fraction: wilson(wrong, n),
        }
    }

    /// Films neither followed, nor refused, nor flagged, nor wrong.
    pub(super) fn others(&self) -> usize {
        self.n - self.followed - self.refused - self.flagged - self.wrong
    }
}

/// Of the keypoints of so much confidence (tenths, all films) how many there are, and the
/// part that lies near the curve.
pub(super) fn reliability(all: &[Tracked]) -> Vec<(f64, u64, f64)> {
    let mut sums = [[0_u64; 2]; CONFIDENCES];
    for film in all {
        if let Fate::Tracked(score) = &film.fate {
            for (sum, found) in sums.iter_mut().zip(score.reliability) {
                *sum = [sum[0] + found[0], sum[1] + found[1]];
            }
        }
    }
    let row = |(k, [n, near]): (usize, &[u64; 2])| {
        let from = k as f64 / CONFIDENCES as f64;
        (from, *n, *near as f64 / (*n).max(1) as f64)
    };
    sums.iter().enumerate().map(row).collect()
}

/// All films, then those of each wall, rope, shadow, shutter and hardship.
pub(super) fn rows(all: &[Tracked]) -> Vec<Row> {
    let mut groups: BTreeMap<(u8, String), Vec<&Tracked>> = BTreeMap::new();
    for film in all {
        let scene = &film.scene;
        let shutter = if scene.rolling { "rolling" } else { "global" };
        let named = [
            (1, format!("wall: {}", scene.wall)),
            (2, format!("rope: {}", scene.rope)),
            (3, format!("weave: {}", scene.weave)),
            (4, format!("shadows: {}", scene.shadows)),
            (5, format!("shutter: {shutter}")),
        ];
        let hard = scene
            .hardships
            .iter()
            .map(|h| (6, format!("hardship: {h}")));
        for key in named.into_iter().chain(hard) {
            groups.entry(key).or_default().push(film);
        }
    }
    let all = Row::of("all".to_owned(), all);
    let groups = groups
        .into_iter()
        .map(|((_, name), films)| Row::of(name, films));
    std::iter::once(all).chain(groups).collect()
}

/// A part and the limits between which the true one lies with 95 %, after Wilson.
fn wilson(hits: usize, n: usize) -> [f64; 3] {
    if n == 0 {
        return [0.0, 0.0, 1.0];
    }
    let (n, part) = (n as f64, hits as f64 / n as f64);
    let centre = part + Z * Z / (2.0 * n);
    let spread = Z * (part * (1.0 - part) / n + Z * Z / (4.0 * n * n)).sqrt();
    let scale = 1.0 + Z * Z / n;
    let limit = |v: f64| (v / scale).clamp(0.0, 1.0);
    [part, limit(centre - spread), limit(centre + spread)]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Newcombe, Statistics in Medicine 17 (1998), table I: 81 of 263, and 0 of 20.
    #[test]
    fn limits_are_those_of_the_literature() {
        let [_, low, high] = wilson(81, 263);
        assert!((low - 0.2553).abs() < 5e-5 && (high - 0.3662).abs() < 5e-5);
        let [_, low, high] = wilson(0, 20);
        assert!(low == 0.0 && (high - 0.1611).abs() < 5e-5);
    }
}
