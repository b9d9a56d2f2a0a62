//! The live page of `wag watch`: it looks on, it never drives.
//!
//! One thread reads shared memory and makes the newest state and the newest picture;
//! threads of the server hand them out, each page the newest whenever it is ready. A
//! page can ask for a stop, and for what an operator's presence allows.

mod ask;
mod attached;
mod desk;
mod facts;
mod film;
mod http;
mod jitter;
mod newest;
mod page;
mod picture;
mod received;
mod rope;
mod snapshot;
mod stage;
mod token;

pub use attached::{Joined, newest_domain};
pub use desk::{Asked, Desk};
pub use facts::{Facts, domain_of_run};
pub use http::Reply;
pub use page::{IDS, script, style};

use crate::report::{REPORT, arm_points, headline_of, tenths_mm};
use ask::{Ask, Open, Requested, hand_over};
use attached::{Attached, Seen};
use camera_ingest::preview::PreviewConfig;
use http::Site;
use jitter::Jitter;
use rope::FollowingRope;
use run_log::CellHere;
use shared_types::OperatingMode;
use shared_types::ipc::ControllerMode;
use snapshot::{ControllerView, Snapshot, StopView, note_stop};
use stage::Progress;
use std::net::SocketAddr;
use std::path::{Path, PathBuf};
use std::sync::{Arc, mpsc};
use std::time::{Duration, Instant};

/// Time between two states while a page is open, and while none is.
const TURN: Duration = Duration::from_millis(40);
const TURN_ALONE: Duration = Duration::from_millis(200);
/// Time between two looks for the answer to a request.
const ANSWERS: Duration = Duration::from_millis(5);
/// Time between two looks for a controller, and at the run folder.
const SEARCH: Duration = Duration::from_millis(500);
/// Time between two histograms.
const HISTOGRAMS: Duration = Duration::from_millis(500);

/// What to watch.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Wanted {
    /// Whichever controller started last, one after the other.
    Newest,
    /// This domain, whether anything runs there yet or not; results are in the folder,
    /// if it is known.
    Domain(String, Option<PathBuf>),
}

/// What is known of one controller.
#[derive(Debug, Default)]
struct Shown {
    jitter: Jitter,
    histograms_at: Option<Instant>,
    rope: Option<(FollowingRope, &'static str)>,
    stop: Option<StopView>,
    progress: Progress,
    /// Its run's folder, and once it has ended what came of it.
    folder: Option<PathBuf>,
    result: Option<String>,
    /// What it left in view.
    left: Snapshot,
}

impl Shown {
    /// What is said after its end.
    fn ended(&mut self) -> String {
        if self.result.is_none() {
            self.result = self.folder.as_deref().and_then(headline_of);
        }
        let result = self.result.as_ref().map(|said| format!(": {said}"));
        let report = self.folder.as_ref().map(|folder| folder.join(REPORT));
        let report = report.filter(|path| path.is_file());
        let report = report.map(|path| format!("; report `{}`", path.display()));
        let [result, report] = [result, report].map(Option::unwrap_or_default);
        format!("the run has ended{result}{report}; the next one is shown as soon as it begins")
    }
}

/// The watcher: call [`Watcher::turn`] until it is enough.
#[derive(Debug)]
pub struct Watcher {
    wanted: Wanted,
    /// Where a run does not tell its own.
    here: CellHere,
    site: Arc<Site>,
    asks: mpsc::Receiver<Requested>,
    open: Vec<Open>,
    attached: Option<Attached>,
    searched: Option<Instant>,
    shown: Shown,
    /// What was seen last, while there is a controller.
    seen: Option<Seen>,
    /// When the last turn was due.
    turned: Instant,
}

impl Watcher {
    /// Begins to serve, with what a desk offers beside; returns the page's address.
    ///
    /// # Errors
    /// Nothing can be listened to there, or the domain cannot be joined.
    pub fn start(
        wanted: Wanted,
        bind: SocketAddr,
        here: CellHere,
        desk: Option<Arc<dyn Desk>>,
    ) -> anyhow::Result<(Self, String)> {
        let (sender, asks) = mpsc::channel();
        let attached = match &wanted {
            Wanted::Newest => None,
            Wanted::Domain(domain, _) => Some(Attached::join(domain)?),
        };
        let (url, site) = http::serve(bind, sender, desk)?;
        let watcher = Self {
            wanted,
            here,
            site,
            asks,
            open: Vec::new(),
            attached,
            searched: None,
            shown: Shown::default(),
            seen: None,
            turned: Instant::now(),
        };
        Ok((watcher, url))
    }

