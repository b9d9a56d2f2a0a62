//! Hanging ropes that are moved on step by step, each by an arm of its own.

use crate::error::OrRaise;
use crate::motion::cell_of;
use crate::rope::ropes_of_table;
use crate::simulate::NUMBERS_MAX;
use crate::threads::THREADS_MAX;
use anyhow::ensure;
use arm_model::{JOINTS, JointState, JointVector, Pole};
use numpy::ndarray::{Array2, Array3, ArrayView2};
use numpy::{IntoPyArray, PyArray2, PyArray3, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::prelude::*;
use rope_sim::LiveRope;
use shared_types::RopeParams;
use std::path::PathBuf;

/// Most steps of one call: nothing ends it sooner.
const STEPS_MAX: f64 = 1e8;

/// One rope and the arm that it hangs from.
struct Hanging {
    rope: LiveRope,
    arm: JointState,
}

impl Hanging {
    fn new(rope: &RopeParams, q: JointVector, pole: &Pole, step_s: f64) -> PyResult<Self> {
        let arm = JointState::at_rest(q);
        let rope = LiveRope::new(rope, &pole.attach_motion(&arm), step_s).or_input()?;
        Ok(Self { rope, arm })
    }

    /// Moves on under a constant acceleration of the joints; the tip after each of equal parts
    /// of the period goes to `tips`.
    fn advance(&mut self, qdd: JointVector, period_s: f64, pole: &Pole, tips: &mut [[f64; 3]]) {
        let (start, start_s) = (self.arm, self.rope.time_s());
        let arm = |t_s: f64| {
            let t = t_s - start_s;
            JointState {
                q: start.q + start.qd * t + qdd * (0.5 * t * t),
                qd: start.qd + qdd * t,
                qdd,
            }
        };
        let count = tips.len().max(1) as f64;
        for (index, tip) in (1_u32..).zip(tips) {
            let until_s = start_s + period_s * f64::from(index) / count;
            self.rope
                .advance(&|t_s| pole.attach_motion(&arm(t_s)), until_s);
            *tip = self
                .rope
                .nodes()
                .last()
                .map_or([f64::NAN; 3], |p| (*p).into());
        }
        self.arm = JointState {
            qdd: JointVector::ZERO,
            ..arm(start_s + period_s)
        };
    }
}

/// Ropes that hang from arms at rest and are moved on by accelerations of the joints; see
/// `wag.HangingRopes`.
#[pyclass(module = "wag")]
pub(crate) struct HangingRopes {
    all: Vec<Hanging>,
    pole: Pole,
    step_s: f64,
    threads: usize,
}

#[pymethods]
impl HangingRopes {
    #[new]
    #[pyo3(signature = (table, extras, q_rad, *, step_s, threads, cell = None))]
    fn new(
        table: PyReadonlyArray2<'_, f64>,
        extras: Vec<Option<String>>,
        q_rad: PyReadonlyArray1<'_, f64>,
        step_s: f64,
        threads: usize,
        cell: Option<PathBuf>,
    ) -> PyResult<Self> {
        let pole = cell_of(cell.as_deref())?.pole;
        let q = joints(q_rad.as_array().as_slice().unwrap_or(&[]))?;
        let ropes = ropes_of_table(&table, &extras)?;
        let all = ropes
            .iter()
            .map(|rope| Hanging::new(rope, q, &pole, step_s));
        Ok(Self {
            all: all.collect::<PyResult<_>>()?,
            pole,
            step_s,
            threads: threads.clamp(1, THREADS_MAX),
        })
    }

    /// Hangs other ropes in the place of some, on arms at rest in `q_rad`.
    fn replace(
        &mut self,
        indices: Vec<usize>,
        table: PyReadonlyArray2<'_, f64>,
        extras: Vec<Option<String>>,
        q_rad: PyReadonlyArray1<'_, f64>,
    ) -> PyResult<()> {
        let q = joints(q_rad.as_array().as_slice().unwrap_or(&[]))?;
        let ropes = ropes_of_table(&table, &extras)?;
        let count = self.all.len();
        let known = || {
            ensure!(
                indices.len() == ropes.len() && indices.iter().all(|index| *index < count),
                "{} ropes for {} places of {count}",
                ropes.len(),
                indices.len()
            );
            Ok(())
        };
        known().or_input()?;
        // All or none.
        let hung = ropes
            .iter()
            .map(|rope| Hanging::new(rope, q, &self.pole, self.step_s));
        for (index, hanging) in indices.into_iter().zip(hung.collect::<PyResult<Vec<_>>>()?) {
            self.all[index] = hanging;
        }
        Ok(())
    }

    /// Moves all on under constant accelerations of their joints, (ropes, 7) in rad/s²; gives
    /// the tips after each of `samples` equal parts of the period, (ropes, samples, 3) in m.
    fn advance<'py>(
        &mut self,
        py: Python<'py>,
        qdd_rad_s2: PyReadonlyArray2<'py, f64>,
        period_s: f64,
        samples: usize,
    ) -> PyResult<Bound<'py, PyArray3<f64>>> {
        let count = self.all.len();
        // Copied: another thread may write into the array meanwhile.
        let qdd = qdd_rad_s2.as_array().to_owned();
        let usable = || {
            ensure!(
                qdd.dim() == (count, JOINTS),
                "accelerations need the shape ({count}, {JOINTS}), found {:?}",
                qdd.dim()
            );
            ensure!(
                period_s > 0.0 && period_s / self.step_s <= STEPS_MAX && samples > 0,
                "`period_s` and `samples` must be above 0, and a period at most 1e8 steps"
            );
            ensure!(
                3 * count as u128 * samples as u128 <= NUMBERS_MAX,
                "`samples` is {samples}: {count} ropes have more tips then than memory"
            );
            ensure!(
                qdd.iter().all(|x| x.is_finite()),
                "an acceleration is not finite"
            );
            Ok(())
        };
        usable().or_input()?;
        let mut tips = vec![[0.0; 3]; count * samples];
        let (all, pole, threads) = (&mut self.all, &self.pole, self.threads);
        py.detach(|| {
            advance_all(
                all,
                (&qdd.view(), period_s),
                pole,
                (&mut tips, samples),
                threads,
            )
        });
        let flat = tips.into_iter().flatten().collect();
        let tips = Array3::from_shape_vec((count, samples, 3), flat).or_failed()?;
        Ok(tips.into_pyarray(py))
    }

    /// Joints of all arms, (ropes, 7), in rad and rad/s.
    fn joints<'py>(
        &self,
        py: Python<'py>,
    ) -> (Bound<'py, PyArray2<f64>>, Bound<'py, PyArray2<f64>>) {
        let shape = (self.all.len(), JOINTS);
        let q = Array2::from_shape_fn(shape, |(i, j)| self.all[i].arm.q[j]);
        let qd = Array2::from_shape_fn(shape, |(i, j)| self.all[i].arm.qd[j]);
        (q.into_pyarray(py), qd.into_pyarray(py))
    }

    /// Nodes of one rope, (nodes, 3) in m, clamp first.
    fn nodes<'py>(&self, py: Python<'py>, index: usize) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let hanging = self.all.get(index);
        let missing = || anyhow::anyhow!("rope {index} of {}", self.all.len());
        let nodes = hanging.ok_or_else(missing).or_input()?.rope.nodes();
        let nodes = Array2::from_shape_fn((nodes.len(), 3), |(i, k)| nodes[i][k]);
        Ok(nodes.into_pyarray(py))
    }

    /// Whether each rope's numbers are still finite.
    fn finite(&self) -> Vec<bool> {
        self.all.iter().map(|h| h.rope.is_finite()).collect()
    }
}

