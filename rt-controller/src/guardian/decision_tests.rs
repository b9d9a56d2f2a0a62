use super::*;
use rand::{RngExt, SeedableRng};

const MS: u64 = 1_000_000;
const PERIOD_NS: u64 = 4 * MS;
const TURN_NS: u64 = 2 * MS;
/// As shipped: two cycles more than the controller may miss.
const SILENCE_NS: u64 = 7 * PERIOD_NS;

/// What is known at `now_ms` of a controller whose last cycle woke at `stamp_ms`.
fn seen(now_ms: u64, stamp_ms: u64, moving: bool) -> GuardianInput {
    seen_ns(now_ms * MS, stamp_ms * MS, moving)
}

/// The same in nanoseconds.
fn seen_ns(now_ns: u64, stamp_ns: u64, moving: bool) -> GuardianInput {
    GuardianInput {
        now_ns,
        pulse: Some(Pulse {
            stamp_ns,
            moving,
            ..Pulse::default()
        }),
        arm_state: None,
        connected: true,
    }
}

/// An arm whose state is 4 a while after it was asked for.
#[derive(Default)]
struct Scene {
    requested_ns: Vec<u64>,
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
                arm_state: self.stops_ns.map(|t| if now_ns >= t { 4 } else { 1 }),
                ..seen_ns(now_ns, stamp_ns, true)
            };
            let out = guardian.step(&input);
            if out.ask_stop {
                self.requested_ns.push(now_ns);
            }
            self.phases.extend(out.changed);
        }
    }
}

#[test]
fn a_gap_that_the_controller_meets_itself_is_left_to_it() {
    let shipped = crate::ControllerConfig::default();
    let thresholds = shipped.thresholds.checked(shipped.simulated).unwrap();
    let missed_max = thresholds.missed_cycles_max;
    assert_eq!(
        (missed_max, shipped.guardian_silence_ns().unwrap()),
        (5, SILENCE_NS)
    );
    let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(6);
    for lost in (0..=missed_max).cycle().take(6000) {
        let mut guardian = Guardian::new(SILENCE_NS);
        let begin_ns = 1_000 * MS + rng.random_range(0..TURN_NS);
        let gap_ns = u64::from(lost + 1) * PERIOD_NS;
        for now_ns in (begin_ns..begin_ns + 3 * gap_ns).step_by(2_000_000) {
            let input = seen_ns(now_ns, now_ns / gap_ns * gap_ns, true);
            assert!(!guardian.step(&input).ask_stop, "{lost} cycles lost");
        }
    }
}

/// Its process lives: one that ends is met at once.
#[test]
fn a_controller_that_hangs_at_any_moment_is_met_within_34_ms() {
    let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(28);
    let mut worst_ns = 0;
    for _ in 0..1000 {
        let mut guardian = Guardian::new(SILENCE_NS);
        let mut scene = Scene::default();
        let begin_ns = 1_000 * MS + rng.random_range(0..PERIOD_NS);
        let dies_ns = begin_ns + rng.random_range(40 * MS..400 * MS);
        scene.play(&mut guardian, begin_ns, dies_ns, dies_ns + 50 * MS);
        let reaction_ns = scene.requested_ns[0] - dies_ns;
        assert!(reaction_ns <= 34 * MS, "{reaction_ns}");
        worst_ns = worst_ns.max(reaction_ns);
    }
    println!("slowest reaction: {:.1} ms", worst_ns as f64 / 1e6);
}

