//! The batch of a call: which rollouts it needs and what becomes of them.

use super::direction::Difference;
use super::slopes::{Doubt, Neighbours, Sensitivity};
use super::{Family, SensitivityError};
use crate::base_path::steps_between_jumps;
use crate::batch::roll_out_in;
use crate::error::SimulateError;
use crate::rollout::{Candidate, Outcome, Precision, Rollout, SimOptions, check};
use crate::scene::Scene;
use shared_types::RopeParams;
use std::ops::Range;

/// Joint angle beyond which the model's torque may flip (rad).
const ILL_POSED_RAD: f64 = 2.6;
/// Step lengths tried, relative to the one asked for, until motions whose jump times
/// differ a little are cut into equally many steps.
const STEP_FACTORS: [f64; 5] = [1.0, 0.98, 0.95, 0.91, 0.86];

/// One rollout of the batch.
pub(super) struct Member<'a> {
    rope: RopeParams,
    /// Its base with the varied motion in place; the rope is `rope`.
    base: Candidate<'a>,
    family: usize,
    /// `None` for the base itself.
    direction: Option<usize>,
    /// Signed distance from the base.
    offset: f64,
}

impl Member<'_> {
    fn candidate(&self) -> Candidate<'_> {
        Candidate {
            rope: &self.rope,
            ..self.base
        }
    }

    /// An error of this member alone, in the caller's terms.
    fn blame(&self, error: SimulateError) -> SensitivityError {
        let source = error.of_candidate(self.family);
        match self.direction {
            Some(direction) => SensitivityError::Neighbour { direction, source },
            None => SensitivityError::Base(source),
        }
    }
}

/// Where the members of one family lie: the base first, then one or two neighbours per
/// direction.
pub(super) struct FamilyPlan {
    pub(super) first: usize,
    /// Neighbours of each direction, 1 or 2.
    counts: Vec<usize>,
}

impl FamilyPlan {
    /// Indices of its members.
    pub(super) fn members(&self) -> Range<usize> {
        self.first..self.first + 1 + self.counts.iter().sum::<usize>()
    }

    /// Puts the base's rollout and those of its neighbours, next in `rollouts`, together.
    pub(super) fn collect(
        &self,
        members: &[Member],
        base: Rollout,
        rollouts: &mut impl Iterator<Item = Rollout>,
    ) -> Sensitivity {
        let base_member = &members[self.first];
        let mut beside = members[self.first + 1..self.members().end]
            .iter()
            .zip(rollouts);
        let neighbours = self.counts.iter().filter_map(|count| {
            let (to_member, to) = beside.next()?;
            let (from_member, from) = match count {
                1 => (base_member, None),
                _ => beside.next().map(|(m, r)| (m, Some(r)))?,
            };
            let members = [base_member, to_member, from_member];
            Some(Neighbours {
                doubt: doubt(members, [&base, &to, from.as_ref().unwrap_or(&base)]),
                span: to_member.offset - from_member.offset,
                to,
                from,
            })
        });
        let neighbours = neighbours.collect();
        Sensitivity { base, neighbours }
    }
}

/// What speaks against a slope between these.
fn doubt(members: [&Member; 3], rollouts: [&Rollout; 3]) -> Option<Doubt> {
    let scale_rules = members.map(|m| scale_rules(&m.rope));
    if !rollouts.into_iter().all(is_comparable) {
        Some(Doubt::Diverged)
    } else if rollouts
        .iter()
        .any(|r| r.max_joint_angle_rad > ILL_POSED_RAD)
    {
        Some(Doubt::IllPosed)
    } else if scale_rules.contains(&!scale_rules[0]) {
        Some(Doubt::InertiaKink)
    } else {
        None
    }
}

/// Whether the extra scale, not the rope's radius, rules the link inertia.
fn scale_rules(rope: &RopeParams) -> bool {
    rope.link_extra_scale * rope.link_length_m() / 2.0 > rope.radius_m
}

