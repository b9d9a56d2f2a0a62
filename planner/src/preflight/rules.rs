//! The rules of the arm, one by one.

use arm_model::capsules::self_clearance_m;
use arm_model::limits::STEP_MAX_M;
use arm_model::{JOINTS, JointVector, Limits};
use control_core::control::Thresholds;
use nalgebra::Vector3;
use serde::Serialize;
use shared_types::CommandInterface;

/// How far outside its range a streamed position is still taken (rad): 0.1 deg, as the
/// vendor's SDK tests it.
const RANGE_TOLERANCE_RAD: f64 = core::f64::consts::PI / 1800.0;
/// Part by which a speed may exceed its limit before the arm stops: positions are
/// rounded on the wire, and the arm's clock is not ours.
const SPEED_SLACK: f64 = 1e-3;
/// How far joints may be from where the model of the arm has them when velocities are sent
/// (rad), what that may take from the gap between links and move the tool (m). The arm's
/// clock is not ours, so a ramp may begin a cycle later.
const VELOCITY_STRAY_RAD: f64 = 0.004;
const VELOCITY_GAP_M: f64 = 0.0015;
const VELOCITY_STRAY_M: f64 = 0.004;
/// What of the controller's largest tracking error a plan may use by velocities.
const DEVIATION_FRACTION: f64 = 0.92;

/// One cycle as it is judged.
#[derive(Debug, Clone, Copy)]
pub(super) struct Step {
    /// Setpoint of the cycle before (rad).
    pub(super) before: JointVector,
    /// Setpoint (rad).
    pub(super) setpoint: JointVector,
    /// Where the arm has its joints (rad).
    pub(super) q: JointVector,
    /// How far they are from what was asked of them, which the controller stops for (rad).
    pub(super) deviation_rad: f64,
}

impl Step {
    /// Joints that are where they are asked to be.
    pub(super) fn at(setpoint: JointVector) -> Self {
        Self {
            before: setpoint,
            setpoint,
            q: setpoint,
            deviation_rad: 0.0,
        }
    }
}

/// A box that the tool must stay in, as the arm's safety boundary.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Fence {
    /// Smallest coordinates (m).
    pub min_m: [f64; 3],
    /// Largest coordinates (m).
    pub max_m: [f64; 3],
}

/// A box without an inside.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("the safety boundary needs its lower side below its upper one in {0}")]
pub struct FenceError(String);

impl Fence {
    /// From x-, x+, y-, y+, z-, z+ (m).
    ///
    /// # Errors
    /// A side that is not finite, or not below its partner.
    pub fn new(sides_m: [f64; 6]) -> Result<Self, FenceError> {
        let [x0, x1, y0, y1, z0, z1] = sides_m;
        for (axis, low, high) in [('x', x0, x1), ('y', y0, y1), ('z', z0, z1)] {
            if !(low.is_finite() && high.is_finite() && low < high) {
                return Err(FenceError(format!("{axis}, found {low} and {high} m")));
            }
        }
        Ok(Self {
            min_m: [x0, y0, z0],
            max_m: [x1, y1, z1],
        })
    }

    /// Distance to the nearest side, negative outside (m).
    fn inside_m(&self, p: &Vector3<f64>) -> f64 {
        let low = p - Vector3::from(self.min_m);
        let high = Vector3::from(self.max_m) - p;
        low.inf(&high).min()
    }
}

/// What an arm judges by.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct JudgedArm {
    /// How setpoints reach it.
    pub interface: CommandInterface,
    /// Linear speed limit of servo mode, the factor of 1 m/s set in the arm.
    pub speed_factor: f64,
    /// Safety boundary, if one is set.
    pub fence: Option<Fence>,
}

impl Default for JudgedArm {
    /// As delivered: positions, factor 1.2, no boundary.
    fn default() -> Self {
        Self {
            interface: CommandInterface::ServoPosition,
            speed_factor: 1.2,
            fence: None,
        }
    }
}

/// One rule.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Rule {
    /// Joints outside their range (rad).
    JointRange,
    /// Speed of the fastest joint (rad/s).
    JointSpeed,
    /// Speed of the tool (m/s).
    ToolSpeed,
    /// Gap between links two or more apart (m).
    SelfCollision,
    /// Distance of the tool to the safety boundary (m).
    SafetyBoundary,
    /// Way of the tool in one cycle (m).
    StepLength,
    /// Joints off the plan, more than their delay explains (rad); by velocities only.
    Tracking,
}

impl Rule {
    const fn facts(self) -> (Option<u8>, &'static str, &'static str) {
        match self {
            Self::JointRange => (Some(23), "joint outside its range", "rad"),
            Self::JointSpeed => (Some(24), "joint speed of setpoints", "rad/s"),
            Self::ToolSpeed => (Some(60), "tool speed of setpoints", "m/s"),
            Self::SelfCollision => (Some(22), "gap between links", "m"),
            Self::SafetyBoundary => (Some(35), "tool inside the boundary", "m"),
            Self::StepLength => (None, "tool step per cycle", "m"),
            Self::Tracking => (None, "joints off the plan", "rad"),
        }
    }

