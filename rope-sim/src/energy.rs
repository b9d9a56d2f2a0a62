//! An undamped rope keeps its energy.
//!
//! The elimination gives exact accelerations for a given state, so an explicit
//! Runge-Kutta method of order four over it is a second integrator for the same
//! equations: its drift shows errors of the equations, not of the time stepping.

use crate::algebra::{Quat, Vec3};
use crate::extra_loads::MassLanes;
use crate::extras::RopeExtras;
use crate::kernel::{Elimination, GRAVITY_M_S2, step};
use crate::load::{LinkLoads, Load, Loads};
use crate::scheme::Scheme;
use crate::state::{BaseLanes, Link, RopeLanes};
use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use shared_types::RopeParams;

/// Attitude and angular velocity of one link (world frame, rad/s).
#[derive(Clone, Copy)]
struct Pose {
    q: Quaternion<f64>,
    w: Vector3<f64>,
}

/// Rates of [`Pose`].
#[derive(Clone, Copy)]
struct Rate {
    q: Quaternion<f64>,
    w: Vector3<f64>,
}

/// A step of no length: predictions and corrections do nothing, and what stays is
/// the exact acceleration.
fn still_scheme() -> Scheme<f64> {
    Scheme {
        al_to_a: 0.0,
        a_to_a: 0.0,
        a_to_w: 0.0,
        next_to_w: 0.0,
        h: 0.0,
        a_to_phi: 0.0,
        next_to_phi: 0.0,
        correct_w: 0.0,
        correct_half_phi: 0.0,
        correct_a: 0.0,
        centripetal: 0.0,
    }
}

/// A frame that stands still in the world.
fn fixed_base() -> BaseLanes<f64> {
    let none = Vec3(0.0, 0.0, 0.0);
    BaseLanes {
        q: Quat::identity(),
        w: none,
        alpha: none,
        a: none,
    }
}

/// A rope as the kernel has it.
struct Model {
    rope: RopeLanes<f64>,
    masses: MassLanes<f64>,
}

/// What the links carry, and nothing else.
struct Carried(LinkLoads<f64>);

impl Loads<f64> for Carried {
    const PRESENT: bool = true;
    fn on_link(&self, link: usize) -> Option<&Load<f64>> {
        self.0.on_link(link)
    }
    fn rest_turn(&self) -> Quat<f64> {
        Quat::identity()
    }
}

/// Rates of the state by the kernel's elimination.
fn rates(model: &Model, state: &[Pose]) -> Vec<Rate> {
    let rope = &model.rope;
    let mut links: Vec<Link<f64>> = state
        .iter()
        .map(|pose| {
            let mut link = Link::at_rest();
            link.q.set(0, [pose.q.w, pose.q.i, pose.q.j, pose.q.k]);
            link.w = Vec3(pose.w.x, pose.w.y, pose.w.z);
            link
        })
        .collect();
    let mut scratch = vec![Elimination::empty(); links.len()];
    let (base, scheme) = (fixed_base(), still_scheme());
    // The second pass starts from the first one's accelerations, whereupon the tiny
    // resistance has nothing left to resist.
    let mut carried = Carried(LinkLoads::new(links.len()));
    for _ in 0..2 {
        carried.0.clear();
        for (index, link) in links.iter().enumerate() {
            let span = link.q.down(rope.link_length);
            let load = model.masses.on_link(index, link, span, &scheme);
            carried.0.add(index, &load);
        }
        step(&mut links, &mut scratch, rope, &base, &scheme, &carried);
    }
    links
        .iter()
        .zip(state)
        .map(|(link, pose)| Rate {
            q: Quaternion::from_imag(pose.w) * pose.q * 0.5,
            w: Vector3::from(link.al.get(0)),
        })
        .collect()
}

fn moved(state: &[Pose], rates: &[Rate], h_s: f64) -> Vec<Pose> {
    let mut out = state.to_vec();
    for (pose, rate) in out.iter_mut().zip(rates) {
        pose.q += rate.q * h_s;
        pose.w += rate.w * h_s;
    }
    out
}