    /// One turn: waits for requests until it is time, then looks and shows. Whether it looked
    /// for all there is, and nothing has to be joined anew.
    pub fn turn(&mut self) -> anyhow::Result<bool> {
        let turn = if self.site.is_followed() || self.site.wants_pictures() {
            TURN
        } else {
            TURN_ALONE
        };
        let until = self.turned + turn;
        self.turned = Instant::now().max(until);
        loop {
            while let Ok(requested) = self.asks.try_recv() {
                self.pass_on(requested);
            }
            self.open.retain(Open::is_open);
            let Some(left) = until.checked_duration_since(Instant::now()) else {
                break;
            };
            // A short wait where an answer is to come.
            let wait = if self.open.is_empty() {
                left
            } else {
                left.min(ANSWERS)
            };
            if let Ok(requested) = self.asks.recv_timeout(wait) {
                self.pass_on(requested);
            }
        }
        let search = self.searched.is_none_or(|at| at.elapsed() >= SEARCH);
        if search {
            self.searched = Some(Instant::now());
        }
        let (snapshot, whole) = self.look(search);
        if self.site.is_followed() {
            self.site.state.put(serde_json::to_string(&snapshot)?);
        }
        self.shown.left = snapshot;
        Ok(search && whole)
    }

    fn pass_on(&mut self, requested: Requested) {
        tracing::info!(ask = requested.ask.name(), "requested by a page");
        let attached = self.attached.as_ref();
        let controller = attached.and_then(|attached| attached.joined.controller.as_ref());
        let requests = controller.and_then(|controller| controller.requests.as_ref());
        self.open
            .extend(hand_over(requested, requests, self.seen.as_ref()));
    }

    /// Looks at everything once; whether nothing has to be joined anew.
    fn look(&mut self, search: bool) -> (Snapshot, bool) {
        if self.attached.is_none() && search {
            let domain = match &self.wanted {
                Wanted::Newest => newest_domain(),
                Wanted::Domain(domain, _) => Some(domain.clone()),
            };
            // One that ends between the two looks is no loss.
            self.attached = domain.and_then(|domain| Attached::join(&domain).ok());
        }
        let run = match &self.wanted {
            Wanted::Domain(_, run) => run.clone(),
            Wanted::Newest => None,
        };
        let attached = self.attached.as_mut();
        let had = attached
            .as_ref()
            .is_some_and(|a| a.joined.controller.is_some());
        let seen = attached.and_then(|a| a.look(search, run.as_deref()));
        match (had, seen) {
            // Nothing of the one before counts for it.
            (false, Some(_)) => self.shown = Shown::default(),
            (true, None) => self.end(),
            _ => {}
        }
        self.seen = seen;
        if let Err(error) = self.listen(search) {
            tracing::warn!("reconnecting: {error:#}");
            self.end();
            self.attached = None;
            return (self.snapshot(None), false);
        }
        (self.snapshot(seen), true)
    }

    /// Folder of the run that is shown, where it is known.
    pub fn run(&self) -> Option<&Path> {
        self.shown.folder.as_deref()
    }

    /// Watches something else from now on.
    ///
    /// # Errors
    /// Its domain cannot be joined.
    pub fn follow(&mut self, wanted: Wanted) -> anyhow::Result<()> {
        if self.wanted != wanted {
            self.attached = match &wanted {
                Wanted::Newest => None,
                Wanted::Domain(domain, _) => Some(Attached::join(domain)?),
            };
            (self.wanted, self.seen) = (wanted, None);
        }
        Ok(())
    }

    /// What a preview of the rope is to look at, through the calibration `named` or else that
    /// of the run; the page tells where there is none.
    pub fn preview_view(&mut self, named: Option<&Path>) -> Option<PreviewConfig> {
        let attached = self.attached.as_mut()?;
        let facts = attached.joined.controller.as_ref().map(|c| &c.facts);
        let camera = named.map(Path::to_owned);
        let camera = camera.or_else(|| facts?.camera_file());
        if let Some(film) = &mut attached.film {
            film.lacks_calibration = camera.is_none();
        }
        let cell = self.here.of_run(facts.and_then(|f| f.cell));
        Some(PreviewConfig::new(&attached.joined.domain, camera?, cell))
    }

    /// Whether a preview runs already, whoever started it.
    pub fn has_preview(&self) -> bool {
        let film = self.attached.as_ref().and_then(|a| a.film.as_ref());
        film.is_some_and(|film| film.preview.is_there())
    }

    /// The controller ended; the next may run elsewhere.
    fn end(&mut self) {
        self.seen = None;
        if self.wanted == Wanted::Newest {
            self.attached = None;
        }
    }

