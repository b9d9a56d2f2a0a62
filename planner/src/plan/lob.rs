//! Lobbing: the tip fells a domino on a board and comes to lie there.
//!
//! The paper's fitness (appendix, lobbing) rewards the time near the target once the tip
//! has come near it. Ours adds what success is made of, each with a slope towards it:
//! how far the domino tilts, how long the tip has lain on the board at the end, and how
//! near the target it lies then, which is what leaves room for an error of the rope.

use super::pole_pose::PolePose;
use super::{Robustness, ThrowConfig, ThrowOutcome, ThrowTask, proximity_reward, verdict};
use crate::OutOfRange;
use arm_model::Cell;
use nalgebra::Vector3;
use rope_sim::{BoxRegion, Scene, TaskFrame, Watch};
use serde::{Deserialize, Serialize};
use shared_types::{RopeParams, Task, Verdict};

/// Height above the board, less the lead's radius, up to which the tip lies on it (m).
const LIES_BELOW_M: f64 = 0.05;
/// Time for which it must lie there (s).
const STAY_S: f64 = 1.0;
/// Distance from the segment between domino and target that counts as a hit (m).
const HIT_M: f64 = 0.03;
/// Tilt at which the domino falls (rad).
const TILT_RAD: f64 = core::f64::consts::FRAC_PI_4;

/// What is tuned about lobs.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct LobConfig {
    /// What all tasks have.
    pub throw: ThrowConfig,
    /// Of a second near the target, the paper's dwell reward (1/s); counted up to a second.
    pub dwell_per_s: f64,
    /// Of a domino that stands; a tilted one counts in part.
    pub domino: f64,
    /// Of a tip that does not stay; a short stay counts in part.
    pub stay: f64,
    /// Of the distance from the target at the end (1/m).
    pub end_per_m: f64,
}

impl Default for LobConfig {
    fn default() -> Self {
        Self {
            throw: ThrowConfig {
                generations: 50,
                waypoint_times_s: [0.8, 1.4, 2.0],
                std_dev_rad: [0.1, 0.25, 0.1, 0.25, 0.1, 0.35, 0.1],
                tail_s: 1.5,
                observed_s: 3.0,
                contact_tail_s: 0.7,
                contact_period_s: 0.025,
                stop_success_fraction: Some(0.3),
                robustness: Robustness {
                    finalists: 8,
                    lead_radius: 0.1,
                    ..Robustness::default()
                },
                ..ThrowConfig::default()
            },
            dwell_per_s: 0.3,
            domino: 0.4,
            stay: 0.4,
            end_per_m: 1.0,
        }
    }
}

impl LobConfig {
    /// Refuses numbers of its own that are not finite.
    pub(super) fn check(&self) -> Result<(), OutOfRange> {
        OutOfRange::unless_finite(&[
            ("dwell_per_s", self.dwell_per_s),
            ("domino", self.domino),
            ("stay", self.stay),
            ("end_per_m", self.end_per_m),
        ])
    }
}

/// A lob onto a board.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Lob {
    /// Middle of the board's upper face (m).
    pub target_m: [f64; 3],
    /// Tuned values.
    pub config: LobConfig,
}

impl Lob {
    fn place(&self) -> TaskFrame {
        TaskFrame::at(self.target_m)
    }

    /// How long the tip has lain on the board when the simulation ends (s).
    fn stay_s(outcome: &ThrowOutcome) -> f64 {
        outcome
            .watched
            .dwell
            .and_then(|d| d.inside_since_s)
            .map_or(0.0, |since_s| outcome.end_s - since_s)
    }

    fn is_down(outcome: &ThrowOutcome) -> bool {
        outcome.domino.is_some_and(|d| d.down_at_s.is_some())
    }
}

impl ThrowTask for Lob {
    fn target_m(&self) -> [f64; 3] {
        self.target_m
    }

    fn config(&self) -> &ThrowConfig {
        &self.config.throw
    }

    fn scene(&self, cell: &Cell) -> Scene {
        Scene::of_task(Task::Lob, self.target_m, cell)
    }

    fn watch(&self, rope: &RopeParams, cell: &Cell) -> Watch {
        let place = self.place();
        let [board_x_m, board_y_m, _] = cell.board.size_m;
        let r = rope.lead_radius_m;
        let height_m = LIES_BELOW_M + r;
        Watch {
            point_m: Some(place.point([0.0, 0.0, r])),
            segment_m: Some([
                place.point([-cell.domino.before_target_m, 0.0, r]),
                place.point([0.0, 0.0, r]),
            ]),
            dwell_in: Some(BoxRegion {
                center_m: place.point([0.0, 0.0, height_m / 2.0]),
                half_m: [board_x_m / 2.0, board_y_m / 2.0, height_m / 2.0],
                yaw_rad: place.bearing_rad,
            }),
            rest_window_s: Some(STAY_S),
            ..Watch::NOTHING
        }
    }

    /// Up and back, over the board at arm's length, then down onto it.
    fn warm_start(&self, rope: &RopeParams) -> Vec<PolePose> {
        let l = rope.length_m;
        let poses = [
            [-0.35, 0.8 * l, 0.6],
            [-0.05, l + 0.10, 1.2],
            [-0.05, 0.7 * l, 0.9],
        ];
        PolePose::beside(self.target_m, poses).into()
    }

    fn fitness(&self, _: &RopeParams, outcome: &ThrowOutcome) -> f64 {
        let (c, weights) = (&self.config, &self.config.throw.weights);
        let dwell_s = outcome.watched.dwell.map_or(0.0, |d| d.total_s);
        let tilt = outcome.domino.map_or(0.0, |d| d.peak_tilt_rad.abs());
        let standing = if Self::is_down(outcome) {
            0.0
        } else {
            1.0 - 0.5 * (tilt / TILT_RAD).min(1.0)
        };
        let missing = 1.0 - (Self::stay_s(outcome) / STAY_S).min(1.0);
        let end_m = outcome.watched.rest.map_or(1.0, |rest| {
            (Vector3::from(rest.tip_m) - Vector3::from(outcome.point_m)).norm()
        });
        weights.distance_per_m * outcome.closest_m
            - weights.proximity * proximity_reward(outcome.closest_m)
            - c.dwell_per_s * dwell_s.min(STAY_S)
            + c.domino * standing
            + c.stay * missing
            + c.end_per_m * end_m
    }

    fn judge(&self, _: &RopeParams, outcome: &ThrowOutcome) -> Verdict {
        let down = Self::is_down(outcome);
        let near = outcome
            .watched
            .to_segment
            .is_some_and(|s| s.distance_m < HIT_M);
        let stay = Self::stay_s(outcome) >= STAY_S;
        let mut verdict = verdict([("domino down", down), ("stay", stay)]);
        verdict.conditions.push(shared_types::Condition {
            name: "target hit".to_owned(),
            met: down || near,
        });
        verdict
    }
}