fn runge_kutta_step(model: &Model, state: &mut [Pose], h_s: f64) {
    let k1 = rates(model, state);
    let k2 = rates(model, &moved(state, &k1, 0.5 * h_s));
    let k3 = rates(model, &moved(state, &k2, 0.5 * h_s));
    let k4 = rates(model, &moved(state, &k3, h_s));
    for ((pose, (k1, k2)), (k3, k4)) in state
        .iter_mut()
        .zip(k1.iter().zip(&k2))
        .zip(k3.iter().zip(&k4))
    {
        pose.q += (k1.q + (k2.q + k3.q) * 2.0 + k4.q) * (h_s / 6.0);
        pose.q /= pose.q.norm();
        pose.w += (k1.w + (k2.w + k3.w) * 2.0 + k4.w) * (h_s / 6.0);
    }
}

/// Kinetic, gravity and spring energy (J), and the kinetic part, from the model's
/// definition alone: all quantities of every link, spin and twist included.
fn energy_j(rope: &RopeParams, mass_slope: f64, state: &[Pose]) -> (f64, f64) {
    let s = rope.link_length_m();
    let mut place = 0.5 / f64::from(rope.links);
    let (mut kinetic, mut potential) = (0.0, 0.0);
    let (mut at, mut velocity) = (Vector3::zeros(), Vector3::zeros());
    let mut parent = UnitQuaternion::identity();
    for pose in state {
        let mass = rope.link_mass_kg() * (1.0 - mass_slope + 2.0 * mass_slope * place);
        place += 1.0 / f64::from(rope.links);
        let attitude = UnitQuaternion::from_quaternion(pose.q);
        let span = attitude * Vector3::new(0.0, 0.0, -s);
        let centre_velocity: Vector3<f64> = velocity + pose.w.cross(&span) * 0.5;
        kinetic += 0.5 * mass * centre_velocity.norm_squared()
            + 0.5 * rope.link_inertia_kg_m2() * pose.w.norm_squared();
        potential += mass * GRAVITY_M_S2 * (at + span * 0.5_f64).z;
        let angle = attitude.angle_to(&parent);
        potential += 0.5 * rope.joint_stiffness_nm_per_rad * angle * angle;
        at += span;
        velocity += pose.w.cross(&span);
        parent = attitude;
    }
    let spin = state.last().map_or(Vector3::zeros(), |pose| pose.w);
    kinetic += 0.5 * rope.lead_mass_kg * velocity.norm_squared()
        + 0.5 * rope.lead_inertia_kg_m2() * spin.norm_squared();
    potential += rope.lead_mass_kg * GRAVITY_M_S2 * at.z;
    (kinetic + potential, kinetic)
}

/// Drift of the energy in half a second as a part of the kinetic energy.
fn drift(mass_slope: f64) -> f64 {
    let params = RopeParams::from_array([22.0, 0.55, 0.0, 0.1, 0.008, 0.06, 0.06, 0.03, 1.2]);
    let mut rope = RopeLanes::<f64>::of(&params);
    // None; the kernel puts a tiny one in its place, for a unit.
    rope.set(0, &params, 0.0);
    let extras = RopeExtras {
        mass_slope,
        ..RopeExtras::NONE
    };
    let mut masses = MassLanes::uniform(22);
    masses.set(0, &params, &extras);
    let model = Model { rope, masses };
    // Bent and twisted along its length, and turning about all three axes.
    let mut state: Vec<Pose> = (0..22)
        .map(|i| {
            let along = f64::from(i) / 21.0;
            let turn = Vector3::new(0.9 * along, 0.5, -0.6 * along);
            Pose {
                q: UnitQuaternion::from_scaled_axis(turn).into_inner(),
                w: Vector3::new(2.0, -1.0 + 3.0 * along, 1.5),
            }
        })
        .collect();
    let (start, mut most_kinetic) = energy_j(&params, mass_slope, &state);
    let h_s = 4e-5;
    let mut worst: f64 = 0.0;
    for i in 1..=12_500 {
        runge_kutta_step(&model, &mut state, h_s);
        if i % 125 == 0 {
            let (total, kinetic) = energy_j(&params, mass_slope, &state);
            most_kinetic = most_kinetic.max(kinetic);
            worst = worst.max((total - start).abs());
        }
    }
    let drift = worst / most_kinetic;
    println!("energy drift {drift:.1e} of {most_kinetic:.3} J");
    assert!(most_kinetic > 0.05, "{most_kinetic} J: it hardly moves");
    drift
}

#[test]
fn undamped_energy_drifts_by_less_than_1e_7_in_half_a_second() {
    for mass_slope in [0.0, -0.5, 0.8] {
        let drift = drift(mass_slope);
        assert!(drift < 1e-7, "slope {mass_slope}: {drift}");
    }
}
