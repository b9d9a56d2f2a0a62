//! Start pose of a throw and the bounds of what a tip can reach.

use super::PlanError;
use arm_model::capsules::arm_at;
use arm_model::geometry::Capsule;
use arm_model::joint::START_POSE;
use arm_model::kinematics::JOINT_ORIGIN_M;
use arm_model::{Cell, JointVector, Pole, unit_hint};
use nalgebra::Vector3;

/// Height of the shoulder, the common point of joints 1 to 3 (m).
const SHOULDER_Z_M: f64 = JOINT_ORIGIN_M[0][2];
/// What no tip of a thrown rope was seen to exceed, as a distance from the base axis less
/// the rope's length, is so much short of the pole's reach (m). In the maps of a dozen
/// random ropes the outermost cells lie 0.88 to 0.97 m out.
const THROW_SHORT_M: f64 = 0.005;

/// Room that a target needs around arm, pole and column (m).
const TARGET_ROOM_M: f64 = 0.02;

/// Largest distance from the shoulder to the pole's end (m), down to the millimetre:
/// upper arm, forearm, and wrist with pole in one line.
fn pole_end_reach_m(pole: &Pole) -> f64 {
    let [_, _, above_elbow, elbow, below_elbow, _, flange] = JOINT_ORIGIN_M;
    let upper_arm_m = above_elbow[1].hypot(elbow[0]);
    let forearm_m = below_elbow[0].hypot(below_elbow[1]);
    let end = pole.end_m();
    // Joint 7 turns a pole that is not in the flange's middle to wherever it reaches most.
    let wrist_m = (flange[0] + end.xy().norm()).hypot(flange[1] + end.z);
    ((upper_arm_m + forearm_m + wrist_m) * 1e3).floor() / 1e3
}

/// [`START_POSE`] with joint 1 turned to the target's bearing, so that joints 2,
/// 4 and 6 move in the vertical plane through base axis and target.
#[must_use]
pub fn start_pose_for(target_m: [f64; 3]) -> JointVector {
    let mut pose = START_POSE;
    pose[0] = target_m[1].atan2(target_m[0]);
    pose
}

/// Refuses targets in the column, in the base, or where the arm stands before the throw.
///
/// # Errors
/// [`PlanError::Target`] with the part that the target lies in.
pub fn clear_of_arm(target_m: [f64; 3], cell: &Cell) -> Result<(), PlanError> {
    let target = Vector3::from(target_m);
    let (links, pole) = arm_at(&start_pose_for(target_m), &cell.pole);
    let near = |capsule: &Capsule| capsule.distance_to_point_m(&target) < TARGET_ROOM_M;
    let (base, links): (Vec<_>, Vec<_>) = links.iter().partition(|(link, _)| *link <= 1);
    let part = if cell.column_distance_m(&target) < TARGET_ROOM_M
        || base.iter().any(|(_, capsule)| near(capsule))
    {
        "base"
    } else if links.iter().any(|(_, capsule)| near(capsule)) || near(&pole) {
        "links in the start pose"
    } else {
        return Ok(());
    };
    let [x, y, z] = target_m;
    let room_cm = 100.0 * TARGET_ROOM_M;
    Err(PlanError::Target(format!(
        "target ({x:.3}, {y:.3}, {z:.3}) m lies in the arm's {part}; name one at least {room_cm:.0} cm away from it"
    )))
}

/// Refuses targets that no throw reaches.
///
/// # Errors
/// A target that is not finite, below the floor, or too far; the latter two with
/// a point within the bounds on its bearing: near it, or what it would be in cm or mm.
pub fn check_reach(target_m: [f64; 3], rope_length_m: f64, cell: &Cell) -> Result<(), PlanError> {
    if target_m.iter().any(|v| !v.is_finite()) {
        return Err(PlanError::Target(format!(
            "target {target_m:?} has a coordinate that is not a finite number of metres"
        )));
    }
    let [x, y, z] = target_m;
    let rho = x.hypot(y);
    let (reach_m, floor_z_m) = (pole_end_reach_m(&cell.pole), cell.floor_z_m);
    let rho_max = reach_m - THROW_SHORT_M + rope_length_m;
    let radius_max = reach_m + rope_length_m;
    let radius = rho.hypot(z - SHOULDER_Z_M);
    let reason = if rho > rho_max {
        format!(
            "{rho:.2} m from the base axis, but a rope of {rope_length_m:.2} m gets to {rho_max:.2} m"
        )
    } else if radius > radius_max {
        format!(
            "{radius:.2} m from the shoulder, but arm, pole and a rope of {rope_length_m:.2} m together reach {radius_max:.2} m"
        )
    } else if z < floor_z_m {
        format!("below the floor at {floor_z_m} m")
    } else {
        return Ok(());
    };
    let farthest_m = target_m.into_iter().map(f64::abs).fold(0.0, f64::max);
    let hint = unit_hint("target_m", farthest_m, radius_max);
    let near = |target_m| nearest(target_m, rho_max, radius_max, floor_z_m);
    // What it is if it was written in cm or in mm.
    let meant = [100.0, 1000.0].map(|parts| target_m.map(|v| v / parts));
    let is_free = |at: &[f64; 3]| {
        check_reach(*at, rope_length_m, cell)
            .and(clear_of_arm(*at, cell))
            .is_ok()
    };
    let mut meant = meant.into_iter().filter(|_| !hint.is_empty());
    Err(PlanError::Unreachable {
        target_m,
        nearest_m: meant.find(is_free).unwrap_or_else(|| near(target_m)),
        reason: reason + hint,
    })
}

