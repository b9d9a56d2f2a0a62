//! How the clamp moves.

use crate::error::OrRaise;
use crate::threads::on_threads;
use anyhow::{Context, anyhow, ensure};
use arm_model::limits::{LimitKind, Margin};
use arm_model::{Cell, JOINTS, JointState, JointTrajectory, JointVector, Limits, Pole};
use numpy::ndarray::{Array2, Array3};
use numpy::{
    AllowTypeChange, IntoPyArray, PyArray1, PyArray2, PyArray3, PyArrayLike1, PyArrayLike2,
    PyArrayLike3,
};
use planner::wiggle::{WiggleConfig, wiggling_arm};
use pyo3::prelude::*;
use rope_sim::{AttachMotion, PlannedArm, PoseRow, PoseTrack};
use run_log::ClampMotion;
use run_log::files::{self, JointsCsv};
use std::path::{Path, PathBuf};

/// What numpy makes numbers of: arrays of any number type, lists.
type Numbers1<'py> = PyArrayLike1<'py, f64, AllowTypeChange>;
type Numbers2<'py> = PyArrayLike2<'py, f64, AllowTypeChange>;
type Numbers3<'py> = PyArrayLike3<'py, f64, AllowTypeChange>;

/// One number for each throw.
type Array<'py, T> = Bound<'py, PyArray1<T>>;
/// One row for each time.
type Table<'py> = Bound<'py, PyArray2<f64>>;

/// Motion of the rope's clamp in time: t = 0 is its begin, or a film's first frame.
#[pyclass(frozen, module = "wag")]
pub(crate) struct Motion {
    attach: Box<dyn AttachMotion + Send>,
    /// A motion that was recorded, which must last as long as the film.
    recorded: Option<ClampMotion>,
}

impl Motion {
    fn new(attach: impl AttachMotion + Send + 'static) -> Self {
        Self {
            attach: Box::new(attach),
            recorded: None,
        }
    }

    fn recorded(clamp: ClampMotion) -> PyResult<Self> {
        Ok(Self {
            attach: clamp.attach().or_input()?,
            recorded: Some(clamp),
        })
    }

    /// For simulator, tracker and fit.
    pub(crate) fn attach(&self) -> &dyn AttachMotion {
        &*self.attach
    }

    /// Refuses a recorded motion that does not last as long as the film.
    pub(crate) fn check_covers(&self, film_s: f64) -> PyResult<()> {
        let recorded = self.recorded.as_ref();
        recorded.map_or(Ok(()), |clamp| clamp.check_covers(film_s).or_input())
    }
}

/// The pole of a cell file, or the usual one.
pub(crate) fn cell_of(path: Option<&Path>) -> PyResult<Cell> {
    path.map_or_else(
        || Ok(Cell::default()),
        |path| files::read_cell(path).or_input(),
    )
}

/// Limits of a file, or the usual ones.
pub(crate) fn limits_of(path: Option<&Path>) -> PyResult<Limits> {
    let limits = path.map_or_else(
        || Ok(Limits::default()),
        |path| files::read_toml::<Limits>(path, "limits").or_input(),
    )?;
    limits.check_rating().or_input()?;
    Ok(limits)
}

/// Smallest and largest position of each joint (rad), by the usual limits.
#[pyfunction]
pub(crate) fn ranges_rad() -> Vec<(f64, f64)> {
    let limits = arm_model::limits::LimitsSpec::from(Limits::default());
    let (low, high) = (limits.position_min_rad, limits.position_max_rad);
    (0..JOINTS).map(|j| (low[j], high[j])).collect()
}

/// A throw within the limits of speed and acceleration.
struct Slowed {
    trajectory: JointTrajectory,
    factor: f64,
    is_within_ranges: bool,
}

/// Slows a throw down as a whole: speeds shrink with the factor, accelerations with its square.
fn slowed(times_s: &[f64], q: &[JointVector], limits: &Limits) -> anyhow::Result<Slowed> {
    /// Keeps rounding from breaking a limit that is used to the full.
    const ROUNDING: f64 = 1.0 + 1e-9;
    let as_asked = JointTrajectory::new(times_s, q)?;
    let margins = limits.margins(&as_asked);
    let needed = |margin: &Margin| match margin.kind {
        LimitKind::PositionMin | LimitKind::PositionMax => 1.0,
        LimitKind::Velocity | LimitKind::TcpSpeed => 1.0 - margin.left,
        LimitKind::Acceleration => (1.0 - margin.left).sqrt(),
    };
    let factor = margins.iter().map(needed).fold(1.0, f64::max);
    let is_range = |m: &&Margin| matches!(m.kind, LimitKind::PositionMin | LimitKind::PositionMax);
    let is_within_ranges = margins.iter().filter(is_range).all(|m| m.left >= 0.0);
    let trajectory = if factor > 1.0 {
        let times_s: Vec<f64> = times_s.iter().map(|t| t * factor * ROUNDING).collect();
        JointTrajectory::new(&times_s, q)?
    } else {
        as_asked
    };
    Ok(Slowed {
        trajectory,
        factor,
        is_within_ranges,
    })
}

