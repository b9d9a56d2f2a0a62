//! Motions to look at: the arm as measured, the identified rope simulated on it.

use super::approach::tip_curve;
use super::data::{Joints, Scene};
use anyhow::Context;
use arm_model::{Cell, JOINTS, JointVector, Pole, kinematics};
use nalgebra::Vector3;
use rope_sim::{
    AttachMotion, Candidate, FrameTimes, MeasuredArm, NodeTrack, Outcome, PlannedArm, Precision,
    SimOptions, roll_out_in,
};
use run_log::Cycles;
use shared_types::ipc::{ControllerMode, CycleRecord};
use shared_types::{MonotonicNs, Plan, RopeParams, RopeState};

const RATE_HZ: f64 = 60.0;
/// Samples of a throw's tip for each frame: at 10 m/s it moves by 2 cm from one to the next.
const TIP_SAMPLES: usize = 8;
/// Shown before a motion (s).
const BEFORE_S: f64 = 0.2;
/// Shown after a motion (s).
const AFTER_S: f64 = 0.8;
/// Longest motion that is shown (s); of a longer one, its begin.
const LONGEST_S: f64 = 15.0;
/// Step of the simulation of a throw, and of calmer motions (s).
const STEP_S: (f64, f64) = (5e-4, 1e-3);
/// Points of a joint's curve.
const CURVE_POINTS: usize = 400;
/// Fewer cycles than this are nothing to look at.
const CYCLES_MIN: usize = 25;
/// Samples the measured motion needs.
const SAMPLES_MIN: usize = 8;

/// The cycles of each motion that was asked for, in order; moves to a start pose are the
/// controller's own.
pub(crate) fn motions(cycles: &[CycleRecord]) -> Vec<&[CycleRecord]> {
    let streams = |c: &CycleRecord| c.mode == ControllerMode::Streaming as u8;
    cycles
        .chunk_by(|a, b| a.mode == b.mode && b.trajectory_s >= a.trajectory_s)
        .filter(|run| streams(&run[0]) && run.len() >= CYCLES_MIN)
        .collect()
}

fn begin(motion: &[CycleRecord]) -> MonotonicNs {
    MonotonicNs(motion[0].deadline_ns).plus_s(-motion[0].trajectory_s)
}

/// What is known of a run beside the motion itself.
#[derive(Debug)]
pub(crate) struct Known<'a> {
    /// The cell it ran in.
    pub cell: Cell,
    /// Its cycles and measured joints.
    pub cycles: &'a Cycles,
    pub rope: Option<&'a RopeParams>,
    /// The plan of the throw.
    pub plan: Option<&'a Plan>,
    pub target_m: Option<[f64; 3]>,
}

