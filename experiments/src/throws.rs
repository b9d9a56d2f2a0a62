//! `experiments throws`: the library of throws that plans of strikes begin with.

use crate::args::ThrowsArgs;
use anyhow::anyhow;
use cli_output::{Failure, Machine, OrInput, Outcome, Stage, is_interrupted};
use planner::plan::{LibraryOptions, ThrowLibrary};
use run_log::files;
use serde_json::{Value, json};
use std::ops::ControlFlow;

/// Makes a library and writes it. The value is what `--json` prints.
pub fn run(args: &ThrowsArgs) -> Outcome<Option<Value>> {
    cli_output::watch_interrupts().or_failed()?;
    let options = LibraryOptions {
        seed: args.seed,
        searches: args.searches,
        kept: args.kept.into(),
    };
    let threads = args.threads.map_or(Machine::here().cores, usize::from);
    files::check_writable(&args.out).or_input()?;
    let stage = Stage::begin("throws");
    let library = ThrowLibrary::make(options, threads, &mut |progress| {
        stage.progress(&progress);
        if is_interrupted() {
            return ControlFlow::Break(());
        }
        ControlFlow::Continue(())
    })
    .or_failed()?;
    if is_interrupted() {
        return Err(Failure::failed(anyhow!("interrupted: nothing is written")));
    }
    let bytes = library.to_bytes().or_failed()?;
    files::write_atomic(&args.out, &bytes).or_failed()?;
    let seconds = stage.done(&format!(
        "{} throws, {:.1} MB, in `{}`",
        library.len(),
        1e-6 * bytes.len() as f64,
        args.out.display()
    ));
    Ok(Some(json!({
        "ok": true, "command": "throws", "options": options, "throws": library.len(),
        "bytes": bytes.len(), "out": args.out, "seconds": seconds,
    })))
}
