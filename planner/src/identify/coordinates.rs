//! The coordinates in which a rope, the clocks and the camera are fitted.
//!
//! Motion depends on bending stiffness and damping per length (`k s`, `c s`),
//! masses and length, up to one common factor of stiffness, damping and masses.
//! These are the coordinates: a change of the link count then leaves the motion
//! nearly alone, so that the count can be fitted like a number and rounded. The
//! common factor is left to [`super::scale`].
//!
//! The last coordinates are what real ropes have beyond the nine parameters, and how the
//! rope swings when the film begins ([`Coordinates::beyond`]); a plain fit leaves them at 0.

use super::camera_pose::CORRECTIONS;
use super::clock::ClockWindow;
use crate::observation::Appearance;
use nalgebra::{Matrix2, SMatrix, SVector, Vector2};
use rope_sim::Sway;
use shared_types::rope::RANGES;
use shared_types::{BendingFriction, RopeExtras, RopeParams};

/// Number of coordinates.
pub(super) const FREE: usize = 23;
/// Number of those that a plain fit moves, the first ones.
pub(super) const PLAIN: usize = 14;

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
/// Radius of a link's inertia in half links, `max(e, 2 r / s)` (1).
pub(super) const INERTIA: usize = 5;
/// Number of links, as if it were a real number.
pub(super) const LINKS: usize = 6;
/// Clock offset between arm and camera (s).
pub(super) const CLOCK: usize = 7;
/// First of the six corrections of the camera's place.
pub(super) const CAMERA: usize = 8;
/// First of the rest curvature's two components across the rope (rad/m).
pub(super) const CURVATURE: usize = 14;
/// Greatest moment of the friction over the bending stiffness (1/m): the curvature that it
/// can hold.
pub(super) const FRICTION: usize = 16;
/// Logarithm of the change of curvature over which the friction comes up (1/m).
pub(super) const SLIP: usize = 17;
/// Logarithm of the first joint's stiffness and damping over the others'.
pub(super) const CLAMP: usize = 18;
/// First of the two angles (rad) of the swing at the film's begin, their rates (rad/s)
/// behind them.
pub(super) const SWAY: usize = 19;

/// Coordinates that need a simulation of their own, the link count left out: those of a
/// plain fit first.
pub(super) const SIMULATED: [usize; 15] = [
    LENGTH,
    STIFFNESS,
    DAMPING,
    LEAD_MASS,
    LEAD_RADIUS,
    INERTIA,
    CURVATURE,
    CURVATURE + 1,
    FRICTION,
    SLIP,
    CLAMP,
    SWAY,
    SWAY + 1,
    SWAY + 2,
    SWAY + 3,
];
/// How many of them a plain fit moves.
pub(super) const SIMULATED_PLAIN: usize = 6;

/// A point of the fit.
pub(super) type Point = SVector<f64, FREE>;
/// Matrix over the coordinates.
pub(super) type Square = SMatrix<f64, FREE, FREE>;

/// Indices into [`RANGES`].
pub(super) mod parameter {
    pub(crate) const LINKS: usize = 0;
    pub(crate) const LENGTH: usize = 1;
    pub(crate) const DAMPING: usize = 2;
    pub(crate) const STIFFNESS: usize = 3;
    pub(crate) const RADIUS: usize = 4;
    pub(crate) const MASS_PER_LENGTH: usize = 5;
    pub(crate) const LEAD_MASS: usize = 6;
    pub(crate) const LEAD_RADIUS: usize = 7;
    pub(crate) const EXTRA_SCALE: usize = 8;
}

/// Mass per length of simulated ropes (kg/m): any would do, see the module; small, so
/// that the stiffest ropes of a wide search stay within what the simulator accepts.
const SIMULATED_MASS_PER_LENGTH: f64 = 0.01;
/// Deviation of the rest curvature by which a rope bends along the line of sight (rad/m).
const BEND_IN_SIGHT_STD_PER_M: f64 = 0.05;
/// Deviation of a length measured by tape (m).
const TAPE_STD_M: f64 = 2e-3;
/// Radius of simulated ropes (m): too small to rule the link inertia.
const SIMULATED_RADIUS_M: f64 = 1e-4;

