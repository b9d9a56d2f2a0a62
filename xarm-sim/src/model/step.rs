//! One millisecond of the controller: which command is due, where the joints
//! go, what they meet.

use super::*;

impl ArmModel {
    /// Runs whole steps up to `now` and gives the motion after each.
    pub fn advance_to(&mut self, now: MonotonicNs, mut each: impl FnMut(JointSample)) {
        while self.time.0 + STEP_NS <= now.0 {
            self.step();
            each(JointSample {
                at: self.time,
                state: self.true_motion(),
            });
        }
    }

    /// One step of 1 ms.
    pub fn step(&mut self) {
        let end = MonotonicNs(self.time.0 + STEP_NS);
        match self.mode {
            Mode::Servo => self.run_stream(end),
            Mode::JointVelocity => self.run_velocity(end),
            _ => self.start_next_move(),
        }
        let before = self.reference.q;
        self.reference.advance(end, STEP_S, &self.config.limits);
        if self.reference.q != before {
            self.guard_reference(before);
            self.drive_joints(end);
        }
        if self.phase == ArmState::Stopping && !self.is_moving() {
            self.phase = ArmState::Stopped;
        }
        for joint in &mut self.joints {
            joint.advance(self.time, end);
        }
        self.time = end;
        self.watch_obstacles();
        self.tell_state();
    }

    /// Executes the streamed setpoint that is due, holds when none comes.
    pub(super) fn run_stream(&mut self, end: MonotonicNs) {
        if !self.can_move() {
            return;
        }
        let cycle_s = self.cycle_s();
        if let Some(setpoint) = self.servo.take(end, cycle_s, self.config.intake) {
            self.counters.executed += 1;
            self.reference.jump(setpoint.q, setpoint.qd);
            self.drive_joints(setpoint.at);
        } else if self.servo.is_silent(end) && !self.reference.is_busy() {
            self.reference.hold();
        }
    }

    /// Executes the velocity command that is due.
    pub(super) fn run_velocity(&mut self, end: MonotonicNs) {
        if !self.can_move() {
            return;
        }
        let cycle_s = self.cycle_s();
        if let Some((at, command)) = self.velocity.take(end, cycle_s, self.config.intake) {
            self.counters.executed += 1;
            // A duration of zero, like none, means without end.
            let until = command
                .duration_s
                .filter(|s| *s > 0.0)
                .map(|s| at.plus_s(self.clock.span_s(s)));
            self.reference
                .start_velocity(command.qd, command.synchronised, until);
        }
    }

    /// Time between two motion commands that are taken, on our clock (s).
    fn cycle_s(&self) -> f64 {
        self.clock.span_s(self.config.firmware.setpoint_cycle_s())
    }

    fn start_next_move(&mut self) {
        if !self.can_move() || self.mode != Mode::Position || self.reference.is_busy() {
            return;
        }
        match self.moves.front().copied() {
            Some(next) if (next.target - self.reference.q).max_abs() > 1e-6 => {
                self.tell_task(next.task, FeedbackKind::Started);
                self.reference.start_move(&next);
            }
            // The move at the front has arrived.
            Some(done) => {
                self.moves.pop_front();
                self.tell_task(done.task, FeedbackKind::Ended);
            }
            None => {}
        }
    }

    pub(super) fn tell_task(&mut self, task: Task, kind: FeedbackKind) {
        let time_us = self.time_us();
        self.feedback.push(Feedback {
            task,
            kind,
            time_us,
        });
    }

    /// A move or velocity that leaves the joint range, meets the arm itself or
    /// the safety boundary stops before it does.
    fn guard_reference(&mut self, before: JointVector) {
        if self.phase != ArmState::Ready || self.mode == Mode::Servo {
            return;
        }
        let outside = self.config.limits.position_violation(&self.reference.q);
        let verdict = match outside {
            Some(_) if self.mode == Mode::JointVelocity => Err(ErrorCode::JOINT_LIMIT),
            _ => self.setpoint_limits().check_pose(&self.reference.q),
        };
        if let Err(code) = verdict {
            self.reference.jump(before, JointVector::ZERO);
            self.raise(code);
        }
    }

    /// A contact that deepens is a collision.
    fn watch_obstacles(&mut self) {
        let ArmConfig {
            cell, obstacles, ..
        } = &self.config;
        let stands_free = cell.is_none() && obstacles.is_empty();
        if stands_free || self.true_motion().qd.max_abs() < STANDING_RAD_S {
            return;
        }
        let tool = self.settings.tcp_offset.position();
        let depth_m = obstacle_depth_m(&self.true_motion().q, &tool, cell.as_ref(), obstacles);
        if depth_m > self.contact_m + CONTACT_STEP_M {
            self.contact_m = depth_m;
            if self.error.is_none() {
                self.collide();
            }
        } else {
            self.contact_m = self.contact_m.min(depth_m.max(0.0));
        }
    }

    pub(super) fn tell_state(&mut self) {
        let now = (self.state(), self.mode);
        if now != self.reported {
            self.reported = now;
            let (state, mode) = now;
            self.log(ArmEvent::State { state, mode });
        }
    }

    fn drive_joints(&mut self, at: MonotonicNs) {
        for (joint, q) in self.joints.iter_mut().zip(self.reference.q.iter()) {
            joint.command(at, *q);
        }
    }
}
