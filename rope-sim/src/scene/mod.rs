//! What a rope may touch, and what a rollout says about touching.

mod check;
mod task;

pub use task::TaskFrame;

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
    /// Cylinder about the z axis with flat ends.
    Cylinder {
        /// Half its length (m).
        half_length_m: f64,
        /// Radius (m).
        radius_m: f64,
    },
}

/// A body fixed in the world that the rope can touch. It does not yield; contacts are inelastic with Coulomb
/// friction. The rope's links touch as capsules of the rope's radius, the lead as a
/// sphere.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Obstacle {
    /// Its form.
    pub shape: Shape,
    /// Pose of its frame in the world.
    pub pose: Isometry3<f64>,
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

/// What happened between a rope and one obstacle, from the states at step ends.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ContactSummary {
    /// First touch, if any: when (s) and by which part.
    pub first: Option<(f64, RopePart)>,
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
}

impl Obstacle {
    /// A body whose axes are along the world's.
    #[must_use]
    pub fn fixed(shape: Shape, centre_m: [f64; 3], friction: f64) -> Self {
        let [x, y, z] = centre_m;
        Self {
            shape,
            pose: Isometry3::translation(x, y, z),
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