    /// The arm's error code; none where the controller is the one to stop.
    #[must_use]
    pub const fn code(self) -> Option<u8> {
        self.facts().0
    }

    /// In words.
    #[must_use]
    pub const fn name(self) -> &'static str {
        self.facts().1
    }

    /// Unit of its value.
    #[must_use]
    pub const fn unit(self) -> &'static str {
        self.facts().2
    }

    /// Whether small values break it.
    fn is_least(self) -> bool {
        matches!(self, Self::SelfCollision | Self::SafetyBoundary)
    }

    /// Its value in one cycle.
    pub(super) fn value(self, step: &Step, limits: &Limits, arm: &JudgedArm) -> f64 {
        let Step {
            before,
            setpoint,
            q,
            deviation_rad,
        } = step;
        let way_m =
            || (limits.tool_centre_point_m(setpoint) - limits.tool_centre_point_m(before)).norm();
        match self {
            Self::JointRange => (0..JOINTS)
                .map(|j| {
                    let below = limits.position_min_rad[j] - q[j];
                    below.max(q[j] - limits.position_max_rad[j])
                })
                .fold(f64::NEG_INFINITY, f64::max),
            // Where joints differ, the one with the least left counts.
            Self::JointSpeed => {
                let speed = |j: usize| (setpoint[j] - before[j]).abs() / limits.period_s();
                let part = |j: usize| speed(j) / limits.velocity_max_rad_s[j];
                let worst = (0..JOINTS).max_by(|a, b| part(*a).total_cmp(&part(*b)));
                worst.map_or(0.0, |j| part(j) * limits.velocity_max_rad_s[0])
            }
            Self::ToolSpeed => way_m() / limits.period_s(),
            Self::StepLength => way_m(),
            Self::SelfCollision => self_clearance_m(q),
            Self::SafetyBoundary => arm.fence.map_or(f64::INFINITY, |f| {
                f.inside_m(&limits.tool_centre_point_m(q))
            }),
            Self::Tracking => *deviation_rad,
        }
    }
}

/// How close the setpoints come to one rule.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct RuleMargin {
    /// Which.
    pub rule: Rule,
    /// Extreme value, in the rule's unit.
    pub value: f64,
    /// The value at which the arm stops.
    pub limit: f64,
    /// When the extreme occurs (s).
    pub time_s: f64,
    /// When the rule is first broken (s).
    pub broken_s: Option<f64>,
}

impl RuleMargin {
    fn new(rule: Rule, limit: f64) -> Self {
        Self {
            rule,
            value: if rule.is_least() {
                f64::INFINITY
            } else {
                f64::NEG_INFINITY
            },
            limit,
            time_s: 0.0,
            broken_s: None,
        }
    }

    pub(super) fn meet(&mut self, value: f64, time_s: f64) {
        let least = self.rule.is_least();
        let worse_than = |other: f64| if least { value < other } else { value > other };
        if worse_than(self.value) {
            (self.value, self.time_s) = (value, time_s);
        }
        if worse_than(self.limit) || value.is_nan() {
            self.broken_s.get_or_insert(time_s);
        }
    }

    /// What is left until the arm stops, in the rule's unit; negative when it does.
    #[must_use]
    pub fn left(&self) -> f64 {
        if self.rule.is_least() {
            self.value - self.limit
        } else {
            self.limit - self.value
        }
    }

    /// One line for people.
    #[must_use]
    pub fn describe(&self) -> String {
        let unit = self.rule.unit();
        format!(
            "{} {:.4} {unit} against {:.4} {unit} at {:.3} s",
            self.rule.name(),
            self.value,
            self.limit,
            self.broken_s.unwrap_or(self.time_s)
        )
    }
}

impl JudgedArm {
    /// The rules of its mode, in the order in which it looks at them.
    pub(super) fn rules(&self, limits: &Limits) -> Vec<RuleMargin> {
        let margin = RuleMargin::new;
        let speed = 1.0 + SPEED_SLACK;
        let joint_speed = limits.velocity_max_rad_s[0] * speed;
        let deviation_rad = DEVIATION_FRACTION * Thresholds::strict().tracking_error_max_rad;
        // The controller looks before the arm does.
        let mut out = vec![margin(Rule::StepLength, STEP_MAX_M)];
        let stray_m = match self.interface {
            CommandInterface::ServoPosition => {
                out.extend([
                    margin(Rule::JointRange, RANGE_TOLERANCE_RAD),
                    margin(Rule::JointSpeed, joint_speed),
                    margin(Rule::ToolSpeed, self.speed_factor * speed),
                    margin(Rule::SelfCollision, 0.0),
                ]);
                0.0
            }
            // Speeds are limited before they are sent; where the joints go is not quite
            // where the plan goes.
            CommandInterface::JointVelocity => {
                out.extend([
                    margin(Rule::JointRange, -VELOCITY_STRAY_RAD),
                    margin(Rule::SelfCollision, VELOCITY_GAP_M),
                    margin(Rule::Tracking, deviation_rad),
                ]);
                VELOCITY_STRAY_M
            }
        };
        if self.fence.is_some() {
            out.push(margin(Rule::SafetyBoundary, stray_m));
        }
        out
    }
}
