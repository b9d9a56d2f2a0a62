//! `wag check`: preflight of a plan.

use crate::cli::CheckArgs;
use crate::failure::{Failure, OrInput, Outcome};
use crate::files;
use crate::table;
use anyhow::{Context, anyhow, ensure};
use comfy_table::Table;
use serde_json::{Value, json};
use shared_types::Plan;
use shared_types::limits::{LimitKind, Margin};
use shared_types::plan::trajectory_hash_hex;
use std::path::Path;

/// Reads a plan and verifies that it is whole.
pub fn read_plan(path: &Path) -> anyhow::Result<Plan> {
    let fail = || format!("plan `{}`", path.display());
    let plan: Plan = serde_json::from_str(&files::read_text(path)?).with_context(fail)?;
    ensure!(
        trajectory_hash_hex(&plan.trajectory) == plan.trajectory_sha256,
        "plan `{}`: `trajectory_sha256` does not match the waypoints; the file was changed by hand or damaged, plan again",
        path.display()
    );
    Ok(plan)
}

fn kind_name(kind: LimitKind) -> &'static str {
    match kind {
        LimitKind::PositionMin => "position, lower",
        LimitKind::PositionMax => "position, upper",
        LimitKind::Velocity => "speed",
        LimitKind::Acceleration => "acceleration",
        LimitKind::TcpSpeed => "speed",
    }
}

/// The arm's own error code for breaking a limit, where it has one.
fn arm_code(kind: LimitKind) -> Option<&'static str> {
    match kind {
        LimitKind::PositionMin | LimitKind::PositionMax => Some("C23"),
        LimitKind::Velocity => Some("C24"),
        LimitKind::TcpSpeed => Some("C60"),
        LimitKind::Acceleration => None,
    }
}

fn margin_table(margins: &[Margin]) -> Table {
    let rows = margins.iter().map(|m| {
        let who = if m.joint == 0 {
            "tool".to_owned()
        } else {
            format!("joint {}", m.joint)
        };
        [
            format!("{who} {}", kind_name(m.kind)),
            format!("{:.3}", m.value),
            format!("{:.3}", m.limit),
            format!("{:.3}", m.time_s),
            format!("{:.1} %", 100.0 * m.left),
        ]
    });
    table::numbers(["limit", "extreme", "allowed", "at (s)", "left"], 0, rows)
}

pub fn run(args: &CheckArgs, quiet: bool) -> Outcome<Option<Value>> {
    let plan = read_plan(&args.plan).or_input()?;
    let limits = files::read_limits(args.limits.as_deref()).or_input()?;
    let margins = limits.margins(&plan.trajectory);
    let broken: Vec<&Margin> = margins
        .iter()
        .filter(|m| m.left.is_nan() || m.left < 0.0)
        .collect();
    if !quiet {
        println!("{}", margin_table(&margins));
    }
    if let Some(worst) = limits.worst_violation(&plan.trajectory) {
        let stop = arm_code(worst.kind).map_or_else(
            || "the controller would refuse it".to_owned(),
            |code| format!("the arm would stop with {code}"),
        );
        return Err(Failure::failed(anyhow!(
            "plan `{}` breaks {} of {} limits; the worst is {}: {stop}",
            args.plan.display(),
            broken.len(),
            margins.len(),
            worst.describe()
        )));
    }
    if !quiet {
        let tightest = margins.iter().min_by(|a, b| a.left.total_cmp(&b.left));
        println!(
            "All {} limits are kept. Tightest: {}.",
            margins.len(),
            tightest.map_or_else(String::new, Margin::describe)
        );
    }
    Ok(Some(
        json!({ "ok": true, "command": "check", "margins": margins }),
    ))
}
