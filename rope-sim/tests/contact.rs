//! Contacts against formulas: depth of an impact, friction, walls that hold.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::float_cmp,
    missing_docs,
    reason = "tests may fail loudly"
)]

use nalgebra::{Isometry3, Rotation3, Translation3, UnitQuaternion, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rope_sim::{
    AttachMotion, Candidate, FrameTimes, Obstacle, Outcome, Placement, Precision, Rollout, Scene,
    Shape, SimOptions, Start, roll_out_in,
};
use shared_types::RopeParams;
use shared_types::kinematics::FrameMotion;

const G_M_S2: f64 = 9.81;

fn rope() -> RopeParams {
    RopeParams::from_array([22.0, 0.55, 0.02, 0.1, 0.005, 0.06, 0.12, 0.03, 0.8])
}

/// A frame that falls freely from rest for a while, then brakes to a halt.
struct Drop {
    from_m: f64,
    fall_s: f64,
    brake_m_s2: f64,
}

impl Drop {
    fn halt_s(&self) -> f64 {
        self.fall_s * (1.0 + G_M_S2 / self.brake_m_s2)
    }
}

impl AttachMotion for Drop {
    fn at(&self, t_s: f64) -> FrameMotion {
        let fall = t_s.min(self.fall_s);
        let brake = t_s.clamp(self.fall_s, self.halt_s()) - self.fall_s;
        let v = G_M_S2 * fall;
        let a = match t_s {
            t if t < self.fall_s => -G_M_S2,
            t if t < self.halt_s() => self.brake_m_s2,
            _ => 0.0,
        };
        let fallen = 0.5 * v * fall + (v - 0.5 * self.brake_m_s2 * brake) * brake;
        FrameMotion {
            p_m: Vector3::z() * (self.from_m - fallen),
            v_m_s: Vector3::z() * (self.brake_m_s2 * brake - v),
            a_m_s2: Vector3::z() * a,
            // Off the vertical: a straight rope pushed from above would be a rod.
            r: Rotation3::from_axis_angle(&Vector3::y_axis(), 0.1).into_inner(),
            ..FrameMotion::world()
        }
    }
    fn duration_s(&self) -> f64 {
        self.halt_s()
    }
    fn acceleration_jumps_s(&self) -> Vec<f64> {
        vec![self.fall_s, self.halt_s()]
    }
}

fn options(precision: Precision, horizon_s: f64, rate_hz: f64) -> SimOptions {
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "small"
    )]
    let count = (horizon_s * rate_hz + 1e-6) as usize + 1;
    SimOptions {
        step_s: 5e-4,
        precision,
        start: Start::Equilibrium,
        frames: FrameTimes {
            first_s: 0.0,
            period_s: 1.0 / rate_hz,
            count,
        },
        closest_to_m: None,
        horizon_s,
        threads: 2,
    }
}

fn alone(obstacle: Obstacle) -> Scene {
    Scene {
        obstacles: vec![obstacle],
        domino: None,
    }
}

fn simulate(
    scene: &Scene,
    rope: &RopeParams,
    motion: &dyn AttachMotion,
    options: &SimOptions,
) -> Rollout {
    roll_out_in(scene, &[Candidate::new(rope, motion)], options)
        .unwrap()
        .remove(0)
}

#[test]
fn a_dropped_lead_sinks_less_than_a_millimetre_and_settles() {
    let rope = rope();
    let floor = alone(Obstacle::fixed(Shape::HalfSpace, [0.0; 3], 0.6));
    let fall_s = (2.0 * 0.5 / G_M_S2).sqrt();
    // After half a metre of free fall the lead meets the floor; the frame follows a little.
    let motion = Drop {
        from_m: 0.5 + rope.length_m + rope.lead_radius_m,
        fall_s,
        brake_m_s2: 60.0,
    };
    for precision in [Precision::F64, Precision::F32] {
        let run = simulate(&floor, &rope, &motion, &options(precision, 3.0, 50.0));
        assert_eq!(run.outcome, Outcome::Clean);
        let contact = run.contacts[0];
        let (touched_s, _) = contact.first.unwrap();
        assert!((touched_s - fall_s).abs() < 0.01, "{touched_s}");
        assert!(contact.lead_touched);
        println!("{precision:?} {contact:?}");
        let last = run.nodes.frames() - 1;
        let tip = |f| run.nodes.position(f, 22);
        println!("{} {}", tip(last), tip(last - 10));
        assert!((tip(last) - tip(last - 10)).norm() < 1e-4);
        assert!((tip(last).z - rope.lead_radius_m).abs() < 3e-4);
    }
}

