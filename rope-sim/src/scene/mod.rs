//! What a rope may touch, and what a rollout says about touching.

mod check;

pub use check::{SceneBody, SceneError};

use nalgebra::Isometry3;

/// Convex body, in a frame of its own.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Shape {
    /// Everything below z = 0.
    HalfSpace,
    /// Box about the origin.
    Box {
        /// Half its edges (m).
        half_m: [f64; 3],
    },
    /// Cylinder about the z axis with hemispheres on its ends.
    Capsule {
        /// Half the length of the cylindrical part (m).
        half_length_m: f64,
        /// Radius (m).
        radius_m: f64,
    },
    /// Cylinder about the z axis with flat ends.
    Cylinder {
        /// Half its length (m).
        half_length_m: f64,
        /// Radius (m).
        radius_m: f64,
    },
}

/// Where a shape's frame is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Placement {
    /// Fixed in the world.
    World(Isometry3<f64>),
    /// Fixed in the attach frame, as the pole is. Parts of the rope that touch it
    /// while the rope leaves the frame straight belong to the mounting and pass it.
    Attach(Isometry3<f64>),
    /// Fixed in a link of the arm; needs a motion that knows its arm, see
    /// [`crate::AttachMotion::arm_links`].
    ArmLink {
        /// Link 1 to 7; its frame is as in `arm_model::kinematics::link_motions`.
        link: usize,
        /// Pose in the link's frame.
        pose: Isometry3<f64>,
    },
}

/// A body the rope can touch. It does not yield; contacts are inelastic with Coulomb
/// friction. The rope's links touch as capsules of the rope's radius, the lead as a
/// sphere.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Obstacle {
    /// Its form.
    pub shape: Shape,
    /// Its place.
    pub placement: Placement,
    /// Coefficient of friction (1).
    pub friction: f64,
}

/// A thin box standing on one end until the rope pushes it over. It rocks about the
/// lower edges of its broad faces, does not slide, and does not block the rope once
/// it has fallen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Domino {
    /// Centre of its lower face (m, world).
    pub foot_m: [f64; 3],
    /// Direction its broad face looks to, about z from x (rad).
    pub facing_rad: f64,
    /// Edge along that direction (m).
    pub thickness_m: f64,
    /// Horizontal edge of the broad face (m).
    pub width_m: f64,
    /// Height (m).
    pub height_m: f64,
    /// Mass (kg).
    pub mass_kg: f64,
    /// Coefficient of friction against the rope (1).
    pub friction: f64,
}

/// Everything the rope can touch.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Scene {
    /// Bodies that do not yield.
    pub obstacles: Vec<Obstacle>,
    /// A domino to push over.
    pub domino: Option<Domino>,
}

/// Which part of the rope touched.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RopePart {
    /// A link.
    Links,
    /// The lead.
    Lead,
}

/// What happened between a rope and one obstacle, from the states at step ends. All
/// numbers are zero while nothing has touched.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ContactSummary {
    /// First touch: when (s) and by which part.
    pub first: Option<(f64, RopePart)>,
    /// Whether a link has touched.
    pub links_touched: bool,
    /// Whether the lead has touched.
    pub lead_touched: bool,
    /// Time in touch (s).
    pub in_touch_s: f64,
    /// Largest normal force of one contact point in one step (N); an impact's is its
    /// impulse over the step.
    pub peak_normal_force_n: f64,
    /// Greatest depth of one contact point (m).
    pub greatest_penetration_m: f64,
}

impl ContactSummary {
    /// Whether anything touched.
    #[must_use]
    pub fn touched(&self) -> bool {
        self.first.is_some()
    }
}

/// What became of the domino.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct DominoOutcome {
    /// First touch by the rope (s).
    pub touched_at_s: Option<f64>,
    /// When its tilt passed 45 degrees (s).
    pub down_at_s: Option<f64>,
    /// Greatest tilt (rad), positive along the direction it faces away from the
    /// push; it is no longer followed beyond 45 degrees.
    pub peak_tilt_rad: f64,
}

impl Scene {
    /// Nothing to touch.
    pub const EMPTY: Self = Self {
        obstacles: Vec::new(),
        domino: None,
    };

    /// These obstacles, no domino.
    #[must_use]
    pub fn with(obstacles: Vec<Obstacle>) -> Self {
        Self {
            obstacles,
            domino: None,
        }
    }

    /// Whether there is nothing to touch.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.obstacles.is_empty() && self.domino.is_none()
    }

    /// First obstacle on an arm link: its index and the link, 1 to 7.
    pub(crate) fn first_on_arm(&self) -> Option<(usize, usize)> {
        let carriers = self.obstacles.iter().enumerate();
        carriers
            .filter_map(|(index, o)| match o.placement {
                Placement::ArmLink { link, .. } => Some((index, link)),
                _ => None,
            })
            .next()
    }

    /// The arm links its obstacles are on, each once.
    pub(crate) fn arm_links(&self) -> Vec<usize> {
        let mut links: Vec<usize> = self
            .obstacles
            .iter()
            .filter_map(|o| match o.placement {
                Placement::ArmLink { link, .. } => Some(link),
                _ => None,
            })
            .collect();
        links.sort_unstable();
        links.dedup();
        links
    }
}

impl Obstacle {
    /// A body fixed in the world with its own axes along the world's.
    #[must_use]
    pub fn fixed(shape: Shape, centre_m: [f64; 3], friction: f64) -> Self {
        let [x, y, z] = centre_m;
        Self {
            shape,
            placement: Placement::World(Isometry3::translation(x, y, z)),
            friction,
        }
    }

    /// An upright box by the middle of its upper face and its whole edges (m).
    #[must_use]
    pub fn box_below(top_m: [f64; 3], size_m: [f64; 3], friction: f64) -> Self {
        let [x, y, z] = top_m;
        let half_m = [0.5 * size_m[0], 0.5 * size_m[1], 0.5 * size_m[2]];
        Self::fixed(Shape::Box { half_m }, [x, y, z - half_m[2]], friction)
    }

    /// An upright cylinder by the middle of its upper face (m).
    #[must_use]
    pub fn column_below(top_m: [f64; 3], radius_m: f64, height_m: f64, friction: f64) -> Self {
        let [x, y, z] = top_m;
        let half_length_m = 0.5 * height_m;
        let shape = Shape::Cylinder {
            half_length_m,
            radius_m,
        };
        Self::fixed(shape, [x, y, z - half_length_m], friction)
    }

    /// Everything below a height (m).
    #[must_use]
    pub fn floor(height_m: f64, friction: f64) -> Self {
        Self::fixed(Shape::HalfSpace, [0.0, 0.0, height_m], friction)
    }
}