    /// Takes in everything that has been published.
    fn listen(&mut self, search: bool) -> anyhow::Result<()> {
        let Some(attached) = &mut self.attached else {
            return Ok(());
        };
        if let Some(controller) = attached.joined.controller.as_mut().filter(|_| search) {
            controller.facts.look();
        }
        let facts = attached.joined.controller.as_ref().map(|c| &c.facts);
        let pole = self.here.of_run(facts.and_then(|f| f.cell)).pole;
        let known = facts.and_then(|facts| facts.rope());
        let followed = self.shown.rope.as_ref().map(|(rope, _)| rope.params);
        if followed != known.map(|(rope, _)| rope) {
            self.shown.rope = known.map(|(rope, name)| (FollowingRope::new(rope, pole), name));
        }
        if let Some(cycles) = &attached.cycles {
            while let Some(cycle) = cycles.receive()? {
                self.shown.jitter.add(&cycle);
                note_stop(&mut self.shown.stop, cycle.fault, cycle.cycle);
            }
        }
        if let Some(joints) = &attached.joints {
            while let Some(report) = joints.receive()? {
                if let Some((rope, _)) = &mut self.shown.rope {
                    rope.report(report.stamp_ns, report.q);
                }
            }
        }
        let camera = facts.and_then(|facts| facts.camera.as_ref());
        let rope = self.shown.rope.as_ref();
        let nodes = rope.map_or(&[][..], |(rope, _)| rope.nodes());
        if let Some(film) = &mut attached.film
            && let Some(picture) = film.turn(self.site.wants_pictures(), camera, nodes)?
        {
            self.site.pictures.put(picture);
        }
        Ok(())
    }

    fn snapshot(&mut self, seen: Option<Seen>) -> Snapshot {
        let attached = self.attached.as_ref();
        let film = attached.and_then(|a| a.film.as_ref());
        let mut snapshot = Snapshot {
            missed: self.shown.jitter.missed,
            camera: film
                .and_then(|film| film.seen)
                .is_some_and(|at| at.elapsed() < Duration::from_secs(1)),
            asks: Ask::ALL
                .map(|ask| (ask, ask.objection(self.seen.as_ref())))
                .to_vec(),
            ..Snapshot::default()
        };
        let (Some(seen), Some(attached)) = (seen, attached) else {
            // The last one stays in view, said to be over.
            let left = std::mem::take(&mut self.shown.left);
            snapshot.title = match &self.wanted {
                Wanted::Domain(domain, _) => format!("domain {domain}"),
                Wanted::Newest => "no run".to_owned(),
            };
            snapshot.note = if left.arm.is_empty() {
                "no controller runs yet; it is shown as soon as one does".to_owned()
            } else {
                self.shown.ended()
            };
            return Snapshot {
                arm: left.arm,
                rope: left.rope,
                rope_is: left.rope_is,
                radii_m: left.radii_m,
                cell: left.cell,
                target_m: left.target_m,
                ..snapshot
            };
        };
        let facts = attached.joined.controller.as_ref().map(|c| &c.facts);
        snapshot.cell = self.here.of_run(facts.and_then(|f| f.cell));
        self.shown.folder = facts.and_then(|facts| facts.folder.clone());
        let name = self.shown.folder.as_ref().and_then(|f| f.file_name());
        snapshot.title = match name {
            Some(name) => format!("{} (domain {})", name.display(), attached.joined.domain),
            None => format!("domain {}", attached.joined.domain),
        };
        if !seen.alive {
            "the controller is silent: use the emergency stop".clone_into(&mut snapshot.note);
        }
        let state = &seen.state;
        note_stop(&mut self.shown.stop, state.fault, state.cycle);
        let mode = ControllerMode::from_raw(state.mode);
        let armed = OperatingMode::from_raw(state.operating_mode);
        snapshot.controller = Some(ControllerView {
            mode,
            operating_mode: armed,
            real_time: state.real_time != 0,
            cycle: state.cycle,
            alive: seen.alive,
            operator: seen.operator,
            stop: self.shown.stop.clone(),
        });
        let results = facts.and_then(|facts| facts.results());
        snapshot.stage = results.map(|found| self.shown.progress.stage(mode, armed, found));
        if mode != ControllerMode::Offline && state.q.is_finite() {
            snapshot.arm = arm_points(&state.q, &snapshot.cell.pole);
        }
        snapshot.target_m = facts.and_then(|facts| facts.target_m());
        match &self.shown.rope {
            Some((rope, name)) => {
                snapshot.rope = rope.nodes().iter().flat_map(tenths_mm).collect();
                snapshot.rope_is = name;
                snapshot.radii_m = [rope.params.radius_m, rope.params.lead_radius_m];
            }
            None => snapshot.rope_is = "no rope is identified yet",
        }
        let told = self.shown.histograms_at;
        if told.is_none_or(|at| at.elapsed() >= HISTOGRAMS) {
            self.shown.histograms_at = Some(Instant::now());
            snapshot.jitter = Some(self.shown.jitter.histograms());
        }
        snapshot
    }
}
