//! One rope advanced as its attach frame moves: for simulated rigs.

use crate::algebra::Vec3;
use crate::clock::BaseState;
use crate::contact::{Contacts, Starting, StepEnd};
use crate::equilibrium::hanging_links;
use crate::error::SimulateError;
use crate::extras::RopeExtras;
use crate::kernel::Elimination;
use crate::lanes::{Kernel, LaneTask, Lanes};
use crate::scene::{ContactSummary, DominoOutcome, Scene, SceneError};
use crate::scheme::{Phase, Scheme, joint_resistance};
use crate::state::{Link, RopeLanes};
use crate::surroundings::Around;
use arm_model::JOINTS;
use arm_model::kinematics::FrameMotion;
use nalgebra::Vector3;
use shared_types::RopeParams;

/// What moves, at one time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MovingFrames {
    /// The attach frame.
    pub attach: FrameMotion,
    /// The arm's links 1 to 7, where obstacles are on them.
    pub arm_links: Option<[FrameMotion; JOINTS]>,
}

impl MovingFrames {
    /// An attach frame and no arm.
    #[must_use]
    pub fn attach_only(attach: FrameMotion) -> Self {
        Self {
            attach,
            arm_links: None,
        }
    }
}

/// A rope in double precision that follows its attach frame step by step. Advancing
/// it does not allocate.
pub struct LiveRope {
    params: RopeParams,
    rope: RopeLanes<f64>,
    max_step_s: f64,
    links: Vec<Link<f64>>,
    scratch: Vec<Elimination<f64>>,
    scheme: Scheme<f64>,
    phase: Phase,
    step_s: f64,
    restart: bool,
    time_s: f64,
    nodes: Vec<Vector3<f64>>,
    around: Around<f64>,
    /// Arm links that carry obstacles, and their last known motions.
    carriers: Vec<usize>,
    carried: Vec<BaseState<f64>>,
}

impl core::fmt::Debug for LiveRope {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.debug_struct("LiveRope")
            .field("time_s", &self.time_s)
            .field("nodes", &self.nodes)
            .finish_non_exhaustive()
    }
}

impl LiveRope {
    /// A rope hanging still below `attach` at time 0, advanced in steps of at most
    /// `step_s`.
    ///
    /// # Errors
    /// Parameters that are not physical, a step that is not above zero.
    pub fn new(
        rope: &RopeParams,
        attach: &FrameMotion,
        step_s: f64,
    ) -> Result<Self, SimulateError> {
        let start = MovingFrames::attach_only(*attach);
        Self::new_in(&Scene::EMPTY, rope, RopeExtras::NONE, &start, step_s)
    }

    /// [`LiveRope::new`] among obstacles and a domino, with drag or rest curvature. Use
    /// steps of at most 0.5 ms.
    ///
    /// # Errors
    /// As [`LiveRope::new`]; a scene that cannot be simulated, that the rope would start
    /// inside, or that has obstacles on an arm `start` lacks; extras out of bounds.
    pub fn new_in(
        scene: &Scene,
        rope: &RopeParams,
        extras: RopeExtras,
        start: &MovingFrames,
        step_s: f64,
    ) -> Result<Self, SimulateError> {
        check_live(scene, extras, start)?;
        let attach = &start.attach;
        rope.validate().map_err(|source| SimulateError::Rope {
            candidate: 0,
            source,
        })?;
        if !(step_s.is_finite() && step_s > 0.0) {
            let need = "must be finite and above 0";
            return Err(SimulateError::Option {
                field: "step_s",
                value: step_s,
                need,
            });
        }
        if !(attach.p_m.sum() + attach.r.sum()).is_finite() {
            return Err(SimulateError::MotionNotFinite {
                candidate: 0,
                time_s: 0.0,
            });
        }
        let attitudes = hanging_links(rope, &extras, &attach.r);
        let starting = Starting {
            candidate: 0,
            rope,
            attach,
            arm: start.arm_links.as_ref(),
            links: &attitudes,
        };
        starting.check(scene)?;
        let mut links: Vec<Link<f64>> = Vec::new();
        for q in attitudes {
            let mut link = Link::at_rest();
            link.q.set(0, q);
            links.push(link);
        }
        let n = links.len();
        let mut live = Self {
            rope: RopeLanes::of(rope),
            params: *rope,
            max_step_s: step_s,
            links,
            scratch: vec![Elimination::empty(); n],
            scheme: Scheme::new(),
            phase: Phase::Regular,
            step_s: 0.0,
            restart: true,
            time_s: 0.0,
            nodes: vec![Vector3::zeros(); n + 1],
            around: Around::new(
                Contacts::new(scene, &[rope], step_s, [0.0; 3]),
                &[(rope, extras)],
            ),
            carriers: scene.arm_links(),
            carried: Vec::new(),
        };
        live.carry(start);
        let base = BaseState::of(attach);
        live.around
            .look(&live.links, &live.rope, &base, &live.carried);
        live.place_nodes(&attach.p_m);
        Ok(live)
    }

    /// Advances to `to_t_s` in equal steps, reading the attach frame's motion at the
    /// end of each. Times that are not later than [`LiveRope::time_s`] do nothing.
    pub fn advance(&mut self, motion: &dyn Fn(f64) -> FrameMotion, to_t_s: f64) {
        self.advance_in(&|t_s| MovingFrames::attach_only(motion(t_s)), to_t_s);
    }

