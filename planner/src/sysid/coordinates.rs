//! The coordinates in which a rope is searched.
//!
//! Motion depends on bending stiffness and damping per length (`k s`, `c s`),
//! masses and length, up to one common factor of stiffness, damping and masses.
//! These are the coordinates: a change of the link count then leaves the motion
//! nearly alone, so that the count is chosen after the search. Rope radius and
//! link extra scale act only through the tiny link inertia and are not searched.

use super::clock::ClockWindow;
use super::scale::MassScale;
use shared_types::RopeParams;
use shared_types::rope::RANGES;

/// Number of coordinates.
pub(super) const COORDINATES: usize = 6;
/// Rope length (m).
pub(super) const LENGTH: usize = 0;
/// `ln(k s / µ)`.
pub(super) const STIFFNESS: usize = 1;
/// `ln(c s / µ)`.
pub(super) const DAMPING: usize = 2;
/// `ln(m_L / µ)`.
pub(super) const LEAD_MASS: usize = 3;
/// Radius of the lead (m).
pub(super) const LEAD_RADIUS: usize = 4;
/// Clock offset between arm and camera (s).
pub(super) const CLOCK: usize = 5;

/// Indices into [`RANGES`].
mod parameter {
    pub(super) const LINKS: usize = 0;
    pub(super) const LENGTH: usize = 1;
    pub(super) const DAMPING: usize = 2;
    pub(super) const STIFFNESS: usize = 3;
    pub(super) const RADIUS: usize = 4;
    pub(super) const MASS_PER_LENGTH: usize = 5;
    pub(super) const LEAD_MASS: usize = 6;
    pub(super) const LEAD_RADIUS: usize = 7;
    pub(super) const EXTRA_SCALE: usize = 8;
}

/// Sizes seen in the picture, where it was sharp enough.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Appearance {
    /// Half of the rope's apparent width (m).
    pub rope_radius_m: Option<f64>,
    /// Half of the lead's apparent width (m).
    pub lead_radius_m: Option<f64>,
}

/// Box of the search and the way from its points to ropes.
#[derive(Debug, Clone)]
pub(super) struct Coordinates {
    pub(super) lower: [f64; COORDINATES],
    pub(super) upper: [f64; COORDINATES],
    pub(super) middle: [f64; COORDINATES],
    links: u32,
    rope_radius_m: f64,
    link_extra_scale: f64,
    scale: MassScale,
}

fn middle_of(parameter: usize) -> f64 {
    (RANGES[parameter].min + RANGES[parameter].max) / 2.0
}

fn middle_links() -> u32 {
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a range of small positive numbers"
    )]
    let links = middle_of(parameter::LINKS).round() as u32;
    links
}

impl Coordinates {
    /// The box for a film with this appearance and clock.
    pub(super) fn new(
        appearance: Appearance,
        lead_mass_kg: Option<f64>,
        clock: ClockWindow,
    ) -> Self {
        use parameter as p;
        let links = (RANGES[p::LINKS].min, RANGES[p::LINKS].max);
        let length = (RANGES[p::LENGTH].min - 0.05, RANGES[p::LENGTH].max + 0.05);
        let link_length = (length.0 / links.1, length.1 / links.0);
        let mass = RANGES[p::MASS_PER_LENGTH];
        let ratio = |parameter: usize, (s0, s1): (f64, f64), widen: f64| {
            let r = RANGES[parameter];
            (
                (r.min * widen * s0 / mass.max).ln(),
                (r.max * s1 / mass.min).ln(),
            )
        };
        let lead_radius = appearance.lead_radius_m.map_or(
            (0.010, RANGES[p::LEAD_RADIUS].max + 0.005),
            // A width in pixels is good to a pixel or two of motion blur.
            |r| ((r * 0.8).max(0.003), r * 1.2),
        );
        let boxes = [
            length,
            ratio(p::STIFFNESS, link_length, 1.0),
            ratio(p::DAMPING, link_length, 1.0),
            // Leads of real ropes weigh as little as a quarter of the range's end.
            ratio(p::LEAD_MASS, (1.0, 1.0), 0.25),
            lead_radius,
            (
                clock.offset_s - clock.half_width_s,
                clock.offset_s + clock.half_width_s,
            ),
        ];
        Self {
            lower: boxes.map(|b| b.0),
            upper: boxes.map(|b| b.1),
            middle: boxes.map(|b| (b.0 + b.1) / 2.0),
            links: middle_links(),
            rope_radius_m: appearance
                .rope_radius_m
                .unwrap_or_else(|| middle_of(p::RADIUS))
                .max(1e-4),
            link_extra_scale: middle_of(p::EXTRA_SCALE),
            scale: MassScale::new(lead_mass_kg),
        }
    }

    /// The same box for ropes of another link count.
    pub(super) fn with_links(&self, links: u32) -> Self {
        Self {
            links,
            ..self.clone()
        }
    }

