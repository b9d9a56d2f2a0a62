//! What a page of the studio may ask for, and who may ask.

use crate::job::{self, Job};
use crate::reach::{LENGTH_MAX_M, ReachBounds, objection};
use crate::rig::{self, Rig};
use crate::settings::{Cell, Settings};
use crate::work::{View, Work, name_of};
use crate::{history, page};
use anyhow::Context;
use planner::plan;
use run_log::{Run, files, ledger};
use serde::Serialize;
use serde_json::{Value, json};
use shared_types::{ErrorForecast, Plan, Task};
use std::path::Path;
use std::sync::{Mutex, MutexGuard, PoisonError};
use viewer::live::{Asked, Desk, Reply};
use viewer::report::{PlannedMotion, RopeRow, rope_rows};

/// Arm, camera, and the one run that is under way.
#[derive(Debug)]
pub(crate) struct Workplace {
    settings: Settings,
    state: Mutex<State>,
}

/// Dropped in order: a run ends before its rig.
#[derive(Debug, Default)]
struct State {
    work: Option<Work>,
    rig: Option<Rig>,
    /// Another rig is on its way.
    is_changing: bool,
    /// The studio is ending.
    is_closed: bool,
}

impl State {
    /// Why nothing may begin now.
    fn objection(&self) -> Option<&'static str> {
        if self.is_closed {
            Some("the studio is ending")
        } else if self.is_changing {
            Some("the simulated rope is being changed")
        } else if self.work.as_ref().is_some_and(|work| !work.is_over()) {
            Some("a run is under way")
        } else {
            None
        }
    }
}

/// A refusal: its status and its words.
type Refused = (u16, String);

fn conflict(why: impl ToString) -> Refused {
    (409, why.to_string())
}

/// What a page is told four times a second.
#[derive(Debug, Serialize)]
struct Told {
    /// Whether this page may begin, confirm and hold.
    is_local: bool,
    /// The seed and task of the simulated rig; none with an arm that is there.
    rig: Option<(u64, Task)>,
    /// Whether the controller is a service, whose stop somebody must acknowledge.
    is_service: bool,
    work: Option<View>,
}

/// What a run has found so far.
#[derive(Debug, Default, Serialize)]
struct Found {
    rope: Vec<RopeRow>,
    /// Why the rope should not be relied on.
    unconfirmed: Vec<String>,
    plan: Option<PlanView>,
}

#[derive(Debug, Serialize)]
struct PlanView {
    task: Task,
    target_m: [f64; 3],
    predicted_error_m: f64,
    forecast: Option<ErrorForecast>,
    /// What a person should know before the throw.
    warnings: Vec<String>,
    motion: PlannedMotion,
}

impl Workplace {
    /// Makes ready what runs need.
    ///
    /// # Errors
    /// The simulated rig does not come up.
    pub(crate) fn open(settings: Settings) -> anyhow::Result<Self> {
        let rig = match settings.cell {
            Cell::Simulated { seed, task } => Some(Rig::start(seed, task, &settings.of_all())?),
            Cell::Real { .. } => None,
        };
        let state = Mutex::new(State {
            rig,
            ..State::default()
        });
        Ok(Self { settings, state })
    }

    /// Where the run's controller is, or will be: where the camera films, if it does so in a domain, else
    /// that of the run.
    pub(crate) fn domain(&self) -> String {
        match &self.settings.cell {
            Cell::Simulated { .. } => rig::domain(),
            Cell::Real { domain, .. } => domain.clone().unwrap_or_else(|| {
                let state = self.state();
                let pid = state.work.as_ref().map(Work::process);
                ledger::domain_of_process(pid.unwrap_or_else(std::process::id))
            }),
        }
    }

    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Looks whether the run has ended.
    pub(crate) fn look(&self) {
        if let Some(work) = &mut self.state().work {
            work.look();
        }
    }

    /// Ends the run, as Ctrl-C would, and then the rig; none begins after that.
    pub(crate) fn close(&self) {
        let ended = std::mem::replace(
            &mut *self.state(),
            State {
                is_closed: true,
                ..State::default()
            },
        );
        drop(ended);
    }

    fn told(&self, is_local: bool) -> Told {
        let state = self.state();
        Told {
            is_local,
            rig: state.rig.as_ref().map(|rig| (rig.seed, rig.task)),
            is_service: self.settings.cell.is_service(),
            work: state.work.as_ref().map(Work::view),
        }
    }

