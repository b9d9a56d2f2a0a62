//! What became of films.

use super::folder::Scene;
use super::score::Score;
use serde::{Deserialize, Serialize};

/// What became of a film.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum Fate {
    /// The tracker refused it, for this reason.
    Refused(String),
    /// It was tracked this well.
    Tracked(Score),
}

/// A film and what became of it, as kept in a file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Tracked {
    /// Version and hash of the program that tracked it.
    pub(super) program: String,
    pub(super) scene: Scene,
    pub(super) fate: Fate,
    /// Why the tracker would not rely on it.
    pub(super) unconfirmed: Vec<String>,
}

impl Tracked {
    /// Whether the tracker followed the rope, and relies on that.
    pub(super) fn is_followed(&self) -> bool {
        matches!(&self.fate, Fate::Tracked(score) if score.follows()) && self.unconfirmed.is_empty()
    }

    /// One line about it.
    pub(super) fn said(&self) -> String {
        let scene = &self.scene;
        let about = format!(
            "seed {}: {}, {} rope, {} tip weight, {} shadows",
            scene.seed, scene.wall, scene.rope, scene.lead, scene.shadows
        );
        match &self.fate {
            Fate::Refused(reason) => format!("{about}: refused: {reason}"),
            Fate::Tracked(s) => format!(
                "{about}: median {:.2}, 95th percentile {:.2}, at the tip {:.2}, largest {:.0} \
                 px; lost {}, wrong {} of {} frames{}",
                s.median_px,
                s.p95_px,
                s.tip_p95_px,
                s.max_px,
                s.lost,
                s.wrong,
                s.frames,
                self.unconfirmed
                    .iter()
                    .map(|d| format!("; unconfirmed: {d}"))
                    .collect::<String>()
            ),
        }
    }
}
