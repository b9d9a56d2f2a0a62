//! Cost per rope and step of every compiled form of the simulator.

use super::Extent;
use super::workload::{LINKS, Workload, roll_out_in, throw_options};
use crate::bench::spent::least;
use core::f64::consts::FRAC_PI_2;
use rope_sim::{Candidate, Kernel, Scene, SimOptions, SimulateError, Start};
use serde::Serialize;

/// Lane groups per measurement: many enough that starting up does not count.
const GROUPS: usize = 16;
/// Simulated time (s).
const HORIZON_S: f64 = 1.0;
/// Height of the clamp above a floor that ropes fall on (m).
const BELOW_M: f64 = 0.3;
/// Height of the clamp above a floor that no rope comes near (m).
const FAR_BELOW_M: f64 = 50.0;

/// One kernel, on one thread.
#[derive(Debug, Clone, Serialize)]
pub struct KernelRow {
    /// Name.
    pub kernel: String,
    /// Ropes side by side.
    pub lanes: usize,
    /// `f32` or `f64`.
    pub precision: &'static str,
    /// Links of every rope.
    pub links: u32,
    /// All ropes swing from one frame that stands still (ns per rope-step).
    pub still_ns: f64,
    /// Every rope on an arm spline of its own, kinematics included (ns per rope-step).
    pub throw_ns: f64,
    /// As `still_ns`, with a floor in the scene that the rope never comes near.
    pub floor_far_ns: f64,
    /// Ropes let go level 0.3 m above a floor, to fall and lie on it (ns per rope-step).
    pub on_floor_ns: f64,
    /// Simulated seconds of rope per second of processor time, in the throws.
    pub simulated_s_per_cpu_s: f64,
}

/// Measures every kernel this processor has.
///
/// # Errors
/// What the simulator refuses.
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
    let swinging = SimOptions {
        start: Start::Straight {
            joint0_rotvec: [0.2, 0.4, 0.1],
        },
        ..throwing
    };
    let falling = SimOptions {
        start: Start::Straight {
            joint0_rotvec: [FRAC_PI_2, 0.0, 0.0],
        },
        ..throwing
    };
    let cost_ns = |scene: &Scene, candidates: &[Candidate], options: &SimOptions| {
        let (spent, (rope_steps, _)) = least(extent.repeats, || {
            roll_out_in(scene, kernel, candidates, options)
        })?;
        Ok::<f64, SimulateError>(1e9 * spent.cpu_s / rope_steps)
    };
    let standing = workload.on(&workload.still, count);
    let floor = |below_m| workload.floor(below_m);
    let still_ns = cost_ns(&Scene::EMPTY, &standing, &swinging)?;
    let throw_ns = cost_ns(&Scene::EMPTY, &workload.throwing(count), &throwing)?;
    let floor_far_ns = cost_ns(&floor(FAR_BELOW_M), &standing, &swinging)?;
    let on_floor_ns = cost_ns(&floor(BELOW_M), &standing, &falling)?;
    Ok(KernelRow {
        kernel: format!("{kernel:?}"),
        lanes: kernel.lanes(),
        precision: if kernel.is_single_precision() {
            "f32"
        } else {
            "f64"
        },
        links: LINKS,
        still_ns,
        throw_ns,
        floor_far_ns,
        on_floor_ns,
        simulated_s_per_cpu_s: throwing.step_s / (1e-9 * throw_ns),
    })
}
