//! Offsets of least residual vibration: damped Gauss-Newton, all finite differences in one
//! batch of simulations.

use super::request::{SettleConfig, SettleError};
use super::residual::{Residual, ResidualSimulator};
use super::shape::MoveShape;
use nalgebra::{DMatrix, DVector};
use shared_types::ipc::message::Progress;
use std::ops::ControlFlow;

/// Step of the finite differences (rad): moves the rope by millimetres, far
/// above single precision, well within the linear range.
const STEP_RAD: f64 = 4e-3;
/// Damping of the first step (m/rad): far above the price of an offset, so that
/// the first steps take the small offsets and leave the large ones that promise
/// little; these lead into regions where the slopes mean nothing.
const DAMPING_M_PER_RAD: f64 = 0.05;
/// Damping at which no better step is expected (m/rad).
const DAMPING_MAX_M_PER_RAD: f64 = 2.0;
/// Change of the damping after a good or a bad step.
const DAMPING_FACTOR: f64 = 4.0;
/// Part of the cost that a step must save for another one to be worth it.
const WORTHWHILE: f64 = 0.05;

/// Residual and its slopes at one point.
struct Linearised {
    /// Squared residual vibration (mean over frames, m²) plus the price of the offsets.
    cost: f64,
    /// Mean square residual alone (m²).
    residual_m2: f64,
    residual: Residual,
    normal: DMatrix<f64>,
    gradient: DVector<f64>,
}

/// What the descent ends with.
#[derive(Debug)]
pub(super) struct LeastResidual {
    /// Offsets of least residual (rad).
    pub(super) offsets_rad: Vec<f64>,
    /// Residual with these.
    pub(super) residual: Residual,
    /// Largest displacement of the tip after the plain move (m).
    pub(super) plain_residual_m: f64,
}

/// Finds the offsets after which the rope swings least.
pub(super) fn least_residual(
    shape: &MoveShape,
    simulator: &ResidualSimulator<'_>,
    config: &SettleConfig,
    progress: &mut dyn FnMut(Progress) -> ControlFlow<()>,
) -> Result<LeastResidual, SettleError> {
    let mut x = DVector::from_vec(shape.no_offsets());
    let mut at = linearise(shape, simulator, config, &x)?.ok_or(SettleError::Diverged)?;
    let plain_residual_m = at.residual.largest_m;
    let mut damping = DAMPING_M_PER_RAD;
    for step in 0..config.iterations {
        if at.residual_m2.sqrt() < config.stop_below_rms_m || damping > DAMPING_MAX_M_PER_RAD {
            break;
        }
        let report = Progress {
            done: u32::try_from(step).unwrap_or(u32::MAX),
            total: u32::try_from(config.iterations).unwrap_or(u32::MAX),
            value: 100.0 * at.residual.largest_m,
            label: "residual cm".to_owned(),
        };
        if progress(report).is_break() {
            return Err(SettleError::Cancelled(step));
        }
        let ridge = DMatrix::from_diagonal_element(x.len(), x.len(), damping.powi(2));
        let Some(factor) = (&at.normal + ridge).cholesky() else {
            break;
        };
        let tried = &x - factor.solve(&at.gradient);
        match linearise(shape, simulator, config, &tried)? {
            Some(there) if there.cost < at.cost => {
                let saved = (at.cost - there.cost) / at.cost;
                (x, at) = (tried, there);
                damping /= DAMPING_FACTOR;
                if saved < WORTHWHILE {
                    break;
                }
            }
            _ => damping *= DAMPING_FACTOR,
        }
    }
    Ok(LeastResidual {
        offsets_rad: x.as_slice().to_vec(),
        residual: at.residual,
        plain_residual_m,
    })
}

/// Simulates `x` and its neighbours; `None` where the rope diverges.
fn linearise(
    shape: &MoveShape,
    simulator: &ResidualSimulator<'_>,
    config: &SettleConfig,
    x: &DVector<f64>,
) -> Result<Option<Linearised>, SettleError> {
    let here = shape.trajectory(x.as_slice())?;
    let beside = (0..x.len())
        .map(|i| {
            let mut beside = x.clone();
            beside[i] += STEP_RAD;
            shape.trajectory(beside.as_slice())
        })
        .collect::<Result<Vec<_>, _>>()?;
    let Some((here, slopes)) = simulator.slopes(&here, &beside, STEP_RAD)? else {
        return Ok(None);
    };
    let residuals = DVector::from_column_slice(&here.displacements_m);
    let slopes = DMatrix::from_fn(residuals.len(), x.len(), |row, column| slopes[column][row]);
    // Six numbers per frame: tip and middle in three axes.
    let per_frame = 6.0 / residuals.len().max(1) as f64;
    let price = config.offset_cost_m_per_rad.powi(2);
    let residual_m2 = residuals.norm_squared() * per_frame;
    Ok(Some(Linearised {
        cost: residual_m2 + price * x.norm_squared(),
        residual_m2,
        residual: here,
        normal: slopes.tr_mul(&slopes) * per_frame
            + DMatrix::from_diagonal_element(x.len(), x.len(), price),
        gradient: slopes.tr_mul(&residuals) * per_frame + x * price,
    }))
}
