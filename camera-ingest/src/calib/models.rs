//! `[models]` in `camera.toml`: a learned model that stands in for a part of the tracker.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

/// ONNX files; what is not named is built in.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ModelFiles {
    /// For following points of the rope through the film.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tracker: Option<PathBuf>,
}

impl ModelFiles {
    /// Everything is built in.
    pub(super) fn none(&self) -> bool {
        *self == Self::default()
    }

    /// With the paths taken relative to a folder.
    pub(super) fn within(self, folder: &Path) -> Self {
        Self {
            tracker: self.tracker.map(|p| folder.join(p)),
        }
    }
}
