//! Obstacles that move, on the attach frame and on arm links.
#![cfg(test)]
#![allow(clippy::float_cmp, missing_docs, reason = "a test")]

mod scenes;

use arm_model::JOINTS;
use arm_model::kinematics::FrameMotion;
use nalgebra::{Isometry3, Rotation3, Vector3};
use rope_sim::sensitivity::{Difference, Direction, Family, sensitivities_in};
use rope_sim::{
    AttachMotion, Candidate, Domino, LiveRope, MovingFrames, Obstacle, Outcome, Placement,
    Precision, RopeExtras, Scene, Shape, Start, roll_out_in,
};
use scenes::{G_M_S2, alone, options, simulate};
use shared_types::RopeParams;

const LINK: usize = 5;

/// An attach frame that stands still, at an arm whose links all travel.
struct Travelling {
    attach_r: Rotation3<f64>,
    velocity_m_s: Vector3<f64>,
}

impl AttachMotion for Travelling {
    fn at(&self, _t_s: f64) -> FrameMotion {
        FrameMotion {
            r: self.attach_r.into_inner(),
            ..FrameMotion::world()
        }
    }
    fn duration_s(&self) -> f64 {
        10.0
    }
    fn acceleration_jumps_s(&self) -> Vec<f64> {
        Vec::new()
    }
    fn arm_links(&self, t_s: f64) -> Option<[FrameMotion; JOINTS]> {
        let link = FrameMotion {
            p_m: self.velocity_m_s * t_s,
            v_m_s: self.velocity_m_s,
            ..FrameMotion::world()
        };
        Some([link; JOINTS])
    }
}

fn on_link(shape: Shape, local_m: [f64; 3], friction: f64) -> Obstacle {
    let [x, y, z] = local_m;
    Obstacle {
        shape,
        placement: Placement::ArmLink {
            link: LINK,
            pose: Isometry3::translation(x, y, z),
        },
        friction,
    }
}

/// One light link of 1 m with a small heavy lead, level along x.
fn lever(stiffness_nm_per_rad: f64) -> RopeParams {
    RopeParams {
        links: 1,
        length_m: 1.0,
        joint_damping_nms_per_rad: 0.2,
        joint_stiffness_nm_per_rad: stiffness_nm_per_rad,
        radius_m: 0.002,
        mass_per_length_kg_per_m: 1e-4,
        lead_mass_kg: 0.1,
        lead_radius_m: 0.002,
        link_extra_scale: 0.05,
    }
}

fn along_x() -> Rotation3<f64> {
    Rotation3::from_axis_angle(&Vector3::y_axis(), -core::f64::consts::FRAC_PI_2)
}

const FRICTION: f64 = 0.3;

/// A belt under the lever that travels across it.
fn belt(lever: &RopeParams) -> (Scene, Travelling) {
    let belt = on_link(Shape::HalfSpace, [0.0, 0.0, -lever.lead_radius_m], FRICTION);
    let travelling = Travelling {
        attach_r: along_x(),
        velocity_m_s: Vector3::y() * 0.5,
    };
    (alone(belt), travelling)
}

/// The belt drags the lead along until the joint's spring balances sliding friction,
/// always across the lever: `k angle = mu m g L cos(angle)`.
fn dragged_angle(lever: &RopeParams) -> f64 {
    let load = FRICTION * lever.lead_mass_kg * G_M_S2 * lever.length_m;
    let mut angle = 0.0_f64;
    for _ in 0..200 {
        angle = 0.5 * (angle + load * angle.cos() / lever.joint_stiffness_nm_per_rad);
    }
    angle
}

fn straight(precision: Precision, horizon_s: f64) -> rope_sim::SimOptions {
    let mut options = options(precision, horizon_s, 10.0);
    options.start = Start::Straight {
        joint0_rotvec: [0.0; 3],
    };
    options
}

#[test]
fn a_moving_surface_drags_with_its_friction() {
    let lever = lever(1.0);
    let (scene, travelling) = belt(&lever);
    let want = dragged_angle(&lever);
    for precision in [Precision::F64, Precision::F32] {
        let run = simulate(&scene, &lever, &travelling, &straight(precision, 8.0));
        let tip = run.nodes.position(80, 1);
        let angle = tip.y.atan2(tip.x);
        println!("{precision:?}: {angle} against {want}");
        assert!((angle / want - 1.0).abs() < 0.03, "{angle} against {want}");
        assert!(want > 0.2);
    }
}

