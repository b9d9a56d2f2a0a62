//! Draping: the rope comes to hang over a wall.
//!
//! The paper's fitness (appendix, draping) wants the tip to pass over the edge and then
//! near a point half a rope below it, without a high arc. Ours adds where the rope is at
//! the end: its middle on the edge, its tip below it on the far side, at rest.

use super::pole_pose::PolePose;
use super::{ThrowConfig, ThrowOutcome, ThrowTask, verdict};
use crate::OutOfRange;
use arm_model::Cell;
use nalgebra::Vector3;
use rope_sim::{BoxRegion, Scene, TaskFrame, Watch};
use serde::{Deserialize, Serialize};
use shared_types::{RopeParams, Task, Verdict};

/// The condition that no camera sees.
pub(super) const TOUCHED: &str = "rope touched the wall";
/// Time before the end in which the rope must rest (s).
const REST_S: f64 = 1.0;
/// Movements allowed in it: of the tip's height, and of the rope's middle (m).
const TIP_HEIGHT_M: f64 = 0.05;
const MIDDLE_M: f64 = 0.03;
/// Height above the edge at which the tip should pass (m).
const PASS_ABOVE_M: f64 = 0.06;
/// Size of the region beyond the wall: larger than any rope (m).
const FAR_M: f64 = 3.0;

/// What is tuned about drapes.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct DrapeConfig {
    /// What all tasks have.
    pub throw: ThrowConfig,
    /// Height above the wall beyond which an arc costs (m).
    pub arc_height_m: f64,
    /// Of the height beyond it (1/m).
    pub arc_per_m: f64,
    /// Of the distance of the tip from where it should hang at the end (1/m).
    pub tip_per_m: f64,
    /// Of the distance of the rope's middle from the edge at the end (1/m).
    pub middle_per_m: f64,
    /// Of movement within the last second (1/m).
    pub moving_per_m: f64,
    /// Of each condition of success that is not met.
    pub condition: f64,
}

impl Default for DrapeConfig {
    fn default() -> Self {
        Self {
            throw: ThrowConfig {
                generations: 15,
                waypoint_times_s: [0.8, 1.4, 2.1],
                std_dev_rad: [0.1, 0.2, 0.1, 0.2, 0.1, 0.3, 0.1],
                tail_s: 2.5,
                observed_s: 4.0,
                contact_tail_s: 0.7,
                contact_period_s: 0.025,
                stop_success_fraction: Some(0.5),
                ..ThrowConfig::default()
            },
            arc_height_m: 0.6,
            arc_per_m: 1.0,
            tip_per_m: 0.5,
            middle_per_m: 3.0,
            moving_per_m: 0.5,
            condition: 0.3,
        }
    }
}

impl DrapeConfig {
    /// Refuses numbers of its own that are not finite.
    pub(super) fn check(&self) -> Result<(), OutOfRange> {
        OutOfRange::unless_finite(&[
            ("arc_height_m", self.arc_height_m),
            ("arc_per_m", self.arc_per_m),
            ("tip_per_m", self.tip_per_m),
            ("middle_per_m", self.middle_per_m),
            ("moving_per_m", self.moving_per_m),
            ("condition", self.condition),
        ])
    }
}

/// A drape over a wall.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Drape {
    /// Middle of the wall's upper edge (m).
    pub target_m: [f64; 3],
    /// Tuned values.
    pub config: DrapeConfig,
}

/// Movement of a rope at rest that is not measured: it counts as moving (m).
const UNKNOWN_M: f64 = 1.0;

impl Drape {
    fn place(&self) -> TaskFrame {
        TaskFrame::at(self.target_m)
    }

    /// Where the tip hangs when the rope's middle is on the edge (m).
    fn hanging(&self, rope: &RopeParams, cell: &Cell) -> [f64; 3] {
        let beyond = cell.wall.size_m[0] / 2.0 + rope.lead_radius_m;
        self.place().point([beyond, 0.0, -rope.length_m / 2.0])
    }

