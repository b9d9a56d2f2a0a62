//! `wag doctor`: whether this machine is fit to drive an arm.

use super::network::network;
use crate::cli::ArmPorts;
use crate::config;
use arm_model::{JOINTS, Limits};
use cli_output::{OrInput, Outcome, output, table};
use doctor::{Finding, Machine, Verdict, inputs, judge_line, settings};
use rt_controller::ControllerConfig;
use run_log::files;
use serde_json::{Value, json};
use std::net::{IpAddr, SocketAddr};

pub fn run(address: Option<IpAddr>, ports: &ArmPorts) -> Outcome<Option<Value>> {
    let mut findings = Machine::here().judge();
    findings.push(network_finding());
    if let Some(ip) = address {
        let reports = [ports.report_port, ports.status_port];
        let limits = config::here::<Limits>(None).or_input()?;
        let plans_m_s = limits.tcp_speed_max_m_s;
        let (line, is_real) = judge_line(ip, ports.command_port, &reports, plans_m_s);
        let reports = |f: &Finding| f.name == "report port" && f.verdict != Verdict::Fail;
        let answers = line.iter().any(reports);
        if is_real {
            findings.iter_mut().for_each(Finding::require_of_a_real_arm);
        }
        findings.extend(line);
        findings.push(response_finding(ip, is_real)?);
        if answers {
            let config: ControllerConfig = config::here(None).or_input()?;
            let (wanted, tool_m) = (&config.arm_settings, limits.tcp_offset_m);
            let at = |port| SocketAddr::new(ip, port);
            findings.push(settings(at(ports.status_port), wanted, tool_m));
            findings.push(inputs(at(ports.command_port), config.enabling_input));
        }
    }
    let is_failed = |f: &&Finding| f.verdict == Verdict::Fail;
    let failed = findings.iter().filter(is_failed).count();
    show(&findings);
    let value = json!({ "ok": failed == 0, "command": "doctor", "findings": findings });
    if failed == 0 {
        return Ok(Some(value));
    }
    output::object(&value);
    Err(failed!(
        "{failed} of {} checks failed; remedies are listed above",
        findings.len()
    ))
}

/// Whether it is known how the arm follows its setpoints; wiggles and throws of a real one are
/// refused otherwise.
fn response_finding(ip: IpAddr, is_real: bool) -> Outcome<Finding> {
    let name = "arm response";
    let mut places = config::arm_response_files().or_input()?;
    let remedy = format!(
        "measure it with `wag latency --arm {ip} --response FILE`, FILE being arm-response.toml in the folder of configurations"
    );
    let Some(path) = places.find(|file| file.try_exists().unwrap_or(true)) else {
        let verdict = Verdict::fail_unless(!is_real);
        let found = "not measured".to_owned();
        return Ok(Finding::new(name, verdict, found, &remedy));
    };
    let (verdict, found) = match files::read_arm_response(&path) {
        Ok(response) => {
            let known = response.joints.iter().filter(|j| j.lag().is_some());
            let (known, source) = (known.count(), &response.source);
            let found = format!(
                "`{}`: {known} of {JOINTS} joints, of {source}",
                path.display()
            );
            (Verdict::Pass, found)
        }
        Err(reason) => (Verdict::Fail, reason.to_string()),
    };
    Ok(Finding::new(name, verdict, found, &remedy))
}

/// Whether the network that reads a film can be loaded.
fn network_finding() -> Finding {
    let (verdict, found) = match network(None) {
        Ok(_) => (Verdict::Pass, "built in, loads".to_owned()),
        Err(reason) => (Verdict::Fail, reason.to_string()),
    };
    let remedy = "this build is damaged: install it again";
    Finding::new("network", verdict, found, remedy)
}

fn show(findings: &[Finding]) {
    let rows = findings.iter().map(|f| {
        let (name, word) = (f.name.to_owned(), f.verdict.word().to_owned());
        [name, word, f.found.clone()]
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