/// A pose of seven finite joints.
fn joints(q_rad: &[f64]) -> PyResult<JointVector> {
    let pose = <[f64; JOINTS]>::try_from(q_rad).ok();
    let pose = pose.filter(|q| q.iter().all(|q| q.is_finite()));
    let need = || anyhow::anyhow!("`q_rad` needs {JOINTS} finite joints, found {q_rad:?}");
    pose.map(JointVector).ok_or_else(need).or_input()
}

/// Each rope by whichever thread has it; what one does depends on no other.
fn advance_all(
    all: &mut [Hanging],
    (qdd, period_s): (&ArrayView2<'_, f64>, f64),
    pole: &Pole,
    (tips, samples): (&mut [[f64; 3]], usize),
    threads: usize,
) {
    let share = all.len().div_ceil(threads).max(1);
    std::thread::scope(|scope| {
        let parts = all.chunks_mut(share).zip(tips.chunks_mut(share * samples));
        for (part, (ropes, tips)) in parts.enumerate() {
            scope.spawn(move || {
                let tips = tips.chunks_mut(samples);
                for (index, (hanging, tips)) in ropes.iter_mut().zip(tips).enumerate() {
                    let row = qdd.row(part * share + index);
                    let qdd = JointVector(std::array::from_fn(|j| row[j]));
                    hanging.advance(qdd, period_s, pole, tips);
                }
            });
        }
    });
}
