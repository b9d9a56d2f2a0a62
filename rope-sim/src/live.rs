//! One rope advanced as its attach frame moves: for simulated rigs.

use crate::algebra::Vec3;
use crate::clock::BaseState;
use crate::contact::{Contacts, StepEnd, check_start};
use crate::equilibrium::hanging_links;
use crate::error::{SimulateError, refuse_unless_positive};
use crate::kernel::{Elimination, step};
use crate::lanes::{LaneTask, Lanes, run_scalar};
use crate::load::Unloaded;
use crate::scene::{DominoOutcome, Scene};
use crate::scheme::{Phase, Scheme, joint_resistance};
use crate::state::{Link, RopeLanes};
use crate::surroundings::Surroundings;
use arm_model::kinematics::FrameMotion;
use nalgebra::Vector3;
use shared_types::RopeParams;

/// A rope in double precision that follows its attach frame step by step. Advancing
/// it does not allocate.
#[derive(Clone)]
pub struct LiveRope {
    params: RopeParams,
    rope: RopeLanes<f64>,
    max_step_s: f64,
    links: Vec<Link<f64>>,
    scratch: Vec<Elimination<f64>>,
    scheme: Scheme<f64>,
    /// Of the last step; `None` before the first.
    phase: Option<Phase>,
    step_s: f64,
    time_s: f64,
    nodes: Vec<Vector3<f64>>,
    /// What the rope has beyond its nine parameters, and what it can touch.
    surroundings: Option<Surroundings>,
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
        rope.validate().map_err(|e| SimulateError::of(0, e))?;
        let option = |e| SimulateError::new(format_args!("simulation option {e}"));
        refuse_unless_positive("step_s", step_s).map_err(option)?;
        if !(attach.p_m.sum() + attach.r.sum()).is_finite() {
            return Err(SimulateError::motion_not_finite(0, 0.0));
        }
        let mut links: Vec<Link<f64>> = Vec::new();
        for q in hanging_links(rope, &attach.r) {
            let mut link = Link::at_rest();
            link.q.set(0, q);
            links.push(link);
        }
        let n = links.len();
        let surroundings = rope
            .extras
            .is_some()
            .then(|| Surroundings::of(rope, &links, attach));
        let mut live = Self {
            rope: RopeLanes::of(rope),
            params: *rope,
            max_step_s: step_s,
            links,
            scratch: vec![Elimination::empty(); n],
            scheme: Scheme::new(),
            phase: None,
            step_s: 0.0,
            time_s: 0.0,
            nodes: vec![Vector3::zeros(); n + 1],
            surroundings,
        };
        live.place_nodes(&attach.p_m);
        Ok(live)
    }

    /// Puts a scene around the rope, in place of what was there; a domino of it stands.
    /// `attach` is the frame from which the rope hangs now.
    ///
    /// # Errors
    /// The rope is inside a body of it; the rope is as before then.
    pub fn set_scene(&mut self, scene: &Scene, attach: &FrameMotion) -> Result<(), SimulateError> {
        let attitude = |link: &Link<f64>| [link.q.w, link.q.v.0, link.q.v.1, link.q.v.2];
        let attitudes: Vec<_> = self.links.iter().map(attitude).collect();
        check_start(scene, &self.params, &attach.p_m, &attitudes)
            .map_err(|why| SimulateError::of(0, why))?;
        self.surroundings
            .get_or_insert_with(|| Surroundings::of(&self.params, &self.links, attach))
            .put(scene, &self.params, self.max_step_s);
        Ok(())
    }

    /// What became of the scene's domino; `None` without one.
    #[must_use]
    pub fn domino(&self) -> Option<DominoOutcome> {
        self.contacts()?.domino_of(0)
    }

    /// Its tilt now (rad), as [`DominoOutcome::peak_tilt_rad`] is counted.
    #[must_use]
    pub fn domino_tilt_rad(&self) -> Option<f64> {
        self.contacts()?.tilt_rad_of(0)
    }

    /// Whether the rope has touched an obstacle of the scene, by its index.
    #[must_use]
    pub fn has_touched(&self, obstacle: usize) -> bool {
        let touched = self.contacts().map(|c| c.summaries_of(0));
        touched.is_some_and(|t| t.get(obstacle).is_some_and(|o| o.touched()))
    }

    fn contacts(&self) -> Option<&Contacts<f64>> {
        self.surroundings.as_ref()?.contacts.as_ref()
    }

    /// Advances to `to_t_s` in equal steps, reading the attach frame's motion at the
    /// end of each: accelerations at these times must add up to the velocity, which those of a
    /// staircase of setpoints do not. Times that are not later than the one reached do nothing.
    pub fn advance(&mut self, motion: &dyn Fn(f64) -> FrameMotion, to_t_s: f64) {
        if !(to_t_s > self.time_s && to_t_s.is_finite()) {
            return;
        }
        run_scalar(Advance {
            live: self,
            motion,
            to_t_s,
        });
        self.time_s = to_t_s;
        self.place_nodes(&motion(to_t_s).p_m);
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

    #[inline(always)]
    fn step(&mut self, attach: &BaseState<f64>, end: StepEnd) {
        let (links, scratch, rope) = (&mut self.links, &mut self.scratch, &self.rope);
        let (base, scheme) = (&attach.dynamics, &self.scheme);
        match &mut self.surroundings {
            Some(around) => around.step(links, scratch, (rope, attach, scheme), end),
            None => {
                step(links, scratch, rope, base, scheme, &Unloaded);
            }
        }
    }

    /// A rope that is about to touch something restarts at every step, see [`Contacts`].
    fn set_step(&mut self, step_s: f64) {
        let touches = self
            .surroundings
            .as_ref()
            .is_some_and(Surroundings::is_imminent);
        let phase = match self.phase {
            _ if touches => Phase::Restart,
            None => Phase::Restart,
            Some(Phase::Restart) => Phase::AfterRestart,
            Some(_) => Phase::Regular,
        };
        if self.phase != Some(phase) || (step_s - self.step_s).abs() > 0.0 {
            self.scheme.set(0, step_s, phase);
            let resistance = joint_resistance(step_s, phase, &self.params);
            self.rope.set(0, &self.params, resistance);
            (self.phase, self.step_s) = (Some(phase), step_s);
        }
        if phase == Phase::Restart {
            self.links
                .iter_mut()
                .for_each(|link| link.clear_memory(1.0));
        }
    }
}

