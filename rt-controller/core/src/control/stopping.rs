//! Which way to stop: the softest that keeps every limit from here to rest.
//!
//! Candidates are tried in order and each is run through a copy of the limiter
//! on the grid of coming cycles. A limit that holds on the whole grid also holds
//! when cycles are missed, because differences over several cycles are averages
//! of those over one.

#![allow(
    clippy::arithmetic_side_effects,
    reason = "arithmetic of floats only, which cannot overflow or panic"
)]

use super::brake::brake_with_jerk;
use super::limiter::{Allowance, Limiter};
use super::motion::Motion;
use super::phases::PhasedMotion;
use super::reaction::StopCategory;
use super::time_scaling::SlowDown;
use arm_model::{JointState, Limits};
use serde::{Deserialize, Serialize};

/// Durations of slow-downs that are tried (s).
const SLOW_S: [f64; 4] = [0.12, 0.24, 0.48, 0.96];
/// Jerks of brakes that are tried, as multiples of the limit for motions the
/// controller makes itself; the last is what a streamed trajectory may show.
const HARDER: [f64; 3] = [1.0, 2.0, 5.0];
/// Most cycles a stop may last: four seconds at 250 Hz.
const CYCLES_MAX: u32 = 1000;

/// A way to rest, from the state commanded last. RT-safe to copy.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[allow(
    clippy::large_enum_variant,
    reason = "there is one, in place: the real-time path makes no boxes"
)]
pub enum Stop {
    /// Along the path of the running motion.
    OnPath(SlowDown),
    /// Every joint by itself.
    JointSpace(PhasedMotion),
}

impl Stop {
    /// Time until rest (s).
    #[must_use]
    pub fn duration_s(&self) -> f64 {
        match self {
            Self::OnPath(slow) => slow.duration_s,
            Self::JointSpace(phases) => phases.duration_s(),
        }
    }

    /// State `t_s` after the begin; `motion` is the one that ran. RT-safe.
    #[must_use]
    pub fn state_at(&self, motion: &Motion, t_s: f64) -> JointState {
        match self {
            Self::OnPath(slow) => slow.state_at(motion, t_s),
            Self::JointSpace(phases) => phases.state_at(t_s),
        }
    }

    /// How it goes.
    #[must_use]
    pub const fn path(&self) -> StopCategory {
        match self {
            Self::OnPath(_) => StopCategory::OnPath,
            Self::JointSpace(_) => StopCategory::JointSpace,
        }
    }
}

/// Where a stop begins: what was commanded last, on which motion and where.
#[derive(Debug, Clone, Copy)]
pub struct StopFrom<'a> {
    /// State commanded last.
    pub state: &'a JointState,
    /// Motion that runs.
    pub motion: &'a Motion,
    /// Time on it when it was commanded (s).
    pub motion_s: f64,
    /// The limiter after that command.
    pub limiter: &'a Limiter,
    /// Tool speed allowed (m/s).
    pub tcp_speed_max_m_s: f64,
}

/// The softest stop that holds; slowing is tried first when `path` asks for it,
/// last otherwise. When nothing holds, the first brake: the limiter then ends it
/// where it breaks a limit. RT-safe.
#[must_use]
pub fn choose_stop(from: &StopFrom<'_>, path: StopCategory, limits: &Limits) -> Stop {
    let from_s = from.motion_s;
    let slow = SLOW_S.map(|duration_s| SlowDown { from_s, duration_s });
    let slow = slow.into_iter().map(Stop::OnPath);
    let brake = |jerk_max: &dyn Fn(usize) -> f64| {
        Stop::JointSpace(brake_with_jerk(from.state, limits, jerk_max))
    };
    let harder = |factor: f64| brake(&|j| limits.jerk_max_rad_s3[j] * factor);
    let hardest = || brake(&|j| limits.acceleration_max_rad_s2[j] * (1.0 / limits.period_s()));
    let brakes = HARDER.into_iter().map(harder);
    let brakes = brakes.chain(core::iter::once_with(hardest));
    let keeps_limits = |stop: &Stop| holds(from, stop, limits);
    let found = if path == StopCategory::OnPath {
        slow.chain(brakes).find(keeps_limits)
    } else {
        brakes.chain(slow).find(keeps_limits)
    };
    found.unwrap_or_else(|| harder(1.0))
}

/// Whether a stop keeps every limit on the grid of coming cycles.
fn holds(from: &StopFrom<'_>, stop: &Stop, limits: &Limits) -> bool {
    let mut limiter = *from.limiter;
    let period_s = limits.period_s();
    let allowed = Allowance {
        tcp_speed_max_m_s: from.tcp_speed_max_m_s,
        streamed: true,
    };
    for cycle in 1..=CYCLES_MAX {
        let t_s = f64::from(cycle) * period_s;
        let state = stop.state_at(from.motion, t_s);
        if limiter.admit(&state.q, period_s, limits, &allowed).is_err() {
            return false;
        }
        if t_s > stop.duration_s() + 2.0 * period_s {
            return true;
        }
    }
    false
}
