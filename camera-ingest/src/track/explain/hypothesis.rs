//! Eight numbers that say where the rope is in every frame.
//!
//! A rope that hangs on the clamp, moved as the arm reports it, seen by a camera that may
//! look a little elsewhere than its file says, with a clock of its own.

use nalgebra::{Rotation3, Vector3};
use rope_sim::{
    AttachMotion, Candidate, FrameTimes, Outcome, Precision, Rollout, SimOptions, SimulateError,
};
use shared_types::{RopeParams, StereoCamera};

/// Numbers of a hypothesis.
pub(super) const FREE: usize = 8;
/// Length from clamp to the tip weight's centre (m).
pub(super) const LENGTH: usize = 0;
/// `ln(k s / µ)`: bending stiffness per mass and length.
pub(super) const STIFFNESS: usize = 1;
/// `ln(c / k)`.
pub(super) const DAMPING: usize = 2;
/// `ln(m_L / µ)`.
pub(super) const TIP_MASS: usize = 3;
/// First of three turns of the camera about its own axes (rad).
pub(super) const TURN: usize = 4;
/// Film's clock behind the arm's (s).
pub(super) const CLOCK: usize = 7;

/// A point of the search.
pub(super) type Point = [f64; FREE];

/// Box of the search, wider than the paper's ranges.
pub(super) const LOWER: Point = [0.2, -9.0, -7.0, -3.0, -0.03, -0.03, -0.03, -0.03];
pub(super) const UPPER: Point = [0.9, 1.0, 0.5, 2.5, 0.03, 0.03, 0.03, 0.03];
/// Where it begins and how widely.
pub(super) const MIDDLE: Point = [0.52, -2.5, -3.5, 0.0, 0.0, 0.0, 0.0, 0.0];
pub(super) const SPREAD: Point = [0.10, 1.5, 1.2, 0.9, 0.010, 0.010, 0.010, 0.008];

/// Period at which nodes are kept (s).
const SAMPLE_S: f64 = 0.005;
/// Mass per length of simulated ropes (kg/m): only ratios to it show.
const MASS_PER_LENGTH: f64 = 0.01;

/// How finely a hypothesis is simulated.
#[derive(Debug, Clone, Copy)]
pub(super) struct Fidelity {
    pub(super) links: u32,
    pub(super) step_s: f64,
    pub(super) precision: Precision,
}

impl Fidelity {
    pub(super) const COARSE: Self = Self {
        links: 12,
        step_s: 2e-3,
        precision: Precision::F32,
    };
    pub(super) const FINAL: Self = Self {
        links: 24,
        step_s: 1e-3,
        precision: Precision::F64,
    };
}

/// The rope, with masses of which only the ratios show.
pub(super) fn rope(x: &Point, links: u32) -> RopeParams {
    let link_m = x[LENGTH] / f64::from(links);
    let stiffness = MASS_PER_LENGTH * x[STIFFNESS].exp() / link_m;
    RopeParams {
        links,
        length_m: x[LENGTH],
        joint_damping_nms_per_rad: stiffness * x[DAMPING].exp(),
        joint_stiffness_nm_per_rad: stiffness,
        radius_m: 1e-4,
        mass_per_length_kg_per_m: MASS_PER_LENGTH,
        lead_mass_kg: MASS_PER_LENGTH * x[TIP_MASS].exp(),
        lead_radius_m: 0.02,
        link_extra_scale: 0.85,
    }
}

/// Simulates hypotheses until the film's end (s), on the arm's clock.
pub(super) fn simulate(
    points: &[Point],
    fidelity: Fidelity,
    motion: &dyn AttachMotion,
    film_s: f64,
    threads: usize,
) -> Result<Vec<Rollout>, SimulateError> {
    let horizon_s = (film_s + UPPER[CLOCK] + 0.04).min(motion.duration_s());
    let ropes: Vec<RopeParams> = points.iter().map(|x| rope(x, fidelity.links)).collect();
    let candidates: Vec<_> = ropes.iter().map(|r| Candidate::new(r, motion)).collect();
    let options = SimOptions {
        frames: FrameTimes {
            first_s: 0.0,
            period_s: SAMPLE_S,
            count: (horizon_s / SAMPLE_S) as usize + 1,
        },
        threads,
        ..SimOptions::new(fidelity.step_s, fidelity.precision, horizon_s)
    };
    rope_sim::roll_out(&candidates, &options)
}

