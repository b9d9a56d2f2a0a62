use super::*;
use crate::history::ArmHistory;
use crate::ropes::random_rope;
use crate::wiggle::{WiggleConfig, wiggle};
use arm_model::joint::START_POSE;
use arm_model::limits::LimitsSpec;
use arm_model::{Cell, JointVector, Limits, Pole};
use nalgebra::Vector3;
use rope_sim::{AttachMotion, Candidate, FrameTimes, MeasuredArm, Precision, SimOptions, roll_out};
use shared_types::RopeParams;
use shared_types::rope_state::Sway;

/// Damping, stiffness and turn of joint 1 (degrees); the rest is drawn.
const ROPES: [(f64, f64, f64); 6] = [
    (0.001, 0.05, 35.0),
    (0.001, 0.5, -35.0),
    (0.001, 1.0, 0.0),
    (0.005, 0.3, 20.0),
    (0.02, 0.7, -10.0),
    (0.05, 0.1, 35.0),
];

fn samples(duration_s: f64, at: impl Fn(f64) -> JointVector) -> (Vec<f64>, Vec<JointVector>) {
    (0..)
        .map(|i| f64::from(i) * 0.004)
        .take_while(|t| *t <= duration_s)
        .map(|t| (t, at(t)))
        .unzip()
}

/// A wiggle near the pendulum frequencies that ends abruptly: it leaves up to
/// 0.24 m of swing.
fn wiggled() -> JointTrajectory {
    let config = WiggleConfig {
        amplitude_rad: 18.0_f64.to_radians(),
        frequency_hz: 1.1,
        duration_s: 5.2,
        ramp_s: 0.8,
        ..WiggleConfig::default()
    };
    wiggle(&config, &Limits::default()).unwrap()
}

fn turned(turn_deg: f64) -> JointVector {
    let mut q = START_POSE;
    q[0] += turn_deg.to_radians();
    q
}

/// A move 1.5 s after the wiggle, with one of the ropes.
fn request(index: usize) -> SettleRequest {
    let (c, k, turn_deg) = ROPES[index];
    let before = wiggled();
    let (times_s, q) = samples(before.duration_s(), |t| before.state_at(t).q);
    SettleRequest {
        rope: RopeParams {
            joint_damping_nms_per_rad: c,
            joint_stiffness_nm_per_rad: k,
            ..random_rope(index as u64)
        },
        before: ArmHistory {
            sway: Sway::NONE,
            times_s,
            q,
            start_s: before.duration_s() + 1.5,
            start_q: START_POSE,
        },
        end_q: turned(turn_deg),
        limits: Limits::default(),
        cell: Cell::default(),
        config: SettleConfig::default(),
    }
}

/// Largest distance of the tip from the point a rope length below the pole's
/// end, over two seconds after the move: wiggle, wait and move as one measured
/// motion, in double precision and half the step.
fn settled_residual_m(request: &SettleRequest, trajectory: &JointTrajectory) -> f64 {
    let before = wiggled();
    let end_s = request.before.start_s + trajectory.duration_s();
    let (times_s, q) = samples(end_s + 0.1, |t| {
        if t < request.before.start_s {
            before.state_at(t).q
        } else {
            trajectory.state_at(t - request.before.start_s).q
        }
    });
    let arm = MeasuredArm::new(&times_s, &q, Pole::default()).unwrap();
    let options = SimOptions {
        frames: FrameTimes {
            first_s: end_s,
            period_s: 0.02,
            count: 100,
        },
        ..SimOptions::new(5e-4, Precision::F64, end_s + 2.0)
    };
    let rollouts = roll_out(&[Candidate::new(&request.rope, &arm)], &options).unwrap();
    let below =
        Pole::default().attach_pose(&request.end_q).0 - Vector3::z() * request.rope.length_m;
    let nodes = &rollouts[0].nodes;
    (0..nodes.frames())
        .map(|f| (nodes.position(f, nodes.nodes() - 1) - below).norm())
        .fold(0.0, f64::max)
}

fn settled(request: &SettleRequest) -> Result<SettleMove, SettleError> {
    settle(request, &mut |_| ControlFlow::Continue(()))
}

#[test]
fn ropes_from_soft_to_stiff_hang_still_after_the_move() {
    for seed in 0..ROPES.len() {
        let request = request(seed);
        let found = settled(&request).unwrap();
        let true_m = settled_residual_m(&request, &found.trajectory);
        assert!(found.residual_m < 5e-3 && true_m < 6e-3, "{seed}: {true_m}");
        assert!(request.limits.worst_violation(&found.trajectory).is_none());
        assert_eq!(found.trajectory.start(), request.before.start_q);
        assert_eq!(found.trajectory.end(), request.end_q);
        let duration_s = found.trajectory.duration_s();
        let plain = MoveShape::new(request.before.start_q, request.end_q, duration_s, 0.44);
        let plain = plain.trajectory(&plain.no_offsets()).unwrap();
        let plain_m = settled_residual_m(&request, &plain);
        // Judged at 30 Hz over a little less than here.
        assert!(
            (plain_m / found.plain_residual_m - 1.0).abs() < 0.1,
            "{seed}"
        );
    }
}

