//! Requests that move the arm.

use super::*;

/// Speed and acceleration of a move that names none (SDK defaults: 20 deg/s,
/// 500 deg/s²).
const DEFAULT_MOVE_SPEED_RAD_S: f64 = 0.349_066;
const DEFAULT_MOVE_ACCELERATION_RAD_S2: f64 = 8.726_646;

impl ArmModel {
    /// Commands that move the arm; without effect while it cannot move.
    pub(super) fn run_motion(&mut self, at: MonotonicNs, command: &Command) -> Option<ReplyData> {
        Some(match command {
            Command::ServoJoint(q) => {
                if self.can_move() && self.mode == Mode::Servo {
                    self.stream(at, *q);
                } else {
                    self.ignore(command);
                }
                ReplyData::None
            }
            Command::JointVelocity {
                velocity,
                synchronised,
                duration_s,
            } => {
                if self.can_move() && self.mode == Mode::JointVelocity {
                    let known = self.config.firmware.has_velocity_duration();
                    let request = VelocityCommand {
                        qd: *velocity,
                        synchronised: *synchronised,
                        duration_s: duration_s.filter(|_| known),
                    };
                    self.take_velocity(at, request);
                } else {
                    self.ignore(command);
                }
                ReplyData::None
            }
            Command::MoveJoint {
                target,
                speed_rad_s,
                acceleration_rad_s2,
                checked,
            } => {
                let speeds = [*speed_rad_s, *acceleration_rad_s2];
                self.queue_move(command.register(), target, speeds, *checked)
            }
            Command::MoveHome {
                speed_rad_s,
                acceleration_rad_s2,
                checked,
            } => {
                let speeds = [*speed_rad_s, *acceleration_rad_s2];
                self.queue_move(command.register(), &JointVector::ZERO, speeds, *checked)
            }
            _ => return None,
        })
    }

    /// A streamed setpoint: checked on arrival, taken at once unless that would
    /// exceed 250 Hz, then by a later step.
    fn stream(&mut self, arrived: MonotonicNs, q: JointVector) {
        let at = arrived.max(self.time);
        // What was due before this one came has had its turn.
        self.run_stream(at);
        let present = self.reference.q;
        let mut servo = std::mem::take(&mut self.servo);
        let verdict = servo.offer(arrived, at, q, present, &self.setpoint_limits());
        self.servo = servo;
        match verdict {
            Ok(()) => {
                self.counters.motion_commands += 1;
                self.log(ArmEvent::Setpoint(q));
                self.run_stream(at);
            }
            Err(error) => self.raise(error),
        }
    }

    /// A motion command that cannot be executed now is answered, no more.
    fn ignore(&mut self, command: &Command) {
        self.counters.ignored += 1;
        self.log(ArmEvent::Ignored {
            register: command.register().code(),
        });
    }

    fn take_velocity(&mut self, at: MonotonicNs, request: VelocityCommand) {
        let limits = &self.config.limits.velocity_max_rad_s;
        if (0..JOINTS).any(|j| request.qd[j].abs() > limits[j]) {
            return self.raise(ErrorCode::SPEED_LIMIT);
        }
        self.counters.motion_commands += 1;
        self.log(ArmEvent::Velocity {
            qd: request.qd,
            duration_s: request.duration_s,
        });
        let at = at.max(self.time);
        self.run_velocity(at);
        self.velocity.offer(at, request);
        self.run_velocity(at);
    }

    fn queue_move(
        &mut self,
        register: Register,
        target: &JointVector,
        [speed_rad_s, acceleration_rad_s2]: [f64; 2],
        checked: Option<u8>,
    ) -> ReplyData {
        let outside = self.config.limits.position_violation(target).is_some();
        let only_check = checked.is_some_and(|kind| kind > 0);
        if self.can_move() && self.mode == Mode::Position && !only_check {
            if outside {
                self.raise(ErrorCode::JOINT_LIMIT);
            } else if self.moves.len() >= BUFFER_CAPACITY {
                self.warn(warning::QUEUE_FULL);
            } else {
                self.tasks = self.tasks.wrapping_add(1);
                let limits = &self.config.limits;
                let or_default = |value: f64, default: f64, max: f64| {
                    if value > 0.0 { value } else { default }.min(max)
                };
                self.moves.push_back(Move {
                    target: *target,
                    speed_rad_s: or_default(
                        speed_rad_s,
                        DEFAULT_MOVE_SPEED_RAD_S,
                        limits.velocity_max_rad_s[0],
                    ),
                    acceleration_rad_s2: or_default(
                        acceleration_rad_s2,
                        DEFAULT_MOVE_ACCELERATION_RAD_S2,
                        self.settings.joint_acceleration_rad_s2,
                    ),
                    task: Task {
                        origin: self.origin,
                        register,
                        number: self.tasks,
                    },
                });
            }
        }
        let buffered = self.buffered();
        match checked {
            Some(_) => ReplyData::CheckedMove {
                buffered,
                result: u8::from(outside),
            },
            None => ReplyData::Buffered(buffered),
        }
    }
}
