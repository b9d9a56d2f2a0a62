//! The one run that is under way: a command as a child, what it tells, and the page as its
//! operator.

use crate::child;
use cli_output::event::Event;
use serde::Serialize;
use serde_json::Value;
use std::io::{BufRead, BufReader, Read, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStderr, ChildStdin, ChildStdout};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::Duration;
use viewer::report::headline_of;

/// Lines for people that are kept.
const LINES_MAX: usize = 60;
/// Most bytes of the object that it prints at its end.
const OBJECT_MAX: u64 = 1 << 24;
/// Questions that were asked.
static QUESTIONS: AtomicU64 = AtomicU64::new(1);
/// How long it may take to stop the arm and to keep its record, once it was asked to end.
const GRACE: Duration = Duration::from_secs(20);

/// A stage of the run.
#[derive(Debug, Clone, Serialize)]
struct StageLine {
    stage: String,
    /// What it does, or its result.
    text: String,
    is_done: bool,
}

/// What it waits for before the arm moves.
#[derive(Debug, Clone, Serialize)]
struct Question {
    /// No other question of this studio has it.
    number: u64,
    word: String,
    text: String,
}

/// What the command has told.
#[derive(Debug, Clone, Default, Serialize)]
pub(crate) struct Told {
    stages: Vec<StageLine>,
    question: Option<Question>,
    /// Whether the arm waits for the control to be held, or moves while it is.
    holds: bool,
    /// What it said to people.
    lines: Vec<String>,
    /// The object that it printed at its end.
    #[serde(skip)]
    object: Option<Value>,
}

impl Told {
    fn take(&mut self, line: &str) {
        match Event::of_line(line) {
            Some(Event::Stage { stage }) => self.stages.push(StageLine {
                stage,
                text: String::new(),
                is_done: false,
            }),
            Some(Event::Progress { text }) => {
                if let Some(last) = self.stages.iter_mut().rev().find(|s| !s.is_done) {
                    last.text = text;
                }
            }
            Some(Event::Done { stage, result }) => {
                if let Some(done) = self.stages.iter_mut().rev().find(|s| s.stage == stage) {
                    (done.text, done.is_done) = (result, true);
                }
            }
            Some(Event::Ask { word, text }) => {
                let number = QUESTIONS.fetch_add(1, Ordering::Relaxed);
                self.question = Some(Question { number, word, text });
            }
            Some(Event::Confirmed { .. }) => self.question = None,
            Some(Event::Hold) => self.holds = true,
            Some(Event::Release) => self.holds = false,
            None if line.trim().is_empty() => {}
            None => {
                if self.lines.len() == LINES_MAX {
                    self.lines.remove(0);
                }
                self.lines.push(line.trim_end().to_owned());
            }
        }
    }
}

type Shared = Arc<Mutex<Told>>;

fn locked(told: &Shared) -> MutexGuard<'_, Told> {
    told.lock().unwrap_or_else(PoisonError::into_inner)
}

/// A run under way, or one that has ended.
#[derive(Debug)]
pub(crate) struct Work {
    child: Child,
    operator: Option<ChildStdin>,
    told: Shared,
    readers: Vec<JoinHandle<()>>,
    /// Its folder.
    pub(crate) run: PathBuf,
    /// Its exit code, once it has ended.
    code: Option<i32>,
    /// What came of it, once it has ended well.
    headline: Option<String>,
}

/// What a page is told of it.
#[derive(Debug, Serialize)]
pub(crate) struct View {
    /// Name of its folder.
    run: String,
    is_over: bool,
    is_ok: bool,
    /// What came of it: one that ends well may have missed.
    headline: Option<String>,
    /// What went wrong.
    error: Option<String>,
    #[serde(flatten)]
    told: Told,
}

impl Work {
    /// Starts what a page asked for.
    ///
    /// # Errors
    /// The command cannot be started.
    pub(crate) fn begin(arguments: &[String], run: PathBuf) -> anyhow::Result<Self> {
        let mut child = child::start(arguments)?;
        let told = Shared::default();
        let mut readers = Vec::new();
        if let Some(stderr) = child.stderr.take() {
            let told = Arc::clone(&told);
            readers.push(std::thread::spawn(move || listen(stderr, &told)));
        }
        if let Some(stdout) = child.stdout.take() {
            let told = Arc::clone(&told);
            readers.push(std::thread::spawn(move || read_object(stdout, &told)));
        }
        Ok(Self {
            operator: child.stdin.take(),
            child,
            told,
            readers,
            run,
            code: None,
            headline: None,
        })
    }