#[test]
fn a_rope_identified_half_a_percent_wrong_still_loses_most_of_its_swing() {
    for seed in [1, 2] {
        let request = request(seed);
        let found = settled(&request).unwrap();
        assert!(found.plain_residual_m > 0.05, "{seed}: nothing to take out");
        for part in [0.995, 1.005] {
            let mut truth = request.clone();
            truth.rope.length_m *= part;
            truth.rope.joint_stiffness_nm_per_rad *= part;
            let left_m = settled_residual_m(&truth, &found.trajectory);
            assert!(left_m < 0.15 * found.plain_residual_m, "{seed}: {left_m}");
        }
    }
}

#[test]
fn threads_do_not_change_the_move() {
    let with = |threads| {
        let mut request = request(3);
        request.config.threads = threads;
        settled(&request).unwrap()
    };
    assert_eq!(with(1), with(3));
}

#[test]
fn tight_limits_are_kept_by_taking_out_less() {
    let mut request = request(2);
    request.config.durations_s = vec![3.5];
    let free = settled(&request).unwrap();
    let used = free.trajectory.extrema(5).qdd.value.abs();
    let mut spec = LimitsSpec::from(Limits::default());
    spec.acceleration_max_rad_s2[5] = 0.7 * used;
    request.limits = Limits::try_from(spec.clone()).unwrap();
    let tight = settled(&request).unwrap();
    assert!(request.limits.worst_violation(&tight.trajectory).is_none());
    assert!(tight.residual_m < 0.6 * tight.plain_residual_m);
    assert!(tight.residual_m > 2.0 * free.residual_m);
    assert_eq!(tight.plain_residual_m, free.plain_residual_m);
    // The turn itself is too fast for this tool speed.
    spec.tcp_speed_max_m_s = 0.05;
    request.limits = Limits::try_from(spec).unwrap();
    request.end_q = turned(35.0);
    assert!(matches!(
        settled(&request),
        Err(SettleError::BreaksLimit(_))
    ));
}

#[test]
fn a_rope_that_would_come_too_near_is_refused() {
    let mut request = request(1);
    request.end_q = START_POSE;
    request.config.clearance_m = 0.9;
    match settled(&request) {
        Err(SettleError::TooClose(gap_m)) => assert!(gap_m > 0.1 && gap_m < 0.9, "{gap_m}"),
        other => panic!("{other:?}"),
    }
}

#[test]
fn a_wrong_start_is_refused_by_name() {
    let good = request(4);
    type Change = fn(&mut SettleRequest);
    let cases: [(Change, &str); 10] = [
        (|r| r.before.start_s = 5.0, "would begin 5.000 s"),
        (|r| r.before.start_q[3] += 0.05, "joint 4 stands"),
        (|r| r.before.q[7][2] = f64::NAN, "measured joints: "),
        (|r| r.rope.length_m = -1.0, "`length_m`"),
        (|r| r.config.knot_s = 0.0, "`knot_s`"),
        (|r| r.config.offset_cost_m_per_rad = 10.0, "below 10 m/rad"),
        (|r| r.config.clearance_m = 1.0, "`clearance_m`"),
        (|r| r.before.start_s = 1e6, "`start_s`"),
        (|r| r.config.durations_s = vec![3.5; 1000], "`durations_s`"),
        (|r| r.config.iterations = usize::MAX, "`iterations`"),
    ];
    for (change, said) in cases {
        let mut wrong = good.clone();
        change(&mut wrong);
        let error = settled(&wrong).unwrap_err().to_string();
        assert!(error.contains(said), "{error}");
    }
}

#[test]
fn a_caller_that_leaves_ends_the_search() {
    let mut steps = Vec::new();
    let ended = settle(&request(2), &mut |p| {
        steps.push(p.done);
        ControlFlow::Break(())
    });
    assert!(matches!(ended, Err(SettleError::Cancelled(0))));
    assert_eq!(steps, [0]);
}

#[test]
fn the_arm_keeps_its_standing_error_through_the_move() {
    let mut request = request(0);
    request.before.start_q[5] -= 0.004;
    let prelude = Prelude::new(&request.before, &request.cell).unwrap();
    let shape = MoveShape::new(request.before.start_q, request.end_q, 3.5, 0.44);
    let trajectory = shape.trajectory(&shape.no_offsets()).unwrap();
    let arm = prelude.then(&trajectory);
    let start_s = request.before.start_s;
    let (before, after) = (arm.at(start_s - 1e-6), arm.at(start_s + 1e-6));
    assert!((before.p_m - after.p_m).norm() < 1e-9);
    let mut end_q = request.end_q;
    end_q[5] += 0.004;
    let end = arm.at(arm.duration_s() + 1.0);
    assert!((end.p_m - Pole::default().attach_pose(&end_q).0).norm() < 1e-6);
    assert_eq!(end.v_m_s.norm(), 0.0);
}
