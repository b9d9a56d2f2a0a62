//! Whichever controller is wanted, attached to as long as it runs.

use anyhow::Result;
use cli_output::eprintln;
use run_log::{CellHere, Feed, LatestResults, Sink, StandingScene};
use std::path::Path;
use std::time::{Duration, Instant};
use viewer::live::{Joined, Wanted, newest_domain};

/// Time between two looks for a controller, and at the run folder.
const SEARCH: Duration = Duration::from_millis(500);
/// What does not change is told so often, for those who come late.
const TELL_AGAIN: Duration = Duration::from_secs(1);
/// Most pictures a second: as many as the page of `wag watch` shows.
const PICTURES_HZ: f64 = 15.0;
/// Pictures compressed before everything else is looked at again.
const PICTURES_AT_ONCE: usize = 1;

/// One domain. Fields are dropped in order: subscriptions, connection.
#[derive(Debug)]
struct Attached {
    feed: Feed,
    joined: Joined,
    /// The process of the controller that was there last.
    controller: Option<u32>,
}

/// The messages of the run that is wanted.
#[derive(Debug)]
pub struct Source {
    wanted: Wanted,
    /// Where a run does not tell its own cell.
    here: CellHere,
    attached: Option<Attached>,
    searched: Option<Instant>,
    told: Option<Instant>,
    /// Scene and results of the run that is told, and after its end of the one that was.
    scene: Option<StandingScene>,
    results: Option<LatestResults>,
    /// Why nothing could be attached to, as it was said last.
    said: String,
}

impl Source {
    /// Joins the domain that is wanted, if it is a certain one.
    ///
    /// # Errors
    /// The domain cannot be joined, or too many listen there already.
    pub fn new(wanted: Wanted, here: CellHere) -> Result<Self> {
        let mut source = Self {
            wanted,
            here,
            attached: None,
            searched: None,
            told: None,
            scene: None,
            results: None,
            said: String::new(),
        };
        if let Wanted::Domain(domain, _) = &source.wanted {
            source.attached = Some(source.attach(&domain.clone())?);
        }
        Ok(source)
    }

    fn attach(&self, domain: &str) -> Result<Attached> {
        let joined = Joined::join(domain)?;
        // Whoever was killed while it listened is not in the way.
        joined.bus().remove_leftovers();
        let pole = self.here.of_run(None).pole;
        let feed = Feed::open(joined.bus(), pole, PICTURES_HZ)?;
        Ok(Attached {
            feed,
            joined,
            controller: None,
        })
    }

    /// Hands what has arrived to the sink. A run that has ended is let go, and so is a connection
    /// that fails: what is wanted is attached to anew as soon as it is there.
    ///
    /// # Errors
    /// Those of the sink.
    pub fn turn(&mut self, sink: &mut impl Sink) -> Result<()> {
        let search = due(&mut self.searched, SEARCH);
        if self.attached.is_none() && search {
            self.search();
        }
        if let Err(reason) = self.follow(search, sink) {
            self.say(format!("{reason:#}"));
            self.attached = None;
        }
        if due(&mut self.told, TELL_AGAIN) {
            self.tell_again(sink)?;
        }
        Ok(())
    }

    fn search(&mut self) {
        let domain = match &self.wanted {
            Wanted::Newest => newest_domain(),
            Wanted::Domain(domain, _) => Some(domain.clone()),
        };
        match domain.map(|domain| self.attach(&domain)).transpose() {
            Ok(attached) => self.attached = attached,
            Err(reason) => self.say(format!("{reason:#}")),
        }
    }

    /// Says a reason once.
    fn say(&mut self, reason: String) {
        if self.said != reason {
            eprintln!("warning: not attached: {reason}");
            self.said = reason;
        }
    }

    /// Looks for the controller, and hands on what has arrived.
    fn follow(&mut self, search: bool, sink: &mut impl Sink) -> Result<()> {
        let run = match &self.wanted {
            Wanted::Domain(_, run) => run.as_deref(),
            Wanted::Newest => None,
        };
        let Some(attached) = &mut self.attached else {
            return Ok(());
        };
        let there = attached.joined.has_controller(search, run);
        let now = attached.joined.pid().filter(|_| there);
        let ended = attached.controller.is_some() && now.is_none();
        if now.is_some() && now != attached.controller {
            let folder = attached.joined.facts().and_then(|f| f.folder.as_deref());
            self.results = folder.map(LatestResults::of);
            attached.feed.begin_anew();
            sink.begin_anew()?;
            self.told = None;
        }
        attached.controller = now;
        if let Some(facts) = attached
            .joined
            .facts()
            .filter(|_| search || self.told.is_none())
        {
            let scene = StandingScene {
                pole: self.here.of_run(facts.cell).pole,
                target_m: facts.target_m(),
                camera: facts.camera.clone(),
            };
            attached.feed.set_pole(scene.pole);
            self.scene = Some(scene);
        }
        attached.feed.turn(PICTURES_AT_ONCE, sink)?;
        if ended {
            eprintln!("the run has ended; what begins next is shown as soon as it does");
        }
        if ended && self.wanted == Wanted::Newest {
            self.attached = None;
        }
        Ok(())
    }

    /// Tells what does not change, and the results, which are written until after the run's end.
    fn tell_again(&mut self, sink: &mut impl Sink) -> Result<()> {
        if let Some(scene) = &self.scene {
            scene.tell(sink)?;
        }
        let mut results = self.results.iter_mut();
        results.try_for_each(|results| results.tell(sink))
    }

    /// Folder of the run that is told, where it is known.
    pub fn run(&self) -> Option<&Path> {
        self.results.as_ref().map(LatestResults::folder)
    }
}

/// Whether it is time again.
fn due(last: &mut Option<Instant>, every: Duration) -> bool {
    let due = last.is_none_or(|at| at.elapsed() >= every);
    if due {
        *last = Some(Instant::now());
    }
    due
}
