//! Offsets of least sway: damped Gauss-Newton, all finite differences in one
//! batch of simulations.

use super::shape::MoveShape;
use super::sway::{Sway, SwaySimulator};
use super::{CalmConfig, CalmError};
use nalgebra::{DMatrix, DVector};

/// Step of the finite differences (rad): moves the rope by millimetres, far
/// above single precision, well within the linear range.
const STEP_RAD: f64 = 4e-3;
/// Damping at first, relative to the diagonal.
const DAMPING: f64 = 1e-4;
/// Damping at which no better step is expected.
const DAMPING_MAX: f64 = 1e2;
/// Part of the cost that a step must save for another one to be worth it.
const WORTHWHILE: f64 = 0.02;

/// Sway and its slopes at one point.
struct Linearised {
    /// Squared sway (mean over frames, m²) plus the price of the offsets.
    cost: f64,
    /// Mean square sway alone (m²).
    sway_m2: f64,
    normal: DMatrix<f64>,
    gradient: DVector<f64>,
}

/// Offsets (rad) after which the rope sways least.
pub(super) fn least_sway(
    shape: &MoveShape,
    simulator: &SwaySimulator<'_>,
    config: &CalmConfig,
) -> Result<Vec<f64>, CalmError> {
    let mut x = DVector::from_vec(shape.no_offsets());
    let mut at = linearise(shape, simulator, config, &x)?.ok_or(CalmError::Diverged)?;
    let mut damping = DAMPING;
    for _ in 0..config.iterations {
        if at.sway_m2.sqrt() < config.content_m {
            break;
        }
        let damped = &at.normal + DMatrix::from_diagonal(&(at.normal.diagonal() * damping));
        let Some(step) = damped.cholesky().map(|f| f.solve(&at.gradient)) else {
            break;
        };
        let tried = &x - step;
        match linearise(shape, simulator, config, &tried)? {
            Some(there) if there.cost < at.cost => {
                let saved = (at.cost - there.cost) / at.cost;
                (x, at) = (tried, there);
                damping /= 10.0;
                if saved < WORTHWHILE {
                    break;
                }
            }
            _ => {
                damping = damping.max(DAMPING) * 30.0;
                if damping > DAMPING_MAX {
                    break;
                }
            }
        }
    }
    Ok(x.as_slice().to_vec())
}

/// Simulates `x` and its neighbours; `None` where the rope diverges.
#[allow(clippy::cast_precision_loss, reason = "a few hundred residuals")]
fn linearise(
    shape: &MoveShape,
    simulator: &SwaySimulator<'_>,
    config: &CalmConfig,
    x: &DVector<f64>,
) -> Result<Option<Linearised>, CalmError> {
    let mut moves = vec![shape.trajectory(x.as_slice())?];
    for i in 0..x.len() {
        let mut beside = x.clone();
        beside[i] += STEP_RAD;
        moves.push(shape.trajectory(beside.as_slice())?);
    }
    let sways = simulator.run(&moves)?;
    let Some((here, beside)) = sways.split_first().filter(|_| all_finite(&sways)) else {
        return Ok(None);
    };
    let residuals = DVector::from_column_slice(&here.displacements_m);
    let slopes = DMatrix::from_fn(residuals.len(), x.len(), |row, column| {
        (beside[column].displacements_m[row] - residuals[row]) / STEP_RAD
    });
    // Six numbers per frame: tip and middle in three axes.
    let per_frame = 6.0 / residuals.len().max(1) as f64;
    let price = config.offset_cost_m_per_rad.powi(2);
    let sway_m2 = residuals.norm_squared() * per_frame;
    Ok(Some(Linearised {
        cost: sway_m2 + price * x.norm_squared(),
        sway_m2,
        normal: slopes.tr_mul(&slopes) * per_frame
            + DMatrix::from_diagonal_element(x.len(), x.len(), price),
        gradient: slopes.tr_mul(&residuals) * per_frame + x * price,
    }))
}

fn all_finite(sways: &[Sway]) -> bool {
    sways.iter().all(|s| s.finite)
}