#[test]
fn an_ended_process_needs_no_silence() {
    let mut guardian = Guardian::new(500 * MS);
    guardian.step(&seen(1000, 999, true));
    let mut ended = seen(1002, 999, true);
    ended.pulse.as_mut().unwrap().ended = true;
    assert!(guardian.step(&ended).ask_stop);
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
    assert_eq!(scene.requested_ns.len(), 3);
    assert!(
        scene
            .requested_ns
            .windows(2)
            .all(|w| w[1] - w[0] == 100 * MS)
    );
    let phases = [
        GuardianPhase::Watching,
        GuardianPhase::Stopping,
        GuardianPhase::Stopped,
    ];
    assert_eq!(scene.phases, phases);
    // Only a living controller at rest ends the latch.
    guardian.step(&seen(9500, 9500, true));
    assert_eq!(guardian.phase(), GuardianPhase::Stopped);
    guardian.step(&seen(9502, 9502, false));
    assert_eq!(guardian.phase(), GuardianPhase::Watching);
}

#[test]
fn an_arm_that_never_answers_is_asked_for_3_s_and_reported() {
    let mut guardian = Guardian::new(SILENCE_NS);
    let mut scene = Scene::default();
    scene.play(&mut guardian, 1000 * MS, 1100 * MS, 9000 * MS);
    assert_eq!(scene.requested_ns.len(), 31);
    assert_eq!(scene.phases.last(), Some(&GuardianPhase::StopUnconfirmed));
}

#[test]
fn a_controller_lost_at_rest_is_no_emergency() {
    let mut guardian = Guardian::new(SILENCE_NS);
    guardian.step(&seen(1001, 1000, false));
    assert_eq!(guardian.phase(), GuardianPhase::Watching);
    let out = guardian.step(&seen(2000, 1000, false));
    assert!(!out.ask_stop && out.look_again, "silent for long");
    assert_eq!(guardian.phase(), GuardianPhase::Waiting);
}

#[test]
fn without_a_connection_the_first_request_goes_out_with_it() {
    let mut guardian = Guardian::new(SILENCE_NS);
    for (now_ms, connected) in [(1000, false), (1050, false), (1080, true)] {
        let input = GuardianInput {
            connected,
            ..seen(now_ms, 1000, true)
        };
        assert_eq!(guardian.step(&input).ask_stop, connected);
    }
}

/// Turns of a guardian that watches a living controller.
struct Turns {
    guardian: Guardian,
    now_ms: u64,
}

impl Turns {
    fn new() -> Self {
        Self {
            guardian: Guardian::new(SILENCE_NS),
            now_ms: 1000,
        }
    }

    fn turn(&mut self, moving: bool, cut_off: bool) -> GuardianOutput {
        self.now_ms += 2;
        let mut input = seen(self.now_ms, self.now_ms, moving);
        input.pulse.as_mut().unwrap().cut_off = cut_off;
        self.guardian.step(&input)
    }
}

#[test]
fn a_controller_cut_off_from_a_moving_arm_has_it_stopped_until_it_is_acknowledged() {
    let mut turns = Turns::new();
    turns.turn(true, false);
    assert!(!turns.turn(true, false).ask_stop);
    let out = turns.turn(false, true);
    assert!(out.ask_stop, "in the turn that shows it");
    assert_eq!(turns.guardian.emergency(), Emergency::CutOff);
    assert!(!turns.turn(false, true).ask_stop, "again after 0.1 s only");
    turns.now_ms += 100;
    assert!(turns.turn(false, true).ask_stop);
    turns.now_ms += 100;
    assert!(!turns.turn(false, false).ask_stop, "acknowledged");
    assert_eq!(turns.guardian.phase(), GuardianPhase::Watching);
    assert!(!turns.turn(true, false).ask_stop);
}

#[test]
fn a_controller_that_moves_and_dies_right_after_a_silence_at_rest_is_met() {
    let mut turns = Turns::new();
    turns.turn(false, false);
    let at_ms = turns.now_ms;
    let out = turns.guardian.step(&seen(at_ms + 40, at_ms, false));
    assert_eq!(turns.guardian.phase(), GuardianPhase::Waiting);
    assert!(!out.look_again, "it may only be held up");
    let mut input = seen(at_ms + 42, at_ms + 41, true);
    input.pulse.as_mut().unwrap().ended = true;
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
