//! How a program begins and ends: its log, a wrong command line, Ctrl-C, its exit code.

use crate::{Outcome, output};
use anyhow::Context;
use clap::error::ErrorKind;
use clap::{Arg, Command, Parser};
use serde_json::{Value, json};
use std::ffi::OsString;
use std::io::IsTerminal;
use std::process::ExitCode;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::Duration;
use tracing_subscriber::filter::Targets;
use tracing_subscriber::prelude::*;

/// A seed on the command line.
///
/// # Errors
/// What a seed is.
pub fn seed(text: &str) -> Result<u64, String> {
    text.parse()
        .map_err(|_e| "a seed is a whole number from 0 to 18446744073709551615".to_owned())
}

/// Reads the command line `args`, the program's name first. A number with a minus before it is
/// a value wherever one may stand, so that its option says what it takes.
///
/// # Errors
/// What [`refuse_usage`] prints.
pub fn parse<C: Parser>(args: impl IntoIterator<Item = OsString>) -> Result<C, clap::Error> {
    let args: Vec<OsString> = args.into_iter().collect();
    let mut command = with_negative_numbers(C::command());
    // What is named goes into JSON files, which are UTF-8.
    if let Some(arg) = args.iter().find(|arg| arg.to_str().is_none()) {
        let message = format!("`{}` is not UTF-8: rename it", arg.display());
        return Err(command.error(ErrorKind::InvalidUtf8, message));
    }
    let mut found = command.try_get_matches_from_mut(args)?;
    C::from_arg_matches_mut(&mut found).map_err(|error| error.format(&mut command))
}

/// Without it `-1` is taken for an option of that name, and refused as an unknown one.
fn with_negative_numbers(command: Command) -> Command {
    let number = |arg: Arg| {
        let takes = arg.get_action().takes_values();
        arg.allow_negative_numbers(takes)
    };
    command
        .mut_args(number)
        .mut_subcommands(with_negative_numbers)
}

/// Prints what `--json` asks for, and why the command failed; returns the exit code.
pub fn finish(outcome: Outcome<Option<Value>>) -> ExitCode {
    let code = match outcome {
        Ok(result) => {
            if let Some(value) = result {
                output::object(&value);
            }
            0
        }
        Err(failure) => {
            output::object(&json!({ "ok": false, "error": failure.to_string() }));
            eprintln!("error: {failure}");
            failure.exit_code()
        }
    };
    ExitCode::from(match output::failure() {
        Some(reason) => {
            eprintln!("error: cannot write to standard output: {reason}");
            code.max(1)
        }
        None => code,
    })
}

/// Help, version or a wrong command line; `--json` counts even there.
pub fn refuse_usage(error: &clap::Error) -> ExitCode {
    let text = error.render();
    if !error.use_stderr() {
        print!("{text}");
        return ExitCode::SUCCESS;
    }
    output::set_json(std::env::args_os().any(|arg| arg == "--json"));
    let plain = text.to_string();
    let said = plain.trim().strip_prefix("error: ").unwrap_or(&plain);
    output::object(&json!({ "ok": false, "error": said }));
    if std::io::stderr().is_terminal() {
        eprint!("{}", text.ansi());
    } else {
        eprint!("{text}");
    }
    ExitCode::from(2)
}

/// Begins a command: what it prints is for programs or for people, and it logs to standard
/// error; `WAG_LOG` sets the filter (`debug`, `planner=trace`).
pub fn start(json: bool, verbose: u8) {
    output::set_json(json);
    let own = match verbose {
        0 => "warn",
        1 => "info",
        _ => "debug",
    };
    // What others say of their own insides helps nobody but who looks for everything.
    let others = match verbose {
        0 | 1 => {
            ",iceoryx2=error,foxglove=off,rustdds=error,tract_onnx=error,calib_targets_charuco=error,calib_targets_chessboard=error"
        }
        _ => "",
    };
    let default = format!("{own}{others}");
    let filter: Targets = std::env::var("WAG_LOG")
        .ok()
        .and_then(|text| text.parse().ok())
        .unwrap_or_else(|| default.parse().unwrap_or_default());
    tracing_subscriber::registry()
        .with(filter)
        .with(
            tracing_subscriber::fmt::layer()
                .with_writer(std::io::stderr)
                .with_ansi(std::io::stderr().is_terminal()),
        )
        .init();
}

static INTERRUPTED: AtomicBool = AtomicBool::new(false);

/// Lets Ctrl-C and SIGTERM end the command in order instead of at once.
///
/// # Errors
/// When the signals are watched for already or the system refuses.
pub fn watch_interrupts() -> anyhow::Result<()> {
    ctrlc::set_handler(|| {
        let is_first = !INTERRUPTED.swap(true, Ordering::SeqCst);
        // Stopping an arm and its processes takes seconds during which nothing else is printed.
        if is_first && std::io::stderr().is_terminal() {
            eprintln!("\nending");
        }
    })
    .context("cannot watch for Ctrl-C")
}

/// Whether Ctrl-C or SIGTERM has come.
pub fn is_interrupted() -> bool {
    INTERRUPTED.load(Ordering::SeqCst)
}

/// The flag that Ctrl-C and SIGTERM set.
pub fn interrupted() -> &'static AtomicBool {
    &INTERRUPTED
}

/// How often the parent is looked for.
const PARENT_EVERY: Duration = Duration::from_millis(100);

/// Sets the stop flag when the parent is gone, `outlives` later, and ends the process if it
/// does not manage to end itself.
///
/// # Errors
/// When the system refuses another thread.
pub fn watch_parent(
    parent: Option<u32>,
    outlives: Duration,
    end_within: Duration,
) -> anyhow::Result<()> {
    thread::Builder::new()
        .name("parent-watch".to_owned())
        .spawn(move || {
            loop {
                thread::sleep(PARENT_EVERY);
                if parent.is_some_and(|p| std::os::unix::process::parent_id() != p) {
                    tracing::warn!("the parent process is gone, ending");
                    thread::sleep(outlives);
                    INTERRUPTED.store(true, Ordering::SeqCst);
                }
                if INTERRUPTED.load(Ordering::SeqCst) {
                    thread::sleep(end_within);
                    tracing::warn!("not ended in time, exiting");
                    std::process::exit(1);
                }
            }
        })
        .context("cannot start the parent watch")?;
    Ok(())
}
