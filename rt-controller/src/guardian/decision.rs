//! What the guardian does and when: pure, no clock, no I/O.
//!
//! ```text
//!            controller fresh        lost or cut off while moving
//!  Waiting ------------------> Watching -----------------> Stopping
//!     ^                           |                          |   | 3 s without
//!     |    lost at rest           |      state 4 or 5 read   |   | state 4
//!     +---------------------------+            +-------------+   v
//!     |                                        v              Unheard
//!     +------------------ another controller, at rest ----------+
//!                                           Stopped
//! ```
//!
//! Cut off is a controller that lives but has lost its link to the moving arm:
//! it cannot ask for the stop itself. A stop under way ends when the fault is
//! acknowledged, since the controller has a new link by then.
//!
//! Stopping is the way the vendor's own SDK does it: state 4 is asked for, then
//! read; again every 0.1 s for at most 3 s.

use crate::xarm::ArmState;

/// The stop is asked for this often (ns).
const ASK_EVERY_NS: u64 = 100_000_000;
/// Silence at rest after which the controller is looked for anew (ns).
const FORGET_AFTER_NS: u64 = 500_000_000;
/// Time in which the arm must be seen stopped (ns).
const STOP_WITHIN_NS: u64 = 3_000_000_000;

/// What the guardian knows in one turn.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct GuardianInput {
    /// Now (CLOCK_MONOTONIC, ns).
    pub now_ns: u64,
    /// The controller's newest sign of life, `None` without a controller.
    pub pulse: Option<Pulse>,
    /// State of the arm, if it was read since the last turn.
    pub arm_state: Option<u8>,
    /// Whether there is a connection to the arm.
    pub connected: bool,
}

/// The controller's sign of life.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Pulse {
    /// When its newest cycle woke (CLOCK_MONOTONIC, ns).
    pub stamp_ns: u64,
    /// Whether the arm moved in it.
    pub moving: bool,
    /// Whether its control thread or its process has ended.
    pub ended: bool,
    /// Whether it has latched because its link to the arm failed.
    pub cut_off: bool,
}

/// Why the arm is being stopped.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Emergency {
    /// The controller ended or fell silent.
    #[default]
    Lost,
    /// The controller lives but cannot reach the arm.
    CutOff,
}

/// What the guardian is doing. Numbers are part of the shared layout.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[repr(u8)]
pub enum GuardianPhase {
    /// There is no controller.
    #[default]
    Waiting = 0,
    /// The controller lives.
    Watching = 1,
    /// The controller was lost while the arm moved: it is being stopped.
    Stopping = 2,
    /// The arm was seen stopped.
    Stopped = 3,
    /// The arm was asked to stop but never seen stopped.
    StopUnconfirmed = 4,
}

/// What is to be done after a turn.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct GuardianOutput {
    /// Ask the arm for state 4, then read its state.
    pub ask_stop: bool,
    /// The phase changed in this turn.
    pub changed: Option<GuardianPhase>,
    /// Look for a controller anew: the one known is gone.
    pub look_again: bool,
}

/// The guardian's mind. RT-safe.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Guardian {
    silence_ns: u64,
    phase: GuardianPhase,
    since_ns: u64,
    asked_ns: Option<u64>,
    lost_stamp_ns: u64,
    emergency: Emergency,
    /// Whether the arm moved when the controller was seen last.
    moved: bool,
}

impl Guardian {
    /// Takes a controller for lost after `silence_ns` without a sign of life.
    #[must_use]
    pub const fn new(silence_ns: u64) -> Self {
        Self {
            silence_ns,
            phase: GuardianPhase::Waiting,
            since_ns: 0,
            asked_ns: None,
            lost_stamp_ns: 0,
            emergency: Emergency::Lost,
            moved: false,
        }
    }

    /// Why the arm is being stopped, or was.
    #[must_use]
    pub const fn emergency(&self) -> Emergency {
        self.emergency
    }

    /// Present phase.
    #[must_use]
    pub const fn phase(&self) -> GuardianPhase {
        self.phase
    }

    /// From the lost controller's last sign of life to the first request for a
    /// stop (ns), once there was one.
    #[must_use]
    pub fn reaction_ns(&self) -> Option<u64> {
        let stopped = matches!(
            self.phase,
            GuardianPhase::Stopping | GuardianPhase::Stopped | GuardianPhase::StopUnconfirmed
        );
        stopped.then(|| self.since_ns.saturating_sub(self.lost_stamp_ns))
    }

    /// The request of the last turn could not be sent: it is due at once.
    pub fn was_not_sent(&mut self) {
        self.asked_ns = None;
    }

