//! The rope's motion in a film, known beforehand.

use crate::wiggle_film::attach;
use nalgebra::Vector3;
use rand::{Rng, RngExt};
use rope_sim::{Candidate, FrameTimes, NodeTrack, Precision, SimOptions, SimulateError, roll_out};
use shared_types::{AirDrag, RopeExtras, RopeParams};

const STEP_S: f64 = 2e-4;
/// Time between two kept places (s).
const PERIOD_S: f64 = 1e-3;

/// The nodes of a rope under the shipped wiggle.
#[derive(Debug)]
pub(super) struct Swing {
    nodes: NodeTrack,
}

impl Swing {
    /// Simulates a rope from its rest to `end_s` after the wiggle's beginning.
    pub(super) fn of(rope: &RopeParams, end_s: f64) -> Result<Self, SimulateError> {
        let options = SimOptions {
            frames: FrameTimes {
                first_s: 0.0,
                period_s: PERIOD_S,
                count: (end_s / PERIOD_S) as usize,
            },
            ..SimOptions::new(STEP_S, Precision::F64, end_s)
        };
        let mut rolled = roll_out(&[Candidate::new(rope, &attach)], &options)?;
        let nodes = rolled.swap_remove(0).nodes;
        Ok(Self { nodes })
    }

    /// Nodes at a time (s) from the wiggle's beginning, before which the rope hangs
    /// still (world, m).
    pub(super) fn at(&self, t_s: f64) -> Vec<Vector3<f64>> {
        let last = self.nodes.frames() - 1;
        let place = (t_s / PERIOD_S).clamp(0.0, last as f64);
        let before = (place as usize).min(last - 1);
        let part = place - before as f64;
        let between = |node| {
            let [a, b] = [before, before + 1].map(|frame| self.nodes.position(frame, node));
            a + (b - a) * part
        };
        (0..self.nodes.nodes()).map(between).collect()
    }
}

/// What real ropes have and the rope's nine parameters lack: air, a bend from lying
/// coiled, mass that is uneven.
pub(super) fn extras(rng: &mut impl Rng) -> RopeExtras {
    let air_drag = AirDrag {
        air_density_kg_m3: 1.2,
        normal_coefficient: rng.random_range(0.8..1.4),
        tangential_coefficient: rng.random_range(0.01..0.05),
        lead_coefficient: rng.random_range(0.4..0.8),
    };
    let coiled = rng.random_bool(0.6);
    let mut bend = || {
        if coiled {
            rng.random_range(-0.9..0.9)
        } else {
            0.0
        }
    };
    RopeExtras {
        air_drag: Some(air_drag),
        rest_curvature_per_m: [bend(), bend(), 0.0],
        mass_slope: rng.random_range(-0.12..0.12),
        ..RopeExtras::NONE
    }
}
