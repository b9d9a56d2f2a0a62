//! One rope advanced as its attach frame moves: for simulated rigs.

use crate::algebra::{Quat, Vec3};
use crate::base_path::attitude;
use crate::equilibrium::hanging_links;
use crate::error::SimulateError;
use crate::kernel::{Elimination, step};
use crate::lanes::{Kernel, LaneTask, Lanes};
use crate::load::Unloaded;
use crate::scheme::{Phase, Scheme, joint_resistance};
use crate::state::{BaseLanes, Link, RopeLanes};
use nalgebra::Vector3;
use shared_types::RopeParams;
use shared_types::kinematics::FrameMotion;

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
        let mut links: Vec<Link<f64>> = Vec::new();
        for q in hanging_links(rope, &attach.r) {
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
        };
        live.place_nodes(&attach.p_m);
        Ok(live)
    }

    /// Advances to `to_t_s` in equal steps, reading the attach frame's motion at the
    /// end of each. Times that are not later than [`LiveRope::time_s`] do nothing.
    pub fn advance(&mut self, motion: &dyn Fn(f64) -> FrameMotion, to_t_s: f64) {
        if !(to_t_s > self.time_s && to_t_s.is_finite()) {
            return;
        }
        Kernel::ScalarF64.run(Advance {
            live: self,
            motion,
            to_t_s,
        });
        self.time_s = to_t_s;
        self.place_nodes(&motion(to_t_s).p_m);
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
            self.links.iter_mut().for_each(|link| link.clear_memory(0));
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
    motion: &'a dyn Fn(f64) -> FrameMotion,
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
            let motion = (self.motion)(from_s + span_s * (done / steps));
            let base = base_of(&motion);
            step(
                &mut live.links,
                &mut live.scratch,
                &live.rope,
                &base,
                &live.scheme,
                &Unloaded::new(),
            );
        }
    }
}

fn base_of(m: &FrameMotion) -> BaseLanes<f64> {
    let q = attitude(m);
    let vector = |v: &Vector3<f64>| Vec3(v.x, v.y, v.z);
    BaseLanes {
        q: Quat {
            w: q.w,
            v: Vec3(q.i, q.j, q.k),
        },
        w: vector(&m.w_rad_s),
        alpha: vector(&m.alpha_rad_s2),
        a: vector(&m.a_m_s2),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        AttachMotion, Candidate, FrameTimes, Precision, SimOptions, Start, Watch, roll_out,
    };

    fn rope() -> RopeParams {
        RopeParams::from_array([22.0, 0.55, 0.02, 0.3, 0.008, 0.06, 0.06, 0.03, 0.8])
    }

    /// Swings along x, starting and ending softly.
    struct Swing;

    impl AttachMotion for Swing {
        fn at(&self, t_s: f64) -> FrameMotion {
            let w = core::f64::consts::TAU;
            let (s, c) = (w * t_s).sin_cos();
            FrameMotion {
                p_m: Vector3::new(0.1 * (t_s - s / w), 0.0, 1.0),
                v_m_s: Vector3::new(0.1 * (1.0 - c), 0.0, 0.0),
                a_m_s2: Vector3::new(0.1 * w * s, 0.0, 0.0),
                ..FrameMotion::world()
            }
        }
        fn duration_s(&self) -> f64 {
            1.0
        }
        fn acceleration_jumps_s(&self) -> Vec<f64> {
            Vec::new()
        }
    }

    #[test]
    fn stays_in_equilibrium_under_a_tilted_frame() {
        let tilt = nalgebra::Rotation3::from_euler_angles(0.3, 0.9, 0.2);
        let attach = FrameMotion {
            r: tilt.into_inner(),
            ..FrameMotion::world()
        };
        let mut live = LiveRope::new(&rope(), &attach, 1e-3).unwrap();
        let before = live.tip();
        live.advance(&|_| attach, 1.0);
        assert!(
            (live.tip() - before).norm() < 1e-9,
            "{}",
            live.tip() - before
        );
    }

    /// Turns about the vertical by more than a full turn, tilted, softly.
    struct Turn;

    impl AttachMotion for Turn {
        fn at(&self, t_s: f64) -> FrameMotion {
            let w = core::f64::consts::TAU;
            let (s, c) = (w * t_s).sin_cos();
            let yaw = nalgebra::Rotation3::from_axis_angle(&Vector3::z_axis(), 7.0 * (t_s - s / w));
            let tilt = nalgebra::Rotation3::from_axis_angle(&Vector3::x_axis(), 0.4);
            FrameMotion {
                r: (yaw * tilt).into_inner(),
                w_rad_s: Vector3::z() * (7.0 * (1.0 - c)),
                alpha_rad_s2: Vector3::z() * (7.0 * w * s),
                ..FrameMotion::world()
            }
        }
        fn duration_s(&self) -> f64 {
            1.0
        }
        fn acceleration_jumps_s(&self) -> Vec<f64> {
            Vec::new()
        }
    }

    /// The batch reads continuous quaternions, the live rope those of matrices, whose
    /// sign jumps: a full turn must not matter to either.
    #[test]
    fn follows_the_batch_simulation() {
        let motions: [&dyn AttachMotion; 2] = [&Swing, &Turn];
        for motion in motions {
            let mut live = LiveRope::new(&rope(), &motion.at(0.0), 5e-4).unwrap();
            for cycle in 1..=250 {
                live.advance(&|t| motion.at(t), f64::from(cycle) * 0.004);
            }
            let options = SimOptions {
                step_s: 5e-4,
                precision: Precision::F64,
                start: Start::Equilibrium,
                frames: FrameTimes {
                    first_s: 1.0,
                    period_s: 1.0,
                    count: 1,
                },
                watch: Watch::NOTHING,
                horizon_s: 1.0,
                threads: 1,
            };
            let rope = rope();
            let batch = roll_out(&[Candidate::new(&rope, motion)], &options).unwrap();
            for (node, at) in live.nodes().iter().enumerate() {
                let d = (batch[0].nodes.position(0, node) - at).norm();
                assert!(d < 1e-7, "node {node} differs by {d} m");
            }
        }
    }

    #[test]
    fn bad_input_is_named() {
        let world = FrameMotion::world();
        let mut bad = rope();
        bad.links = 0;
        assert!(matches!(
            LiveRope::new(&bad, &world, 1e-3),
            Err(SimulateError::Rope { .. })
        ));
        assert!(matches!(
            LiveRope::new(&rope(), &world, 0.0),
            Err(SimulateError::Option {
                field: "step_s",
                ..
            })
        ));
    }
}
