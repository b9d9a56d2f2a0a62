//! A rope on a motion with its neighbours, and why there are no slopes around it.

use crate::base_path::steps_between_jumps;
use crate::error::SimulateError;
use crate::motion::AttachMotion;
use crate::rollout::Candidate;
use shared_types::RopeParams;
use shared_types::rope_state::Sway;

/// Step lengths tried, relative to the one asked for, until motions whose jump times
/// differ a little are cut into equally many steps.
const STEP_FACTORS: [f64; 5] = [1.0, 0.98, 0.95, 0.91, 0.86];

/// What takes the place of the base's rope or motion, and how far away it is, in the unit
/// in which slopes are wanted.
#[derive(Debug, Clone, Copy)]
pub enum Perturbation<'a> {
    /// Another rope of the same link count.
    Rope {
        /// The rope.
        rope: RopeParams,
        /// Its distance from the base's; positive.
        distance: f64,
    },
    /// Another swing at the start.
    Sway {
        /// The swing.
        sway: Sway,
        /// Its distance from the base's; positive.
        distance: f64,
    },
    /// Another attach motion, such as that of a moved waypoint.
    Motion {
        /// The motion.
        motion: &'a dyn AttachMotion,
        /// Its distance from the base's; positive.
        distance: f64,
    },
}

/// A candidate and its neighbours.
#[derive(Debug, Clone, Copy)]
pub struct Family<'a> {
    /// Where slopes are wanted.
    pub base: Candidate<'a>,
    /// Towards what.
    pub perturbations: &'a [Perturbation<'a>],
}

/// Why there are no slopes. Bases and neighbours are counted from 0.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum SensitivityError {
    /// A neighbour that has no slope.
    #[error("base {base}, neighbour {neighbour}: {reason}")]
    NoSlope {
        /// Index of the base.
        base: usize,
        /// Index of its neighbour.
        neighbour: usize,
        /// Why not, and what to do.
        reason: String,
    },
    /// A base, named as `candidate`, or an option cannot be simulated.
    #[error(transparent)]
    Base(#[from] SimulateError),
    /// A neighbour cannot be simulated.
    #[error("neighbour {neighbour} of a base: {source}")]
    Neighbour {
        /// Index of the neighbour.
        neighbour: usize,
        /// What is wrong; its `candidate` is the index of the base.
        source: SimulateError,
    },
}

/// One rollout of a batch of families.
pub(super) struct Member<'a> {
    pub(super) candidate: Candidate<'a>,
    /// Index of its family.
    pub(super) family: usize,
    /// Index and distance from the base; `None` for the base itself.
    pub(super) neighbour: Option<(usize, f64)>,
}

impl<'a> Family<'a> {
    /// The base, then its neighbours.
    pub(super) fn members(&self, family: usize) -> Result<Vec<Member<'a>>, SensitivityError> {
        let base = self.base;
        let mut members = vec![Member {
            candidate: base,
            family,
            neighbour: None,
        }];
        for (index, perturbation) in self.perturbations.iter().enumerate() {
            let (candidate, distance) = match perturbation {
                Perturbation::Rope { rope, distance } => (Candidate { rope, ..base }, *distance),
                Perturbation::Sway { sway, distance } => (base.with_sway(*sway), *distance),
                Perturbation::Motion { motion, distance } => (
                    Candidate {
                        motion: *motion,
                        ..base
                    },
                    *distance,
                ),
            };
            let member = Member {
                candidate,
                family,
                neighbour: Some((index, distance)),
            };
            if candidate.rope.links != base.rope.links {
                return Err(member.no_slope(
                    "the number of links is discrete and has no slope; compare rollouts of both \
                     counts instead",
                ));
            }
            if !(distance.is_finite() && distance > 0.0) {
                return Err(member.no_slope(&format!(
                    "the step is {distance}, but must be finite and above 0"
                )));
            }
            members.push(member);
        }
        Ok(members)
    }
}

impl Member<'_> {
    fn no_slope(&self, reason: &str) -> SensitivityError {
        SensitivityError::NoSlope {
            base: self.family,
            neighbour: self.neighbour.unwrap_or_default().0,
            reason: reason.to_owned(),
        }
    }

    /// An error of this member alone, in the caller's terms.
    pub(super) fn blame(&self, mut source: SimulateError) -> SensitivityError {
        source.candidate = Some(self.family);
        match self.neighbour {
            Some((neighbour, _)) => SensitivityError::Neighbour { neighbour, source },
            None => SensitivityError::Base(source),
        }
    }
}

/// The longest step tried with which every neighbour takes as many steps between its jumps
/// as its base (s).
pub(super) fn common_step_s(
    members: &[Member<'_>],
    step_s: f64,
    horizon_s: f64,
) -> Result<f64, SensitivityError> {
    let mut different = None;
    for factor in STEP_FACTORS {
        different = stepped_differently(members, factor * step_s, horizon_s);
        if different.is_none() {
            return Ok(factor * step_s);
        }
    }
    different.map_or(Ok(step_s), |member| {
        Err(member.no_slope(
            "the acceleration of the varied motion jumps so differently that it cannot take the \
             same steps; vary it less",
        ))
    })
}

/// First neighbour that would not step like its base.
fn stepped_differently<'m, 'a>(
    members: &'m [Member<'a>],
    step_s: f64,
    horizon_s: f64,
) -> Option<&'m Member<'a>> {
    let mut families = members.chunk_by(|a, b| a.family == b.family);
    families.find_map(|family| {
        let (base, neighbours) = family.split_first()?;
        let base = base.candidate.motion;
        let steps = steps_between_jumps(base, step_s, horizon_s);
        neighbours.iter().find(|member| {
            let motion = member.candidate.motion;
            !core::ptr::addr_eq(motion, base)
                && steps_between_jumps(motion, step_s, horizon_s) != steps
        })
    })
}
