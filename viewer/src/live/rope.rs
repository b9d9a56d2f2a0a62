//! A known rope simulated under the joints as they are measured, a little behind them.

use arm_model::{JointPiece, JointState, JointVector, Pole};
use rope_sim::LiveRope;
use shared_types::RopeParams;

/// Step of the simulation (s).
const STEP_S: f64 = 1e-3;
/// Least time between two reports that are used (s): closer ones tell more about the
/// encoders' last digit than about accelerations.
const KNOT_S: f64 = 0.016;
/// A silence after which the rope is hung up anew (s).
const SILENCE_S: f64 = 0.25;

/// Joints at a time.
#[derive(Debug, Clone, Copy)]
struct Knot {
    t_s: f64,
    q: JointVector,
}

/// The rope, and the last joints it has heard of.
#[derive(Debug)]
pub(crate) struct FollowingRope {
    pub params: RopeParams,
    pole: Pole,
    live: Option<LiveRope>,
    /// When the simulation's clock began (CLOCK_MONOTONIC, ns).
    began_ns: u64,
    /// At most four, in order of time.
    knots: Vec<Knot>,
}

impl FollowingRope {
    /// A rope on this pole that hangs still at the first report.
    pub(crate) fn new(params: RopeParams, pole: Pole) -> Self {
        Self {
            params,
            pole,
            live: None,
            began_ns: 0,
            knots: Vec::with_capacity(4),
        }
    }

    /// Nodes in metres, attach point first; none before the first report or when the
    /// simulation broke down.
    pub(crate) fn nodes(&self) -> &[nalgebra::Vector3<f64>] {
        self.live.as_ref().map_or(&[], LiveRope::nodes)
    }

    /// Takes in measured joints (CLOCK_MONOTONIC, ns).
    pub(crate) fn report(&mut self, stamp_ns: u64, q: JointVector) {
        let t_s = |began: u64| stamp_ns.saturating_sub(began) as f64 * 1e-9;
        match self.knots.last() {
            Some(last) => {
                let since_s = t_s(self.began_ns) - last.t_s;
                if since_s > SILENCE_S || !self.live.as_ref().is_some_and(LiveRope::is_finite) {
                    self.hang(stamp_ns, q);
                } else if since_s >= KNOT_S {
                    self.knots.push(Knot {
                        t_s: t_s(self.began_ns),
                        q,
                    });
                    self.follow();
                }
            }
            None => self.hang(stamp_ns, q),
        }
    }

    fn hang(&mut self, stamp_ns: u64, q: JointVector) {
        let attach = self.pole.attach_motion(&JointState::at_rest(q));
        self.live = LiveRope::new(&self.params, &attach, STEP_S).ok();
        self.began_ns = stamp_ns;
        self.knots.clear();
        self.knots.push(Knot { t_s: 0.0, q });
    }

    /// Follows the joints from the second last but one to the last but one: cubics that
    /// pass through the reports with the slope between their neighbours.
    fn follow(&mut self) {
        let (before, from, to, after) = match self.knots[..] {
            [a, b, c] => (a, a, b, c),
            [a, b, c, d] => (a, b, c, d),
            _ => return,
        };
        let slope = |a: Knot, b: Knot| (b.q - a.q) * (1.0 / (b.t_s - a.t_s));
        let slopes = [slope(before, to), slope(from, after)];
        let piece = JointPiece::cubic([from.q, to.q], slopes, to.t_s - from.t_s);
        if let Some(live) = &mut self.live {
            let pole = self.pole;
            live.advance(&|t_s| pole.attach_motion(&piece.at(t_s - from.t_s)), to.t_s);
        }
        if self.knots.len() == 4 {
            self.knots.remove(0);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use arm_model::joint::START_POSE;
    use rope_sim::{Candidate, FrameTimes, MeasuredArm, Precision, SimOptions, roll_out};
    use shared_types::rope::RANGES;

    fn rope() -> RopeParams {
        RopeParams::from_array(RANGES.map(|r| 0.5 * (r.min + r.max)))
    }

    fn joints(t_s: f64) -> JointVector {
        let mut q = START_POSE;
        q[5] += 0.15 * (1.0 - (5.0 * t_s).cos());
        q
    }

    #[test]
    fn it_follows_the_reports_as_a_simulation_of_the_whole_motion_does() {
        let mut rope_live = FollowingRope::new(rope(), Pole::default());
        let began_ns = 7_000_000_000;
        for k in 0..500_u64 {
            rope_live.report(began_ns + k * 4_000_000, joints(k as f64 * 0.004));
        }
        let reached_s = rope_live.live.as_ref().unwrap().time_s();
        assert!(reached_s > 1.93, "{reached_s}");
        let times: Vec<f64> = (0..1000).map(|k| f64::from(k) * 0.002).collect();
        let q: Vec<JointVector> = times.iter().map(|t| joints(*t)).collect();
        let arm = MeasuredArm::new(&times, &q, Pole::default()).unwrap();
        let options = SimOptions {
            frames: FrameTimes {
                first_s: reached_s,
                period_s: 1.0,
                count: 1,
            },
            ..SimOptions::new(1e-3, Precision::F64, reached_s)
        };
        let rope = rope();
        let whole = roll_out(&[Candidate::new(&rope, &arm)], &options).unwrap();
        let nodes = &whole[0].nodes;
        let tip = nodes.position(0, nodes.nodes() - 1);
        let apart_m = (rope_live.nodes().last().unwrap() - tip).norm();
        let moved_m = (rope_live.nodes().last().unwrap() - FollowingRope::at_rest(&rope)).norm();
        assert!(apart_m < 0.01, "{apart_m} m apart");
        assert!(moved_m > 0.05, "moved {moved_m} m");
    }

    impl FollowingRope {
        fn at_rest(rope: &RopeParams) -> nalgebra::Vector3<f64> {
            let mut still = Self::new(*rope, Pole::default());
            still.report(0, joints(0.0));
            *still.nodes().last().unwrap()
        }
    }

    #[test]
    fn after_a_silence_it_hangs_still_where_the_arm_is_now() {
        let mut rope = FollowingRope::new(rope(), Pole::default());
        assert!(rope.nodes().is_empty());
        rope.report(0, joints(0.0));
        rope.report(2_000_000_000, joints(0.6));
        let (clamp, tip) = (rope.nodes()[0], *rope.nodes().last().unwrap());
        let there = Pole::default()
            .attach_motion(&JointState::at_rest(joints(0.6)))
            .p_m;
        assert!((clamp - there).norm() < 1e-12);
        assert!(tip.z < clamp.z - 0.2);
    }
}
