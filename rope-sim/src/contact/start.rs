//! Ropes that would start inside an obstacle.

use super::body::Body;
use super::middle;
use super::rocking::RockingBlocks;
use crate::algebra::Vec3;
use crate::scene::Scene;
use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use shared_types::RopeParams;

/// Depth at the start that is still a touch (m). Contacts push it out at once.
const TOUCH_M: f64 = 1e-3;

/// Refuses a rope that starts with the attach point at `attach_m` and `links` of these
/// attitudes, scalar first, deeper than a touch in a body of the scene: the first such.
pub(crate) fn check_start(
    scene: &Scene,
    rope: &RopeParams,
    attach_m: &Vector3<f64>,
    links: &[[f64; 4]],
) -> Result<(), String> {
    let down = Vector3::z() * -rope.link_length_m();
    let mut at = *attach_m;
    let mut nodes = vec![Vec3(at.x, at.y, at.z)];
    for [w, x, y, z] in links {
        at += UnitQuaternion::new_unchecked(Quaternion::new(*w, *x, *y, *z)) * down;
        nodes.push(Vec3(at.x, at.y, at.z));
    }
    for (index, obstacle) in scene.obstacles.iter().enumerate() {
        let body = Body::new(obstacle, [0.0; 3]);
        check_body(rope, &nodes, &body, &format!("obstacle {index}"))?;
    }
    let Some(domino) = &scene.domino else {
        return Ok(());
    };
    let body = RockingBlocks::new(domino, 1, [0.0; 3]).body();
    check_body(rope, &nodes, &body, "the domino")
}

fn check_body(
    rope: &RopeParams,
    nodes: &[Vec3<f64>],
    body: &Body<f64>,
    name: &str,
) -> Result<(), String> {
    for (link, ends) in nodes.windows(2).enumerate() {
        let &[near, far] = ends else { continue };
        let is_last = link + 2 == nodes.len();
        let radius_m = if is_last {
            rope.lead_radius_m.max(rope.radius_m)
        } else {
            rope.radius_m
        };
        let mut depth_m = radius_m - body.distance(far).0;
        if let Some((back, _)) = middle::closest(body, near, far) {
            let at = near.sub(far).scale_add(back, far);
            depth_m = depth_m.max(rope.radius_m - body.distance(at).0);
        }
        if depth_m > TOUCH_M {
            return Err(format!(
                "at the start its rope is {depth_m} m deep in {name}, at link {link}; start it \
                 outside"
            ));
        }
    }
    Ok(())
}
