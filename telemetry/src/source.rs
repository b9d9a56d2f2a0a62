//! Whichever controller is wanted, attached to as long as it runs.

use anyhow::Result;
use run_log::{CellHere, Feed, Sink};
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
        Ok(Attached { feed, joined })
    }

    /// Hands what has arrived to the sink. What cannot be read any more is attached to anew.
    ///
    /// # Errors
    /// Those of the sink.
    pub fn turn(&mut self, sink: &mut impl Sink) -> Result<()> {
        let search = due(&mut self.searched, SEARCH);
        if self.attached.is_none() && search {
            let domain = match &self.wanted {
                Wanted::Newest => newest_domain(),
                Wanted::Domain(domain, _) => Some(domain.clone()),
            };
            // One that ends between the two looks is no loss.
            self.attached = domain.and_then(|domain| self.attach(&domain).ok());
            self.told = None;
        }
        let run = match &self.wanted {
            Wanted::Domain(_, run) => run.as_deref(),
            Wanted::Newest => None,
        };
        let Some(attached) = &mut self.attached else {
            return Ok(());
        };
        let runs = attached.joined.has_controller(search, run);
        attached.feed.turn(PICTURES_AT_ONCE, sink)?;
        if !runs {
            if search && self.wanted == Wanted::Newest {
                self.attached = None;
            }
            return Ok(());
        }
        if due(&mut self.told, TELL_AGAIN)
            && let Some(facts) = attached.joined.facts()
        {
            attached.feed.set_pole(self.here.of_run(facts.cell).pole);
            let (target_m, camera) = (facts.target_m(), facts.camera.as_ref());
            attached.feed.scene(target_m, camera, sink)?;
            if let Some(folder) = &facts.folder {
                attached.feed.results(folder, sink)?;
            }
        }
        Ok(())
    }

    /// Folder of the run that is told, where it is known.
    pub fn run(&self) -> Option<&Path> {
        let facts = self.attached.as_ref()?.joined.facts()?;
        facts.folder.as_deref()
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
