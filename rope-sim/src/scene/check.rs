//! Scenes that cannot be simulated, and why.

use super::{Domino, Obstacle, Scene, Shape};
use crate::error::{SimulateError, refuse_unless, refuse_unless_finite};

impl Scene {
    /// # Errors
    /// The first obstacle, or the domino, with an unusable number.
    pub(crate) fn check(&self) -> Result<(), SimulateError> {
        for (index, obstacle) in self.obstacles.iter().enumerate() {
            let named = |e| SimulateError::new(format_args!("obstacle {index}: {e}"));
            obstacle.check().map_err(named)?;
        }
        self.domino
            .as_ref()
            .map_or(Ok(()), Domino::check)
            .map_err(|e| SimulateError::new(format_args!("domino: {e}")))
    }
}

fn check_size(field: &'static str, numbers: impl IntoIterator<Item = f64>) -> Result<(), String> {
    let need = "must be above 0 and at most 100 m";
    refuse_unless(field, need, numbers, |v| v > 0.0 && v <= 100.0)
}

fn check_friction(number: f64) -> Result<(), String> {
    refuse_unless("friction", "must be from 0 to 10", [number], |v| {
        (0.0..=10.0).contains(&v)
    })
}

impl Obstacle {
    fn check(&self) -> Result<(), String> {
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
        refuse_unless_finite("translation", place.iter().copied())?;
        refuse_unless_finite("rotation", self.pose.rotation.coords.iter().copied())
    }
}

impl Domino {
    fn check(&self) -> Result<(), String> {
        check_size("thickness_m", [self.thickness_m])?;
        check_size("width_m", [self.width_m])?;
        check_size("height_m", [self.height_m])?;
        check_friction(self.friction)?;
        refuse_unless_finite("foot_m", self.foot_m)?;
        refuse_unless_finite("facing_rad", [self.facing_rad])?;
        let need = "must be above 0 and at most 100 kg";
        refuse_unless("mass_kg", need, [self.mass_kg], |v| v > 0.0 && v <= 100.0)
    }
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
            scene.check().unwrap_err().to_string()
        };
        let friction = fault(|o| o.friction = -0.1);
        assert!(friction.starts_with("obstacle 1: `friction`"), "{friction}");
        let flat = |o: &mut Obstacle| {
            o.shape = Shape::Box {
                half_m: [0.1, 0.0, 0.1],
            };
        };
        assert!(fault(flat).starts_with("obstacle 1: `half_m`"));
        let nowhere = |o: &mut Obstacle| o.pose.translation.vector.x = f64::NAN;
        assert!(fault(nowhere).starts_with("obstacle 1: `translation`"));
    }
}
