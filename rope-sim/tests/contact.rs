//! Contacts against formulas: depth of an impact, friction, walls that hold.
#![cfg(test)]
#![allow(clippy::float_cmp, missing_docs, reason = "a test")]

mod support;

use nalgebra::{Isometry3, Rotation3, Translation3, UnitQuaternion, Vector3};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rope_sim::{
    Candidate, Obstacle, Outcome, Precision, Rollout, RopePart, Scene, Shape, SimOptions,
    roll_out_in,
};
use shared_types::RopeParams;
use support::contact::{WALL_HALF_M, random_rope, random_whip, wall};
use support::pushed::Pushed;
use support::{G_M_S2, options, released, simulate, still};

fn rope() -> RopeParams {
    RopeParams::from_array([22.0, 0.55, 0.02, 0.1, 0.005, 0.06, 0.12, 0.03, 0.8])
}

#[test]
fn a_dropped_lead_sinks_less_than_a_millimetre_and_settles() {
    let rope = rope();
    let floor = Scene::with(vec![Obstacle::floor(0.0, 0.6)]);
    let fall_s = (2.0 * 0.5 / G_M_S2).sqrt();
    // After half a metre of free fall the lead meets the floor; the frame brakes to a halt.
    let (brake_m_s2, height_m) = (60.0, 0.5 + rope.length_m + rope.lead_radius_m);
    let halt_s = fall_s * (1.0 + G_M_S2 / brake_m_s2);
    let motion = Pushed {
        from_m: Vector3::z() * height_m,
        // Off the vertical: a straight rope pushed from above would be a rod.
        r: Rotation3::from_axis_angle(&Vector3::y_axis(), 0.1),
        pieces: vec![
            (fall_s, -Vector3::z() * G_M_S2),
            (halt_s, Vector3::z() * brake_m_s2),
        ],
    };
    for precision in [Precision::F64, Precision::F32] {
        let run = simulate(&floor, &rope, &motion, &options(precision, 3.0, 50.0));
        assert_eq!(run.outcome, Outcome::Clean);
        let contact = run.contacts[0];
        let (touched_s, part) = contact.first.unwrap();
        assert!((touched_s - fall_s).abs() < 0.01, "{touched_s}");
        assert_eq!(part, RopePart::Lead);
        println!("{precision:?} {contact:?}");
        let last = run.nodes.frames() - 1;
        let tip = |f| run.nodes.position(f, 22);
        println!("{} {}", tip(last), tip(last - 10));
        assert!((tip(last) - tip(last - 10)).norm() < 1e-4);
        assert!((tip(last).z - rope.lead_radius_m).abs() < 3e-4);
    }
}

/// One light link of 1 m with a small heavy lead.
fn lever() -> RopeParams {
    RopeParams {
        links: 1,
        length_m: 1.0,
        joint_damping_nms_per_rad: 1e-4,
        joint_stiffness_nm_per_rad: 0.05,
        radius_m: 0.002,
        mass_per_length_kg_per_m: 1e-4,
        lead_mass_kg: 0.1,
        lead_radius_m: 0.002,
        link_extra_scale: 0.05,
        extras: None,
    }
}

/// Shorter steps follow the surface's spring: they must not let it bounce.
#[test]
fn impacts_are_inelastic_at_any_step() {
    let lever = lever();
    // The frame's -z looks along +x: the lever falls from the horizontal.
    let along_x = Rotation3::from_axis_angle(&Vector3::y_axis(), -core::f64::consts::FRAC_PI_2);
    let fall_m = 0.1;
    let floor_m = -fall_m - lever.lead_radius_m;
    let floor = Scene::with(vec![Obstacle::floor(floor_m, 0.6)]);
    for step_s in [5e-4, 2.5e-4, 1e-4, 3e-5] {
        let options = SimOptions {
            step_s,
            ..released([0.0; 3], options(Precision::F64, 0.2, 1000.0))
        };
        let run = simulate(&floor, &lever, &still(Vector3::zeros(), along_x), &options);
        let (touched_s, _) = run.contacts[0].first.unwrap();
        let after = (1e3 * touched_s) as usize + 2..run.nodes.frames();
        let heights_m = after.map(|frame| run.nodes.position(frame, 1).z + fall_m);
        let highest_m = heights_m.fold(0.0, f64::max);
        println!("{step_s} s: up by {highest_m} m");
        // Less than a seventh of the speed is left.
        assert!(highest_m < fall_m / 50.0, "{step_s} s: up by {highest_m} m");
    }
}

