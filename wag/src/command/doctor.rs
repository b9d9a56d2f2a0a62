//! `wag doctor`: whether this machine is fit to drive an arm.

use super::network::network;
use crate::cli::DoctorArgs;
use crate::doctor::{ArmLine, Facts, Finding, Verdict, judge, judge_line};
use anyhow::anyhow;
use cli_output::{Failure, Outcome, output, table};
use serde_json::{Value, json};
use std::path::Path;

pub fn run(args: &DoctorArgs, quiet: bool) -> Outcome<Option<Value>> {
    let facts = Facts::read(Path::new("/")).with_processor_and_room(Path::new("."));
    let mut findings = judge(&facts);
    findings.push(network_finding());
    if let Some(ip) = args.address {
        let ports = [args.ports.report_port, args.ports.status_port];
        findings.extend(judge_line(&ArmLine::measure(
            ip,
            args.ports.command_port,
            &ports,
        )));
    }
    let failed = findings
        .iter()
        .filter(|f| f.verdict == Verdict::Fail)
        .count();
    if !quiet {
        show(&findings);
    }
    let value = json!({ "ok": failed == 0, "command": "doctor", "findings": findings });
    if failed == 0 {
        return Ok(Some(value));
    }
    if quiet {
        output::object(&value);
    }
    Err(Failure::failed(anyhow!(
        "{failed} of {} checks failed; remedies are listed above",
        findings.len()
    )))
}

/// Whether the network that reads a film can be loaded.
fn network_finding() -> Finding {
    let (verdict, found, remedy) = match network(None) {
        Ok(_) => (Verdict::Pass, "built in, loads".to_owned(), ""),
        Err(reason) => (
            Verdict::Fail,
            reason.to_string(),
            "this build is damaged: install it again",
        ),
    };
    Finding {
        name: "network",
        verdict,
        found,
        remedy: remedy.to_owned(),
    }
}

fn show(findings: &[Finding]) {
    let rows = findings.iter().map(|f| {
        [
            f.name.to_owned(),
            f.verdict.word().to_owned(),
            f.found.clone(),
        ]
    });
    println!("{}", table::numbers(["check", "", "found"], 2, rows));
    let wrong: Vec<&Finding> = findings.iter().filter(|f| !f.remedy.is_empty()).collect();
    if !wrong.is_empty() {
        println!("\nWhat to do:");
    }
    for finding in wrong {
        println!("  {}: {}", finding.name, finding.remedy);
    }
}
