//! Arm, pole, rope, target and camera in space.
//!
//! The arm is drawn once, each piece bound to the frame of its link; only the frames
//! move.

use super::messages::{CAMERA_FRAME, colour, round, time};
use super::urdf::{BASE, POLE_END, link_name};
use arm_model::kinematics::{JOINT_ORIGIN_M, link_poses};
use arm_model::{JOINTS, JointVector, Pole};
use nalgebra::{Isometry3, Matrix3, Rotation3, Translation3, UnitQuaternion, Vector3};
use serde_json::{Value, json};
use shared_types::StereoCamera;

const ARM_DIAMETER_M: f64 = 0.08;
/// Diameter of the simulated rig's target ball.
const TARGET_DIAMETER_M: f64 = 0.04;
const ARM: [f64; 4] = [0.75, 0.78, 0.82, 1.0];
const POLE_RGBA: [f64; 4] = [0.2, 0.2, 0.2, 1.0];
const TARGET: [f64; 4] = [0.9, 0.1, 0.1, 1.0];
const ROPE: [f64; 4] = [0.1, 0.5, 0.9, 1.0];
const LEAD: [f64; 4] = [0.95, 0.75, 0.1, 1.0];

fn vector(v: &Vector3<f64>) -> Value {
    json!({ "x": round(v.x), "y": round(v.y), "z": round(v.z) })
}

fn quaternion(q: &UnitQuaternion<f64>) -> Value {
    json!({ "x": round(q.i), "y": round(q.j), "z": round(q.k), "w": round(q.w) })
}

fn pose(at: &Isometry3<f64>) -> Value {
    json!({ "position": vector(&at.translation.vector), "orientation": quaternion(&at.rotation) })
}

/// A place from an origin (m) and an attitude.
fn placed(p_m: &Vector3<f64>, r: &Matrix3<f64>) -> Isometry3<f64> {
    let rotation = Rotation3::from_matrix_unchecked(*r);
    Isometry3::from_parts(
        Translation3::from(*p_m),
        UnitQuaternion::from_rotation_matrix(&rotation),
    )
}

/// One `foxglove.FrameTransform`.
fn transform(at_ns: u64, parent: &str, child: &str, place: Isometry3<f64>) -> Value {
    json!({
        "timestamp": time(at_ns), "parent_frame_id": parent, "child_frame_id": child,
        "translation": vector(&place.translation.vector), "rotation": quaternion(&place.rotation),
    })
}

/// Places of all links and of the pole's end; `None` when an angle is no number.
pub(super) fn arm_frames(at_ns: u64, q: &JointVector, pole: &Pole) -> Option<Value> {
    if !q.is_finite() {
        return None;
    }
    let mut transforms: Vec<Value> = link_poses(q)
        .iter()
        .enumerate()
        .map(|(i, (p, r))| transform(at_ns, BASE, &link_name(i), placed(p, r)))
        .collect();
    let (p, r) = pole.attach_pose(q);
    transforms.push(transform(at_ns, BASE, POLE_END, placed(&p, &r)));
    Some(json!({ "transforms": transforms }))
}

fn entity(at_ns: u64, id: &str, frame: &str, parts: &[(&str, Value)]) -> Value {
    let mut entity = json!({
        "timestamp": time(at_ns), "frame_id": frame, "id": id, "frame_locked": true,
        "lifetime": { "sec": 0, "nsec": 0 }, "metadata": [], "arrows": [], "cubes": [], "spheres": [],
        "cylinders": [], "lines": [], "triangles": [], "texts": [], "models": [],
    });
    for (kind, part) in parts {
        if let Some(list) = entity[*kind].as_array_mut() {
            list.push(part.clone());
        }
    }
    entity
}

fn ball(at_m: &Vector3<f64>, diameter_m: f64, rgba: [f64; 4]) -> Value {
    json!({
        "pose": pose(&Translation3::from(*at_m).into()), "color": colour(rgba),
        "size": vector(&Vector3::repeat(diameter_m)),
    })
}

/// A rod between two points of the frame.
fn rod(from_m: &Vector3<f64>, to_m: &Vector3<f64>, diameter_m: f64, rgba: [f64; 4]) -> Value {
    let way_m = to_m - from_m;
    let along = UnitQuaternion::rotation_between(&Vector3::z(), &way_m).unwrap_or_else(|| {
        UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI)
    });
    let middle = Isometry3::from_parts(Translation3::from(from_m + way_m * 0.5), along);
    json!({
        "pose": pose(&middle), "size": vector(&Vector3::new(diameter_m, diameter_m, way_m.norm())),
        "bottom_scale": 1.0, "top_scale": 1.0, "color": colour(rgba),
    })
}

