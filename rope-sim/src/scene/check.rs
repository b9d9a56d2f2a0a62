//! Scenes that cannot be simulated, and why.

use super::{Domino, Obstacle, Scene, Shape};
use crate::extras::Unusable;

impl Scene {
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

const SIZE: &str = "must be above 0 and at most 100 m";
const FRICTION: &str = "must be from 0 to 10";
const FINITE: &str = "must be finite";

fn size(field: &'static str, value: f64) -> Option<Unusable> {
    (!(value > 0.0 && value <= 100.0)).then_some((field, value, SIZE))
}

fn friction(value: f64) -> Option<Unusable> {
    (!(0.0..=10.0).contains(&value)).then_some(("friction", value, FRICTION))
}

fn finite(field: &'static str, values: impl IntoIterator<Item = f64>) -> Option<Unusable> {
    let bad = values.into_iter().find(|v| !v.is_finite());
    bad.map(|value| (field, value, FINITE))
}

impl Obstacle {
    fn fault(&self) -> Option<Unusable> {
        let place = self.pose.translation.vector;
        self.shape
            .fault()
            .or_else(|| friction(self.friction))
            .or_else(|| finite("translation", place.iter().copied()))
            .or_else(|| finite("rotation", self.pose.rotation.coords.iter().copied()))
    }
}

impl Shape {
    fn fault(&self) -> Option<Unusable> {
        match *self {
            Self::HalfSpace => None,
            Self::Box { half_m } => half_m.into_iter().find_map(|v| size("half_m", v)),
            Self::Cylinder {
                half_length_m,
                radius_m,
            } => size("half_length_m", half_length_m).or_else(|| size("radius_m", radius_m)),
        }
    }
}

impl Domino {
    fn fault(&self) -> Option<Unusable> {
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

/// Something of a [`Scene`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SceneBody {
    /// The obstacle with this index, from 0.
    Obstacle(usize),
    /// The domino.
    Domino,
}

impl core::fmt::Display for SceneBody {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Obstacle(index) => write!(f, "obstacle {index}"),
            Self::Domino => f.write_str("the domino"),
        }
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
    /// A rope starts deeper in an obstacle than a touch.
    #[error(
        "candidate {candidate}: at the start its rope is {depth_m} m deep in {body}, at link \
         {link}; start it outside"
    )]
    StartsInside {
        /// Index of the candidate, from 0.
        candidate: usize,
        /// In what.
        body: SceneBody,
        /// The link that is in it or ends in it, from 0 at the attach point.
        link: usize,
        /// How deep the rope's surface is (m).
        depth_m: f64,
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
        let flat = |o: &mut Obstacle| {
            o.shape = Shape::Box {
                half_m: [0.1, 0.0, 0.1],
            };
        };
        assert_eq!(fault(flat), "half_m");
        let nowhere = |o: &mut Obstacle| o.pose.translation.vector.x = f64::NAN;
        assert_eq!(fault(nowhere), "translation");
    }
}