    /// One turn.
    pub fn step(&mut self, input: &GuardianInput) -> GuardianOutput {
        let before = self.phase;
        let mut out = match self.phase {
            GuardianPhase::Waiting => self.wait(input),
            GuardianPhase::Watching => self.watch(input),
            GuardianPhase::Stopping => self.stop(input),
            GuardianPhase::Stopped | GuardianPhase::StopUnconfirmed => self.rest(input),
        };
        out.changed = (self.phase != before).then_some(self.phase);
        out
    }

    fn is_lost(&self, input: &GuardianInput, pulse: &Pulse) -> bool {
        pulse.ended || input.now_ns.saturating_sub(pulse.stamp_ns) > self.silence_ns
    }

    fn enter(&mut self, phase: GuardianPhase, now_ns: u64) {
        self.phase = phase;
        self.since_ns = now_ns;
    }

    fn wait(&mut self, input: &GuardianInput) -> GuardianOutput {
        let Some(pulse) = input.pulse else {
            return look_again(true);
        };
        if !self.is_lost(input, &pulse) {
            self.enter(GuardianPhase::Watching, input.now_ns);
            self.moved = pulse.moving;
            return GuardianOutput::default();
        }
        if pulse.moving {
            // It began to move and was lost before it could be watched.
            return self.stop_for(Emergency::Lost, &pulse, input);
        }
        look_again(is_gone(input, &pulse))
    }

    fn watch(&mut self, input: &GuardianInput) -> GuardianOutput {
        let Some(pulse) = input.pulse else {
            return GuardianOutput::default();
        };
        let moved = core::mem::replace(&mut self.moved, pulse.moving);
        if !self.is_lost(input, &pulse) {
            if pulse.cut_off && moved {
                return self.stop_for(Emergency::CutOff, &pulse, input);
            }
            return GuardianOutput::default();
        }
        if !pulse.moving {
            // At rest the arm holds by itself.
            self.enter(GuardianPhase::Waiting, input.now_ns);
            return look_again(is_gone(input, &pulse));
        }
        self.stop_for(Emergency::Lost, &pulse, input)
    }

    fn stop_for(
        &mut self,
        emergency: Emergency,
        pulse: &Pulse,
        input: &GuardianInput,
    ) -> GuardianOutput {
        self.enter(GuardianPhase::Stopping, input.now_ns);
        self.emergency = emergency;
        self.lost_stamp_ns = pulse.stamp_ns;
        self.asked_ns = None;
        self.ask(input)
    }

    fn stop(&mut self, input: &GuardianInput) -> GuardianOutput {
        let stopped = |code| {
            matches!(
                ArmState::from_code(code),
                ArmState::Stopped | ArmState::NeedsReset
            )
        };
        let reached_again = |pulse: &Pulse| !self.is_lost(input, pulse) && !pulse.cut_off;
        if self.emergency == Emergency::CutOff && input.pulse.as_ref().is_some_and(reached_again) {
            self.enter(GuardianPhase::Watching, input.now_ns);
            return GuardianOutput::default();
        }
        // A state read before the first request says nothing.
        if self.asked_ns.is_some() && input.arm_state.is_some_and(stopped) {
            self.phase = GuardianPhase::Stopped;
            return GuardianOutput::default();
        }
        if input.now_ns.saturating_sub(self.since_ns) > STOP_WITHIN_NS {
            self.phase = GuardianPhase::StopUnconfirmed;
            return GuardianOutput::default();
        }
        self.ask(input)
    }

    /// Asks when it is time and there is a connection.
    fn ask(&mut self, input: &GuardianInput) -> GuardianOutput {
        let due = self
            .asked_ns
            .is_none_or(|at_ns| input.now_ns.saturating_sub(at_ns) >= ASK_EVERY_NS);
        let ask_stop = due && input.connected;
        if ask_stop {
            self.asked_ns = Some(input.now_ns);
        }
        GuardianOutput {
            ask_stop,
            ..GuardianOutput::default()
        }
    }

    /// Latched: only another sign of life than the lost one's, at rest, is
    /// watched again.
    fn rest(&mut self, input: &GuardianInput) -> GuardianOutput {
        let again = input.pulse.filter(|pulse| {
            !self.is_lost(input, pulse) && !pulse.moving && pulse.stamp_ns != self.lost_stamp_ns
        });
        if again.is_some() {
            self.enter(GuardianPhase::Watching, input.now_ns);
            return GuardianOutput::default();
        }
        look_again(input.pulse.is_none_or(|pulse| self.is_lost(input, &pulse)))
    }
}

/// Whether a controller that is lost at rest will not come back.
fn is_gone(input: &GuardianInput, pulse: &Pulse) -> bool {
    pulse.ended || input.now_ns.saturating_sub(pulse.stamp_ns) > FORGET_AFTER_NS
}