/// Which ropes are looked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Reach {
    /// Those of the parameter ranges, with a margin.
    Ranges,
    /// Far beyond them.
    Wide,
}

/// Box of the fit, its prior, and the way from its points to ropes.
#[derive(Debug, Clone)]
pub(super) struct Coordinates {
    /// How many of the coordinates move, the first ones.
    pub(super) fitted: usize,
    pub(super) lower: Point,
    pub(super) upper: Point,
    /// Mean and deviation of the prior used while fitting. Where the ranges are the
    /// prior it is weak: their edges come in with [`super::posterior`].
    pub(super) prior_mean: Point,
    pub(super) prior_std: Point,
    /// Inverse covariance of the rest curvature beyond that.
    curvature_information: Matrix2<f64>,
}

/// Coordinates of a rope; clock and camera are 0.
pub(super) fn point_of(rope: &RopeParams) -> Point {
    let s = rope.link_length_m();
    let mu = rope.mass_per_length_kg_per_m;
    let mut x = Point::zeros();
    x[LENGTH] = rope.length_m;
    x[STIFFNESS] = (rope.joint_stiffness_nm_per_rad * s / mu).ln();
    x[DAMPING] = (rope.joint_damping_nms_per_rad * s / mu).ln();
    x[LEAD_MASS] = (rope.lead_mass_kg / mu).ln();
    x[LEAD_RADIUS] = rope.lead_radius_m;
    x[INERTIA] = rope.link_extra_scale.max(2.0 * rope.radius_m / s);
    x[LINKS] = f64::from(rope.links);
    x
}

/// What a rope with this bending stiffness (N m²) has beyond the nine parameters at a
/// point; none at a plain fit's.
pub(super) fn extras_of(x: &Point, bending_stiffness_nm2: f64) -> Option<RopeExtras> {
    let is_plain = (PLAIN..FREE).all(|i| x[i] == 0.0);
    (!is_plain).then(|| RopeExtras {
        rest_curvature_per_m: [x[CURVATURE], x[CURVATURE + 1], 0.0],
        clamp_stiffness: x[CLAMP].exp(),
        friction: Some(BendingFriction {
            moment_max_nm: x[FRICTION] * bending_stiffness_nm2,
            slip_curvature_per_m: x[SLIP].exp(),
        }),
        ..RopeExtras::NONE
    })
}

fn curvature_of(x: &Point) -> Vector2<f64> {
    Vector2::new(x[CURVATURE], x[CURVATURE + 1])
}

/// How the rope swings at the film's begin.
pub(super) fn sway_of(x: &Point) -> Sway {
    Sway {
        angle_rad: [x[SWAY], x[SWAY + 1]],
        rate_rad_s: [x[SWAY + 2], x[SWAY + 3]],
    }
}

/// The rope to simulate at a point, with this many links.
pub(super) fn simulated_rope(x: &Point, links: u32) -> RopeParams {
    let link_length = x[LENGTH] / f64::from(links);
    let mu = SIMULATED_MASS_PER_LENGTH;
    RopeParams {
        links,
        length_m: x[LENGTH],
        joint_damping_nms_per_rad: mu * x[DAMPING].exp() / link_length,
        joint_stiffness_nm_per_rad: mu * x[STIFFNESS].exp() / link_length,
        radius_m: SIMULATED_RADIUS_M,
        mass_per_length_kg_per_m: mu,
        lead_mass_kg: mu * x[LEAD_MASS].exp(),
        lead_radius_m: x[LEAD_RADIUS],
        link_extra_scale: x[INERTIA],
        extras: extras_of(x, mu * x[STIFFNESS].exp()),
    }
}

/// Smallest and largest link count of the ranges.
pub(super) fn link_range() -> (u32, u32) {
    let range = RANGES[parameter::LINKS];
    (range.min as u32, range.max as u32)
}

/// The link count of the ranges nearest to a point's.
pub(super) fn nearest_links(x: &Point) -> u32 {
    let (low, high) = link_range();
    (x[LINKS].round().max(1.0) as u32).clamp(low, high)
}

