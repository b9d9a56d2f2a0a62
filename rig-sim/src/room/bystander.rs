//! What moves in a hard room besides the arm: a person who walks by, cables and ropes
//! that hang or swing.

use super::palette::{CLOTH, ROPES, one_of};
use crate::render::solid::{Material, Solid};
use nalgebra::Vector3;
use rand::{Rng, RngExt};

/// A person of capsules, walking along x.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Walker {
    start_m: Vector3<f64>,
    speed_m_s: f64,
    height_m: f64,
    steps_hz: f64,
    shirt: [u8; 3],
    trousers: [u8; 3],
}

impl Walker {
    pub(crate) fn draw(rng: &mut impl Rng, floor_z_m: f64, wall_y_m: f64) -> Self {
        let speed_m_s = rng.random_range(0.3..1.1) * if rng.random() { 1.0 } else { -1.0 };
        let y = rng.random_range(0.35..(wall_y_m - 0.2).max(0.40));
        // Passes the rope some time during the film.
        let at_rope_s = rng.random_range(1.0..6.0);
        Self {
            start_m: Vector3::new(0.66 - speed_m_s * at_rope_s, y, floor_z_m),
            speed_m_s,
            height_m: rng.random_range(1.55..1.9),
            steps_hz: speed_m_s.abs() * 0.65 + 0.3,
            shirt: one_of(rng, &CLOTH),
            trousers: one_of(rng, &[[46, 56, 84], [52, 50, 50], [110, 100, 84]]),
        }
    }

    fn solids(&self, t_s: f64) -> Vec<Solid> {
        const SKIN: [u8; 3] = [206, 160, 132];
        let h = self.height_m;
        let foot = self.start_m + Vector3::x() * (self.speed_m_s * t_s);
        let swing = (core::f64::consts::TAU * self.steps_hz * t_s).sin();
        let at = |x: f64, y: f64, z: f64| foot + Vector3::new(x, y, z) * h;
        let (shirt, trousers) = (
            Material::plain(self.shirt, 6.0),
            Material::plain(self.trousers, 6.0),
        );
        let skin = Material::plain(SKIN, 14.0);
        let limb = |a, b, radius: f64, material| Solid::new(&a, &b, radius * h, material);
        let mut body = vec![
            limb(at(0.0, 0.0, 0.93), at(0.0, 0.0, 0.95), 0.062, skin),
            limb(at(0.0, 0.0, 0.58), at(0.0, 0.0, 0.76), 0.085, shirt),
        ];
        for side in [-1.0, 1.0] {
            let (step, y) = (0.16 * side * swing, 0.05 * side);
            let knee = at(step * 0.8, y, 0.27);
            body.push(limb(at(0.0, y, 0.50), knee, 0.048, trousers));
            body.push(limb(knee, at(step * 1.3 - 0.03, y, 0.03), 0.036, trousers));
            let (elbow, y) = (at(-step * 0.7, 2.4 * y, 0.60), 2.3 * y);
            body.push(limb(at(0.0, y, 0.78), elbow, 0.030, shirt));
            body.push(limb(elbow, at(-step * 1.4 + 0.05, y, 0.48), 0.024, skin));
        }
        body
    }
}

/// A cable or another rope that hangs from above and may swing.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Cable {
    top_m: Vector3<f64>,
    length_m: f64,
    sag_m: f64,
    swing_m: f64,
    swing_hz: f64,
    phase_rad: f64,
    radius_m: f64,
    material: Material,
}

impl Cable {
    /// One behind or beside the rope, by chance in the rope's own colour.
    pub(crate) fn draw(rng: &mut impl Rng, rope: &Material) -> Self {
        let own = rng.random_bool(0.3);
        let other = Material::plain(one_of(rng, &ROPES).rgb, 12.0);
        Self {
            top_m: Vector3::new(
                rng.random_range(0.2..1.2),
                rng.random_range(0.15..0.6),
                rng.random_range(0.5..1.0),
            ),
            length_m: rng.random_range(0.5..1.3),
            sag_m: rng.random_range(-0.25..0.25),
            swing_m: if rng.random() {
                rng.random_range(0.01..0.12)
            } else {
                0.0
            },
            swing_hz: rng.random_range(0.3..1.2),
            phase_rad: rng.random_range(0.0..6.0),
            radius_m: rng.random_range(0.003..0.009),
            material: if own { *rope } else { other },
        }
    }

    fn solids(&self, t_s: f64) -> Vec<Solid> {
        const PIECES: i32 = 24;
        let swing = (core::f64::consts::TAU * self.swing_hz * t_s + self.phase_rad).sin();
        let line: Vec<_> = (0..=PIECES)
            .map(|i| {
                let s = f64::from(i) / f64::from(PIECES);
                let aside = self.sag_m * (s * 3.0).sin() * s + self.swing_m * swing * s * s;
                self.top_m + Vector3::new(aside, 0.05 * s, -self.length_m * s)
            })
            .collect();
        Solid::chain(&line, self.radius_m, self.material).collect()
    }
}

/// All that moves by itself.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Bystanders {
    pub(crate) walkers: Vec<Walker>,
    pub(crate) cables: Vec<Cable>,
}

impl Bystanders {
    /// Their bodies at a time (s).
    pub(crate) fn at(&self, t_s: f64) -> Vec<Solid> {
        let walkers = self.walkers.iter().flat_map(|w| w.solids(t_s));
        walkers
            .chain(self.cables.iter().flat_map(|c| c.solids(t_s)))
            .collect()
    }
}