pub(crate) fn scene(
    name: String,
    motion: &[CycleRecord],
    known: &Known<'_>,
) -> anyhow::Result<Scene> {
    let is_throw = name == "throw";
    let plan = known.plan.filter(|_| is_throw);
    // A throw's tip is looked at closely; of other motions the frames are enough.
    let target = known.target_m.filter(|_| is_throw).map(Vector3::from);
    let rate = target.map_or(1, |_| TIP_SAMPLES);
    let begin = begin(motion);
    let last = motion.last().unwrap_or(&motion[0]);
    let until_s = MonotonicNs(last.deadline_ns).since_s(begin).min(LONGEST_S) + AFTER_S;
    let (times_s, q, is_measured) = moved(motion, begin, until_s, known.cycles);
    let arm = MeasuredArm::new(&times_s, &q, known.cell.pole).context("the joints of a motion")?;
    let start = plan.and_then(|plan| plan.start.as_ref());
    // Where a rope that swings was is known when its throw begins, not before.
    let before_s = start.map_or(BEFORE_S, |_| 0.0);
    let frames = frames(before_s + until_s);
    // The simulator's clock begins with the first frame.
    let shifted: Vec<f64> = times_s.iter().map(|t| t + before_s).collect();
    let on_film =
        MeasuredArm::new(&shifted, &q, known.cell.pole).context("the joints of a motion")?;
    let step_s = if is_throw { STEP_S.0 } else { STEP_S.1 };
    let around = plan.map_or(rope_sim::Scene::EMPTY, |plan| {
        rope_sim::Scene::of_task(plan.task, plan.target_m, &known.cell)
    });
    let rope = match known.rope {
        Some(rope) => {
            let finer = finer(frames, rate);
            simulate(&around, (rope, start), &on_film, finer, step_s)?
        }
        None => None,
    };
    let planned = match plan {
        Some(plan) => {
            let arm = PlannedArm::new(plan.trajectory, known.cell.pole);
            simulate(
                &around,
                (&plan.rope, start),
                &arm,
                finer(self::frames(until_s), rate),
                STEP_S.0,
            )?
        }
        None => None,
    };
    let curve = |rope: &Option<NodeTrack>, from_s: f64| {
        let span = [from_s, frames.period_s / rate as f64];
        tip_curve(&tips(rope.as_ref()?), span, target.as_ref()?)
    };
    Ok(Scene {
        begin,
        from_s: -before_s,
        period_s: frames.period_s,
        cell: known.cell,
        arm: (0..frames.count)
            .map(|i| arm_points(&on_film.joints_at(frames.time_s(i)).q, &known.cell.pole))
            .collect(),
        tip: curve(&rope, -before_s),
        planned: curve(&planned, 0.0),
        planned_tip: planned
            .iter()
            .flat_map(|rope| tips(rope).into_iter().step_by(rate))
            .flat_map(|tip| tenths_mm(&tip))
            .collect(),
        rope: rope.map_or_else(Vec::new, |rope| rows(&rope, rate)),
        radii_m: known
            .rope
            .map_or([0.0; 2], |r| [r.radius_m, r.lead_radius_m]),
        target_m: known.target_m,
        joints: curves(motion, begin, plan, is_measured.then_some(&arm)),
        name,
    })
}

pub(super) fn frames(span_s: f64) -> FrameTimes {
    FrameTimes {
        first_s: 0.0,
        period_s: 1.0 / RATE_HZ,
        count: (span_s * RATE_HZ).floor() as usize + 1,
    }
}

/// Joints on the motion's clock: measured, or as commanded where nothing was
/// measured; then they stand for the arm but are not called measured.
fn moved(
    motion: &[CycleRecord],
    begin: MonotonicNs,
    until_s: f64,
    cycles: &Cycles,
) -> (Vec<f64>, Vec<JointVector>, bool) {
    let span = [-BEFORE_S, until_s].map(|t| begin.plus_s(t).0);
    let measured = cycles.joints_between(span[0], span[1]);
    let is_measured = measured.len() >= SAMPLES_MIN;
    let commanded = || motion.iter().map(|c| (c.deadline_ns, c.q_c)).collect();
    let moved: Vec<(u64, JointVector)> = if is_measured { measured } else { commanded() };
    let (times_s, q) = moved
        .into_iter()
        .map(|(at_ns, q)| (MonotonicNs(at_ns).since_s(begin), q))
        .filter(|(t, _)| *t <= until_s)
        .unzip();
    (times_s, q, is_measured)
}

/// A place as the page reads it (0.1 mm).
pub fn tenths_mm(p: &Vector3<f64>) -> [i32; 3] {
    [0, 1, 2].map(|axis| (p[axis] * 1e4).round() as i32)
}

/// Base, origins of the joints, end of the pole (0.1 mm).
pub fn arm_points(q: &JointVector, pole: &Pole) -> Vec<i32> {
    let origins = kinematics::link_poses(q).map(|(p, _)| p);
    let (tip, _) = pole.attach_pose(q);
    std::iter::once(Vector3::zeros())
        .chain(origins)
        .chain([tip])
        .flat_map(|p| tenths_mm(&p))
        .collect()
}

