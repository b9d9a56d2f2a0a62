//! Slopes read off a base and its neighbours.

use crate::frames::NodeTrack;
use crate::rollout::{Outcome, Rollout};
use crate::watch::LinkState;
use nalgebra::{Quaternion, UnitQuaternion, Vector3};

/// Largest difference between the times of two closest approaches for them to be the
/// same one (s); beyond it a neighbour passes the target on another part of its way.
const SAME_APPROACH_S: f64 = 0.01;

/// Why a slope is not to be relied on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Doubt {
    /// Base or neighbour blew up even in smaller steps: there is no slope.
    Diverged,
    /// A joint came near half a turn, where the model's torque flips.
    IllPosed,
    /// Base and neighbours lie on different sides of the kink of the link inertia
    /// `R_I = max(e s/2, r)`.
    InertiaKink,
}

/// The neighbours of a base in one direction.
#[derive(Debug, Clone, PartialEq)]
pub struct Neighbours {
    /// Rollout of the neighbour slopes are taken to.
    pub to: Rollout,
    /// Rollout they are taken from; `None` if that is the base.
    pub from: Option<Rollout>,
    /// Distance from `from` to `to` in the direction's unit; negative if the only
    /// neighbour within physical bounds lies towards smaller values.
    pub span: f64,
    /// Why not to rely on it.
    pub doubt: Option<Doubt>,
}

/// A base with its neighbours in every direction, all simulated in the same steps.
#[derive(Debug, Clone, PartialEq)]
pub struct Sensitivity {
    /// The base itself. [`Outcome::RerunAtQuarterStep`] means that it or a neighbour
    /// blew up at first, and that all of them took steps of a quarter.
    pub base: Rollout,
    /// Its neighbours, one entry per direction.
    pub neighbours: Vec<Neighbours>,
}

/// Slope of a closest approach per unit of a direction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ApproachSlope {
    /// Of the distance (m per unit).
    pub distance_m: f64,
    /// Of its time (s per unit).
    pub time_s: f64,
    /// Of the lead's place at its own closest approach (m per unit).
    pub tip_m: [f64; 3],
    /// Of the lead's velocity there (m/s per unit).
    pub velocity_m_s: [f64; 3],
}

/// Slope of one link's final state per unit of a direction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LinkSlope {
    /// Rotation vector (rad per unit, world).
    pub turn_rad: [f64; 3],
    /// Of the angular velocity (rad/s per unit, world).
    pub w_rad_s: [f64; 3],
}

impl Sensitivity {
    /// Slopes of anything that can be read off a rollout, one row per direction, or
    /// `None` there after [`Doubt::Diverged`]. `observe` must give equally many numbers
    /// for each rollout.
    #[must_use]
    pub fn slopes(&self, observe: impl Fn(&Rollout) -> Vec<f64>) -> Vec<Option<Vec<f64>>> {
        let needs_base = self.neighbours.iter().any(|n| n.from.is_none());
        let base = if needs_base {
            observe(&self.base)
        } else {
            Vec::new()
        };
        let slope = |n: &Neighbours| {
            let to = observe(&n.to);
            let between = |from: &[f64]| {
                let pairs = to.iter().zip(from);
                pairs.map(|(b, a)| (b - a) / n.span).collect::<Vec<f64>>()
            };
            match &n.from {
                Some(from) => between(&observe(from)),
                None => between(&base),
            }
        };
        self.neighbours
            .iter()
            .map(|n| (n.doubt != Some(Doubt::Diverged)).then(|| slope(n)))
            .collect()
    }

    /// Slopes of all node positions in all frames (m per unit), in one direction;
    /// `None` without such a direction or after [`Doubt::Diverged`].
    #[must_use]
    pub fn nodes(&self, direction: usize) -> Option<NodeTrack> {
        let (to, from, span) = self.ends(direction)?;
        let [frames, nodes, _] = to.nodes.shape();
        let mut out = NodeTrack::zeros(frames, nodes, false);
        for frame in 0..frames {
            for node in 0..nodes {
                let d = to.nodes.position(frame, node) - from.nodes.position(frame, node);
                out.set(frame, node, (d / span).into());
            }
        }
        Some(out)
    }

    /// Slope of the closest approach to [`crate::Watch::point_m`]; `None` if it was not
    /// watched, after [`Doubt::Diverged`], or if a neighbour comes closest at quite
    /// another time, so that there is no slope.
    #[must_use]
    pub fn closest(&self, direction: usize) -> Option<ApproachSlope> {
        let (to, from, span) = self.ends(direction)?;
        let base_s = self.base.watched.to_point?.time_s;
        let (b, a) = (to.watched.to_point?, from.watched.to_point?);
        let is_same = |time_s: f64| (time_s - base_s).abs() < SAME_APPROACH_S;
        let slope = |b: [f64; 3], a: [f64; 3]| core::array::from_fn(|i| (b[i] - a[i]) / span);
        (is_same(a.time_s) && is_same(b.time_s)).then(|| ApproachSlope {
            distance_m: (b.distance_m - a.distance_m) / span,
            time_s: (b.time_s - a.time_s) / span,
            tip_m: slope(b.tip_m, a.tip_m),
            velocity_m_s: slope(b.velocity_m_s, a.velocity_m_s),
        })
    }

    /// Slopes of the final state of every link; `None` if
    /// [`crate::Watch::final_state`] was not asked for or after [`Doubt::Diverged`].
    #[must_use]
    pub fn final_state(&self, direction: usize) -> Option<Vec<LinkSlope>> {
        let (to, from, span) = self.ends(direction)?;
        let (b, a) = (
            to.watched.final_state.as_ref()?,
            from.watched.final_state.as_ref()?,
        );
        Some(b.iter().zip(a).map(|(b, a)| b.slope(a, span)).collect())
    }

    /// Notes that everything took steps of a quarter.
    pub(super) fn mark_repeated(&mut self) {
        let beside = self.neighbours.iter_mut();
        let beside = beside.flat_map(|n| core::iter::once(&mut n.to).chain(&mut n.from));
        for rollout in core::iter::once(&mut self.base).chain(beside) {
            if rollout.outcome == Outcome::Clean {
                rollout.outcome = Outcome::RerunAtQuarterStep;
            }
        }
    }

    fn ends(&self, direction: usize) -> Option<(&Rollout, &Rollout, f64)> {
        let n = self.neighbours.get(direction)?;
        let from = n.from.as_ref().unwrap_or(&self.base);
        (n.doubt != Some(Doubt::Diverged)).then_some((&n.to, from, n.span))
    }
}

impl LinkState {
    /// Slope from `from` to this state, `span` apart.
    fn slope(&self, from: &Self, span: f64) -> LinkSlope {
        let attitude =
            |[w, x, y, z]: [f64; 4]| UnitQuaternion::new_normalize(Quaternion::new(w, x, y, z));
        let turn = attitude(self.q_wxyz) * attitude(from.q_wxyz).inverse();
        let spin = Vector3::from(self.w_rad_s) - Vector3::from(from.w_rad_s);
        LinkSlope {
            turn_rad: (turn.scaled_axis() / span).into(),
            w_rad_s: (spin / span).into(),
        }
    }
}
