//! The rope on the arm's true motion, a few milliseconds behind real time.

use super::contact::touches;
use super::error::RigError;
use super::record::{Bodies, Placed, Record, Snapshot};
use arm_model::{Cell, JointPiece, JointState, JointVector};
use rope_sim::{LiveRope, Scene};
use shared_types::{MonotonicNs, RopeParams};
use std::sync::atomic::{AtomicBool, Ordering};
use xarm_sim::{History, JointSample, clock};

/// Step of the rope's integration (s).
const STEP_S: f64 = 1e-4;
/// Pause between two looks at the arm (s).
const PAUSE_S: f64 = 0.004;
/// Longest gap in the arm's motion that is bridged (s). The arm keeps 5 s.
const GAP_S: f64 = 0.1;

/// Runs the rope until `stop`: hangs it on the arm at rest, then follows every
/// sample of the arm's motion.
pub(super) fn run(
    rope: &RopeParams,
    cell: &Cell,
    arm: &History<JointSample>,
    record: &Record,
    stop: &AtomicBool,
) -> Result<(), RigError> {
    let mut physics: Option<Physics> = None;
    while !stop.load(Ordering::Acquire) {
        let after = physics.as_ref().map_or(MonotonicNs(0), |p| p.last.at);
        let samples = arm.since(after);
        let mut rest = samples.iter();
        if physics.is_none()
            && let Some(first) = rest.next()
        {
            physics = Some(Physics::new(rope, cell, first)?);
        }
        if let Some(physics) = &mut physics {
            if let Some(wanted) = record.wanted() {
                record.placed_as(wanted, physics.place(wanted));
            }
            let snapshots = rest.map(|sample| physics.follow(sample));
            record.extend(snapshots.collect::<Result<_, _>>()?);
        }
        clock::sleep_until(clock::now().plus_s(PAUSE_S));
    }
    Ok(())
}

struct Physics {
    live: LiveRope,
    rope: RopeParams,
    cell: Cell,
    start: MonotonicNs,
    last: JointSample,
    /// Mean acceleration of the joints up to it (rad/s²).
    mean_qdd: JointVector,
}

impl Physics {
    fn new(rope: &RopeParams, cell: &Cell, first: &JointSample) -> Result<Self, RigError> {
        let attach = cell.pole.attach_motion(&JointState::at_rest(first.state.q));
        Ok(Self {
            live: LiveRope::new(rope, &attach, STEP_S)?,
            rope: *rope,
            cell: *cell,
            start: first.at,
            last: *first,
            mean_qdd: JointVector::ZERO,
        })
    }

    /// Puts the bodies of a task around the rope, or takes them away and stops its swing.
    fn place(&mut self, placed: Placed) -> Result<(), String> {
        let Some((task, target_m)) = placed else {
            let still = Self::new(&self.rope, &self.cell, &self.last);
            *self = still.map_err(|why| why.to_string())?;
            return Ok(());
        };
        let attach = self.cell.pole.attach_motion(&self.last.state);
        let scene = Scene::of_task(task, target_m.into(), &self.cell);
        let placed = self.live.set_scene(&scene, &attach);
        placed.map_err(|why| {
            tracing::warn!(%why, "a body cannot stand where it is to be placed");
            "the rope hangs where board, domino or wall would stand: move the target farther from the arm".to_owned()
        })
    }