    fn begin(&self, asked: &Asked<'_>) -> Result<String, Refused> {
        let runs = &self.settings.runs;
        let job = Job::of(asked, runs).map_err(conflict)?;
        let mut state = self.state();
        if let Some(why) = state.objection() {
            return Err(conflict(why));
        }
        let (reached_by, target_rgb) = match &self.settings.cell {
            Cell::Real {
                reached_by,
                target_rgb,
                ..
            } => (reached_by.as_slice(), target_rgb.as_deref()),
            Cell::Simulated { .. } => {
                let is_there = state.rig.as_mut().is_some_and(Rig::is_there);
                let rig = state.rig.as_ref().filter(|_| is_there);
                let gone = "the simulated rig has ended: hang another rope";
                let rig = rig.ok_or_else(|| conflict(gone))?;
                (rig.reached_by.as_slice(), None)
            }
        };
        let run = runs.join(ledger::new_name(job.name()));
        let name = name_of(&run);
        let mut words = job.arguments(reached_by, target_rgb, &run);
        words.extend(self.settings.of_all());
        let work = Work::begin(&words, run);
        state.work = Some(work.map_err(|error| conflict(format!("{error:#}")))?);
        Ok(name)
    }

    /// Hangs another rope on the simulated arm.
    fn hang(&self, asked: &Asked<'_>) -> Result<String, Refused> {
        let seed = asked.value("seed").and_then(|seed| seed.parse().ok());
        let seed = seed.ok_or_else(|| conflict("a seed is a whole number"))?;
        let task = job::task(asked).map_err(conflict)?;
        if !matches!(self.settings.cell, Cell::Simulated { .. }) {
            return Err(conflict("this is no simulated rig"));
        }
        let mut state = self.state();
        if let Some(why) = state.objection() {
            return Err(conflict(why));
        }
        state.is_changing = true;
        let before = state.rig.take();
        drop(state);
        // The one before has the domain; meanwhile the page goes on.
        drop(before);
        let rig = Rig::start(seed, task, &self.settings.of_all());
        let mut state = self.state();
        state.is_changing = false;
        if state.is_closed {
            return Err(conflict("the studio is ending"));
        }
        state.rig = Some(rig.map_err(|error| conflict(format!("{error:#}")))?);
        Ok("done".to_owned())
    }

    /// What the page's operator does while a run is under way.
    fn operate(&self, asked: &Asked<'_>) -> Result<String, Refused> {
        let mut state = self.state();
        let work = state.work.as_mut().filter(|work| !work.is_over());
        let work = work.ok_or_else(|| conflict("nothing runs"))?;
        match asked.path {
            "confirm" => {
                let number = asked.value("number").and_then(|text| text.parse().ok());
                work.confirm(number).map_err(conflict)?;
            }
            "hold" => work.hold().map_err(conflict)?,
            _ => work.interrupt(),
        }
        Ok("done".to_owned())
    }

    /// Where targets may lie at a height, and what is wrong with the one that is named.
    fn reach(&self, asked: &Asked<'_>) -> Result<Value, Refused> {
        let number = |key: &str| asked.value(key).and_then(|text| text.parse::<f64>().ok());
        let cell = &self.settings.here.cell;
        let length_m = number("length_m").unwrap_or(LENGTH_MAX_M);
        let [x, y, z] = ["x", "y", "z"].map(number);
        let z = z.ok_or_else(|| conflict("a height is a number"))?;
        let named = x.zip(y).map(|(x, y)| objection([x, y, z], length_m, cell));
        Ok(json!({
            "map": ReachBounds::at(z, length_m, cell), "objection": named.flatten(),
        }))
    }

    /// What a run has found: its rope, its plan with arm and rope over time.
    fn found(&self, name: &str) -> anyhow::Result<Found> {
        let folder = self.settings.runs.join(name_of(Path::new(name)));
        if !folder.is_dir() {
            // A run that has just begun.
            return Ok(Found::default());
        }
        let run = Run::open(&folder)?;
        let file = folder.join(files::ROPE);
        let rope = match run.rope()? {
            Some(rope) => rope_rows(&rope, &file, &Value::Null)?,
            None => Vec::new(),
        };
        let unconfirmed = match file.is_file() {
            true => files::read_unconfirmed(&file)?,
            false => Vec::new(),
        };
        let plan = run.plan()?.map(|plan| self.plan_view(&plan)).transpose()?;
        Ok(Found {
            rope,
            unconfirmed,
            plan,
        })
    }

    fn plan_view(&self, plan: &Plan) -> anyhow::Result<PlanView> {
        let motion = PlannedMotion::of_plan(plan, &self.settings.here.cell);
        Ok(PlanView {
            task: plan.task,
            target_m: plan.target_m,
            predicted_error_m: plan.predicted_error_m,
            forecast: plan.forecast,
            warnings: plan::warnings(plan),
            motion: motion.context("the plan's throw")?,
        })
    }

