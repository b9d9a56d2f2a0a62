//! The page where one works: a target set by a click, a wiggle, a plan to look at, a throw,
//! its result, and the runs before.
//!
//! Nothing here moves an arm. What a page asks for is a command of `wag` that runs as a child,
//! as it would in a terminal; the page is its operator: it answers what the command asks, and
//! its hold-to-run control lets the arm move only while it is held. A page that falls silent
//! has let go. Other machines may look and stop, not more.

mod child;
mod desk;
mod history;
mod job;
mod page;
mod preview;
mod reach;
mod rig;
mod settings;
mod work;

pub use preview::Preview;
pub use settings::{Cell, Settings};

use desk::Workplace;
use std::net::SocketAddr;
use std::sync::Arc;
use viewer::live::{Wanted, Watcher};

/// The studio: call [`Studio::turn`] until it is enough. Dropped, it ends the work that is
/// under way, as Ctrl-C would, and then its rig.
#[derive(Debug)]
pub struct Studio {
    watcher: Watcher,
    workplace: Arc<Workplace>,
}

impl Studio {
    /// Begins to serve; returns the page's address.
    ///
    /// # Errors
    /// Nothing can be listened to there, or the simulated rig does not start.
    pub fn start(settings: Settings, bind: SocketAddr) -> anyhow::Result<(Self, String)> {
        let here = settings.here;
        let workplace = Arc::new(Workplace::open(settings)?);
        let wanted = Wanted::Domain(workplace.domain(), None);
        let desk = Arc::clone(&workplace);
        let (watcher, url) = Watcher::start(wanted, bind, here, Some(desk))?;
        Ok((Self { watcher, workplace }, url))
    }

    /// Looks at everything once.
    ///
    /// # Errors
    /// A state cannot be told.
    pub fn turn(&mut self) -> anyhow::Result<()> {
        self.watcher.turn()?;
        self.workplace.look();
        // Its own run's controller, never another: the page's stop goes there.
        let domain = self.workplace.domain();
        self.watcher.follow(Wanted::Domain(domain, None))
    }
}

impl Drop for Studio {
    fn drop(&mut self) {
        self.workplace.close();
    }
}
