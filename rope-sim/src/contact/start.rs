//! Ropes that would start inside an obstacle.

use super::body::Body;
use super::middle;
use super::rocking::RockingBlocks;
use crate::algebra::Vec3;
use crate::error::SimulateError;
use crate::scene::Scene;
use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use shared_types::RopeParams;

/// Depth at the start that is still a touch (m). Contacts push it out at once.
const TOUCH_M: f64 = 1e-3;

/// A rope about to start.
pub(crate) struct Starting<'a> {
    pub(crate) candidate: usize,
    pub(crate) rope: &'a RopeParams,
    pub(crate) attach_m: &'a Vector3<f64>,
    /// Attitudes of the links, scalar first.
    pub(crate) links: &'a [[f64; 4]],
}

impl Starting<'_> {
    /// # Errors
    /// The first body of the scene that the rope is in.
    pub(crate) fn check(&self, scene: &Scene) -> Result<(), SimulateError> {
        let nodes = self.nodes_m();
        for (index, obstacle) in scene.obstacles.iter().enumerate() {
            let body = Body::new(obstacle, [0.0; 3]);
            self.check_body(&body, &nodes, &format!("obstacle {index}"))?;
        }
        if let Some(domino) = &scene.domino {
            let body = RockingBlocks::new(domino, 1, [0.0; 3]).body();
            self.check_body(&body, &nodes, "the domino")?;
        }
        Ok(())
    }

    /// All nodes, attach point first (m).
    fn nodes_m(&self) -> Vec<Vec3<f64>> {
        let down = Vector3::z() * -self.rope.link_length_m();
        let mut at = *self.attach_m;
        let mut nodes = vec![Vec3(at.x, at.y, at.z)];
        for [w, x, y, z] in self.links {
            at += UnitQuaternion::new_unchecked(Quaternion::new(*w, *x, *y, *z)) * down;
            nodes.push(Vec3(at.x, at.y, at.z));
        }
        nodes
    }

    fn check_body(
        &self,
        body: &Body<f64>,
        nodes: &[Vec3<f64>],
        name: &str,
    ) -> Result<(), SimulateError> {
        for (link, ends) in nodes.windows(2).enumerate() {
            let &[near, far] = ends else { continue };
            let is_last = link + 1 == self.links.len();
            let radius_m = if is_last {
                self.rope.lead_radius_m.max(self.rope.radius_m)
            } else {
                self.rope.radius_m
            };
            let mut depth_m = radius_m - body.distance(far).0;
            if let Some((back, _)) = middle::closest(body, near, far) {
                let at = near.sub(far).scale_add(back, far);
                depth_m = depth_m.max(self.rope.radius_m - body.distance(at).0);
            }
            if depth_m > TOUCH_M {
                return Err(SimulateError::of(
                    self.candidate,
                    format_args!(
                        "at the start its rope is {depth_m} m deep in {name}, at link {link}; \
                         start it outside"
                    ),
                ));
            }
        }
        Ok(())
    }
}