/// A frame that stands still.
struct Still {
    p_m: Vector3<f64>,
    r: Rotation3<f64>,
}

impl AttachMotion for Still {
    fn at(&self, _t_s: f64) -> FrameMotion {
        FrameMotion {
            p_m: self.p_m,
            r: self.r.into_inner(),
            ..FrameMotion::world()
        }
    }
    fn duration_s(&self) -> f64 {
        0.0
    }
    fn acceleration_jumps_s(&self) -> Vec<f64> {
        Vec::new()
    }
}

/// One light link of 1 m on a plane that contains it, with a small heavy lead: along
/// the plane gravity pulls the lead sideways, and next to nothing else holds it than
/// friction. The joint's little stiffness keeps the lead from rolling.
#[test]
fn friction_holds_up_to_its_angle_and_no_further() {
    let lever = RopeParams {
        links: 1,
        length_m: 1.0,
        joint_damping_nms_per_rad: 1e-4,
        joint_stiffness_nm_per_rad: 0.05,
        radius_m: 0.002,
        mass_per_length_kg_per_m: 1e-4,
        lead_mass_kg: 0.1,
        lead_radius_m: 0.002,
        link_extra_scale: 0.05,
    };
    let friction: f64 = 0.5;
    for precision in [Precision::F64, Precision::F32] {
        for (part, slides) in [(0.97, false), (1.03, true)] {
            let tilt = part * friction.atan();
            let slope = Rotation3::from_axis_angle(&Vector3::x_axis(), tilt);
            let normal = slope * Vector3::z();
            let plane = Obstacle {
                shape: Shape::HalfSpace,
                placement: Placement::World(Isometry3::from_parts(
                    Translation3::from(-normal * lever.lead_radius_m),
                    UnitQuaternion::from_rotation_matrix(&slope),
                )),
                friction,
            };
            // The frame's -z looks along +x.
            let along_x =
                Rotation3::from_axis_angle(&Vector3::y_axis(), -core::f64::consts::FRAC_PI_2);
            let still = Still {
                p_m: Vector3::zeros(),
                r: along_x,
            };
            let mut options = options(precision, 1.0, 10.0);
            options.start = Start::Straight {
                joint0_rotvec: [0.0; 3],
            };
            let run = simulate(&alone(plane), &lever, &still, &options);
            let [start, end] = [0, 10].map(|f| run.nodes.position(f, 1));
            let path_m = (end - start).norm();
            let excess = G_M_S2 * (tilt.sin() - friction * tilt.cos());
            println!("{precision:?} {part}: {path_m} m, law {}", 0.5 * excess);
            println!("{:?}", run.contacts);
            if slides {
                assert!(path_m > 0.5 * (0.5 * excess), "{path_m}");
            } else {
                assert!(path_m < 5e-4, "{path_m}");
            }
        }
    }
}

/// Throws a rope across a thin wall: the frame jerks sideways with a constant
/// acceleration for a moment, faster than any arm.
struct Whip {
    from_m: Vector3<f64>,
    acceleration_m_s2: Vector3<f64>,
    push_s: f64,
    r: Rotation3<f64>,
}

impl Whip {
    /// One whose frame stays clear of the wall; the rope does not push it back.
    fn random(rng: &mut ChaCha8Rng) -> Self {
        loop {
            let push_s = rng.random_range(0.1..0.25);
            let mut speed = |max: f64| rng.random_range(-max..max);
            let velocity = Vector3::new(3.0 + speed(2.0), speed(1.0), speed(1.0));
            let whip = Self {
                from_m: Vector3::new(-0.25 + speed(0.15), speed(0.2), 0.42 + speed(0.17)),
                acceleration_m_s2: velocity / push_s,
                push_s,
                r: Rotation3::from_axis_angle(&Vector3::y_axis(), 1.0 + speed(1.0)),
            };
            let is_clear = (0..=100).all(|i| {
                let p = whip.at(whip.duration_s() * f64::from(i) / 100.0).p_m;
                (0..3).any(|axis| p[axis].abs() > WALL_HALF_M[axis] + 0.03)
            });
            if is_clear {
                return whip;
            }
        }
    }
}

