//! Random plans, feasible and not: what the preflight says against what controller and
//! arm do. `WAG_LONG_TESTS=1` runs 10 000 plans instead of 300.

use super::{arm_error, long_tests, run};
use arm_model::capsules::self_clearance_m;
use arm_model::joint::START_POSE;
use arm_model::limits::{LimitKind, LimitsSpec};
use arm_model::{JointTrajectory, JointVector, Limits, kinematics};
use planner::preflight::{Fence, JudgedArm, arm_margins, first_stop};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rt_controller::control::{ControlSettings, Thresholds};
use shared_types::CommandInterface;
use xarm_sim::ArmConfig;

/// A plan and the safety boundary it is judged with, if any (mm: x+, x-, y+, y-, z+, z-).
struct Case {
    plan: JointTrajectory,
    fence_mm: Option<[i32; 6]>,
}

impl Case {
    fn random(rng: &mut ChaCha8Rng) -> Self {
        let (start, plan) = match rng.random_range(0..10) {
            0 => spin(rng),
            1 => fold(rng),
            _ => {
                let start = random_start(rng, START_POSE, 0.8);
                (start, random_plan(rng, start))
            }
        };
        let fence_mm = rng.random_bool(0.3).then(|| {
            let tool = kinematics::flange_pose(&start).0;
            core::array::from_fn(|side| {
                let way = rng.random_range(0.05..0.5) * [1.0, -1.0][side % 2];
                (1e3 * (tool[side / 2] + way)).round() as i32
            })
        });
        Self { plan, fence_mm }
    }

    fn judged(&self, interface: CommandInterface) -> JudgedArm {
        let fence = self.fence_mm.map(|mm| {
            let [x1, x0, y1, y0, z1, z0] = mm.map(|mm| f64::from(mm) * 1e-3);
            Fence::new([x0, x1, y0, y1, z0, z1]).unwrap()
        });
        JudgedArm {
            interface,
            fence,
            ..JudgedArm::default()
        }
    }

    fn arm(&self) -> ArmConfig {
        ArmConfig {
            self_collision_check: true,
            fence_mm: self.fence_mm,
            ..ArmConfig::default()
        }
    }

    /// The code the arm is expected to stop with; none if it runs to the end.
    fn expected(&self, interface: CommandInterface, limits: &Limits) -> Option<u8> {
        let margins = arm_margins(&self.plan, limits, &self.judged(interface));
        first_stop(&margins).map(|m| m.rule.code().unwrap_or(0))
    }
}

/// A pose in range, about another, that the encoders can tell exactly and that the arm may
/// stand in.
fn random_start(rng: &mut ChaCha8Rng, about: JointVector, spread_rad: f64) -> JointVector {
    let limits = Limits::default();
    loop {
        let wide = about.map(|q| q + rng.random_range(-spread_rad..spread_rad));
        let q = wide.map(|q| (q / 1e-5).round() * 1e-5);
        if limits.position_violation(&q).is_none() && self_clearance_m(&q) > 0.004 {
            return q;
        }
    }
}

/// Joint 7 alone, which moves no link: up to a little above its largest speed.
fn spin(rng: &mut ChaCha8Rng) -> (JointVector, JointTrajectory) {
    let start = random_start(rng, START_POSE, 0.5);
    let mut end = start;
    end[6] += rng.random_range(1.6..2.4);
    let plan = JointTrajectory::new(&[0.0, 1.0], &[start, end]).unwrap();
    (start, plan)
}

/// The wrist folds towards the shoulder, slowly.
fn fold(rng: &mut ChaCha8Rng) -> (JointVector, JointTrajectory) {
    let start = random_start(rng, JointVector::ZERO, 0.1);
    let end = random_start(rng, JointVector::ZERO, 0.1);
    let mut folded = end;
    folded[5] = rng.random_range(1.0..3.1);
    let plan = JointTrajectory::new(&[0.0, 2.5, 4.0], &[start, folded, end]).unwrap();
    (start, plan)
}

/// Three random waypoints; half of the plans are drawn together until what limits them
/// most is used to 85 to 102 %.
fn random_plan(rng: &mut ChaCha8Rng, start: JointVector) -> JointTrajectory {
    let limits = Limits::default();
    let spread = rng.random_range(0.05..0.9);
    let mut ways = [JointVector::ZERO; 3];
    let mut times_s = [0.0; 4];
    for k in 0..3 {
        let before = if k == 0 {
            JointVector::ZERO
        } else {
            ways[k - 1]
        };
        ways[k] = before.map(|way| way + spread * rng.random_range(-1.0..1.0));
        times_s[k + 1] = times_s[k] + rng.random_range(0.25..0.8);
    }
    let at = |part: f64| {
        let [a, b, c] = ways.map(|way| start + way * part);
        JointTrajectory::new(&times_s, &[start, a, b, c]).unwrap()
    };
    if rng.random_bool(0.5) {
        return at(1.0);
    }
    let is_range = |k| matches!(k, LimitKind::PositionMin | LimitKind::PositionMax);
    let margins = limits.margins(&at(1.0));
    let used = margins.iter().filter(|m| !is_range(m.kind));
    let used = used.map(|m| 1.0 - m.left).fold(0.0, f64::max);
    at(rng.random_range(0.85..1.02) / used)
}