fn pole_of(path: Option<&Path>) -> PyResult<Pole> {
    Ok(cell_of(path)?.pole)
}

/// Times (s) and joints (rad), as many of the one as of the other.
fn joints_of(times_s: &Numbers1<'_>, q_rad: &Numbers2<'_>) -> PyResult<JointsCsv> {
    let (times_s, q_rad) = (times_s.as_array(), q_rad.as_array());
    let joints = || {
        ensure!(
            q_rad.dim() == (times_s.len(), JOINTS),
            "`q_rad` has the shape {:?}, but {} times need ({}, {JOINTS})",
            q_rad.dim(),
            times_s.len(),
            times_s.len()
        );
        let row =
            |row: numpy::ndarray::ArrayView1<'_, f64>| JointVector(std::array::from_fn(|j| row[j]));
        Ok(JointsCsv {
            times_s: times_s.to_vec(),
            q: q_rad.outer_iter().map(row).collect(),
        })
    };
    joints().or_input()
}

/// Positions, velocities and accelerations, (times, 7) each, of the clamped cubic spline through
/// these joints; at rest before and after it.
#[pyfunction]
#[pyo3(signature = (times_s, q_rad, at_s))]
pub(crate) fn spline<'py>(
    py: Python<'py>,
    times_s: Numbers1<'py>,
    q_rad: Numbers2<'py>,
    at_s: Numbers1<'py>,
) -> PyResult<(Table<'py>, Table<'py>, Table<'py>)> {
    let joints = joints_of(&times_s, &q_rad)?;
    let trajectory = JointTrajectory::new(&joints.times_s, &joints.q).or_input()?;
    let at_s = at_s.as_array();
    let states: Vec<JointState> = at_s.iter().map(|t| trajectory.state_at(*t)).collect();
    let table = |of: fn(&JointState) -> JointVector| {
        Array2::from_shape_fn((states.len(), JOINTS), |(i, j)| of(&states[i])[j]).into_pyarray(py)
    };
    Ok((table(|s| s.q), table(|s| s.qd), table(|s| s.qdd)))
}

#[pymethods]
impl Motion {
    /// Joints as an arm reported them: a smooth curve near all of them.
    #[staticmethod]
    #[pyo3(signature = (times_s, q_rad, *, cell = None))]
    fn joints(times_s: Numbers1<'_>, q_rad: Numbers2<'_>, cell: Option<PathBuf>) -> PyResult<Self> {
        let joints = joints_of(&times_s, &q_rad)?;
        let pole = pole_of(cell.as_deref())?;
        Self::recorded(ClampMotion::new(
            Path::new("q_rad"),
            Some(joints),
            pole,
            0.0,
        ))
    }

    /// The same from a file `joints.csv`.
    #[staticmethod]
    #[pyo3(signature = (path, *, film_late_s = 0.0, cell = None))]
    fn joints_file(path: PathBuf, film_late_s: f64, cell: Option<PathBuf>) -> PyResult<Self> {
        let joints = files::read_joints(&path).or_input()?;
        let pole = pole_of(cell.as_deref())?;
        Self::recorded(ClampMotion::new(&path, Some(joints), pole, film_late_s))
    }

    /// Poses of the clamp, nearly without noise: a curve through all of them.
    #[staticmethod]
    fn poses(
        times_s: Numbers1<'_>,
        position_m: Numbers2<'_>,
        quaternion_wxyz: Numbers2<'_>,
    ) -> PyResult<Self> {
        let (t, p, q) = (
            times_s.as_array(),
            position_m.as_array(),
            quaternion_wxyz.as_array(),
        );
        let poses = || {
            let count = t.len();
            ensure!(
                p.dim() == (count, 3) && q.dim() == (count, 4),
                "{count} times need positions of shape ({count}, 3) and quaternions of shape \
                 ({count}, 4), found {:?} and {:?}",
                p.dim(),
                q.dim()
            );
            let row = |i: usize| PoseRow {
                t_s: t[i],
                p_m: std::array::from_fn(|k| p[[i, k]]),
                q_wxyz: std::array::from_fn(|k| q[[i, k]]),
            };
            let rows: Vec<PoseRow> = (0..count).map(row).collect();
            Ok(PoseTrack::new(&rows)?)
        };
        poses().or_input().map(Self::new)
    }

