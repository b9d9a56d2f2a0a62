//! `[models]` in `camera.toml`: learned models that stand in for parts of the tracker.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

/// ONNX files; what is not named is built in.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ModelFiles {
    /// For the mask of the first frame.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub segmenter: Option<PathBuf>,
    /// For following points from frame to frame.
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
        let within = |path: Option<PathBuf>| path.map(|p| folder.join(p));
        Self {
            segmenter: within(self.segmenter),
            tracker: within(self.tracker),
        }
    }
}