/// Slope of that angle with stiffness, among obstacles.
#[test]
fn slopes_exist_among_obstacles() {
    let lever = lever(1.0);
    let (scene, travelling) = belt(&lever);
    let directions = [Direction::Parameter {
        index: 3,
        step: None,
    }];
    let family = Family {
        base: Candidate::new(&lever, &travelling),
        directions: &directions,
    };
    let options = straight(Precision::F64, 8.0);
    let slopes = sensitivities_in(&scene, &[family], Difference::Central, &options).unwrap();
    let beside = &slopes[0].neighbours[0];
    let angle = |run: &rope_sim::Rollout| {
        let tip = run.nodes.position(80, 1);
        tip.y.atan2(tip.x)
    };
    let slope = (angle(&beside.to) - angle(beside.from.as_ref().unwrap())) / beside.span;
    let h = 1e-4;
    let by = |k: f64| {
        dragged_angle(&RopeParams {
            joint_stiffness_nm_per_rad: k,
            ..lever
        })
    };
    let want = (by(1.0 + h) - by(1.0 - h)) / (2.0 * h);
    println!("{slope} against {want}");
    assert!((slope / want - 1.0).abs() < 0.03, "{slope} against {want}");
}

fn rope() -> RopeParams {
    RopeParams::from_array([22.0, 0.55, 0.01, 0.05, 0.005, 0.06, 0.06, 0.02, 0.8])
}

/// A wall on an arm link pushes a hanging rope ahead of it.
#[test]
fn an_arm_link_pushes_the_rope_ahead() {
    let rope = rope();
    let wall = Shape::Box {
        half_m: [0.01, 0.3, 0.4],
    };
    let scene = alone(on_link(wall, [-0.15, 0.0, -0.45], 0.2));
    let speed_m_s = 0.5;
    let travelling = Travelling {
        attach_r: Rotation3::identity(),
        velocity_m_s: Vector3::x() * speed_m_s,
    };
    for precision in [Precision::F64, Precision::F32] {
        let run = simulate(&scene, &rope, &travelling, &options(precision, 0.6, 100.0));
        assert_eq!(run.outcome, Outcome::Clean);
        let (first_s, _) = run.contacts[0].first.unwrap();
        let meets_s = (0.15 - 0.01 - rope.lead_radius_m) / speed_m_s;
        assert!((first_s - meets_s).abs() < 5e-3, "{first_s}, {meets_s}");
        for frame in 0..run.nodes.frames() {
            let face_m = -0.14 + speed_m_s * 0.01 * frame as f64;
            let ahead_m = run.nodes.position(frame, 22).x - face_m;
            assert!(ahead_m > rope.lead_radius_m - 1e-3, "{frame}: {ahead_m} m");
        }
        let tip = run.nodes.position(60, 22);
        assert!((0.16..0.35).contains(&tip.x), "{tip}");
    }
}

/// Accelerates steadily along x.
struct Starting {
    acceleration_m_s2: f64,
}

impl AttachMotion for Starting {
    fn at(&self, t_s: f64) -> FrameMotion {
        let a = Vector3::x() * self.acceleration_m_s2;
        FrameMotion {
            p_m: a * (0.5 * t_s * t_s),
            v_m_s: a * t_s,
            a_m_s2: a,
            ..FrameMotion::world()
        }
    }
    fn duration_s(&self) -> f64 {
        10.0
    }
    fn acceleration_jumps_s(&self) -> Vec<f64> {
        Vec::new()
    }
}

