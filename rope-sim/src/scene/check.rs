//! Scenes that cannot be simulated, and why.

use super::{Domino, Obstacle, Scene, Shape};
use crate::unusable::Unusable;

impl Scene {
    /// # Errors
    /// The first obstacle, or the domino, with an unusable number.
    pub(crate) fn check(&self) -> Result<(), SceneError> {
        for (obstacle, of) in self.obstacles.iter().enumerate() {
            let named = |unusable| SceneError::Obstacle { obstacle, unusable };
            of.check().map_err(named)?;
        }
        self.domino
            .as_ref()
            .map_or(Ok(()), Domino::check)
            .map_err(SceneError::Domino)
    }
}

fn check_size(field: &'static str, numbers: impl IntoIterator<Item = f64>) -> Result<(), Unusable> {
    let need = "must be above 0 and at most 100 m";
    Unusable::unless(field, need, numbers, |v| v > 0.0 && v <= 100.0)
}

fn check_friction(number: f64) -> Result<(), Unusable> {
    Unusable::unless("friction", "must be from 0 to 10", [number], |v| {
        (0.0..=10.0).contains(&v)
    })
}

impl Obstacle {
    fn check(&self) -> Result<(), Unusable> {
        match self.shape {
            Shape::HalfSpace => {}
            Shape::Box { half_m } => check_size("half_m", half_m)?,
            Shape::Cylinder {
                half_length_m,
                radius_m,
            } => {
                check_size("half_length_m", [half_length_m])?;
                check_size("radius_m", [radius_m])?;
            }
        }
        check_friction(self.friction)?;
        let place = self.pose.translation.vector;
        Unusable::unless_finite("translation", place.iter().copied())?;
        Unusable::unless_finite("rotation", self.pose.rotation.coords.iter().copied())
    }
}

impl Domino {
    fn check(&self) -> Result<(), Unusable> {
        check_size("thickness_m", [self.thickness_m])?;
        check_size("width_m", [self.width_m])?;
        check_size("height_m", [self.height_m])?;
        check_friction(self.friction)?;
        Unusable::unless_finite("foot_m", self.foot_m)?;
        Unusable::unless_finite("facing_rad", [self.facing_rad])?;
        let need = "must be above 0 and at most 100 kg";
        Unusable::unless("mass_kg", need, [self.mass_kg], |v| v > 0.0 && v <= 100.0)
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
    #[error("obstacle {obstacle}: {unusable}")]
    Obstacle {
        /// Index of the obstacle, from 0.
        obstacle: usize,
        /// The number.
        unusable: Unusable,
    },
    /// The domino has an unusable number.
    #[error("domino: {0}")]
    Domino(Unusable),
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
                    obstacle: 1,
                    unusable,
                } => unusable.field,
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
