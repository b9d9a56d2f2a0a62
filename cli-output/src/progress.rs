//! What people see while they wait: one line per stage, on standard error, and
//! only on a terminal does it move.

use crate::event::{Event, tell};
use crate::{is_interrupted, output};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::io::IsTerminal;
use std::ops::ControlFlow;
use std::time::{Duration, Instant};

/// One stage of a command.
#[derive(Debug)]
pub struct Stage {
    bar: ProgressBar,
    name: &'static str,
    began: Instant,
    plain: bool,
}

impl Stage {
    /// Begins a stage; `--json` hides it altogether.
    pub fn begin(name: &'static str) -> Self {
        tell(&Event::Stage {
            stage: name.to_owned(),
        });
        let quiet = output::is_json();
        let terminal = std::io::stderr().is_terminal();
        let bar = ProgressBar::new(0);
        bar.set_draw_target(if quiet || !terminal {
            ProgressDrawTarget::hidden()
        } else {
            ProgressDrawTarget::stderr()
        });
        let style = ProgressStyle::with_template("{spinner:.cyan} {prefix:<12} {wide_msg}")
            .unwrap_or_else(|_| ProgressStyle::default_spinner());
        bar.set_style(style);
        bar.set_prefix(name);
        bar.enable_steady_tick(Duration::from_millis(100));
        Self {
            bar,
            name,
            began: Instant::now(),
            plain: !quiet && !terminal,
        }
    }

    /// Shows a short message.
    pub fn say(&self, message: impl Into<String>) {
        let message = message.into();
        // Not more often than somebody reads.
        if self.bar.message() != message {
            tell(&Event::Progress {
                text: message.clone(),
            });
        }
        self.bar.set_message(message);
    }

    /// Shows how far along a long piece of work is.
    pub fn progress(&self, p: &shared_types::ipc::message::Progress) {
        if p.total > 0 {
            let width = 24usize;
            let filled = (width * p.done.min(p.total) as usize) / p.total as usize;
            self.say(format!(
                "{}{} {}/{}  {} {:.*}",
                "█".repeat(filled),
                "░".repeat(width - filled),
                p.done,
                p.total,
                p.label,
                // A count has no decimals.
                if p.value.fract() == 0.0 { 0 } else { 3 },
                p.value
            ));
        }
    }

    /// [`Self::progress`], and whether to go on: until somebody interrupts the program.
    pub fn go_on(&self, p: &shared_types::ipc::message::Progress) -> ControlFlow<()> {
        self.progress(p);
        if is_interrupted() {
            ControlFlow::Break(())
        } else {
            ControlFlow::Continue(())
        }
    }

    /// Ends the stage with its result; returns its duration (s).
    pub fn done(&self, result: &str) -> f64 {
        self.end('✔', result)
    }

    /// Ends a stage without what it was for, while the command goes on; returns its duration (s).
    pub fn failed(&self, why: &str) -> f64 {
        self.end('✘', why)
    }

    fn end(&self, mark: char, result: &str) -> f64 {
        let seconds = self.began.elapsed().as_secs_f64();
        tell(&Event::Done {
            stage: self.name.to_owned(),
            result: result.to_owned(),
        });
        let line = format!("{mark} {:<12} {result} ({seconds:.1} s)", self.name);
        if self.plain {
            eprintln!("{line}");
        }
        self.bar.println(&line);
        self.bar.finish_and_clear();
        seconds
    }
}

impl Drop for Stage {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}
