//! The batch of a call: which rollouts it needs.

use super::family::{Family, Perturbation, SensitivityError};
use crate::base_path::steps_between_jumps;
use crate::batch::roll_out;
use crate::error::SimulateError;
use crate::rollout::{Candidate, Rollout, SimOptions, check};
use shared_types::RopeParams;
use std::ops::Range;

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
    neighbour: Option<usize>,
    /// Distance from the base.
    pub(super) distance: f64,
}

impl<'a> Member<'a> {
    fn base(family: usize, base: &Candidate<'a>) -> Self {
        Self {
            rope: *base.rope,
            base: *base,
            family,
            neighbour: None,
            distance: 0.0,
        }
    }

    /// The neighbour with this index.
    fn perturbed(
        self,
        perturbation: &Perturbation<'a>,
        neighbour: usize,
    ) -> Result<Self, SensitivityError> {
        let base = self.family;
        let (rope, motion, distance) = match *perturbation {
            Perturbation::Rope { rope, distance } => (rope, self.base.motion, distance),
            Perturbation::Motion { motion, distance } => (self.rope, motion, distance),
        };
        if rope.links != self.rope.links {
            return Err(SensitivityError::LinksAreDiscrete { base, neighbour });
        }
        if !(distance.is_finite() && distance > 0.0) {
            return Err(SensitivityError::Distance {
                base,
                neighbour,
                value: distance,
            });
        }
        Ok(Self {
            rope,
            base: Candidate {
                motion,
                ..self.base
            },
            neighbour: Some(neighbour),
            distance,
            ..self
        })
    }

    fn candidate(&self) -> Candidate<'_> {
        Candidate {
            rope: &self.rope,
            ..self.base
        }
    }

    /// An error of this member alone, in the caller's terms.
    fn blame(&self, error: SimulateError) -> SensitivityError {
        let source = error.of_candidate(self.family);
        match self.neighbour {
            Some(neighbour) => SensitivityError::Neighbour { neighbour, source },
            None => SensitivityError::Base(source),
        }
    }
}

/// All rollouts of a call.
pub(super) struct Plan<'a> {
    pub(super) members: Vec<Member<'a>>,
    /// Where each family's members lie, the base first.
    pub(super) families: Vec<Range<usize>>,
}

impl<'a> Plan<'a> {
    /// Every base followed by its neighbours.
    pub(super) fn new(families: &[Family<'a>]) -> Result<Self, SensitivityError> {
        let mut members = Vec::new();
        let mut ranges = Vec::with_capacity(families.len());
        for (family, of) in families.iter().enumerate() {
            let first = members.len();
            members.push(Member::base(family, &of.base));
            for (neighbour, perturbation) in of.perturbations.iter().enumerate() {
                members.push(Member::base(family, &of.base).perturbed(perturbation, neighbour)?);
            }
            ranges.push(first..members.len());
        }
        Ok(Self {
            members,
            families: ranges,
        })
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
        roll_out(&candidates, &options).map_err(|error| {
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
        let (base, neighbour) = different.unwrap_or_default();
        Err(SensitivityError::SteppedDifferently { base, neighbour })
    }

    /// First family and neighbour that would not step like its base.
    fn stepped_differently(&self, step_s: f64, horizon_s: f64) -> Option<(usize, usize)> {
        self.families.iter().find_map(|family| {
            let base = self.members[family.start].base.motion;
            let steps = steps_between_jumps(base, step_s, horizon_s);
            self.members[family.clone()].iter().find_map(|member| {
                let motion = member.base.motion;
                let differs = !core::ptr::addr_eq(motion, base)
                    && steps_between_jumps(motion, step_s, horizon_s) != steps;
                let neighbour = member.neighbour.filter(|_| differs);
                neighbour.map(|neighbour| (member.family, neighbour))
            })
        })
    }
}