    /// Link counts of the ranges.
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a range of small positive numbers"
    )]
    pub(super) fn link_counts() -> impl Iterator<Item = u32> {
        let range = RANGES[parameter::LINKS];
        range.min as u32..=range.max as u32
    }

    /// Deviation of the first generation: a quarter of the box.
    pub(super) fn spread(&self) -> [f64; COORDINATES] {
        core::array::from_fn(|i| (self.upper[i] - self.lower[i]) / 4.0)
    }

    /// The rope of a point, its masses at the likeliest scale.
    pub(super) fn rope(&self, x: &[f64; COORDINATES]) -> RopeParams {
        let links = f64::from(self.links);
        let link_length = x[LENGTH] / links;
        let ratios = [
            x[STIFFNESS].exp() / link_length,
            x[DAMPING].exp() / link_length,
            x[LEAD_MASS].exp(),
        ];
        let mass_per_length = self.scale.mass_per_length(ratios).middle;
        RopeParams::from_array([
            links,
            x[LENGTH],
            ratios[1] * mass_per_length,
            ratios[0] * mass_per_length,
            self.rope_radius_m,
            mass_per_length,
            ratios[2] * mass_per_length,
            x[LEAD_RADIUS],
            self.link_extra_scale,
        ])
    }

    /// Standard deviations in the order of [`RANGES`] from those of the
    /// coordinates (`None` where the film says nothing).
    pub(super) fn rope_std_dev(
        &self,
        x: &[f64; COORDINATES],
        std_dev: &[Option<f64>; COORDINATES],
    ) -> [Option<f64>; shared_types::rope::ROPE_PARAMETERS] {
        use parameter as p;
        let rope = self.rope(x).to_array();
        let link_length = x[LENGTH] / f64::from(self.links);
        let ratios = [
            x[STIFFNESS].exp() / link_length,
            x[DAMPING].exp() / link_length,
            x[LEAD_MASS].exp(),
        ];
        let scale = self.scale.mass_per_length(ratios);
        let relative_scale = scale.std_dev / scale.middle;
        let with_scale =
            |value: f64, log_std: Option<f64>| log_std.map(|s| value * s.hypot(relative_scale));
        let mut out = [None; shared_types::rope::ROPE_PARAMETERS];
        out[p::LENGTH] = std_dev[LENGTH];
        out[p::DAMPING] = with_scale(rope[p::DAMPING], std_dev[DAMPING]);
        out[p::STIFFNESS] = with_scale(rope[p::STIFFNESS], std_dev[STIFFNESS]);
        out[p::MASS_PER_LENGTH] = Some(match self.scale.is_weighed() {
            // A weighed lead leaves the error of the mass ratio to the rope.
            true => rope[p::MASS_PER_LENGTH] * std_dev[LEAD_MASS].unwrap_or(1.0),
            false => scale.std_dev,
        });
        out[p::LEAD_MASS] = match self.scale.is_weighed() {
            true => Some(0.0),
            false => with_scale(rope[p::LEAD_MASS], std_dev[LEAD_MASS]),
        };
        out[p::LEAD_RADIUS] = std_dev[LEAD_RADIUS];
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ropes::random_rope;

    /// Coordinates of a rope, the inverse of [`Coordinates::rope`] up to scale.
    fn point_of(rope: &RopeParams) -> [f64; COORDINATES] {
        let s = rope.link_length_m();
        let mu = rope.mass_per_length_kg_per_m;
        [
            rope.length_m,
            (rope.joint_stiffness_nm_per_rad * s / mu).ln(),
            (rope.joint_damping_nms_per_rad * s / mu).ln(),
            (rope.lead_mass_kg / mu).ln(),
            rope.lead_radius_m,
            0.0,
        ]
    }

    #[test]
    fn every_rope_of_the_ranges_lies_in_the_box_and_keeps_its_ratios() {
        for seed in 0..300 {
            let rope = random_rope(seed);
            let clock = ClockWindow {
                offset_s: 0.0,
                half_width_s: 0.01,
            };
            for lead_mass_kg in [None, Some(rope.lead_mass_kg)] {
                let c = Coordinates::new(Appearance::default(), lead_mass_kg, clock)
                    .with_links(rope.links);
                let x = point_of(&rope);
                for i in 0..COORDINATES {
                    assert!(x[i] >= c.lower[i] && x[i] <= c.upper[i], "{i}: {}", x[i]);
                }
                let back = c.rope(&x);
                assert!(back.validate().is_ok());
                let factor = back.mass_per_length_kg_per_m / rope.mass_per_length_kg_per_m;
                for (a, b) in [
                    (back.lead_mass_kg, rope.lead_mass_kg),
                    (
                        back.joint_stiffness_nm_per_rad,
                        rope.joint_stiffness_nm_per_rad,
                    ),
                    (
                        back.joint_damping_nms_per_rad,
                        rope.joint_damping_nms_per_rad,
                    ),
                ] {
                    assert!((a / b / factor - 1.0).abs() < 1e-9);
                }
                if lead_mass_kg.is_some() {
                    assert!((factor - 1.0).abs() < 1e-9);
                }
            }
        }
    }
}
