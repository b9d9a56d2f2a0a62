//! The simulated arm and camera, in threads of this process.

use crate::error::OrRaise;
use crate::motion::cell_of;
use crate::rope::rope_of_json;
use anyhow::{Context, anyhow};
use pyo3::prelude::*;
use rig_sim::{RigConfig, RigError, run_announced};
use shared_types::Task;
use shared_types::ipc::DomainSweep;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc;
use std::thread::JoinHandle;
use xarm_sim::ArmPorts;

/// What the rig is.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub(crate) struct Setup {
    seed: u64,
    /// The rope (JSON); none for one drawn from the seed.
    rope: Option<String>,
    /// Whether it films, and into which shared-memory domain.
    camera: Option<String>,
    task: String,
    command_port: u16,
    report_ports: [u16; 4],
    cell: Option<PathBuf>,
}

impl Setup {
    fn config(&self) -> PyResult<RigConfig> {
        let named = serde_json::Value::from(self.task.as_str());
        let task = serde_json::from_value::<Task>(named).context("task");
        static RIGS: AtomicU64 = AtomicU64::new(0);
        let number = RIGS.fetch_add(1, Ordering::Relaxed);
        let own = || format!("rig-{}-{number}", std::process::id());
        let mut config = RigConfig {
            domain: self.camera.clone().unwrap_or_else(own),
            seed: self.seed,
            command_port: self.command_port,
            report_ports: self.report_ports,
            cell: cell_of(self.cell.as_deref())?,
            rope: self.rope.as_deref().map(rope_of_json).transpose()?,
            ..RigConfig::default()
        }
        .seeing(task.or_input()?);
        config.camera.enabled = self.camera.is_some();
        Ok(config)
    }
}

/// The rig while it runs; see `wag.Rig`.
#[pyclass(module = "wag")]
pub(crate) struct Rig {
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<Result<(), RigError>>>,
    /// Where the arm listens for commands.
    #[pyo3(get)]
    command_port: u16,
    /// Where it sends reports: joints fast, ordinary, state, real-time.
    #[pyo3(get)]
    report_ports: [u16; 4],
}

#[pymethods]
impl Rig {
    #[new]
    fn new(py: Python<'_>, setup: Setup) -> PyResult<Self> {
        let config = setup.config()?;
        let stop = Arc::new(AtomicBool::new(false));
        let (announce, announced) = mpsc::channel::<ArmPorts>();
        let until = Arc::clone(&stop);
        let thread = std::thread::Builder::new()
            .name("rig".to_owned())
            .spawn(move || {
                // Goes last: nothing of the domain stays once the rig is gone.
                let _sweep = DomainSweep::new(&config.domain);
                run_announced(&config, &until, |ports| {
                    // Nobody waits any more only when the interpreter ends.
                    let _ = announce.send(ports);
                })
            });
        let thread = thread.or_failed()?;
        match py.detach(move || announced.recv()) {
            Ok(ports) => Ok(Self {
                stop,
                thread: Some(thread),
                command_port: ports.command,
                report_ports: ports.reports,
            }),
            Err(_) => {
                let ended = py.detach(move || thread.join());
                let ended = ended.unwrap_or(Ok(()));
                ended.or_failed()?;
                Err(anyhow!("the rig ended before its arm listened")).or_failed()
            }
        }
    }

    /// Whether it still runs.
    fn is_running(&self) -> bool {
        self.thread
            .as_ref()
            .is_some_and(|thread| !thread.is_finished())
    }

    /// Ends it, once; what it failed at meanwhile is raised.
    fn stop(&mut self, py: Python<'_>) -> PyResult<()> {
        self.stop.store(true, Ordering::Release);
        let Some(thread) = self.thread.take() else {
            return Ok(());
        };
        match py.detach(move || thread.join()) {
            Ok(ended) => ended.or_failed(),
            Err(_) => Err(anyhow!("the rig panicked; see the messages above")).or_failed(),
        }
    }
}

impl Drop for Rig {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Release);
    }
}