/// A point within the bounds, on the target's bearing.
fn nearest([x, y, z]: [f64; 3], rho_max: f64, radius_max: f64, floor_z_m: f64) -> [f64; 3] {
    // A little inside each bound, so that the suggestion is accepted itself.
    const INSIDE: f64 = 0.98;
    let (rho, up) = (x.hypot(y), z - SHOULDER_Z_M);
    // Straight towards the shoulder first: what is far too far keeps its direction.
    let part = (radius_max * INSIDE / rho.hypot(up).max(1e-9)).min(1.0);
    let scale = (rho * part).min(rho_max * INSIDE) / rho.max(1e-9);
    let z_m = (SHOULDER_Z_M + up * part).max(floor_z_m * INSIDE);
    [x * scale, y * scale, z_m]
}

#[cfg(test)]
mod tests {
    use super::*;
    use core::f64::consts::{FRAC_PI_2, PI};

    #[test]
    fn the_start_pose_turns_the_plane_to_the_target() {
        let target = [0.8, -0.5, 0.3];
        let (p, _) = Pole::default().attach_pose(&start_pose_for(target));
        assert!((p.y.atan2(p.x) - target[1].atan2(target[0])).abs() < 1e-9);
    }

    #[test]
    fn a_target_in_millimetres_is_asked_about() {
        let said = |target_m| {
            check_reach(target_m, 0.5, &Cell::default())
                .unwrap_err()
                .to_string()
        };
        assert!(said([1000.0, 0.0, 400.0]).contains("is it in mm?"));
        assert!(said([85.0, 0.0, 20.0]).contains("is it in cm or mm?"));
        assert!(!said([1.7, 0.0, 0.4]).contains("is it in"));
    }

    #[test]
    fn no_pose_stretches_further_than_the_stated_reach() {
        let lab = Pole::default();
        let long = Pole {
            length_m: 0.35,
            offset_m: [0.0, 0.02, 0.01],
            ..lab
        };
        for pole in [lab, long] {
            let (longest, stated) = (longest_m(&pole), pole_end_reach_m(&pole));
            assert!((longest - stated).abs() < 2e-3, "{longest} {stated}");
        }
        assert_eq!(pole_end_reach_m(&lab), 0.955);
    }

    fn longest_m(pole: &Pole) -> f64 {
        let mut longest: f64 = 0.0;
        for a in 0..200 {
            for b in 0..200 {
                let q4 = -0.1 + 4.0 * f64::from(a) / 199.0;
                let q6 = -1.69 + 4.83 * f64::from(b) / 199.0;
                for q7 in [-FRAC_PI_2, 0.0, FRAC_PI_2, PI] {
                    let q = JointVector([0.0, 0.0, 0.0, q4, 0.0, q6, q7]);
                    let p = pole.attach_pose(&q).0;
                    longest = longest.max(p.x.hypot(p.z - SHOULDER_Z_M));
                }
            }
        }
        longest
    }

    #[test]
    fn targets_in_the_arm_are_refused() {
        let cell = Cell::default();
        let flange = arm_model::kinematics::flange_pose(&start_pose_for([1.0, 0.0, 0.0])).0;
        let end = cell.pole.attach_pose(&start_pose_for([0.6, 0.6, 0.0])).0;
        for (target_m, part) in [
            ([0.0, 0.0, 0.1], "base"),
            ([0.05, -0.05, -0.3], "base"),
            (flange.into(), "links in the start pose"),
            (end.into(), "links in the start pose"),
        ] {
            let refusal = clear_of_arm(target_m, &cell).unwrap_err().to_string();
            assert!(refusal.contains(&format!("arm's {part};")), "{refusal}");
        }
        for free in [[1.0, 0.0, 0.4], [0.85, 0.3, -0.1], [1.05, -0.3, 0.6]] {
            assert!(clear_of_arm(free, &cell).is_ok(), "{free:?}");
        }
    }

    #[test]
    fn far_targets_are_refused_with_an_acceptable_alternative() {
        let cell = Cell::default();
        for far in [
            [2.0, 1.0, 0.3],
            [0.3, 0.1, 2.5],
            [0.8, 0.0, -0.9],
            [1.6, 0.0, 1.2],
        ] {
            let Err(PlanError::Unreachable { nearest_m, .. }) = check_reach(far, 0.55, &cell)
            else {
                panic!("{far:?} was accepted");
            };
            assert!(
                check_reach(nearest_m, 0.55, &cell).is_ok(),
                "{far:?} -> {nearest_m:?}"
            );
        }
        // In mm, in cm, and in nothing that can be meant.
        for (written, meant_m) in [
            ([1000.0, 0.0, 400.0], Some([1.0, 0.0, 0.4])),
            ([110.0, 0.0, 45.0], Some([1.1, 0.0, 0.45])),
            ([1e6, 0.0, 4e5], None),
        ] {
            let Err(PlanError::Unreachable { nearest_m, .. }) = check_reach(written, 0.55, &cell)
            else {
                panic!("{written:?} was accepted");
            };
            let is_free = check_reach(nearest_m, 0.55, &cell).and(clear_of_arm(nearest_m, &cell));
            assert!(is_free.is_ok(), "{written:?} -> {nearest_m:?}");
            let near = |m: [f64; 3]| (Vector3::from(nearest_m) - Vector3::from(m)).norm() < 1e-9;
            assert!(meant_m.is_none_or(near), "{written:?} -> {nearest_m:?}");
        }
        assert!(check_reach([1.1, 0.0, 0.45], 0.45, &cell).is_ok());
        let refusal = check_reach([f64::NAN, 0.0, 0.0], 0.5, &cell).unwrap_err();
        assert!(refusal.to_string().contains("not a finite"), "{refusal}");
    }
}
