//! Films counted by what they show.

use super::fate::{Fate, Tracked};
use super::score::CONFIDENCES;
use experiments::trials::wilson;
use serde::Serialize;
use std::collections::BTreeMap;

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