/// The link count a fit is linearised at.
pub(super) fn middle_links() -> u32 {
    let (low, high) = link_range();
    u32::midpoint(low, high)
}

impl Coordinates {
    /// The box for a film with this appearance and clock.
    pub(super) fn new(
        appearance: Appearance,
        pixel_m: f64,
        clock: ClockWindow,
        camera_std: &[f64; CORRECTIONS],
        reach: Reach,
    ) -> Self {
        use parameter as p;
        let range = |i: usize| (RANGES[i].min, RANGES[i].max);
        let (links, length, mass) = (range(p::LINKS), range(p::LENGTH), range(p::MASS_PER_LENGTH));
        let ratio = |i: usize, (s0, s1): (f64, f64)| {
            let (low, high) = range(i);
            ((low * s0 / mass.1).ln(), (high * s1 / mass.0).ln())
        };
        let link_length = (length.0 / links.1, length.1 / links.0);
        // How far beyond the ranges: (below, above) in each coordinate's unit.
        let (far_m, far_ln, far_radius_m) = match reach {
            Reach::Ranges => ((0.10, 0.10), (1.4, 1.0), (0.010, 0.010)),
            Reach::Wide => ((0.25, 0.60), (4.0, 2.5), (0.012, 0.040)),
        };
        let widened =
            |(low, high): (f64, f64), (below, above): (f64, f64)| (low - below, high + above);
        let lead_radius = widened(range(p::LEAD_RADIUS), far_radius_m);
        let boxes = [
            widened(length, far_m),
            widened(ratio(p::STIFFNESS, link_length), (far_ln.0 + 1.0, far_ln.1)),
            widened(ratio(p::DAMPING, link_length), (far_ln.0 + 1.0, far_ln.1)),
            // Leads of real ropes weigh as little as a quarter of the range's end.
            widened(ratio(p::LEAD_MASS, (1.0, 1.0)), far_ln),
            (lead_radius.0.max(0.003), lead_radius.1),
            (0.2, 2.0),
            (links.0 - 6.0, links.1 + 6.0),
            (
                clock.offset_s - clock.half_width_s,
                clock.offset_s + clock.half_width_s,
            ),
        ];
        let mut out = Self {
            fitted: PLAIN,
            lower: Point::zeros(),
            upper: Point::zeros(),
            prior_mean: Point::zeros(),
            prior_std: Point::repeat(1.0),
            curvature_information: Matrix2::zeros(),
        };
        for (i, (low, high)) in boxes.into_iter().enumerate() {
            out.lower[i] = low;
            out.upper[i] = high;
            out.prior_mean[i] = f64::midpoint(low, high);
            // Weak: a box's width.
            out.prior_std[i] = high - low;
        }
        out.prior_mean[INERTIA] = 0.95;
        out.prior_std[INERTIA] = 0.22;
        out.prior_std[LINKS] = 4.0;
        if let Some(radius_m) = appearance.lead_radius_m {
            out.prior_mean[LEAD_RADIUS] = radius_m;
            out.prior_std[LEAD_RADIUS] = Appearance::std_dev_m(radius_m, pixel_m);
        }
        for (i, std_dev) in camera_std.iter().enumerate() {
            out.lower[CAMERA + i] = -5.0 * std_dev;
            out.upper[CAMERA + i] = 5.0 * std_dev;
            out.prior_std[CAMERA + i] = *std_dev;
        }
        out
    }

    /// The same for a rope whose length was measured by tape (m).
    pub(super) fn measured(mut self, length_m: Option<f64>) -> Self {
        if let Some(length_m) = length_m {
            self.lower[LENGTH] = self.lower[LENGTH].min(length_m);
            self.upper[LENGTH] = self.upper[LENGTH].max(length_m);
            self.prior_mean[LENGTH] = length_m;
            self.prior_std[LENGTH] = TAPE_STD_M;
        }
        self
    }

