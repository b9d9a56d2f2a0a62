//! State of every link when its rope reaches the end of the simulation.

use crate::clock::Clock;
use crate::lanes::Lanes;
use crate::state::Link;

/// Attitude and spin of one link.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LinkState {
    /// Attitude, link frame to world, unit quaternion with the scalar first.
    pub q_wxyz: [f64; 4],
    /// Angular velocity (rad/s, world).
    pub w_rad_s: [f64; 3],
}

/// Keeps the state of each lane at its own end: lanes take steps of their own length
/// and idle on after their last one.
pub(super) struct FinalStates {
    lanes: Vec<Option<Vec<LinkState>>>,
}

impl FinalStates {
    pub(super) fn new(lanes: usize) -> Self {
        Self {
            lanes: vec![None; lanes],
        }
    }

    /// Keeps lanes that have just finished; call before the next step is taken.
    #[inline(always)]
    pub(super) fn before_step<V: Lanes>(&mut self, clock: &Clock<V>, links: &[Link<V>]) {
        for lane in 0..self.lanes.len() {
            if self.lanes[lane].is_none() && clock.finished(lane) {
                self.lanes[lane] = Some(states(lane, links));
            }
        }
    }

    /// State of a lane at its end; `links` is the group's state after its last step.
    #[inline(always)]
    pub(super) fn take<V: Lanes>(&mut self, lane: usize, links: &[Link<V>]) -> Vec<LinkState> {
        self.lanes[lane]
            .take()
            .unwrap_or_else(|| states(lane, links))
    }
}

#[inline(always)]
fn states<V: Lanes>(lane: usize, links: &[Link<V>]) -> Vec<LinkState> {
    links
        .iter()
        .map(|link| {
            let [x, y, z] = link.q.v.get(lane);
            LinkState {
                q_wxyz: [link.q.w.get(lane), x, y, z],
                w_rad_s: link.w.get(lane),
            }
        })
        .collect()
}