/// The steps of one [`LiveRope::advance`].
struct Advance<'a> {
    live: &'a mut LiveRope,
    motion: &'a dyn Fn(f64) -> FrameMotion,
    to_t_s: f64,
}

impl LaneTask for Advance<'_> {
    type Output = ();

    /// Always run in scalar lanes, which are `f64`.
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
            let end = StepEnd {
                time_s,
                step_s,
                running: true,
            };
            live.step(&BaseState::of(&(self.motion)(time_s)), end);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Candidate, FrameTimes, Precision, SimOptions, roll_out, roll_out_in};
    use arm_model::Cell;
    use core::f64::consts::TAU;
    use nalgebra::Rotation3;
    use shared_types::{BendingFriction, RopeExtras, Task};

    fn rope() -> RopeParams {
        RopeParams::from_array([22.0, 0.55, 0.02, 0.3, 0.008, 0.06, 0.06, 0.03, 0.8])
    }

    /// Swings along x, starting and ending softly.
    fn swing(t_s: f64) -> FrameMotion {
        let (s, c) = (TAU * t_s).sin_cos();
        FrameMotion {
            p_m: Vector3::new(0.1 * (t_s - s / TAU), 0.0, 1.0),
            v_m_s: Vector3::new(0.1 * (1.0 - c), 0.0, 0.0),
            a_m_s2: Vector3::new(0.1 * TAU * s, 0.0, 0.0),
            ..FrameMotion::world()
        }
    }

    /// Turns about the vertical by more than a full turn, tilted, softly.
    fn turn(t_s: f64) -> FrameMotion {
        let (s, c) = (TAU * t_s).sin_cos();
        let yaw = Rotation3::from_axis_angle(&Vector3::z_axis(), 7.0 * (t_s - s / TAU));
        let tilt = Rotation3::from_axis_angle(&Vector3::x_axis(), 0.4);
        FrameMotion {
            r: (yaw * tilt).into_inner(),
            w_rad_s: Vector3::z() * (7.0 * (1.0 - c)),
            alpha_rad_s2: Vector3::z() * (7.0 * TAU * s),
            ..FrameMotion::world()
        }
    }

    /// The batch reads continuous quaternions, the live rope those of matrices, whose
    /// sign jumps: a full turn must not matter to either.
    #[test]
    fn follows_the_batch_simulation() {
        let friction = BendingFriction {
            moment_max_nm: 0.004,
            slip_curvature_per_m: 0.6,
        };
        let extras = RopeExtras {
            rest_curvature_per_m: [0.3, -0.5, 0.0],
            mass_slope: 0.2,
            clamp_stiffness: 1.7,
            friction: Some(friction),
            ..RopeExtras::NONE
        };
        let ropes = [rope(), rope().with_extras(extras)];
        let motions: [fn(f64) -> FrameMotion; 2] = [swing, turn];
        for (rope, motion) in [(0, 0), (0, 1), (1, 1)].map(|(r, m)| (ropes[r], motions[m])) {
            let mut live = LiveRope::new(&rope, &motion(0.0), 5e-4).unwrap();
            for cycle in 1..=250 {
                live.advance(&motion, f64::from(cycle) * 0.004);
            }
            let options = SimOptions {
                frames: FrameTimes {
                    first_s: 1.0,
                    period_s: 1.0,
                    count: 1,
                },
                ..SimOptions::new(5e-4, Precision::F64, 1.0)
            };
            let batch = roll_out(&[Candidate::new(&rope, &motion)], &options).unwrap();
            for (node, at) in live.nodes().iter().enumerate() {
                let d = (batch[0].nodes.position(0, node) - at).norm();
                assert!(d < 1e-7, "node {node} differs by {d} m");
            }
        }
    }

    /// The same fall onto a board with a domino, live and in a batch; without a scene the rope
    /// would go on.
    #[test]
    fn meets_obstacles_as_the_batch_does() {
        let attach = |t_s: f64| {
            let s = (4.0 * t_s).min(core::f64::consts::PI);
            let w = if s < core::f64::consts::PI { 4.0 } else { 0.0 };
            FrameMotion {
                p_m: Vector3::new(0.5, 0.0, 0.85 - 0.2 * (1.0 - s.cos())),
                v_m_s: Vector3::new(0.0, 0.0, -0.2 * w * s.sin()),
                a_m_s2: Vector3::new(0.0, 0.0, -0.2 * w * w * s.cos()),
                ..FrameMotion::world()
            }
        };
        let scene = Scene::of_task(Task::Lob, [0.56, 0.0, 0.2], &Cell::default());
        let rope = rope();
        let horizon_s = 1.6;
        let options = SimOptions {
            frames: FrameTimes {
                first_s: horizon_s,
                period_s: 1.0,
                count: 1,
            },
            ..SimOptions::new(1e-4, Precision::F64, horizon_s)
        };
        let batch = roll_out_in(&scene, &[Candidate::new(&rope, &attach)], &options).unwrap();
        let follow = |scene: &Scene| {
            let mut live = LiveRope::new(&rope, &attach(0.0), 1e-4).unwrap();
            live.set_scene(scene, &attach(0.0)).unwrap();
            for cycle in 1..=400 {
                live.advance(&attach, f64::from(cycle) * 0.004);
            }
            live
        };
        let live = follow(&scene);
        for (node, at) in live.nodes().iter().enumerate() {
            let d = (batch[0].nodes.position(0, node) - at).norm();
            assert!(d < 2e-3, "node {node} differs by {d} m");
        }
        let fell = |domino: Option<DominoOutcome>| domino.unwrap().down_at_s.is_some();
        assert_eq!(fell(live.domino()), fell(batch[0].domino));
        assert!(live.has_touched(0) && batch[0].contacts[0].touched());
        let free = follow(&Scene::EMPTY);
        let moved_m = free.nodes().last().unwrap() - live.nodes().last().unwrap();
        assert!(moved_m.norm() > 0.05, "{moved_m}");
    }

    #[test]
    fn a_body_where_the_rope_hangs_is_refused() {
        let attach = FrameMotion {
            p_m: Vector3::new(0.5, 0.0, 0.6),
            ..FrameMotion::world()
        };
        let mut live = LiveRope::new(&rope(), &attach, 1e-4).unwrap();
        let wall = |x_m: f64| Scene::of_task(Task::Drape, [x_m, 0.0, 0.3], &Cell::default());
        let why = live.set_scene(&wall(0.5), &attach).unwrap_err().to_string();
        assert!(why.contains("deep in obstacle 0"), "{why}");
        live.set_scene(&wall(0.8), &attach).unwrap();
        assert_eq!(live.domino(), None);
    }

    #[test]
    fn bad_input_is_named() {
        let world = FrameMotion::world();
        let bad = RopeParams { links: 0, ..rope() };
        for (rope, step_s, field) in [(bad, 1e-3, "`links`"), (rope(), 0.0, "`step_s`")] {
            let refusal = LiveRope::new(&rope, &world, step_s).unwrap_err();
            assert!(refusal.to_string().contains(field), "{refusal}");
        }
    }
}