    /// [`LiveRope::advance`] with the arm's links, for obstacles on them; where a frame
    /// lacks them, such obstacles stay where they were.
    pub fn advance_in(&mut self, frames: &dyn Fn(f64) -> MovingFrames, to_t_s: f64) {
        if !(to_t_s > self.time_s && to_t_s.is_finite()) {
            return;
        }
        Kernel::ScalarF64.run(Advance {
            live: self,
            frames,
            to_t_s,
        });
        self.time_s = to_t_s;
        self.place_nodes(&frames(to_t_s).attach.p_m);
    }

    /// What the rope has done with each obstacle so far.
    #[must_use]
    pub fn contacts(&self) -> Vec<ContactSummary> {
        self.around.contacts.summaries_of(0)
    }

    /// What has become of the domino so far.
    #[must_use]
    pub fn domino(&self) -> Option<DominoOutcome> {
        self.around.contacts.domino_of(0)
    }

    fn carry(&mut self, frames: &MovingFrames) {
        let Some(links) = &frames.arm_links else {
            return;
        };
        self.carried.clear();
        let motions = self.carriers.iter().filter_map(|link| links.get(link - 1));
        self.carried.extend(motions.map(BaseState::of));
    }

    /// Tells the rope that the attach frame's acceleration jumps now (the arm stops
    /// hard, a trajectory starts): the next step restarts the integrator.
    pub fn restart(&mut self) {
        self.restart = true;
    }

    /// Time reached (s).
    #[must_use]
    pub fn time_s(&self) -> f64 {
        self.time_s
    }

    /// Node positions (m, world), attach point first, lead last.
    #[must_use]
    pub fn nodes(&self) -> &[Vector3<f64>] {
        &self.nodes
    }

    /// Lead centre (m, world).
    #[must_use]
    pub fn tip(&self) -> Vector3<f64> {
        self.nodes.last().copied().unwrap_or_else(Vector3::zeros)
    }

    /// Whether the state is still finite; once false, it stays so.
    #[must_use]
    pub fn is_finite(&self) -> bool {
        self.nodes
            .iter()
            .all(|node| node.iter().all(|x| x.is_finite()))
    }

    fn place_nodes(&mut self, attach_m: &Vector3<f64>) {
        let mut at = *attach_m;
        self.nodes[0] = at;
        for (node, link) in self.nodes.iter_mut().skip(1).zip(&self.links) {
            let Vec3(x, y, z) = link.q.down(self.rope.link_length);
            at += Vector3::new(x, y, z);
            *node = at;
        }
    }

    fn set_step(&mut self, step_s: f64) {
        let phase = match self.phase {
            _ if self.restart => Phase::Restart,
            Phase::Restart => Phase::AfterRestart,
            _ => Phase::Regular,
        };
        if phase == Phase::Restart {
            self.links
                .iter_mut()
                .for_each(|link| link.clear_memory(1.0));
        }
        self.restart = false;
        if phase != self.phase || (step_s - self.step_s).abs() > 0.0 {
            self.scheme.set(0, step_s, phase);
            let resistance = joint_resistance(step_s, phase, &self.params);
            self.rope.set(0, &self.params, resistance);
            (self.phase, self.step_s) = (phase, step_s);
        }
    }
}

/// The steps of one [`LiveRope::advance`].
struct Advance<'a> {
    live: &'a mut LiveRope,
    frames: &'a dyn Fn(f64) -> MovingFrames,
    to_t_s: f64,
}

impl LaneTask for Advance<'_> {
    type Output = ();

    /// Always run as [`Kernel::ScalarF64`], whose lanes are `f64`.
    #[inline(always)]
    fn run<V: Lanes>(self) {
        let live = self.live;
        let from_s = live.time_s;
        let span_s = self.to_t_s - from_s;
        let steps = (span_s / live.max_step_s - 1e-9).ceil().max(1.0);
        // Rounding of the clock must not look like a new step length every time.
        let step_s = (span_s / steps * 1e12).round() / 1e12;
        let mut done = 0.0;
        while done < steps {
            done += 1.0;
            live.set_step(step_s);
            let time_s = from_s + span_s * (done / steps);
            let frames = (self.frames)(time_s);
            live.carry(&frames);
            let base = BaseState::of(&frames.attach);
            let end = StepEnd {
                time_s,
                step_s,
                running: true,
            };
            live.around.step(
                &mut live.links,
                &mut live.scratch,
                &live.rope,
                &live.scheme,
                (&base, &live.carried),
                &[end],
            );
            live.restart |= live.around.contacts.imminent > 0.0;
        }
    }
}

/// Checks what only a rope among things has.
fn check_live(
    scene: &Scene,
    extras: RopeExtras,
    start: &MovingFrames,
) -> Result<(), SimulateError> {
    scene.check()?;
    if let (Some((obstacle, link)), None) = (scene.first_on_arm(), start.arm_links) {
        return Err(SimulateError::Scene(SceneError::NoArm {
            candidate: 0,
            obstacle,
            link,
        }));
    }
    match extras.fault() {
        Some((field, value, need)) => Err(SimulateError::Extras {
            candidate: 0,
            field,
            value,
            need,
        }),
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests;