/// A plate that travels with the attach frame holds back the rope, which would trail
/// far beyond it.
#[test]
fn what_is_on_the_attach_frame_moves_with_it() {
    let rope = rope();
    let face_m = -0.05;
    let plate = Obstacle {
        shape: Shape::Box {
            half_m: [0.01, 0.3, 0.3],
        },
        placement: Placement::Attach(Isometry3::translation(face_m - 0.01, 0.0, -0.4)),
        friction: 0.3,
    };
    let motion = Starting {
        acceleration_m_s2: 6.0,
    };
    let options = options(Precision::F32, 1.5, 50.0);
    let trail = |scene: &Scene| -> Vec<f64> {
        let run = simulate(scene, &rope, &motion, &options);
        let x = |frame| run.nodes.position(frame, 22).x - run.nodes.position(frame, 0).x;
        (0..run.nodes.frames()).map(x).collect()
    };
    let least = |trail: &[f64]| trail.iter().copied().fold(f64::INFINITY, f64::min);
    let held = trail(&alone(plate));
    let stop_m = face_m + rope.lead_radius_m;
    assert!(least(&held) > stop_m - 1e-3, "{} m", least(&held));
    assert!(held[75] < stop_m + 2e-3, "{} m", held[75]);
    assert!(least(&trail(&Scene::EMPTY)) < -0.2);
}

/// Swings along x and back, with a wall and a domino in the lead's way and a plate on
/// an arm link that comes to meet it.
struct Swing;

impl AttachMotion for Swing {
    fn at(&self, t_s: f64) -> FrameMotion {
        let w = core::f64::consts::TAU;
        let (s, c) = (w * t_s).sin_cos();
        FrameMotion {
            p_m: Vector3::new(0.1 * (t_s - s / w), 0.0, 1.0),
            v_m_s: Vector3::new(0.1 * (1.0 - c), 0.0, 0.0),
            a_m_s2: Vector3::new(0.1 * w * s, 0.0, 0.0),
            ..FrameMotion::world()
        }
    }
    fn duration_s(&self) -> f64 {
        1.0
    }
    fn acceleration_jumps_s(&self) -> Vec<f64> {
        Vec::new()
    }
    fn arm_links(&self, t_s: f64) -> Option<[FrameMotion; JOINTS]> {
        let mut link = self.at(t_s);
        link.p_m *= -0.5;
        link.v_m_s *= -0.5;
        link.a_m_s2 *= -0.5;
        Some([link; JOINTS])
    }
}

/// One rope advanced cycle by cycle does among obstacles what the batch does.
#[test]
fn the_live_rope_follows_the_batch_among_obstacles() {
    let rope = rope();
    let plate = Shape::Box {
        half_m: [0.01, 0.2, 0.03],
    };
    let scene = Scene {
        obstacles: vec![
            on_link(plate, [0.075, 0.0, 1.25], 0.4),
            Obstacle::box_below([0.16, 0.0, 0.5], [0.05, 0.3, 0.3], 0.5),
        ],
        domino: Some(Domino {
            foot_m: [0.06, 0.0, 0.43],
            facing_rad: 0.0,
            thickness_m: 0.008,
            width_m: 0.05,
            height_m: 0.05,
            mass_kg: 0.01,
            friction: 0.3,
        }),
    };
    let extras = RopeExtras {
        rest_curvature_per_m: [0.0, 0.4, 0.1],
        ..RopeExtras::NONE
    };
    let frames = |t_s: f64| MovingFrames {
        attach: Swing.at(t_s),
        arm_links: Swing.arm_links(t_s),
    };
    let mut live = LiveRope::new_in(&scene, &rope, extras, &frames(0.0), 5e-4).unwrap();
    for cycle in 1..=250 {
        live.advance_in(&frames, f64::from(cycle) * 0.004);
    }
    let candidate = Candidate::new(&rope, &Swing).with_extras(extras);
    let run = roll_out_in(&scene, &[candidate], &options(Precision::F64, 1.0, 1.0))
        .unwrap()
        .remove(0);
    println!("{:?} {:?}", run.contacts, run.domino);
    assert!(run.contacts[0].touched());
    for (node, at) in live.nodes().iter().enumerate() {
        let d = (run.nodes.position(1, node) - at).norm();
        assert!(d < 1e-5, "node {node} differs by {d} m");
    }
    for (a, b) in live.contacts().iter().zip(&run.contacts) {
        assert!((a.in_touch_s - b.in_touch_s).abs() < 2e-3, "{a:?} {b:?}");
    }
    let (a, b) = (live.domino().unwrap(), run.domino.unwrap());
    assert!(b.touched_at_s.is_some());
    assert_eq!(a.down_at_s.is_some(), b.down_at_s.is_some());
}