/// Nothing to do but, perhaps, to look for another controller.
fn look_again(look_again: bool) -> GuardianOutput {
    GuardianOutput {
        look_again,
        ..GuardianOutput::default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};

    const MS: u64 = 1_000_000;
    const PERIOD_NS: u64 = 4 * MS;
    const TURN_NS: u64 = 2 * MS;
    /// Three cycles.
    const SILENCE_NS: u64 = 3 * PERIOD_NS;

    /// An arm whose state is 4 a while after it was asked for.
    #[derive(Default)]
    struct Scene {
        asked_ns: Vec<u64>,
        /// When the state reads 4; never if absent.
        stops_ns: Option<u64>,
        phases: Vec<GuardianPhase>,
    }

    impl Scene {
        /// Turns from `from_ns` to `to_ns`; the controller lives, moving, until
        /// `dies_ns`.
        fn play(&mut self, guardian: &mut Guardian, from_ns: u64, dies_ns: u64, to_ns: u64) {
            for now_ns in (from_ns..to_ns).step_by(usize::try_from(TURN_NS).unwrap()) {
                let stamp_ns = now_ns.min(dies_ns) / PERIOD_NS * PERIOD_NS;
                let input = GuardianInput {
                    now_ns,
                    pulse: Some(Pulse {
                        stamp_ns,
                        moving: true,
                        ended: false,
                        cut_off: false,
                    }),
                    arm_state: self.stops_ns.map(|t| if now_ns >= t { 4 } else { 1 }),
                    connected: true,
                };
                let out = guardian.step(&input);
                if out.ask_stop {
                    self.asked_ns.push(now_ns);
                }
                self.phases.extend(out.changed);
            }
        }
    }

    #[test]
    fn a_controller_that_dies_at_any_moment_is_met_within_20_ms() {
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(28);
        let mut worst_ns = 0;
        for _ in 0..1000 {
            let mut guardian = Guardian::new(SILENCE_NS);
            let mut scene = Scene::default();
            let begin_ns = 1_000 * MS + rng.random_range(0..PERIOD_NS);
            let dies_ns = begin_ns + rng.random_range(40 * MS..400 * MS);
            scene.play(&mut guardian, begin_ns, dies_ns, dies_ns + 50 * MS);
            let reaction_ns = scene.asked_ns[0] - dies_ns;
            assert!(reaction_ns <= 20 * MS, "{reaction_ns}");
            worst_ns = worst_ns.max(reaction_ns);
        }
        println!("slowest reaction: {:.1} ms", worst_ns as f64 / 1e6);
    }

    #[test]
    fn an_ended_process_needs_no_silence() {
        let mut guardian = Guardian::new(500 * MS);
        let mut input = GuardianInput {
            now_ns: 1000 * MS,
            pulse: Some(Pulse {
                stamp_ns: 999 * MS,
                moving: true,
                ended: false,
                cut_off: false,
            }),
            connected: true,
            ..GuardianInput::default()
        };
        guardian.step(&input);
        input.now_ns += TURN_NS;
        input.pulse = input.pulse.map(|pulse| Pulse {
            ended: true,
            ..pulse
        });
        assert!(guardian.step(&input).ask_stop);
        assert_eq!(guardian.reaction_ns(), Some(3 * MS));
    }

    #[test]
    fn the_stop_is_repeated_until_state_4_is_read_and_then_latched() {
        let mut guardian = Guardian::new(SILENCE_NS);
        let mut scene = Scene {
            stops_ns: Some(1_350 * MS),
            ..Scene::default()
        };
        scene.play(&mut guardian, 1000 * MS, 1100 * MS, 9000 * MS);
        assert_eq!(scene.asked_ns.len(), 3);
        assert!(scene.asked_ns.windows(2).all(|w| w[1] - w[0] == 100 * MS));
        let phases = [
            GuardianPhase::Watching,
            GuardianPhase::Stopping,
            GuardianPhase::Stopped,
        ];
        assert_eq!(scene.phases, phases);
    }

    #[test]
    fn an_arm_that_never_answers_is_asked_for_3_s_and_reported() {
        let mut guardian = Guardian::new(SILENCE_NS);
        let mut scene = Scene::default();
        scene.play(&mut guardian, 1000 * MS, 1100 * MS, 9000 * MS);
        assert_eq!(scene.asked_ns.len(), 31);
        assert_eq!(scene.phases.last(), Some(&GuardianPhase::StopUnconfirmed));
    }

    #[test]
    fn a_controller_lost_at_rest_is_no_emergency() {
        let mut guardian = Guardian::new(SILENCE_NS);
        let pulse = Pulse {
            stamp_ns: 1000 * MS,
            moving: false,
            ended: false,
            cut_off: false,
        };
        let mut input = GuardianInput {
            now_ns: 1001 * MS,
            pulse: Some(pulse),
            connected: true,
            ..GuardianInput::default()
        };
        guardian.step(&input);
        assert_eq!(guardian.phase(), GuardianPhase::Watching);
        input.now_ns = 2000 * MS;
        let out = guardian.step(&input);
        assert!(!out.ask_stop && out.look_again, "silent for long");
        assert_eq!(guardian.phase(), GuardianPhase::Waiting);
    }

    #[test]
    fn only_a_living_controller_at_rest_ends_the_latch() {
        let mut guardian = Guardian::new(SILENCE_NS);
        let mut scene = Scene {
            stops_ns: Some(1_150 * MS),
            ..Scene::default()
        };
        scene.play(&mut guardian, 1000 * MS, 1100 * MS, 1300 * MS);
        assert_eq!(guardian.phase(), GuardianPhase::Stopped);
        let mut turn = |now_ms: u64, moving| {
            guardian.step(&GuardianInput {
                now_ns: now_ms * MS,
                pulse: Some(Pulse {
                    stamp_ns: now_ms * MS,
                    moving,
                    ended: false,
                    cut_off: false,
                }),
                connected: true,
                ..GuardianInput::default()
            });
            guardian.phase()
        };
        assert_eq!(turn(5000, true), GuardianPhase::Stopped);
        assert_eq!(turn(5002, false), GuardianPhase::Watching);
    }

    #[test]
    fn without_a_connection_the_first_request_goes_out_with_it() {
        let mut guardian = Guardian::new(SILENCE_NS);
        let mut input = GuardianInput {
            now_ns: 1000 * MS,
            pulse: Some(Pulse {
                stamp_ns: 1000 * MS,
                moving: true,
                ended: false,
                cut_off: false,
            }),
            connected: false,
            ..GuardianInput::default()
        };
        guardian.step(&input);
        input.now_ns += 50 * MS;
        assert!(!guardian.step(&input).ask_stop);
        input.now_ns += 30 * MS;
        input.connected = true;
        assert!(guardian.step(&input).ask_stop);
    }

    /// Turns of a guardian that watches a living controller.
    struct Turns {
        guardian: Guardian,
        now_ns: u64,
    }

    impl Turns {
        fn new() -> Self {
            Self {
                guardian: Guardian::new(SILENCE_NS),
                now_ns: 1000 * MS,
            }
        }

        fn turn(&mut self, moving: bool, cut_off: bool) -> GuardianOutput {
            self.now_ns += TURN_NS;
            self.guardian.step(&GuardianInput {
                now_ns: self.now_ns,
                pulse: Some(Pulse {
                    stamp_ns: self.now_ns,
                    moving,
                    ended: false,
                    cut_off,
                }),
                connected: true,
                ..GuardianInput::default()
            })
        }
    }

    #[test]
    fn a_controller_cut_off_from_a_moving_arm_has_it_stopped_until_it_is_acknowledged() {
        let mut turns = Turns::new();
        turns.turn(true, false);
        assert!(!turns.turn(true, false).ask_stop);
        assert!(
            turns.turn(false, true).ask_stop,
            "in the turn that shows it"
        );
        assert_eq!(turns.guardian.emergency(), Emergency::CutOff);
        assert!(!turns.turn(false, true).ask_stop, "again after 0.1 s only");
        turns.now_ns += 100 * MS;
        assert!(turns.turn(false, true).ask_stop);
        turns.now_ns += 100 * MS;
        assert!(!turns.turn(false, false).ask_stop, "acknowledged");
        assert_eq!(turns.guardian.phase(), GuardianPhase::Watching);
        assert!(!turns.turn(true, false).ask_stop);
    }

    #[test]
    fn a_controller_that_moves_and_dies_right_after_a_silence_at_rest_is_met() {
        let mut turns = Turns::new();
        turns.turn(false, false);
        let resting = Pulse {
            stamp_ns: turns.now_ns,
            ..Pulse::default()
        };
        let mut input = GuardianInput {
            now_ns: turns.now_ns + 20 * MS,
            pulse: Some(resting),
            connected: true,
            ..GuardianInput::default()
        };
        let out = turns.guardian.step(&input);
        assert_eq!(turns.guardian.phase(), GuardianPhase::Waiting);
        assert!(!out.look_again, "it may only be held up");
        input.pulse = Some(Pulse {
            stamp_ns: input.now_ns + MS,
            moving: true,
            ended: true,
            cut_off: false,
        });
        input.now_ns += 2 * MS;
        assert!(turns.guardian.step(&input).ask_stop);
    }

    #[test]
    fn a_link_lost_at_rest_is_no_emergency() {
        let mut turns = Turns::new();
        for cut_off in [false, false, true, true] {
            assert!(!turns.turn(false, cut_off).ask_stop);
        }
        assert_eq!(turns.guardian.phase(), GuardianPhase::Watching);
    }
}