/// The lever on a plane that contains it: along the plane gravity pulls the lead sideways, and
/// next to nothing else holds it than friction. The joint's little stiffness keeps the lead from
/// rolling.
#[test]
fn friction_holds_up_to_its_angle_and_no_further() {
    let lever = lever();
    let friction: f64 = 0.5;
    for precision in [Precision::F64, Precision::F32] {
        for (part, slides) in [(0.97, false), (1.03, true)] {
            let tilt = part * friction.atan();
            let slope = Rotation3::from_axis_angle(&Vector3::x_axis(), tilt);
            let normal = slope * Vector3::z();
            let plane = Obstacle {
                shape: Shape::HalfSpace,
                pose: Isometry3::from_parts(
                    Translation3::from(-normal * lever.lead_radius_m),
                    UnitQuaternion::from_rotation_matrix(&slope),
                ),
                friction,
            };
            // The frame's -z looks along +x.
            let along_x =
                Rotation3::from_axis_angle(&Vector3::y_axis(), -core::f64::consts::FRAC_PI_2);
            let options = released([0.0; 3], options(precision, 1.0, 10.0));
            let scene = Scene::with(vec![plane]);
            let run = simulate(&scene, &lever, &still(Vector3::zeros(), along_x), &options);
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

/// What many throws at the wall did.
#[derive(Debug, Default)]
struct Throws {
    through: usize,
    touched: usize,
    diverged: usize,
    /// Of those that touched.
    fastest_tip_m_s: f64,
    deepest_m: f64,
}

fn random_throws(count: usize, seed: u64) -> Throws {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let ropes: Vec<RopeParams> = (0..count).map(|_| random_rope(&mut rng, 22.0)).collect();
    let whips: Vec<Pushed> = (0..count).map(|_| random_whip(&mut rng)).collect();
    let candidates: Vec<_> = ropes
        .iter()
        .zip(&whips)
        .map(|(r, w)| Candidate::new(r, w))
        .collect();
    let options = SimOptions {
        threads: 2,
        ..options(Precision::F32, 0.8, 200.0)
    };
    let runs = roll_out_in(&Scene::with(vec![wall()]), &candidates, &options).unwrap();
    let mut throws = Throws::default();
    for run in runs.iter().filter(|run| run.contacts[0].touched()) {
        throws.touched += 1;
        throws.diverged += usize::from(run.outcome == Outcome::Diverged);
        throws.fastest_tip_m_s = throws.fastest_tip_m_s.max(run.peak_tip_speed_m_s);
        let frames = 0..run.nodes.frames();
        let depth_m = frames
            .map(|f| depth_in_wall_m(run, f, 22))
            .fold(0.0, f64::max);
        throws.deepest_m = throws.deepest_m.max(depth_m);
        throws.through += usize::from(depth_m > 0.0);
    }
    throws
}

#[test]
fn nothing_passes_through_a_thin_wall() {
    let count = if std::env::var_os("WAG_LONG_TESTS").is_some() {
        10_000
    } else {
        512
    };
    let throws = random_throws(count, 7);
    println!("{throws:?}");
    assert_eq!(throws.through, 0);
    assert_eq!(throws.diverged, 0);
    assert!(throws.touched > count / 2);
    assert!(throws.fastest_tip_m_s > 15.0);
}

/// Ropes let go over a cylinder come to rest where MuJoCo's do.
#[test]
fn rest_shapes_over_a_cylinder_are_mujocos() {
    let text = include_str!("fixtures/rope-over-cylinder.json");
    let fixture: serde_json::Value = serde_json::from_str(text).unwrap();
    for case in fixture["cases"].as_array().unwrap() {
        let number = |v: &serde_json::Value| v.as_f64().unwrap();
        let vector = |v: &serde_json::Value| Vector3::from_fn(|i, _| number(&v[i]));
        let rope = support::truth::rope_of(&case["rope"]);
        let q = &case["attach_q_wxyz"];
        let [w, x, y, z] = [0, 1, 2, 3].map(|i| number(&q[i]));
        let q = UnitQuaternion::from_quaternion(nalgebra::Quaternion::new(w, x, y, z));
        let still = still(vector(&case["attach_p_m"]), q.to_rotation_matrix());
        let cylinder = &case["cylinder"];
        let axis = vector(&cylinder["axis"]);
        let along = UnitQuaternion::rotation_between(&Vector3::z(), &axis).unwrap();
        let over = Scene::with(vec![Obstacle {
            shape: Shape::Cylinder {
                half_length_m: number(&cylinder["half_length_m"]),
                radius_m: number(&cylinder["radius_m"]),
            },
            pose: Isometry3::from_parts(Translation3::from(vector(&cylinder["centre_m"])), along),
            friction: number(&case["friction"]),
        }]);
        for precision in [Precision::F64, Precision::F32] {
            let turn = vector(&case["initial_joint0_rotvec"]).into();
            let options = released(turn, options(precision, 13.0, 1.0));
            let run = simulate(&over, &rope, &still, &options);
            let rest = case["rest_nodes_m"].as_array().unwrap();
            let offsets = rest
                .iter()
                .enumerate()
                .map(|(node, want)| (run.nodes.position(13, node) - vector(want)).norm());
            let largest_m = offsets.fold(0.0, f64::max);
            let creep_m = (run.nodes.position(13, 22) - run.nodes.position(12, 22)).norm();
            println!(
                "{} {precision:?}: {largest_m} m, creep {creep_m}",
                case["name"]
            );
            assert!(largest_m < 2e-3, "{}: {largest_m} m", case["name"]);
        }
    }
}

/// Who starts inside what is said, whichever candidate it is.
#[test]
fn starting_inside_an_obstacle_is_refused_by_name() {
    let rope = RopeParams::from_array([22.0, 0.55, 0.01, 0.05, 0.005, 0.06, 0.06, 0.02, 0.8]);
    let motions = [0.0, 1.0].map(|x_m| still(Vector3::x() * x_m, Rotation3::identity()));
    let block = Shape::Box { half_m: [0.02; 3] };
    let scene = Scene::with(vec![
        Obstacle::floor(-1.0, 0.5),
        Obstacle::fixed(block, [1.0, 0.0, -0.3], 0.5),
    ]);
    let [outside, inside] = &motions;
    let candidates = [outside, inside].map(|motion| Candidate::new(&rope, motion));
    let options = options(Precision::F32, 0.1, 10.0);
    let refused = roll_out_in(&scene, &candidates, &options).unwrap_err();
    assert_eq!(refused.candidate, Some(1));
    let said = refused.to_string();
    let (before, link) = said.split_once(" m deep in obstacle 1, at link ").unwrap();
    let link: u32 = link
        .split_once("; start it outside")
        .unwrap()
        .0
        .parse()
        .unwrap();
    assert!((10..14).contains(&link), "{said}");
    // Deeper than a touch, at most half the block and the rope's radius.
    let depth_m: f64 = before.rsplit(' ').next().unwrap().parse().unwrap();
    assert!((1e-3..0.0251).contains(&depth_m), "{said}");
    assert!(roll_out_in(&scene, &candidates[..1], &options).is_ok());
}