impl AttachMotion for Whip {
    fn at(&self, t_s: f64) -> FrameMotion {
        // Forth, then braked.
        let forth = t_s.clamp(0.0, self.push_s);
        let back = (t_s - self.push_s).clamp(0.0, self.push_s);
        let v = forth - back;
        let sign = match t_s {
            t if t < self.push_s => 1.0,
            t if t < 2.0 * self.push_s => -1.0,
            _ => 0.0,
        };
        let path = 0.5 * forth * forth + forth * back - 0.5 * back * back;
        FrameMotion {
            p_m: self.from_m + self.acceleration_m_s2 * path,
            v_m_s: self.acceleration_m_s2 * v,
            a_m_s2: self.acceleration_m_s2 * sign,
            r: self.r.into_inner(),
            ..FrameMotion::world()
        }
    }
    fn duration_s(&self) -> f64 {
        2.0 * self.push_s
    }
    fn acceleration_jumps_s(&self) -> Vec<f64> {
        vec![self.push_s, 2.0 * self.push_s]
    }
}

const WALL_HALF_M: [f64; 3] = [0.005, 0.3, 0.2];

/// How deep the rope's centre line lies in the wall (m), by where it is.
fn depth_in_wall_m(run: &Rollout, frame: usize, links: usize) -> f64 {
    let mut deepest = 0.0_f64;
    for link in 0..links {
        let [a, b] = [link, link + 1].map(|n| run.nodes.position(frame, n));
        for part in 0..=8 {
            let p = a.lerp(&b, f64::from(part) / 8.0);
            let inside = (0..3).map(|i| WALL_HALF_M[i] - p[i].abs());
            deepest = deepest.max(inside.fold(f64::INFINITY, f64::min));
        }
    }
    deepest
}

fn random_throws(count: usize, seed: u64) -> (usize, usize, f64, f64) {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let ropes: Vec<RopeParams> = (0..count)
        .map(|_| {
            let mut v: [f64; 9] = core::array::from_fn(|i| {
                let range = &shared_types::rope::RANGES[i];
                rng.random_range(range.min..=range.max)
            });
            v[0] = 22.0;
            if rng.random_bool(0.5) {
                (v[4], v[7]) = (0.003, 0.003);
            }
            RopeParams::from_array(v)
        })
        .collect();
    let whips: Vec<Whip> = (0..count).map(|_| Whip::random(&mut rng)).collect();
    let wall = alone(Obstacle::fixed(
        Shape::Box {
            half_m: WALL_HALF_M,
        },
        [0.0; 3],
        0.5,
    ));
    let candidates: Vec<_> = ropes
        .iter()
        .zip(&whips)
        .map(|(r, w)| Candidate::new(r, w))
        .collect();
    let runs = roll_out_in(&wall, &candidates, &options(Precision::F32, 0.8, 200.0)).unwrap();
    let (mut through, mut touched, mut deepest, mut fastest) = (0, 0, 0.0_f64, 0.0_f64);
    for run in &runs {
        if run.outcome == Outcome::Diverged {
            println!("diverged");
            continue;
        }
        touched += usize::from(run.contacts[0].touched());
        if run.contacts[0].touched() {
            fastest = fastest.max(run.peak_tip_speed_m_s);
        }
        let depth = (0..run.nodes.frames())
            .map(|f| depth_in_wall_m(run, f, 22))
            .fold(0.0, f64::max);
        deepest = deepest.max(depth);
        through += usize::from(depth > 0.0);
    }
    (through, touched, deepest, fastest)
}

#[test]
fn nothing_passes_through_a_thin_wall() {
    let result = random_throws(512, 7);
    println!("{result:?}");
    assert_eq!(result.0, 0);
}