    /// A page only looks.
    fn shown(&self, asked: &Asked<'_>) -> Result<Option<Reply>, Refused> {
        let Settings { runs, here, .. } = &self.settings;
        let missing = |error: anyhow::Error| (404, format!("{error:#}"));
        let report = asked.path.strip_prefix("report/");
        Ok(Some(match (asked.path, report) {
            ("", _) => Reply::of("text/html; charset=utf-8", page::HTML),
            ("studio.js", _) => Reply::of("text/javascript; charset=utf-8", page::script()),
            ("studio.css", _) => Reply::of("text/css; charset=utf-8", page::style()),
            ("work", _) => Reply::json(&self.told(asked.is_local)),
            ("runs", _) => Reply::json(&history::newest(runs)),
            ("reach", _) => Reply::json(&self.reach(asked)?),
            ("wiggle", _) => {
                let wiggle = &self.settings.wiggle;
                Reply::json(&PlannedMotion::of_arm(wiggle, &here.cell))
            }
            ("found", _) => {
                let name = asked.value("run").unwrap_or_default();
                Reply::json(&self.found(name).map_err(missing)?)
            }
            (_, Some(name)) => Reply::document(history::report(runs, name, here).map_err(missing)?),
            _ => return Ok(None),
        }))
    }
}

impl Desk for Workplace {
    fn answer(&self, asked: &Asked<'_>) -> Option<Reply> {
        let acts = matches!(asked.path, "begin" | "rig" | "confirm" | "hold" | "end");
        let done = match (asked.method, acts) {
            ("GET", false) => return self.shown(asked).unwrap_or_else(|why| Some(said(&why))),
            ("POST", true) if !asked.is_local && asked.path != "end" => Err((
                403,
                "from another machine one can look and stop, not more".to_owned(),
            )),
            ("POST", true) => match asked.path {
                "begin" => self.begin(asked),
                "rig" => self.hang(asked),
                _ => self.operate(asked),
            },
            _ => return None,
        };
        Some(done.map_or_else(|why| said(&why), |text| Reply::said(200, &text)))
    }
}

fn said((status, why): &Refused) -> Reply {
    Reply::said(*status, why)
}

#[cfg(test)]
mod tests {
    use super::*;
    use arm_model::JointTrajectory;
    use arm_model::joint::START_POSE;
    use run_log::CellHere;

    fn workplace(runs: &Path) -> Workplace {
        let mut end = START_POSE;
        end[5] += 0.2;
        let settings = Settings {
            cell: Cell::Real {
                reached_by: vec!["--arm".to_owned(), "127.0.0.1".to_owned()],
                target_rgb: None,
                domain: Some("lab".to_owned()),
            },
            cell_file: None,
            runs: runs.to_owned(),
            here: CellHere {
                cell: arm_model::Cell::default(),
                is_named: false,
            },
            wiggle: JointTrajectory::new(&[0.0, 1.0], &[START_POSE, end]).unwrap(),
        };
        Workplace::open(settings).unwrap()
    }

    #[test]
    fn another_machine_looks_and_ends_and_nothing_else() {
        let dir = tempfile::tempdir().unwrap();
        let place = workplace(dir.path());
        let status = |method, path, is_local| {
            let query = "z=0.3&from=wiggle&clear=yes";
            let asked = Asked {
                method,
                path,
                query,
                is_local,
            };
            place.answer(&asked).map(|reply| reply.status())
        };
        for path in ["begin", "confirm", "hold", "rig"] {
            assert_eq!(status("POST", path, false), Some(403), "{path}");
            assert_eq!(status("POST", path, true), Some(409), "{path}");
            assert_eq!(status("GET", path, true), None, "{path}");
        }
        assert_eq!(status("POST", "end", false), Some(409), "nothing runs");
        for path in [
            "",
            "studio.js",
            "studio.css",
            "work",
            "runs",
            "reach",
            "wiggle",
            "found",
        ] {
            assert_eq!(status("GET", path, false), Some(200), "{path}");
            assert_eq!(status("POST", path, true), None, "{path}");
        }
        for path in ["report/none", "report/../x"] {
            assert_eq!(status("GET", path, false), Some(404), "{path}");
        }
        // The live page's own.
        for path in ["state", "picture", "ask/stop"] {
            assert_eq!(status("GET", path, true), None, "{path}");
        }
        assert_eq!(place.domain(), "lab");
    }
}