    fn middle_m(&self, outcome: &ThrowOutcome) -> f64 {
        outcome.watched.rest.map_or(UNKNOWN_M, |rest| {
            (Vector3::from(rest.middle_m) - Vector3::from(self.target_m)).norm()
        })
    }

    /// The conditions of success, by name.
    fn conditions(&self, outcome: &ThrowOutcome) -> [(&'static str, bool); 4] {
        let beyond_s = outcome.watched.dwell.and_then(|d| d.inside_since_s);
        let rest = outcome.watched.rest;
        let stays = beyond_s.is_some_and(|since_s| outcome.end_s - since_s >= REST_S);
        let still = rest.is_some_and(|r| {
            r.tip_height_spread_m < TIP_HEIGHT_M && r.middle_movement_m < MIDDLE_M
        });
        [
            ("cleared", beyond_s.is_some()),
            ("at rest", stays && still),
            (
                "tip below the top",
                rest.is_some_and(|r| r.tip_m[2] < self.target_m[2]),
            ),
            (
                TOUCHED,
                outcome.obstacles.first().is_some_and(|wall| wall.touched()),
            ),
        ]
    }
}

impl ThrowTask for Drape {
    fn target_m(&self) -> [f64; 3] {
        self.target_m
    }

    fn config(&self) -> &ThrowConfig {
        &self.config.throw
    }

    fn scene(&self, cell: &Cell) -> Scene {
        Scene::of_task(Task::Drape, self.target_m, cell)
    }

    fn watch(&self, rope: &RopeParams, cell: &Cell) -> Watch {
        let place = self.place();
        let hanging = self.hanging(rope, cell);
        let [thickness_m, width_m, _] = cell.wall.size_m;
        Watch {
            point_m: Some(place.point([0.0, 0.0, PASS_ABOVE_M])),
            segment_m: Some([hanging, hanging]),
            dwell_in: Some(BoxRegion {
                center_m: place.point([thickness_m / 2.0 + FAR_M, 0.0, 0.0]),
                half_m: [FAR_M, width_m / 2.0, FAR_M],
                yaw_rad: place.bearing_rad,
            }),
            height: true,
            rest_window_s: Some(REST_S),
        }
    }

    /// Up and back, forth over the wall, then down before it.
    fn warm_start(&self, rope: &RopeParams) -> Vec<PolePose> {
        let l = rope.length_m;
        let poses = [
            [-0.25, 0.7 * l, 0.5],
            [0.08, 0.95 * l, 1.3],
            [-0.10, 0.40 * l, 1.0],
        ];
        PolePose::beside(self.target_m, poses).into()
    }

    fn fitness(&self, _: &RopeParams, outcome: &ThrowOutcome) -> f64 {
        let c = &self.config;
        let watched = &outcome.watched;
        let hang_m = watched.to_segment.map_or(UNKNOWN_M, |s| s.distance_m);
        let highest_m = watched.highest_m.unwrap_or(0.0);
        let arc_m = (highest_m - self.target_m[2] - c.arc_height_m).max(0.0);
        let (tip_m, moving_m) = watched.rest.map_or((UNKNOWN_M, UNKNOWN_M), |r| {
            let hanging = Vector3::from(outcome.segment_m[0]);
            (
                (Vector3::from(r.tip_m) - hanging).norm(),
                r.tip_height_spread_m + r.middle_movement_m,
            )
        });
        let missing = self.conditions(outcome).iter().filter(|c| !c.1).count();
        let missing = missing as f64;
        c.throw.weights.distance_per_m * (outcome.closest_m + hang_m)
            + c.arc_per_m * arc_m
            + c.tip_per_m * tip_m
            + c.middle_per_m * self.middle_m(outcome)
            + c.moving_per_m * moving_m.min(0.3)
            + c.condition * missing
    }

    fn error_m(&self, outcome: &ThrowOutcome) -> f64 {
        self.middle_m(outcome)
    }

    fn judge(&self, _: &RopeParams, outcome: &ThrowOutcome) -> Verdict {
        verdict(self.conditions(outcome))
    }
}
