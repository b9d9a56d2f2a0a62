//! What a rope may touch, and what a rollout says about touching.

use nalgebra::{Isometry3, Vector3};
use shared_types::JOINTS;

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
        /// Link 1 to 7; its frame is as in `shared_types::kinematics::link_motions`.
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

    /// # Errors
    /// The first obstacle, or the domino, with an unusable number.
    pub(crate) fn check(&self) -> Result<(), SceneError> {
        for (index, obstacle) in self.obstacles.iter().enumerate() {
            if let Some((field, value, need)) = obstacle.fault() {
                return Err(SceneError::Obstacle {
                    obstacle: index,
                    field,
                    value,
                    need,
                });
            }
        }
        match self.domino.as_ref().and_then(Domino::fault) {
            Some((field, value, need)) => Err(SceneError::Domino { field, value, need }),
            None => Ok(()),
        }
    }
}

type Fault = (&'static str, f64, &'static str);

const SIZE: &str = "must be above 0 and at most 100 m";
const FRICTION: &str = "must be from 0 to 10";
const FINITE: &str = "must be finite";

fn size(field: &'static str, value: f64) -> Option<Fault> {
    (!(value > 0.0 && value <= 100.0)).then_some((field, value, SIZE))
}

fn friction(value: f64) -> Option<Fault> {
    (!(0.0..=10.0).contains(&value)).then_some(("friction", value, FRICTION))
}

fn finite(field: &'static str, values: impl IntoIterator<Item = f64>) -> Option<Fault> {
    let bad = values.into_iter().find(|v| !v.is_finite());
    bad.map(|value| (field, value, FINITE))
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

    fn fault(&self) -> Option<Fault> {
        let pose = match self.placement {
            Placement::World(pose) | Placement::Attach(pose) => pose,
            Placement::ArmLink { link, pose } => {
                if !(1..=JOINTS).contains(&link) {
                    return Some(("link", link as f64, "must be from 1 to 7"));
                }
                pose
            }
        };
        let place: Vector3<f64> = pose.translation.vector;
        self.shape
            .fault()
            .or_else(|| friction(self.friction))
            .or_else(|| finite("translation", place.iter().copied()))
            .or_else(|| finite("rotation", pose.rotation.coords.iter().copied()))
    }
}

impl Shape {
    fn fault(&self) -> Option<Fault> {
        match *self {
            Self::HalfSpace => None,
            Self::Box { half_m } => half_m.into_iter().find_map(|v| size("half_m", v)),
            Self::Capsule {
                half_length_m,
                radius_m,
            }
            | Self::Cylinder {
                half_length_m,
                radius_m,
            } => size("half_length_m", half_length_m).or_else(|| size("radius_m", radius_m)),
        }
    }
}

impl Domino {
    fn fault(&self) -> Option<Fault> {
        size("thickness_m", self.thickness_m)
            .or_else(|| size("width_m", self.width_m))
            .or_else(|| size("height_m", self.height_m))
            .or_else(|| friction(self.friction))
            .or_else(|| finite("foot_m", self.foot_m))
            .or_else(|| finite("facing_rad", [self.facing_rad]))
            .or_else(|| {
                let bad = !(self.mass_kg > 0.0 && self.mass_kg <= 100.0);
                bad.then_some((
                    "mass_kg",
                    self.mass_kg,
                    "must be above 0 and at most 100 kg",
                ))
            })
    }
}

/// Why a scene cannot be simulated.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum SceneError {
    /// An obstacle has an unusable number.
    #[error("obstacle {obstacle}: `{field}` is {value}: {need}")]
    Obstacle {
        /// Index of the obstacle, from 0.
        obstacle: usize,
        /// Field of its shape or placement.
        field: &'static str,
        /// Value found.
        value: f64,
        /// What is wrong with it.
        need: &'static str,
    },
    /// The domino has an unusable number.
    #[error("domino: `{field}` is {value}: {need}")]
    Domino {
        /// Field of [`Domino`].
        field: &'static str,
        /// Value found.
        value: f64,
        /// What is wrong with it.
        need: &'static str,
    },
    /// An obstacle is on a link of an arm nobody knows.
    #[error(
        "obstacle {obstacle} is on arm link {link}, but the motion of candidate {candidate} knows \
         no arm; place it in the world or use a motion with arm links"
    )]
    NoArm {
        /// Index of the candidate, from 0.
        candidate: usize,
        /// Index of the obstacle, from 0.
        obstacle: usize,
        /// The link, 1 to 7.
        link: usize,
    },
}

#[cfg(test)]
mod tests {
    use super::*;

    fn board() -> Obstacle {
        let shape = Shape::Box {
            half_m: [0.15, 0.2, 0.005],
        };
        Obstacle::fixed(shape, [0.85, 0.0, 0.195], 0.6)
    }

    #[test]
    fn unusable_numbers_are_named() {
        let fault = |change: fn(&mut Obstacle)| {
            let mut scene = Scene {
                obstacles: vec![board(), board()],
                domino: None,
            };
            assert_eq!(scene.check(), Ok(()));
            change(&mut scene.obstacles[1]);
            match scene.check().unwrap_err() {
                SceneError::Obstacle {
                    obstacle: 1, field, ..
                } => field,
                other => panic!("{other}"),
            }
        };
        assert_eq!(fault(|o| o.friction = -0.1), "friction");
        assert_eq!(
            fault(|o| o.shape = Shape::Box {
                half_m: [0.1, 0.0, 0.1]
            }),
            "half_m"
        );
        assert_eq!(
            fault(|o| o.placement = Placement::ArmLink {
                link: 8,
                pose: Isometry3::identity()
            }),
            "link"
        );
        assert_eq!(
            fault(|o| o.placement = Placement::World(Isometry3::translation(f64::NAN, 0.0, 0.0))),
            "translation"
        );
    }
}
