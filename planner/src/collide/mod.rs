//! Contacts of rope, pole, arm, column and floor at sampled instants.
//!
//! Shapes: the arm's published collision meshes wrapped in capsules (vendor
//! model of the 1305 arm), the pole as a capsule, the column as a box, the floor
//! as a plane. The planner counts contacts for the paper's `P_coll` (appendix
//! "CMA-ES Fitness Functions", shared quantities) and measures clearances.

mod arm;
mod block;
mod rope;

pub use arm::{ArmShape, Part, tool_contacts};
pub use block::{Block, block_contacts};
pub use rope::{RopeShape, rope_clearance_m, rope_contacts};

/// Contacts of one instant, or their sum over the sampled instants of a throw.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct ContactCounts {
    /// Parts of the arm (or pole) the rope touches.
    pub rope_robot: u32,
    /// Parts of the arm the tool side (links 6, 7, pole) touches.
    pub pole_robot: u32,
    /// Contacts of rope or tool with the base region: base, link 1, column,
    /// floor.
    pub base_region: u32,
}

impl core::ops::AddAssign for ContactCounts {
    fn add_assign(&mut self, other: Self) {
        self.rope_robot += other.rope_robot;
        self.pole_robot += other.pole_robot;
        self.base_region += other.base_region;
    }
}

impl ContactCounts {
    /// Whether nothing touched.
    #[must_use]
    pub fn none(&self) -> bool {
        *self == Self::default()
    }
}