/// The camera as the hypothesis has it.
pub(super) fn turned(x: &Point, camera: &StereoCamera) -> StereoCamera {
    let turn = Rotation3::new(Vector3::new(x[TURN], x[TURN + 1], x[TURN + 2]));
    StereoCamera {
        r_w_cam: camera.r_w_cam * turn.matrix(),
        ..camera.clone()
    }
}

/// Left or right image.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Side {
    Left,
    Right,
}

/// A simulated hypothesis, ready to be looked at.
#[derive(Debug)]
pub(super) struct Seen<'a> {
    rollout: &'a Rollout,
    camera: StereoCamera,
    clock_s: f64,
}

impl<'a> Seen<'a> {
    /// `None` where the simulation blew up.
    pub(super) fn new(x: &Point, rollout: &'a Rollout, camera: &StereoCamera) -> Option<Self> {
        if matches!(rollout.outcome, Outcome::Diverged) {
            return None;
        }
        Some(Self {
            rollout,
            camera: turned(x, camera),
            clock_s: x[CLOCK],
        })
    }

    fn project(&self, p_w_m: &Vector3<f64>, side: Side) -> Option<[f64; 2]> {
        match side {
            Side::Left => self.camera.project_left(p_w_m),
            Side::Right => self.camera.project_right(p_w_m),
        }
    }

    /// A node when a row of the frame that begins at `t_s` is in the middle of its exposure.
    fn node(&self, t_s: f64, row: f64, node: usize) -> Vector3<f64> {
        let nodes = &self.rollout.nodes;
        let last = nodes.frames() - 1;
        let at_s = t_s + self.camera.row_time_s(row) - self.clock_s;
        let place = (at_s / SAMPLE_S).clamp(0.0, last as f64);
        let before = (place as usize).min(last.saturating_sub(1));
        let part = place - before as f64;
        let (a, b) = (
            nodes.position(before, node),
            nodes.position((before + 1).min(last), node),
        );
        a + (b - a) * part
    }

    /// Pixels of `count` points at equal distances along the rope, clamp first, in the
    /// frame that begins at `t_s`; false where a part is behind the camera.
    pub(super) fn curve(&self, t_s: f64, side: Side, count: usize, out: &mut Curve) -> bool {
        let pixel = |node, row| self.project(&self.node(t_s, row, node), side);
        out.fill(&self.camera, self.rollout.nodes.nodes(), count, pixel)
    }
}

/// Pixels of nodes, and of points between them.
#[derive(Debug, Default)]
pub(super) struct Curve {
    nodes: Vec<[f64; 2]>,
    pub(super) points: Vec<[f64; 2]>,
}

impl Curve {
    /// `count` points between the pixels of `nodes` nodes; `pixel` gives that of a node as
    /// it is when a row is exposed. False where a part is behind the camera.
    pub(super) fn fill(
        &mut self,
        camera: &StereoCamera,
        nodes: usize,
        count: usize,
        pixel: impl Fn(usize, f64) -> Option<[f64; 2]>,
    ) -> bool {
        self.nodes.clear();
        let middle = f64::from(camera.height_px) / 2.0;
        // A node moves far less than a row in a row's time.
        let looks = if camera.line_time_s > 0.0 { 3 } else { 1 };
        for node in 0..nodes {
            let look = |seen: [f64; 2], _| pixel(node, seen[1]);
            let Some(seen) = (0..looks).try_fold([0.0, middle], look) else {
                return false;
            };
            self.nodes.push(seen);
        }
        self.spread(count);
        true
    }

    /// Points at equal distances: cubic (Catmull-Rom) through the nodes.
    fn spread(&mut self, count: usize) {
        let last = self.nodes.len() - 1;
        let nodes = &self.nodes;
        let beyond = |a: [f64; 2], b: [f64; 2]| [2.0 * a[0] - b[0], 2.0 * a[1] - b[1]];
        let (first, end) = (
            beyond(nodes[0], nodes[1]),
            beyond(nodes[last], nodes[last - 1]),
        );
        let node = |i: usize| match i {
            0 => first,
            i if i > last + 1 => end,
            i => nodes[i - 1],
        };
        self.points.clear();
        for k in 0..count {
            let place = k as f64 * last as f64 / (count - 1) as f64;
            let i = (place as usize).min(last - 1);
            let w = place - i as f64;
            let [a, b, c, d] = [i, i + 1, i + 2, i + 3].map(node);
            self.points.push(core::array::from_fn(|m| {
                let cubic = 3.0 * (b[m] - c[m]) + d[m] - a[m];
                let square = 2.0 * a[m] - 5.0 * b[m] + 4.0 * c[m] - d[m];
                b[m] + 0.5 * w * (c[m] - a[m] + w * (square + w * cubic))
            }));
        }
    }
}
