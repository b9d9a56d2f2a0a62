//! `wag record`: attaches to a running controller and records its cycles.

use crate::cli::RecordArgs;
use crate::failure::{Failure, OrInput, Outcome};
use crate::pipeline::RunFolder;
use crate::recording::{CYCLES_FILE, RecordingReport, RecordingThread, keep_cause};
use crate::session::{interrupted, watch_interrupts};
use anyhow::anyhow;
use serde_json::{Value, json};
use shared_types::ipc::Bus;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

pub fn run(args: &RecordArgs, quiet: bool) -> Outcome<Option<Value>> {
    if args.seconds.is_some_and(|s| !s.is_finite() || s <= 0.0) {
        return Err(Failure::input(anyhow!(
            "--seconds must be a number above zero"
        )));
    }
    // A wrong domain leaves no folder behind.
    Bus::join(&args.domain).or_input()?;
    watch_interrupts().or_failed()?;
    let folder = RunFolder::create(args.out.as_deref(), "record")?;
    let thread = RecordingThread::start(&args.domain, &folder.file(CYCLES_FILE)).or_failed()?;
    if !quiet {
        println!(
            "recording the controller of domain `{}` in {}; Ctrl-C ends it",
            args.domain,
            folder.path().display()
        );
    }
    let began = Instant::now();
    let over = || {
        args.seconds
            .is_some_and(|s| began.elapsed().as_secs_f64() >= s)
    };
    while !interrupted().load(Ordering::SeqCst) && !over() {
        std::thread::sleep(Duration::from_millis(20));
    }
    let report = thread.finish();
    let explanation = keep_cause(folder.path());
    let summary = json!({
        "ok": report.chunks > 0, "command": "record", "run": folder.path(), "domain": args.domain,
        "recording": report, "explanation": explanation,
    });
    crate::files::write_json(&folder.file("summary.json"), &summary).or_failed()?;
    judge(&report, &args.domain).map_err(Failure::failed)?;
    if !quiet {
        println!(
            "{:.1} MB; read it with `wag explain {}`",
            report.bytes as f64 / 1e6,
            folder.path().display()
        );
    }
    Ok(Some(summary))
}

fn judge(report: &RecordingReport, domain: &str) -> anyhow::Result<()> {
    match &report.disk_error {
        Some(error) => Err(anyhow!(
            "{} chunks could not be written ({error}); make room on the disk",
            report.unwritten_chunks
        )),
        None if report.chunks == 0 => Err(anyhow!(
            "nothing was recorded: no controller runs in domain `{domain}`"
        )),
        None => Ok(()),
    }
}