    /// Moves on to the next sample of the arm.
    fn follow(&mut self, next: &JointSample) -> Result<Snapshot, RigError> {
        let span_s = next.at.since_s(self.last.at);
        if span_s > GAP_S {
            return Err(RigError::Failed(format!(
                "the simulation lost {span_s:.2} s of the arm's motion; the machine is too busy, \
                 stop other programs"
            )));
        }
        let (from_s, to_s) = (
            self.last.at.since_s(self.start),
            next.at.since_s(self.start),
        );
        // The arm's acceleration jumps with every setpoint, and the rope's integration reads it
        // at the ends of its steps: summing single values would give a velocity other than the
        // arm's. The mean follows from the velocities at both ends, its slope from the last one.
        let mean = (next.state.qd - self.last.state.qd) * (1.0 / span_s);
        let half_change = (mean - self.mean_qdd) * 0.5;
        self.mean_qdd = mean;
        let with = |state: JointState, qdd| JointState { qdd, ..state };
        let from = with(self.last.state, mean - half_change);
        let to = with(next.state, mean + half_change);
        let piece = JointPiece::quintic(&from, &to, span_s);
        let pole = self.cell.pole;
        let motion = |t_s: f64| pole.attach_motion(&piece.at(t_s - from_s));
        self.live.advance(&motion, to_s);
        self.last = *next;
        let nodes = self.live.nodes().to_vec();
        if !nodes.iter().all(|p| p.sum().is_finite()) {
            return Err(RigError::Failed(
                "the simulated rope diverged; choose a rope within the documented ranges"
                    .to_owned(),
            ));
        }
        let radii_m = [self.rope.radius_m, self.rope.lead_radius_m];
        Ok(Snapshot {
            at: next.at,
            q: next.state.q,
            bodies: Bodies {
                tilt_rad: self.live.domino_tilt_rad().unwrap_or_default(),
                is_down: self.live.domino().is_some_and(|d| d.down_at_s.is_some()),
                touched: self.live.has_touched(0),
            },
            touched: touches(&nodes, radii_m, &next.state.q, &self.cell),
            nodes,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::hidden::hidden_rope;
    use arm_model::joint::START_POSE;
    use core::f64::consts::TAU;

    /// Joint 6 behind its setpoints, a sample a millisecond: a lag of second order, integrated
    /// finely.
    fn behind(setpoint_rad: impl Fn(f64) -> f64) -> Vec<JointSample> {
        const SUBSTEPS: u64 = 100;
        let (w, dt_s) = (TAU * 25.0, 1e-3 / SUBSTEPS as f64);
        let (mut q, mut qd) = (START_POSE[5], 0.0);
        let mut samples = Vec::new();
        for step in 0..6000 * SUBSTEPS {
            let t_s = step as f64 * dt_s;
            let setpoint = setpoint_rad(t_s + 0.5 * dt_s);
            let pull = |q: f64, qd: f64| w * w * (setpoint - q) - 1.8 * w * qd;
            if step % SUBSTEPS == 0 {
                let mut state = JointState::at_rest(START_POSE);
                (state.q[5], state.qd[5], state.qdd[5]) = (q, qd, pull(q, qd));
                let at = MonotonicNs(7_000_000_000 + step * 1_000_000 / SUBSTEPS);
                samples.push(JointSample { at, state });
            }
            let middle = [q + 0.5 * dt_s * qd, qd + 0.5 * dt_s * pull(q, qd)];
            q += dt_s * middle[1];
            qd += dt_s * pull(middle[0], middle[1]);
        }
        samples
    }

    /// The steps of 4 ms between setpoints move the clamp by micrometres: no rope shows them.
    #[test]
    fn a_staircase_of_setpoints_does_not_show_in_the_rope() {
        const CYCLE_S: f64 = 4e-3;
        let wiggle = |t_s: f64| crate::wiggle_film::joints(t_s)[5];
        // A stair holds its setpoint: on average it is half a cycle late.
        let stairs = behind(|t_s| wiggle((t_s / CYCLE_S).floor() * CYCLE_S));
        let smooth = behind(|t_s| wiggle(t_s - 0.5 * CYCLE_S));
        let (rope, cell) = (hidden_rope(3), Cell::default());
        let rope_on = |samples: &[JointSample]| Physics::new(&rope, &cell, &samples[0]).unwrap();
        let mut physics = [rope_on(&stairs), rope_on(&smooth)];
        let (mut off_m, mut moved_m) = (0.0_f64, 0.0_f64);
        for (stair, smooth) in stairs.iter().zip(&smooth).skip(1) {
            let [a, b] = [physics[0].follow(stair), physics[1].follow(smooth)].map(Result::unwrap);
            let apart_m = a.nodes.iter().zip(&b.nodes).map(|(a, b)| (a - b).norm());
            off_m = apart_m.fold(off_m, f64::max);
            moved_m = moved_m.max((b.nodes[b.nodes.len() - 1].x - 0.663).abs());
        }
        assert!(off_m < 1e-4, "{off_m} m apart");
        assert!(moved_m > 0.05, "the rope hardly moved: {moved_m} m");
    }

    /// Following samples must not differ from knowing the motion exactly.
    #[test]
    fn the_rope_on_samples_moves_like_the_rope_on_the_exact_motion() {
        let state = |t: f64| {
            // Joint 6 of the start pose: 0.2 sin^3, at rest with no jerk at 0.
            let w = 4.0;
            let (s, c) = (w * t).sin_cos();
            let mut state = JointState::at_rest(START_POSE);
            state.q[5] += 0.2 * s.powi(3);
            state.qd[5] = 0.6 * w * s * s * c;
            state.qdd[5] = 0.6 * w * w * (2.0 * s * c * c - s.powi(3));
            state
        };
        let sample = |ms: u32| JointSample {
            at: MonotonicNs(7_000_000_000 + u64::from(ms) * 1_000_000),
            state: state(f64::from(ms) * 1e-3),
        };
        let (rope, cell) = (hidden_rope(3), Cell::default());
        let mut physics = Physics::new(&rope, &cell, &sample(0)).unwrap();
        let mut exact = LiveRope::new(
            &rope,
            &cell.pole.attach_motion(&JointState::at_rest(START_POSE)),
            STEP_S,
        )
        .unwrap();
        let mut moved_m: f64 = 0.0;
        for ms in 1..=1571 {
            let snapshot = physics.follow(&sample(ms)).unwrap();
            exact.advance(
                &|t| cell.pole.attach_motion(&state(t)),
                f64::from(ms) * 1e-3,
            );
            let (got, want) = (
                snapshot.nodes.last().unwrap(),
                exact.nodes().last().unwrap(),
            );
            assert!((got - want).norm() < 1e-5, "{ms} ms: {got} and {want}");
            moved_m = moved_m.max((got.x - 0.663).abs());
        }
        assert!(moved_m > 0.05, "the rope hardly moved: {moved_m}");
        let far = physics.follow(&sample(1771)).unwrap_err().to_string();
        assert!(far.contains("lost 0.20 s of the arm's motion"), "{far}");

        // The arm rests for a moment: held now, the rope hangs still.
        let hangs =
            |snapshot: &Snapshot| snapshot.nodes[snapshot.nodes.len() - 1] - snapshot.nodes[0];
        let swinging = hangs(&physics.follow(&sample(1572)).unwrap());
        physics.place(None).unwrap();
        let still = hangs(&physics.follow(&sample(1573)).unwrap());
        assert!(swinging.xy().norm() > 0.01, "{swinging}");
        assert!(still.xy().norm() < 1e-5, "{still}");
    }
}
