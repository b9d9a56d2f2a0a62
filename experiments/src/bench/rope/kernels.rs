//! Cost per rope and step of every compiled form of the simulator.

use super::Extent;
use super::workload::{LINKS, Workload, released, throw_options, timed};
use crate::report::Column;
use core::f64::consts::FRAC_PI_2;
use rope_sim::{Candidate, Kernel, Scene, SimOptions, SimulateError};
use serde::Serialize;

/// Lane groups per measurement: many enough that starting up does not count.
const GROUPS: usize = 16;
const HORIZON_S: f64 = 1.0;
/// Height of the clamp above a floor that ropes fall on (m).
const BELOW_M: f64 = 0.3;
/// Height of the clamp above a floor that no rope comes near (m).
const FAR_BELOW_M: f64 = 50.0;

/// One kernel, on one thread; costs in ns per rope and step.
#[derive(Debug, Serialize)]
pub struct KernelRow {
    kernel: String,
    /// Ropes side by side.
    lanes: usize,
    precision: &'static str,
    /// Links of every rope.
    links: u32,
    /// All ropes swing from one frame that stands still.
    still_ns: f64,
    /// Every rope on an arm spline of its own, kinematics included.
    throw_ns: f64,
    /// The same throws of ropes with friction, a rest curvature and a clamp of its own.
    real_throw_ns: f64,
    /// As `still_ns`, with a floor in the scene that the rope never comes near.
    floor_far_ns: f64,
    /// Ropes let go level 0.3 m above a floor, to fall and lie on it.
    on_floor_ns: f64,
    /// Simulated seconds of rope per second of processor time, in the throws.
    simulated_s_per_cpu_s: f64,
}

pub const TABLE: [Column<KernelRow>; 8] = [
    ("kernel", |row| row.kernel.clone()),
    ("ropes side by side", |row| row.lanes.to_string()),
    ("frame still (ns)", |row| format!("{:.0}", row.still_ns)),
    ("arm spline each (ns)", |row| format!("{:.0}", row.throw_ns)),
    ("with friction and curvature (ns)", |row| {
        format!("{:.0}", row.real_throw_ns)
    }),
    ("floor far below (ns)", |row| {
        format!("{:.0}", row.floor_far_ns)
    }),
    ("falls on floor (ns)", |row| {
        format!("{:.0}", row.on_floor_ns)
    }),
    ("simulated s per CPU s", |row| {
        format!("{:.0}", row.simulated_s_per_cpu_s)
    }),
];

/// Measures every kernel this processor has.
pub fn measure(
    workload: &Workload,
    extent: Extent,
    say: impl Fn(String),
) -> Result<Vec<KernelRow>, SimulateError> {
    Kernel::ALL
        .into_iter()
        .filter(|kernel| kernel.is_available())
        .map(|kernel| {
            say(format!("{kernel:?}"));
            measure_one(kernel, workload, extent)
        })
        .collect()
}

fn measure_one(
    kernel: Kernel,
    workload: &Workload,
    extent: Extent,
) -> Result<KernelRow, SimulateError> {
    let count = kernel.lanes() * extent.share(GROUPS);
    let throwing = throw_options(HORIZON_S, 1);
    let swinging = released([0.2, 0.4, 0.1], throwing);
    let falling = released([FRAC_PI_2, 0.0, 0.0], throwing);
    let cost_ns = |scene: &Scene, candidates: &[Candidate], options: &SimOptions| {
        let timed = timed(extent.repeats, scene, kernel, candidates, options)?;
        Ok::<f64, SimulateError>(timed.ns_per_rope_step)
    };
    let standing = workload.on(&workload.still, count);
    let still_ns = cost_ns(&Scene::EMPTY, &standing, &swinging)?;
    let throw_ns = cost_ns(&Scene::EMPTY, &workload.throwing(count), &throwing)?;
    let real = workload.throwing_with(&workload.real, count);
    let real_throw_ns = cost_ns(&Scene::EMPTY, &real, &throwing)?;
    let floor_far_ns = cost_ns(&workload.floor(FAR_BELOW_M), &standing, &swinging)?;
    let on_floor_ns = cost_ns(&workload.floor(BELOW_M), &standing, &falling)?;
    let single = kernel.is_single_precision();
    Ok(KernelRow {
        kernel: format!("{kernel:?}"),
        lanes: kernel.lanes(),
        precision: if single { "f32" } else { "f64" },
        links: LINKS,
        still_ns,
        throw_ns,
        real_throw_ns,
        floor_far_ns,
        on_floor_ns,
        simulated_s_per_cpu_s: throwing.step_s / (1e-9 * throw_ns),
    })
}
