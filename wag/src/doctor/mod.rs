//! Whether a machine is fit to drive an arm: what is found, what it means, and what
//! to do about it. Reading is one thing ([`mod@facts`], [`mod@line`]), judging another
//! ([`mod@judge`]).

mod facts;
mod judge;
mod line;

pub use facts::Facts;
pub use judge::{judge, judge_line};
pub use line::ArmLine;

use serde::Serialize;

/// What a finding means for a throw.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Verdict {
    /// As it should be.
    Pass,
    /// It works, but less well than it could.
    Warn,
    /// It does not work.
    Fail,
}

impl Verdict {
    /// One word.
    pub const fn word(self) -> &'static str {
        match self {
            Self::Pass => "pass",
            Self::Warn => "warn",
            Self::Fail => "FAIL",
        }
    }
}

/// One thing that was looked at.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Finding {
    /// What.
    pub name: &'static str,
    /// What it means.
    pub verdict: Verdict,
    /// What was found.
    pub found: String,
    /// What to do; empty when nothing is to be done.
    pub remedy: String,
}