/// Arm, pole and, where there is one, the target.
pub(super) fn room(at_ns: u64, pole: &Pole, target_m: Option<[f64; 3]>) -> Value {
    let mut entities = Vec::new();
    let origins = JOINT_ORIGIN_M.map(Vector3::from);
    for (i, to_m) in origins.iter().enumerate() {
        let frame = i.checked_sub(1).map_or_else(|| BASE.to_owned(), link_name);
        let mut parts = vec![("spheres", ball(&Vector3::zeros(), ARM_DIAMETER_M, ARM))];
        if to_m.norm() > 0.0 {
            let rod = rod(&Vector3::zeros(), to_m, ARM_DIAMETER_M, ARM);
            parts.push(("cylinders", rod));
        }
        entities.push(entity(at_ns, &format!("arm{i}"), &frame, &parts));
    }
    let (from_m, to_m) = (pole.offset_m.into(), pole.end_m());
    let stick = rod(&from_m, &to_m, 2.0 * pole.radius_m, POLE_RGBA);
    let last = link_name(JOINTS - 1);
    entities.push(entity(at_ns, "pole", &last, &[("cylinders", stick)]));
    if let Some(target_m) = target_m {
        let target = ball(&Vector3::from(target_m), TARGET_DIAMETER_M, TARGET);
        entities.push(entity(at_ns, "target", BASE, &[("spheres", target)]));
    }
    json!({ "deletions": [], "entities": entities })
}

/// The rope's nodes (tenths of a millimetre, three by three) and its lead.
pub(super) fn rope(at_ns: u64, nodes: &[i32], [radius_m, lead_radius_m]: [f64; 2]) -> Value {
    let points: Vec<Vector3<f64>> = nodes
        .chunks_exact(3)
        .map(|p| Vector3::new(p[0], p[1], p[2]).map(|v| f64::from(v) * 1e-4))
        .collect();
    let line = json!({
        "type": 0, "pose": pose(&Isometry3::identity()), "thickness": 2.0 * radius_m,
        "scale_invariant": false, "points": points.iter().map(vector).collect::<Vec<_>>(),
        "color": colour(ROPE), "colors": [], "indices": [],
    });
    let mut parts = vec![("lines", line)];
    if let Some(tip) = points.last() {
        parts.push(("spheres", ball(tip, 2.0 * lead_radius_m, LEAD)));
    }
    json!({ "deletions": [], "entities": [entity(at_ns, "rope", BASE, &parts)] })
}

/// `foxglove.CameraCalibration` of the left eye.
pub(super) fn calibration(at_ns: u64, camera: &StereoCamera) -> Value {
    let image = &camera.left;
    let (cx, cy) = (image.cx, image.cy);
    json!({
        "timestamp": time(at_ns), "frame_id": CAMERA_FRAME,
        "width": camera.width_px, "height": camera.height_px,
        "distortion_model": "plumb_bob", "D": image.distortion,
        "K": [image.fx, 0.0, cx, 0.0, image.fy, cy, 0.0, 0.0, 1.0],
        "R": [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
        "P": [image.fx, 0.0, cx, 0.0, 0.0, image.fy, cy, 0.0, 0.0, 0.0, 1.0, 0.0],
    })
}

/// Place of the camera in the world.
pub(super) fn camera_place(at_ns: u64, camera: &StereoCamera) -> Value {
    let place = placed(&camera.p_w_cam_m, &camera.r_w_cam);
    transform(at_ns, BASE, CAMERA_FRAME, place)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rods are bound to frames: each must end where the next frame begins.
    #[test]
    fn each_rod_ends_where_the_next_link_begins() {
        let q = JointVector([0.3, 0.8, -0.4, 2.1, 0.2, 1.2, 0.1]);
        let pole = Pole {
            length_m: 0.3,
            offset_m: [0.01, -0.02, 0.03],
            ..Pole::default()
        };
        let frames = arm_frames(0, &q, &pole).unwrap();
        let read = |v: &Value| Vector3::from(["x", "y", "z"].map(|k| v[k].as_f64().unwrap()));
        let turn = |v: &Value| {
            let [x, y, z, w] = ["x", "y", "z", "w"].map(|k| v[k].as_f64().unwrap());
            UnitQuaternion::from_quaternion(nalgebra::Quaternion::new(w, x, y, z))
        };
        let origin = |i: usize| read(&frames["transforms"][i]["translation"]);
        let drawn = room(0, &pole, None);
        for entity in drawn["entities"].as_array().unwrap() {
            let Some(rod) = entity["cylinders"].get(0) else {
                continue;
            };
            let frame = entity["frame_id"].as_str().unwrap();
            let link = frame
                .strip_prefix("link")
                .map(|n| n.parse::<usize>().unwrap());
            let place = link.map_or_else(Isometry3::identity, |n| {
                let rotation = turn(&frames["transforms"][n - 1]["rotation"]);
                Isometry3::from_parts(Translation3::from(origin(n - 1)), rotation)
            });
            let half = Vector3::new(0.0, 0.0, rod["size"]["z"].as_f64().unwrap() / 2.0);
            let in_frame =
                turn(&rod["pose"]["orientation"]) * half + read(&rod["pose"]["position"]);
            let end = place.transform_point(&in_frame.into()).coords;
            // The frame after link n is number n, the pole's end the last.
            let next = origin(link.unwrap_or(0));
            assert!((end - next).norm() < 1e-6, "{frame}: {end} against {next}");
        }
    }
}
