//! A rope that was identified, as files keep it: its parameters, and what is known about them.

use anyhow::ensure;
use planner::plan::PosteriorEnsemble;
use run_log::files;
use shared_types::rope::RopePosterior;
use shared_types::{RopeEstimate, RopeParams};
use std::path::{Path, PathBuf};

#[derive(Debug)]
pub struct KnownRope {
    pub params: RopeParams,
    /// None in a file that was written by hand.
    pub posterior: Option<RopePosterior>,
    /// Why the track that it was identified from should not be relied on.
    pub unconfirmed: Vec<String>,
    from: From,
}

/// Where a rope is from.
#[derive(Debug)]
enum From {
    File(PathBuf),
    Estimate(Box<RopeEstimate>),
}

impl KnownRope {
    pub fn read(path: &Path) -> anyhow::Result<Self> {
        Ok(Self {
            params: files::read_rope(path)?,
            posterior: files::read_posterior(path)?,
            unconfirmed: files::read_unconfirmed(path)?,
            from: From::File(path.to_owned()),
        })
    }

    pub fn identified(estimate: RopeEstimate, unconfirmed: Vec<String>) -> Self {
        Self {
            params: estimate.params,
            posterior: Some(estimate.posterior.clone()),
            unconfirmed,
            from: From::Estimate(Box::new(estimate)),
        }
    }

    /// What its identification found, if it was identified just now.
    pub fn estimate(&self) -> Option<&RopeEstimate> {
        match &self.from {
            From::File(_) => None,
            From::Estimate(estimate) => Some(estimate),
        }
    }

    /// Writes it into a file.
    pub fn keep(&self, path: &Path) -> anyhow::Result<()> {
        match &self.from {
            From::File(from) => files::write_atomic(path, files::read_text(from)?.as_bytes()),
            From::Estimate(estimate) => {
                files::write_rope_estimate(path, estimate, &self.unconfirmed)
            }
        }
    }

    /// What it might be instead, for the forecast and for a plan that weighs `robust` such ropes.
    ///
    /// # Errors
    /// Ropes are wanted, but nothing is known, or hardly any could be drawn.
    pub fn ensemble(&self, robust: usize, seed: u64) -> anyhow::Result<PosteriorEnsemble> {
        let from = match &self.from {
            From::File(path) => format!("rope file `{}`", path.display()),
            From::Estimate(_) => "the identified rope".to_owned(),
        };
        let Some(posterior) = &self.posterior else {
            ensure!(
                robust == 0,
                "{from} has no table `posterior`: --robust needs a rope identified by this version"
            );
            return Ok(PosteriorEnsemble::default());
        };
        let drawn = PosteriorEnsemble::of_posterior(&self.params, posterior, robust, seed, &from);
        Ok(drawn?)
    }
}
