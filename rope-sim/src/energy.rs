//! An undamped rope keeps its energy.
//!
//! The elimination gives exact accelerations for a given state, so an explicit
//! Runge-Kutta method of order four over it is a second integrator for the same
//! equations: its drift shows errors of the equations, not of the time stepping.

use crate::clock::BaseState;
use crate::extra_loads::MassLanes;
use crate::kernel::{Elimination, GRAVITY_M_S2, step};
use crate::load::LinkLoads;
use crate::scheme::{Phase, Scheme};
use crate::state::{Link, RopeLanes};
use arm_model::kinematics::FrameMotion;
use nalgebra::{DVector, Quaternion, UnitQuaternion, Vector3};
use shared_types::{RopeExtras, RopeParams};

/// Numbers per link in a state: attitude, scalar first, and angular velocity (world frame,
/// rad/s); or their rates.
const PER_LINK: usize = 7;

fn attitude(link: &[f64]) -> Quaternion<f64> {
    Quaternion::new(link[0], link[1], link[2], link[3])
}

fn spin(link: &[f64]) -> Vector3<f64> {
    Vector3::new(link[4], link[5], link[6])
}

/// A rope as the kernel has it.
struct Model {
    rope: RopeLanes<f64>,
    masses: MassLanes<f64>,
}

/// Rates of the state by the kernel's elimination, below a frame that stands still.
fn rates(model: &Model, state: &DVector<f64>) -> DVector<f64> {
    let rope = &model.rope;
    let states = state.as_slice().chunks(PER_LINK);
    let mut links: Vec<Link<f64>> = Vec::new();
    for of in states.clone() {
        let mut link = Link::at_rest();
        link.q.set(0, [of[0], of[1], of[2], of[3]]);
        link.w.set(0, [of[4], of[5], of[6]]);
        links.push(link);
    }
    let mut scratch = vec![Elimination::empty(); links.len()];
    let base = BaseState::of(&FrameMotion::world()).dynamics;
    // In a step of no length predictions and corrections do nothing, and what stays is the
    // exact acceleration.
    let mut scheme = Scheme::new();
    scheme.set(0, 0.0, Phase::Regular);
    // The second pass starts from the first one's accelerations, whereupon the tiny
    // resistance has nothing left to resist.
    let mut carried = LinkLoads::new(links.len());
    for _ in 0..2 {
        carried.clear();
        for (index, link) in links.iter().enumerate() {
            let span = link.q.down(rope.link_length);
            let load = model.masses.on_link(index, link, span, &scheme);
            carried.add(index, &load);
        }
        step(&mut links, &mut scratch, rope, &base, &scheme, &carried);
    }
    let rates = links.iter().zip(states).flat_map(|(link, of)| {
        let q = Quaternion::from_imag(spin(of)) * attitude(of) * 0.5;
        let [x, y, z] = link.al.get(0);
        [q.w, q.i, q.j, q.k, x, y, z]
    });
    DVector::from_iterator(state.len(), rates)
}

fn runge_kutta_step(model: &Model, state: &mut DVector<f64>, h_s: f64) {
    let k1 = rates(model, state);
    let k2 = rates(model, &(&*state + &k1 * (0.5 * h_s)));
    let k3 = rates(model, &(&*state + &k2 * (0.5 * h_s)));
    let k4 = rates(model, &(&*state + &k3 * h_s));
    *state += (k1 + (k2 + k3) * 2.0 + k4) * (h_s / 6.0);
    for link in state.as_mut_slice().chunks_mut(PER_LINK) {
        let norm = attitude(link).norm();
        link[..4].iter_mut().for_each(|x| *x /= norm);
    }
}

/// Kinetic, gravity and spring energy (J), and the kinetic part, from the model's
/// definition alone: all quantities of every link, spin and twist included.
fn energy_j(rope: &RopeParams, mass_slope: f64, state: &DVector<f64>) -> (f64, f64) {
    let s = rope.link_length_m();
    let mut place = 0.5 / f64::from(rope.links);
    let (mut kinetic, mut potential) = (0.0, 0.0);
    let (mut at, mut velocity, mut w) = (Vector3::zeros(), Vector3::zeros(), Vector3::zeros());
    let mut parent = UnitQuaternion::identity();
    for link in state.as_slice().chunks(PER_LINK) {
        let mass = rope.link_mass_kg() * (1.0 - mass_slope + 2.0 * mass_slope * place);
        place += 1.0 / f64::from(rope.links);
        w = spin(link);
        let attitude = UnitQuaternion::from_quaternion(attitude(link));
        let span = attitude * Vector3::new(0.0, 0.0, -s);
        let centre_velocity: Vector3<f64> = velocity + w.cross(&span) * 0.5;
        kinetic += 0.5 * mass * centre_velocity.norm_squared()
            + 0.5 * rope.link_inertia_kg_m2() * w.norm_squared();
        potential += mass * GRAVITY_M_S2 * (at + span * 0.5_f64).z;
        let angle = attitude.angle_to(&parent);
        potential += 0.5 * rope.joint_stiffness_nm_per_rad * angle * angle;
        at += span;
        velocity += w.cross(&span);
        parent = attitude;
    }
    kinetic += 0.5 * rope.lead_mass_kg * velocity.norm_squared()
        + 0.5 * rope.lead_inertia_kg_m2() * w.norm_squared();
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
    masses.set(0, &params.with_extras(extras));
    let model = Model { rope, masses };
    // Bent and twisted along its length, and turning about all three axes.
    let links = (0..22).flat_map(|i| {
        let along = f64::from(i) / 21.0;
        let turn = Vector3::new(0.9 * along, 0.5, -0.6 * along);
        let q = UnitQuaternion::from_scaled_axis(turn);
        [q.w, q.i, q.j, q.k, 2.0, -1.0 + 3.0 * along, 1.5]
    });
    let mut state = DVector::from_iterator(22 * PER_LINK, links);
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