    /// Looks whether it has ended; then all that it said is there.
    pub(crate) fn look(&mut self) {
        if self.code.is_none()
            && let Ok(Some(status)) = self.child.try_wait()
        {
            for reader in self.readers.drain(..) {
                let _ = reader.join();
            }
            self.operator = None;
            self.code = Some(status.code().unwrap_or(-1));
            self.headline = headline_of(&self.run).filter(|_| status.success());
            let mut told = locked(&self.told);
            (told.question, told.holds) = (None, false);
        }
    }

    pub(crate) const fn is_over(&self) -> bool {
        self.code.is_some()
    }

    pub(crate) fn view(&self) -> View {
        let told = locked(&self.told).clone();
        let object = told.object.clone().unwrap_or_default();
        let is_ok = self.code == Some(0);
        let said = object["error"].as_str().map(str::to_owned);
        let ended = || {
            self.code
                .map(|code| format!("it ended with exit code {code}"))
        };
        View {
            run: name_of(&self.run),
            is_over: self.is_over(),
            is_ok,
            headline: self.headline.clone(),
            error: (!is_ok).then(|| said.or_else(ended)).flatten(),
            told,
        }
    }

    /// The question of this number is answered, once, with the word that it asks for.
    ///
    /// # Errors
    /// It is not asked now.
    pub(crate) fn confirm(&mut self, number: Option<u64>) -> Result<(), &'static str> {
        let question = {
            let mut told = locked(&self.told);
            let asked = told.question.as_ref().map(|question| question.number);
            told.question.take_if(|_| asked == number)
        };
        let question = question.ok_or("nothing asks for that now")?;
        self.write(&format!("{}\n", question.word))
    }

    /// The control is held. What comes while nothing waits for it, or moves, is not passed on.
    ///
    /// # Errors
    /// Nothing runs.
    pub(crate) fn hold(&mut self) -> Result<(), &'static str> {
        if locked(&self.told).holds {
            self.write("\n")
        } else {
            Ok(())
        }
    }

    /// Its process.
    pub(crate) fn process(&self) -> u32 {
        self.child.id()
    }

    fn write(&mut self, line: &str) -> Result<(), &'static str> {
        let operator = self.operator.as_mut().ok_or("nothing runs")?;
        let written = operator.write_all(line.as_bytes());
        written.map_err(|_gone| "the run is ending")
    }

    /// Asks it to end, as Ctrl-C would: the arm is stopped, the record kept.
    pub(crate) fn interrupt(&self) {
        if !self.is_over() {
            child::interrupt(&self.child);
        }
    }
}

impl Drop for Work {
    fn drop(&mut self) {
        if !self.is_over() {
            child::end(&mut self.child, GRACE);
        }
    }
}

/// The name of a folder.
pub(crate) fn name_of(folder: &Path) -> String {
    let name = folder.file_name().unwrap_or_default();
    name.to_string_lossy().into_owned()
}

fn listen(stderr: ChildStderr, told: &Shared) {
    for line in BufReader::new(stderr).split(b'\n').map_while(Result::ok) {
        locked(told).take(&String::from_utf8_lossy(&line));
    }
}

fn read_object(stdout: ChildStdout, told: &Shared) {
    let mut text = String::new();
    let read = stdout.take(OBJECT_MAX).read_to_string(&mut text);
    if read.is_ok() {
        locked(told).object = serde_json::from_str(&text).ok();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn events_become_stages_and_a_question_and_the_rest_lines() {
        let mut told = Told::default();
        for line in [
            "\u{1e}{\"event\":\"stage\",\"stage\":\"bring-up\"}",
            "\u{1e}{\"event\":\"ask\",\"word\":\"WIGGLE\",\"text\":\"clear?\"}",
            "warning: dark",
            "",
            "\u{1e}{\"event\":\"progress\",\"text\":\"moving\"}",
        ] {
            told.take(line);
        }
        assert_eq!(told.stages[0].text, "moving");
        assert_eq!(told.question.as_ref().unwrap().word, "WIGGLE");
        assert_eq!(told.lines, ["warning: dark"]);
        told.take("\u{1e}{\"event\":\"confirmed\",\"word\":\"WIGGLE\"}");
        told.take("\u{1e}{\"event\":\"hold\"}");
        assert!(told.question.is_none() && told.holds);
        told.take("\u{1e}{\"event\":\"done\",\"stage\":\"bring-up\",\"result\":\"there\"}");
        told.take("\u{1e}{\"event\":\"release\"}");
        assert!(told.stages[0].is_done && told.stages[0].text == "there" && !told.holds);
        for i in 0..200 {
            told.take(&format!("line {i}"));
        }
        assert_eq!(told.lines.len(), LINES_MAX);
    }
}