/// The same span with more frames.
fn finer(frames: FrameTimes, rate: usize) -> FrameTimes {
    FrameTimes {
        period_s: frames.period_s / rate as f64,
        count: (frames.count.saturating_sub(1)) * rate + 1,
        ..frames
    }
}

/// The rope in every frame, from its state in the first, or hanging still there; none when it
/// cannot be simulated.
pub(super) fn simulate(
    around: &rope_sim::Scene,
    (rope, start): (&RopeParams, Option<&RopeState>),
    motion: &dyn AttachMotion,
    frames: FrameTimes,
    step_s: f64,
) -> anyhow::Result<Option<NodeTrack>> {
    let end_s = frames.time_s(frames.count.saturating_sub(1));
    let options = SimOptions {
        frames,
        ..SimOptions::new(step_s, Precision::F64, end_s)
    };
    let thrown = Candidate::new(rope, motion).from_state(start);
    let rollouts = roll_out_in(around, &[thrown], &options)?;
    let whole = rollouts
        .into_iter()
        .find(|r| r.outcome != Outcome::Diverged);
    Ok(whole.map(|r| r.nodes))
}

/// The tip in every frame (m).
fn tips(rope: &NodeTrack) -> Vec<Vector3<f64>> {
    let tip = rope.nodes().saturating_sub(1);
    (0..rope.frames())
        .map(|frame| rope.position(frame, tip))
        .collect()
}

/// Nodes of every `rate`th frame, as the page reads them.
pub(super) fn rows(rope: &NodeTrack, rate: usize) -> Vec<Vec<i32>> {
    let node = |frame, node| tenths_mm(&rope.position(frame, node));
    (0..rope.frames())
        .step_by(rate)
        .map(|frame| (0..rope.nodes()).flat_map(|i| node(frame, i)).collect())
        .collect()
}

/// Joints as wanted and as measured, at times that show their shape.
fn curves(
    motion: &[CycleRecord],
    begin: MonotonicNs,
    plan: Option<&Plan>,
    measured: Option<&MeasuredArm>,
) -> Joints {
    let every = motion.len().div_ceil(CURVE_POINTS);
    let mut joints = Joints {
        wanted_is: if plan.is_some() {
            "planned"
        } else {
            "commanded"
        },
        ..Joints::default()
    };
    // A hundredth of a milliradian is less than the arm reports.
    let round = |v: f64| (v * 1e5).round() / 1e5;
    for cycle in motion.iter().step_by(every) {
        let t_s = MonotonicNs(cycle.deadline_ns).since_s(begin);
        if t_s > LONGEST_S {
            break;
        }
        joints.t_s.push(round(t_s));
        let wanted = plan.map_or(cycle.q_c, |p| p.trajectory.state_at(t_s).q);
        let seen = measured.map(|arm| arm.joints_at(t_s).q);
        for j in 0..JOINTS {
            joints.wanted[j].push(round(wanted[j]));
            joints.measured[j].extend(seen.map(|q| round(q[j])));
            joints.error[j].extend(seen.map(|q| round(cycle.q_c[j] - q[j])));
        }
    }
    joints
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_motion_is_a_row_of_streaming_cycles() {
        let run = |mode: ControllerMode, count: u32| {
            (0..count).map(move |i| CycleRecord {
                mode: mode as u8,
                trajectory_s: f64::from(i),
                ..CycleRecord::default()
            })
        };
        // The third and the fourth follow each other without a pause.
        let cycles: Vec<CycleRecord> = run(ControllerMode::Moving, 60)
            .chain(run(ControllerMode::Streaming, 40))
            .chain(run(ControllerMode::Idle, 30))
            .chain(run(ControllerMode::Streaming, 50))
            .chain(run(ControllerMode::Streaming, 30))
            .chain(run(ControllerMode::Streaming, 3))
            .collect();
        let lengths: Vec<usize> = motions(&cycles).iter().map(|m| m.len()).collect();
        assert_eq!(lengths, [40, 50, 30]);
    }
}