/// Whether a rollout took the steps it was given.
pub(super) fn is_comparable(rollout: &Rollout) -> bool {
    rollout.outcome == Outcome::Clean
}

/// All rollouts of a call.
pub(super) struct Plan<'a> {
    pub(super) members: Vec<Member<'a>>,
    pub(super) families: Vec<FamilyPlan>,
}

impl<'a> Plan<'a> {
    /// Every base followed by its neighbours.
    pub(super) fn new(
        families: &[Family<'a>],
        difference: Difference,
        precision: Precision,
    ) -> Result<Self, SensitivityError> {
        let mut plan = Self {
            members: Vec::new(),
            families: Vec::with_capacity(families.len()),
        };
        for (family, Family { base, directions }) in families.iter().enumerate() {
            let first = plan.members.len();
            plan.members.push(Member {
                rope: *base.rope,
                base: *base,
                family,
                direction: None,
                offset: 0.0,
            });
            let mut counts = Vec::with_capacity(directions.len());
            for (index, direction) in directions.iter().enumerate() {
                let (to, from) = direction
                    .variants(base, difference, precision)
                    .map_err(|e| e.at(family, index))?;
                counts.push(1 + usize::from(from.is_some()));
                let variants = [Some(to), from].into_iter().flatten();
                plan.members.extend(variants.map(|v| Member {
                    rope: v.rope,
                    base: Candidate {
                        motion: v.motion,
                        ..*base
                    },
                    family,
                    direction: Some(index),
                    offset: v.offset,
                }));
            }
            plan.families.push(FamilyPlan { first, counts });
        }
        Ok(plan)
    }

    /// Refuses neighbours that cannot be simulated, by name.
    pub(super) fn check(&self, options: &SimOptions) -> Result<(), SensitivityError> {
        for member in &self.members {
            check(&[member.candidate()], options).map_err(|e| member.blame(e))?;
        }
        Ok(())
    }

    /// Simulates the members with these indices in steps of at most
    /// [`SimOptions::step_s`].
    pub(super) fn run(
        &self,
        scene: &Scene,
        indices: &[usize],
        options: &SimOptions,
    ) -> Result<Vec<Rollout>, SensitivityError> {
        let options = SimOptions {
            step_s: self.common_step_s(options)?,
            ..*options
        };
        let candidates: Vec<Candidate> = indices
            .iter()
            .map(|i| self.members[*i].candidate())
            .collect();
        roll_out_in(scene, &candidates, &options).map_err(|error| {
            match error.candidate().and_then(|c| indices.get(c)) {
                Some(index) => self.members[*index].blame(error),
                None => SensitivityError::Base(error),
            }
        })
    }

    /// The longest step tried with which every neighbour takes as many steps between
    /// its jumps as its base (s).
    fn common_step_s(&self, options: &SimOptions) -> Result<f64, SensitivityError> {
        let mut different = None;
        for factor in STEP_FACTORS {
            let step_s = factor * options.step_s;
            different = self.stepped_differently(step_s, options.horizon_s);
            if different.is_none() {
                return Ok(step_s);
            }
        }
        let (base, direction) = different.unwrap_or_default();
        Err(SensitivityError::SteppedDifferently { base, direction })
    }

    /// First family and direction whose neighbour would not step like its base.
    fn stepped_differently(&self, step_s: f64, horizon_s: f64) -> Option<(usize, usize)> {
        self.families
            .iter()
            .enumerate()
            .find_map(|(index, family)| {
                let base = self.members[family.first].base.motion;
                let steps = steps_between_jumps(base, step_s, horizon_s);
                self.members[family.members()].iter().find_map(|member| {
                    let motion = member.base.motion;
                    let differs = !core::ptr::addr_eq(motion, base)
                        && steps_between_jumps(motion, step_s, horizon_s) != steps;
                    member.direction.filter(|_| differs).map(|d| (index, d))
                })
            })
    }
}
