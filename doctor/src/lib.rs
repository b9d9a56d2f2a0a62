//! Whether a machine is fit to drive an arm: what is found, what it means, and what
//! to do about it.

mod line;
mod machine;

pub use line::{inputs, judge_line, settings};
pub use machine::Machine;

use serde::Serialize;

/// What a finding means for a throw.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Verdict {
    /// As it should be.
    Pass,
    /// It works, but less well than it could.
    Warn,
    /// Not fit.
    Fail,
}

impl Verdict {
    /// As it stands in a table.
    #[must_use]
    pub const fn word(self) -> &'static str {
        match self {
            Self::Pass => "pass",
            Self::Warn => "warn",
            Self::Fail => "FAIL",
        }
    }

    const fn warn_unless(good: bool) -> Self {
        if good { Self::Pass } else { Self::Warn }
    }

    /// A pass only of what is good.
    #[must_use]
    pub const fn fail_unless(good: bool) -> Self {
        if good { Self::Pass } else { Self::Fail }
    }
}

/// One thing that was looked at.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Finding {
    /// What was looked at.
    pub name: &'static str,
    /// What that means.
    pub verdict: Verdict,
    /// What was there.
    pub found: String,
    /// What to do; empty when nothing is to be done.
    pub remedy: String,
}

/// What the controller does not drive a real arm without.
const REQUIRED_OF_A_REAL_ARM: [&str; 2] = ["real-time priority", "memory lock"];

impl Finding {
    /// With a real arm, what the controller requires is no warning any more.
    pub fn require_of_a_real_arm(&mut self) {
        if self.verdict == Verdict::Warn && REQUIRED_OF_A_REAL_ARM.contains(&self.name) {
            self.verdict = Verdict::Fail;
        }
    }

    /// What was found, with the remedy for what is not as it should be.
    #[must_use]
    pub fn new(name: &'static str, verdict: Verdict, found: String, remedy: &str) -> Self {
        let remedy = match verdict {
            Verdict::Pass => String::new(),
            Verdict::Warn | Verdict::Fail => remedy.to_owned(),
        };
        Self {
            name,
            verdict,
            found,
            remedy,
        }
    }
}
