//! `wag record`: attaches to a running controller and records its cycles.

use crate::cli::{RecordArgs, RecordCommand};
use crate::config;
use crate::pipeline::RunFolder;
use anyhow::Context;
use arm_model::Limits;
use cli_output::{OrInput, Outcome, is_interrupted, watch_interrupts};
use run_log::files;
use run_log::{Recorded, RecorderConfig, Run, RunFileThread};
use serde_json::{Value, json};
use session::remedy;
use shared_types::ipc::{Bus, DomainSweep, running_controllers};
use std::path::Path;
use std::time::{Duration, Instant};
use viewer::live::domain_of_run;
use viewer::report::simulated_rope;

/// `wag record recover`: a file without its end becomes a whole one.
fn recover(path: &Path) -> Outcome<Option<Value>> {
    let found = run_log::recover(path).or_input()?;
    let file = path.display();
    if found.was_whole {
        println!(
            "`{file}` is whole: {} messages, {} s",
            found.messages, found.span_s
        );
    } else {
        println!(
            "`{file}` is whole again: {} messages, {} s; left out: {} damaged chunks, {} bytes at the end",
            found.messages, found.span_s, found.damaged, found.cut_bytes
        );
    }
    Ok(Some(json!({
        "ok": true, "command": "record recover", "file": path, "recovered": found,
    })))
}

pub fn run(args: &RecordArgs) -> Outcome<Option<Value>> {
    if let Some(RecordCommand::Recover { file }) = &args.instead {
        return recover(file);
    }
    if let Some(out) = &args.out {
        RunFolder::refuse_existing(out)?;
    }
    let limits = config::here::<Limits>(args.limits.as_deref()).or_input()?;
    let here = config::cell().or_input()?;
    let domain = chosen_domain(args)?;
    let cell = match &args.run {
        Some(run) => config::cell_of(&Run::open(run).or_input()?).or_input()?,
        None => here,
    };
    // Goes last, so that no file of the domain stays when this was its last user.
    let _sweep = DomainSweep::new(&domain);
    // A wrong domain leaves no folder behind.
    Bus::join(&domain).or_input()?;
    watch_interrupts().or_failed()?;
    let folder = RunFolder::create(args.out.as_deref(), "record")?;
    let config = RecorderConfig::of_run(&domain, &folder.path, &limits, cell);
    let recorder = RunFileThread::start(config).or_failed()?;
    println!(
        "recording the controller of domain `{domain}` in {}; Ctrl-C ends it",
        folder.path.display()
    );
    let began = Instant::now();
    let over = || {
        args.seconds
            .is_some_and(|s| began.elapsed().as_secs_f64() >= s)
    };
    while !is_interrupted() && !over() && !recorder.has_died() {
        std::thread::sleep(Duration::from_millis(20));
    }
    let recorded = recorder.stop();
    let counts = recorded.as_ref().ok().map(Recorded::counts);
    if counts.is_some_and(|counts| counts.chunks == 0) {
        // An empty folder goes by itself.
        let _ = std::fs::remove_file(folder.file(files::RUN));
        return Err(failed!(
            "nothing was recorded: no controller runs in domain `{domain}`; {}",
            those_that_run(&running_controllers())
        ));
    }
    let cell_kept = folder.config("cell", &cell);
    let explanation = Run::open(&folder.path).or_failed()?.keep_cause();
    let mut summary = json!({
        "ok": recorded.is_ok(), "command": "record", "run": folder.path, "domain": domain,
        "recording": counts, "explanation": explanation,
    });
    if let Err(reason) = &recorded {
        summary["error"] = format!("{reason:#}").into();
    }
    let summary_kept = files::write_json(&folder.file(files::SUMMARY), &summary);
    // What became of the recording says more than what could not be written next to it.
    recorded
        .and_then(|recorded| recorded.finish(simulated_rope))
        .with_context(|| remedy(&folder.file(files::RUN)))
        .or_failed()?;
    cell_kept.or_failed()?;
    summary_kept.or_failed()?;
    if let Some(counts) = counts {
        println!(
            "{:.1} MB; read it with `wag explain {}`, or open its {}",
            counts.bytes as f64 / 1e6,
            folder.path.display(),
            files::RUN
        );
    }
    Ok(Some(summary))
}

/// The domain to record: named, of a run folder, or of the only controller there is.
fn chosen_domain(args: &RecordArgs) -> Outcome<String> {
    if let Some(domain) = &args.domain {
        return Ok(domain.clone());
    }
    let Some(run) = &args.run else {
        let running = running_controllers();
        return match running.as_slice() {
            [only] => Ok(only.clone()),
            _ => Err(failed!("{}", those_that_run(&running))),
        };
    };
    let domain = domain_of_run(run).or_input()?;
    let running = running_controllers();
    if !running.contains(&domain) {
        return Err(failed!(
            "the controller of run `{}` does not run any more; {}",
            run.display(),
            those_that_run(&running)
        ));
    }
    Ok(domain)
}

fn those_that_run(domains: &[String]) -> String {
    if domains.is_empty() {
        return "no controller of yours runs on this machine; start one, or name the domain of one that is still to come with --domain".to_owned();
    }
    format!(
        "controllers of these domains run: {}; name one with --domain",
        domains.join(", ")
    )
}