    /// The same from a file `pose.csv`.
    #[staticmethod]
    #[pyo3(signature = (path, *, film_late_s = 0.0))]
    fn poses_file(path: PathBuf, film_late_s: f64) -> PyResult<Self> {
        Self::recorded(ClampMotion::new(&path, None, Pole::default(), film_late_s))
    }

    /// An arm that follows a clamped cubic spline through these joints exactly: a throw.
    #[staticmethod]
    #[pyo3(signature = (times_s, q_rad, *, cell = None))]
    fn waypoints(
        times_s: Numbers1<'_>,
        q_rad: Numbers2<'_>,
        cell: Option<PathBuf>,
    ) -> PyResult<Self> {
        let joints = joints_of(&times_s, &q_rad)?;
        let trajectory = JointTrajectory::new(&joints.times_s, &joints.q).or_input()?;
        Ok(Self::new(PlannedArm::new(
            trajectory,
            pole_of(cell.as_deref())?,
        )))
    }

    /// The wiggle that is filmed.
    #[staticmethod]
    fn wiggle() -> PyResult<Self> {
        wiggling_arm(&WiggleConfig::default())
            .or_failed()
            .map(Self::new)
    }

    /// Throws through these joints, (throws, waypoints, 7) at (throws, waypoints): each slowed down
    /// as a whole until the arm's limits of speed and acceleration hold. With them how much each
    /// was slowed, 1 for not at all, and whether all its joints stay within their ranges.
    #[staticmethod]
    #[pyo3(signature = (times_s, q_rad, *, limits = None, cell = None, threads = None))]
    fn throws<'py>(
        py: Python<'py>,
        times_s: Numbers2<'py>,
        q_rad: Numbers3<'py>,
        limits: Option<PathBuf>,
        cell: Option<PathBuf>,
        threads: Option<usize>,
    ) -> PyResult<(Vec<Self>, Array<'py, f64>, Array<'py, bool>)> {
        let (t, q) = (times_s.as_array().to_owned(), q_rad.as_array().to_owned());
        let (count, waypoints) = t.dim();
        if q.dim() != (count, waypoints, JOINTS) {
            let (found, need) = (q.dim(), (count, waypoints, JOINTS));
            return Err(anyhow!(
                "`q_rad` has the shape {found:?}, but needs {need:?}"
            ))
            .or_input();
        }
        let (limits, pole) = (limits_of(limits.as_deref())?, pole_of(cell.as_deref())?);
        let slow = |i: usize| {
            let times_s: Vec<f64> = t.row(i).to_vec();
            let row = |k: usize| JointVector(std::array::from_fn(|j| q[[i, k, j]]));
            let q: Vec<JointVector> = (0..waypoints).map(row).collect();
            slowed(&times_s, &q, &limits).with_context(|| format!("throw {i}"))
        };
        let slowed = py.detach(|| on_threads(threads, count, &slow)).or_input()?;
        let factors = slowed.iter().map(|s| s.factor).collect::<Vec<f64>>();
        let within = slowed
            .iter()
            .map(|s| s.is_within_ranges)
            .collect::<Vec<bool>>();
        let arm = |s: Slowed| Self::new(PlannedArm::new(s.trajectory, pole));
        let motions = slowed.into_iter().map(arm).collect();
        Ok((motions, factors.into_pyarray(py), within.into_pyarray(py)))
    }

    /// When it ends (s); what is not described lasts for ever.
    #[getter]
    fn duration_s(&self) -> f64 {
        self.attach.duration_s()
    }

    /// Positions (times, 3) in m and attitudes (times, 3, 3), clamp to world.
    fn at<'py>(
        &self,
        py: Python<'py>,
        times_s: Numbers1<'py>,
    ) -> (Bound<'py, PyArray2<f64>>, Bound<'py, PyArray3<f64>>) {
        let times_s = times_s.as_array();
        let frames: Vec<_> = times_s.iter().map(|t| self.attach.at(*t)).collect();
        let p = Array2::from_shape_fn((frames.len(), 3), |(i, k)| frames[i].p_m[k]);
        let shape = (frames.len(), 3, 3);
        let r = Array3::from_shape_fn(shape, |(i, j, k)| frames[i].r[(j, k)]);
        (p.into_pyarray(py), r.into_pyarray(py))
    }
}

impl std::fmt::Debug for Motion {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Motion({:.3} s)", self.attach.duration_s())
    }
}
