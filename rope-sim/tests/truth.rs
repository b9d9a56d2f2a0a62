//! Accuracy against reference trajectories made with other engines' dynamics and an
//! implicit integrator of order five.
#![cfg(test)]
#![allow(clippy::float_cmp, missing_docs, reason = "a test")]

mod support;

use rope_sim::{Kernel, Outcome, Precision};
use support::truth::{cases, max_tip_error_mm, simulate, truth_folder};

/// Published largest tip errors (mm) of this scheme at 0.5 ms: double precision, then
/// single where it differs.
const PUBLISHED_MM: [(&str, f64, f64); 10] = [
    ("A1-M2", 0.005, 0.01),
    ("A3-M2", 0.07, 0.08),
    ("A5-M2", 0.04, 0.07),
    ("A1-M3", 0.03, 0.03),
    ("A2-M3", 0.24, 0.24),
    ("A5-M3", 0.25, 0.25),
    ("A1-M4", 0.11, 0.11),
    ("A5-M4", 3.0, 3.0),
    ("A3-M4", 25.0, 25.0),
    ("A5-M1", 0.16, 0.16),
];

/// Bound (mm) at 0.5 ms; `None` for the one case whose start is not smooth.
fn bound_mm(id: &str, single: bool) -> Option<f64> {
    if let Some((_, f64_mm, f32_mm)) = PUBLISHED_MM.iter().find(|row| row.0 == id) {
        return Some(1.5 * if single { f32_mm } else { f64_mm });
    }
    match id {
        "A3-M1" => None,
        // Not published; these hold the line where it is.
        "A3-M3" => Some(3.6),
        "A2-M4" => Some(0.8),
        _ if id.ends_with("M1") || id.ends_with("M2") => Some(0.05),
        _ => Some(0.21),
    }
}

#[test]
fn half_a_millisecond_keeps_the_bounds_in_both_precisions() {
    let Some(folder) = truth_folder() else { return };
    let all = cases(&folder, |_| true);
    assert_eq!(all.len(), 24);
    let kernels = [Precision::F64, Precision::F32].map(Precision::fastest_kernel);
    for (case, kernel) in all
        .iter()
        .flat_map(|case| kernels.map(|kernel| (case, kernel)))
    {
        let rollout = simulate(case, kernel, 5e-4);
        let error = max_tip_error_mm(case, &rollout);
        if let Some(bound) = bound_mm(&case.id, kernel.is_single_precision()) {
            assert!(
                error <= bound,
                "{} {kernel:?}: {error} mm, bound {bound} mm",
                case.id
            );
            assert_eq!(rollout.outcome, Outcome::Clean, "{}", case.id);
        } else {
            assert_eq!(rollout.outcome, Outcome::RerunAtQuarterStep, "{}", case.id);
            assert!(error < 15.0, "{}: {error} mm", case.id);
        }
    }
}

/// At 25 us the error of the time steps is gone and that of the equations is left. Half of
/// the cases stay in one plane (M1, M2), the others twist the rope by up to 50 degrees at a
/// joint. The start of A3-M1 is not smooth (a torque of 1 N m let go within nothing).
#[test]
fn equations_are_right_in_the_plane_and_in_space_with_twist() {
    let Some(folder) = truth_folder() else { return };
    let all = cases(&folder, |_| true);
    assert_eq!(all.len(), 24);
    for case in all {
        let rollout = simulate(&case, Kernel::ScalarF64, 25e-6);
        let error = max_tip_error_mm(&case, &rollout);
        let bound = if case.id == "A3-M1" { 0.1 } else { 0.02 };
        assert!(error <= bound, "{}: {error} mm, bound {bound} mm", case.id);
        assert_eq!(rollout.outcome, Outcome::Clean, "{}", case.id);
    }
}

#[test]
fn every_kernel_follows_the_truth() {
    let Some(folder) = truth_folder() else { return };
    let case = cases(&folder, |id| id == "A6-M4").remove(0);
    for kernel in Kernel::ALL.into_iter().filter(|k| k.is_available()) {
        let error = max_tip_error_mm(&case, &simulate(&case, kernel, 5e-4));
        assert!(error <= 0.21, "{kernel:?}: {error} mm");
    }
}

/// Planar and spatial cases whose error between 1 and 0.25 ms is that of the steps
/// alone: smooth, and neither at the floor nor in the explicit terms' regime.
const SMOOTH: [&str; 6] = ["A1-M2", "A3-M2", "A4-M2", "A4-M3", "A6-M3", "A1-M4"];

#[test]
fn convergence_is_of_second_order() {
    let Some(folder) = truth_folder() else { return };
    for case in cases(&folder, |id| SMOOTH.contains(&id)) {
        let kernel = Precision::F64.fastest_kernel();
        let error = |step_s| max_tip_error_mm(&case, &simulate(&case, kernel, step_s));
        let order = (error(1e-3) / error(2.5e-4)).log2() / 2.0;
        println!("{}: order {order:.2}", case.id);
        assert!(order >= 1.9, "{}: order {order}", case.id);
    }
}
