//! Eight numbers that say where the rope is in every frame.
//!
//! A rope that hangs on the clamp, moved as the arm reports it, seen by a camera that may
//! look a little elsewhere than its file says, with a clock of its own.

use nalgebra::{Rotation3, Vector3};
use rope_sim::{
    AttachMotion, Candidate, FrameTimes, NodeTrack, Outcome, Precision, Rollout, SimOptions,
};
use shared_types::{RopeParams, StereoCamera};

use super::curve::Pixel;
use crate::track::TrackError;

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
        extras: None,
    }
}

/// What moves the rope, and the camera that sees it.
#[derive(Clone, Copy)]
pub(super) struct Setup<'a> {
    pub(super) camera: &'a StereoCamera,
    /// The attach frame's, t = 0 at the first frame.
    pub(super) motion: &'a dyn AttachMotion,
    /// End of the film (s).
    pub(super) film_s: f64,
    pub(super) threads: usize,
}

impl Setup<'_> {
    /// Simulates hypotheses until the film's end, on the arm's clock; `None` where the
    /// simulation blew up.
    pub(super) fn simulate(
        &self,
        points: &[Point],
        fidelity: Fidelity,
    ) -> Result<Vec<Option<Seen>>, TrackError> {
        let horizon_s = (self.film_s + UPPER[CLOCK] + 0.04).min(self.motion.duration_s());
        let ropes: Vec<RopeParams> = points.iter().map(|x| rope(x, fidelity.links)).collect();
        let candidates: Vec<_> = ropes
            .iter()
            .map(|r| Candidate::new(r, self.motion))
            .collect();
        let options = SimOptions {
            frames: FrameTimes {
                first_s: 0.0,
                period_s: SAMPLE_S,
                count: (horizon_s / SAMPLE_S) as usize + 1,
            },
            threads: self.threads,
            ..SimOptions::new(fidelity.step_s, fidelity.precision, horizon_s)
        };
        let rollouts = rope_sim::roll_out(&candidates, &options).map_err(TrackError::motion)?;
        let seen = |(x, rollout): (&Point, Rollout)| {
            (!matches!(rollout.outcome, Outcome::Diverged)).then(|| Seen {
                nodes: rollout.nodes,
                camera: turned(x, self.camera),
                clock_s: x[CLOCK],
            })
        };
        Ok(points.iter().zip(rollouts).map(seen).collect())
    }

    /// Simulates one hypothesis finely, on one thread.
    pub(super) fn simulate_one(&self, x: &Point, fidelity: Fidelity) -> Result<Seen, TrackError> {
        let alone = Setup {
            threads: 1,
            ..*self
        };
        let seen = alone.simulate(&[*x], fidelity)?.pop().flatten();
        seen.ok_or_else(TrackError::behind_camera)
    }
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
pub(super) struct Seen {
    nodes: NodeTrack,
    camera: StereoCamera,
    clock_s: f64,
}

impl Seen {
    /// A node when a row of the frame that begins at `t_s` is in the middle of its exposure.
    fn node(&self, t_s: f64, row: f64, node: usize) -> Vector3<f64> {
        let last = self.nodes.frames() - 1;
        let at_s = t_s + self.camera.row_time_s(row) - self.clock_s;
        let place = (at_s / SAMPLE_S).clamp(0.0, last as f64);
        let before = (place as usize).min(last.saturating_sub(1));
        let part = place - before as f64;
        let (a, b) = (
            self.nodes.position(before, node),
            self.nodes.position((before + 1).min(last), node),
        );
        a + (b - a) * part
    }

    /// `count` points at equal distances along the rope, clamp first, in the frame that
    /// begins at `t_s`; `None` where a part is behind the camera.
    pub(super) fn curve(&self, t_s: f64, side: Side, count: usize) -> Option<Vec<Pixel>> {
        let project = match side {
            Side::Left => StereoCamera::project_left,
            Side::Right => StereoCamera::project_right,
        };
        let pixel = |node, row| project(&self.camera, &self.node(t_s, row, node));
        seen_curve(&self.camera, self.nodes.nodes(), count, pixel)
    }
}

/// `count` points between the pixels of `nodes` nodes; `pixel` gives that of a node as it is
/// when a row is exposed. `None` where a part is behind the camera.
pub(super) fn seen_curve(
    camera: &StereoCamera,
    nodes: usize,
    count: usize,
    pixel: impl Fn(usize, f64) -> Option<[f64; 2]>,
) -> Option<Vec<Pixel>> {
    let middle = f64::from(camera.height_px) / 2.0;
    // A node moves far less than a row in a row's time.
    let looks = if camera.line_time_s > 0.0 { 3 } else { 1 };
    let seen = |node| (0..looks).try_fold([0.0, middle], |[_, row], _| pixel(node, row));
    let nodes: Option<Vec<Pixel>> = (0..nodes).map(|n| seen(n).map(Pixel::from)).collect();
    nodes.map(|nodes| spread(&nodes, count))
}

/// Points at equal distances: cubic (Catmull-Rom) through the nodes.
fn spread(nodes: &[Pixel], count: usize) -> Vec<Pixel> {
    let last = nodes.len() - 1;
    let node = |i: usize| match i {
        0 => nodes[0] * 2.0 - nodes[1],
        i if i > last + 1 => nodes[last] * 2.0 - nodes[last - 1],
        i => nodes[i - 1],
    };
    let point = |k: usize| {
        let place = k as f64 * last as f64 / (count - 1) as f64;
        let i = (place as usize).min(last - 1);
        let w = place - i as f64;
        let [a, b, c, d] = [i, i + 1, i + 2, i + 3].map(node);
        let cubic = (b - c) * 3.0 + d - a;
        let square = a * 2.0 - b * 5.0 + c * 4.0 - d;
        b + (c - a + (square + cubic * w) * w) * (0.5 * w)
    };
    (0..count).map(point).collect()
}