    /// The same with what real ropes have beyond the nine parameters, and a swing at the
    /// film's begin. The priors are those of ropes that laboratories use. `sight` is the
    /// camera's line of sight across the rope, in the attach frame: one eye cannot tell how
    /// the rope bends along it from where the camera stands.
    pub(super) fn beyond(&self, sight: Vector2<f64>) -> Self {
        // Smallest, likeliest, largest value, and the prior's deviation.
        const BEYOND: [(usize, [f64; 4]); FREE - PLAIN] = [
            (CURVATURE, [-4.0, 0.0, 4.0, 0.5]),
            (CURVATURE + 1, [-4.0, 0.0, 4.0, 0.5]),
            (FRICTION, [0.0, 0.0, 10.0, 0.5]),
            // From 0.03 to 10 rad/m, about 0.5.
            (SLIP, [-3.5, -0.7, 2.3, 0.8]),
            // Between a joint like the others and a rigid clamp of a continuous rope.
            (CLAMP, [-1.5, 0.35, 1.5, 0.35]),
            (SWAY, [-0.3, 0.0, 0.3, 0.04]),
            (SWAY + 1, [-0.3, 0.0, 0.3, 0.04]),
            (SWAY + 2, [-1.5, 0.0, 1.5, 0.2]),
            (SWAY + 3, [-1.5, 0.0, 1.5, 0.2]),
        ];
        let mut out = self.clone();
        out.fitted = FREE;
        // A rope bends along a direction by turning about the one across it.
        let about = Vector2::new(-sight.y, sight.x) / BEND_IN_SIGHT_STD_PER_M;
        out.curvature_information = about * about.transpose();
        for (i, [lower, mean, upper, std_dev]) in BEYOND {
            out.lower[i] = lower;
            out.upper[i] = upper;
            out.prior_mean[i] = mean;
            out.prior_std[i] = std_dev;
        }
        out
    }

    /// The nearest point of the box.
    pub(super) fn clamped(&self, x: &Point) -> Point {
        Point::from_fn(|i, _| x[i].clamp(self.lower[i], self.upper[i]))
    }

    /// Deviations of `x` from the prior's mean in its deviations, squared and summed.
    pub(super) fn prior_distance2(&self, x: &Point) -> f64 {
        let curvature = curvature_of(x);
        let distances = (x - self.prior_mean).component_div(&self.prior_std);
        distances.norm_squared() + (self.curvature_information * curvature).dot(&curvature)
    }

    /// The same for one coordinate, over its deviation: the prior's gradient.
    pub(super) fn prior_gradient(&self, x: &Point) -> Point {
        let variances = self.prior_std.component_mul(&self.prior_std);
        let mut gradient = (x - self.prior_mean).component_div(&variances);
        let of_curvature = self.curvature_information * curvature_of(x);
        gradient[CURVATURE] += of_curvature.x;
        gradient[CURVATURE + 1] += of_curvature.y;
        gradient
    }

    /// Inverse covariance of the prior.
    pub(super) fn prior_information(&self) -> Square {
        let mut information = Square::from_diagonal(&self.prior_std.map(|s| 1.0 / (s * s)));
        let mut of_curvature = information.fixed_view_mut::<2, 2>(CURVATURE, CURVATURE);
        of_curvature += self.curvature_information;
        information
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ropes::random_rope;

    #[test]
    fn every_rope_of_the_ranges_lies_in_the_box_and_keeps_its_ratios() {
        let clock = ClockWindow {
            offset_s: 0.0,
            half_width_s: 0.01,
        };
        let appearance = Appearance::default();
        let c = Coordinates::new(appearance, 0.003, clock, &[0.02; 6], Reach::Ranges);
        for seed in 0..300 {
            let rope = random_rope(seed);
            let x = point_of(&rope);
            assert_eq!(c.clamped(&x), x, "{rope:?}");
            let back = simulated_rope(&x, rope.links);
            assert!(back.validate().is_ok());
            let factor = back.mass_per_length_kg_per_m / rope.mass_per_length_kg_per_m;
            let scaled = |r: &RopeParams| {
                let (stiffness, damping) =
                    (r.joint_stiffness_nm_per_rad, r.joint_damping_nms_per_rad);
                [r.lead_mass_kg, stiffness, damping, r.link_inertia_kg_m2()]
            };
            for (a, b) in scaled(&back).into_iter().zip(scaled(&rope)) {
                assert!((a / b / factor - 1.0).abs() < 1e-9);
            }
        }
    }
}