/// Limits of a controller that leaves all judging to the arm.
fn boundless() -> Limits {
    let mut spec = LimitsSpec::from(Limits::default());
    spec.position_min_rad = JointVector::splat(-50.0);
    spec.position_max_rad = JointVector::splat(50.0);
    spec.velocity_max_rad_s = JointVector::splat(1e3);
    spec.acceleration_max_rad_s2 = JointVector::splat(1e6);
    spec.jerk_max_rad_s3 = JointVector::splat(1e9);
    spec.tcp_speed_max_m_s = 1e3;
    Limits::try_from(spec).unwrap()
}

/// Positions alone: which code the arm raises, whatever the plan breaks.
fn arm_agrees(case: &Case) -> Result<Option<u8>, String> {
    let settings = Thresholds {
        tracking_error_max_rad: 100.0,
        ..Thresholds::relaxed()
    };
    let expected = case.expected(CommandInterface::ServoPosition, &Limits::default());
    let rig = run(&case.plan, &boundless(), settings.into(), case.arm());
    let found = arm_error(&rig);
    if found == expected {
        Ok(found)
    } else {
        let causes: Vec<_> = rig.log.causes.iter().map(|c| c.fault()).collect();
        Err(format!(
            "expected {expected:?}, the arm {found:?}, {causes:?}"
        ))
    }
}

/// Plans within the limits, with the controller as it is: whether one that passes runs to
/// its end. By velocities, one that does not pass may run, where the preflight was only
/// cautious: the arm's ramps are not known to the millisecond.
fn throw_agrees(case: &Case, interface: CommandInterface) -> Result<Throw, String> {
    let limits = Limits::default();
    let settings = ControlSettings {
        interface,
        ..Thresholds::strict().into()
    };
    let expected = case.expected(interface, &limits);
    let rig = run(&case.plan, &limits, settings, case.arm());
    let (found, causes) = (arm_error(&rig), &rig.log.causes);
    let ran = found.is_none() && causes.is_empty();
    let arrived = (rig.commanded() - case.plan.end()).max_abs() < 1e-6;
    match (expected, ran) {
        (None, true) if arrived => Ok(Throw::Ran),
        (Some(_), false) => Ok(Throw::Stopped),
        (Some(_), true) if interface == CommandInterface::JointVelocity => Ok(Throw::Cautious),
        _ => {
            let causes: Vec<_> = causes.iter().map(|c| c.fault()).collect();
            Err(format!(
                "{interface:?}: expected {expected:?}, the arm {found:?}, {causes:?}, arrived {arrived}"
            ))
        }
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Throw {
    Ran,
    Stopped,
    Cautious,
}

#[test]
fn preflight_and_arm_agree() {
    let plans = if long_tests() { 10_000 } else { 300 };
    let limits = Limits::default();
    let mut codes = std::collections::BTreeMap::new();
    let mut throws = [[0_u32; 3]; 2];
    let mut disagreements = Vec::new();
    for seed in 0..plans {
        let case = Case::random(&mut ChaCha8Rng::seed_from_u64(seed));
        match arm_agrees(&case) {
            Ok(code) => *codes.entry(code).or_insert(0_u32) += 1,
            Err(why) => disagreements.push(format!("plan {seed}: {why}")),
        }
        if limits.worst_violation(&case.plan).is_some() {
            continue;
        }
        let interfaces = [
            CommandInterface::ServoPosition,
            CommandInterface::JointVelocity,
        ];
        for (count, interface) in throws.iter_mut().zip(interfaces) {
            match throw_agrees(&case, interface) {
                Ok(throw) => count[throw as usize] += 1,
                Err(why) => disagreements.push(format!("plan {seed}: {why}")),
            }
        }
    }
    println!("{plans} plans; codes of the arm alone {codes:?}");
    println!(
        "within the limits (ran, stopped, refused out of caution): by positions {:?}, by velocities {:?}",
        throws[0], throws[1]
    );
    assert!(
        disagreements.is_empty(),
        "{} of {plans}: {disagreements:#?}",
        disagreements.len()
    );
    for code in [None, Some(22), Some(23), Some(24), Some(35), Some(60)] {
        let is_met = codes.contains_key(&code);
        assert!(is_met, "no plan with {code:?}: {codes:?}");
    }
    assert!(throws.iter().all(|t| t[0] > 20 && t[1] > 0), "{throws:?}");
}
