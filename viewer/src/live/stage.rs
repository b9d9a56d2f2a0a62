//! Which stage a run is in, as far as its controller and its folder tell.

use serde::Serialize;
use shared_types::OperatingMode;
use shared_types::ipc::ControllerMode;

/// The stages of a run, as its terminal names them; the first, its start, is over before there
/// is a controller to watch.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum Stage {
    BringUp,
    Wiggle,
    Track,
    Identify,
    Plan,
    Settle,
    Throw,
    Score,
}

/// Results that lie in the run's folder.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(crate) struct Results {
    /// The rope's keypoints.
    pub keypoints: bool,
    /// The identified rope.
    pub rope: bool,
    pub plan: bool,
}

/// What one controller was seen to do.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Progress {
    wiggled: bool,
    thrown: bool,
}

impl Progress {
    /// Takes in what the controller does now; the stage that this and the results tell.
    ///
    /// The controller does not know what a run is about. What it streams is the wiggle or the
    /// throw by what it is armed for; while it rests, the run makes the result that is not
    /// there yet.
    pub(crate) fn stage(
        &mut self,
        mode: ControllerMode,
        armed: Option<OperatingMode>,
        results: Results,
    ) -> Stage {
        let streams = mode == ControllerMode::Streaming;
        let throws = streams && armed == Some(OperatingMode::Throw);
        let wiggles = streams && armed == Some(OperatingMode::Wiggle) && !results.plan;
        self.thrown |= throws;
        self.wiggled |= wiggles;
        if mode == ControllerMode::Offline {
            Stage::BringUp
        } else if throws {
            Stage::Throw
        } else if wiggles {
            Stage::Wiggle
        } else if self.thrown {
            Stage::Score
        } else if results.plan {
            Stage::Settle
        } else if results.rope {
            Stage::Plan
        } else if results.keypoints {
            Stage::Identify
        } else if self.wiggled {
            Stage::Track
        } else {
            Stage::BringUp
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ControllerMode::{Idle, Moving, Offline, Streaming};

    #[test]
    fn a_run_goes_through_its_stages_in_order() {
        let [wiggle, throw] = [OperatingMode::Wiggle, OperatingMode::Throw].map(Some);
        let results = |count: usize| Results {
            keypoints: count > 0,
            rope: count > 1,
            plan: count > 2,
        };
        let seen = [
            (Offline, None, 0),
            (Moving, wiggle, 0),
            (Streaming, wiggle, 0),
            (Idle, wiggle, 0),
            (Idle, wiggle, 1),
            (Idle, wiggle, 2),
            // The move that damps the swing is streamed, too.
            (Streaming, wiggle, 3),
            (Streaming, throw, 3),
            (Idle, None, 3),
        ];
        let mut progress = Progress::default();
        let stages = seen.map(|(mode, armed, count)| progress.stage(mode, armed, results(count)));
        let all = [
            Stage::BringUp,
            Stage::BringUp,
            Stage::Wiggle,
            Stage::Track,
            Stage::Identify,
            Stage::Plan,
            Stage::Settle,
            Stage::Throw,
            Stage::Score,
        ];
        assert_eq!(stages, all);
        let name = serde_json::to_string(&Stage::BringUp).unwrap();
        assert_eq!(name, "\"bring-up\"");
    }

    #[test]
    fn a_run_that_throws_an_earlier_plan_is_not_said_to_wiggle() {
        let mut progress = Progress::default();
        let results = Results {
            plan: true,
            ..Results::default()
        };
        let mut stage = |mode, armed| progress.stage(mode, armed, results);
        assert_eq!(stage(Offline, None), Stage::BringUp);
        assert_eq!(stage(Idle, None), Stage::Settle);
        assert_eq!(stage(Streaming, Some(OperatingMode::Throw)), Stage::Throw);
        assert_eq!(stage(Idle, None), Stage::Score);
    }
}
