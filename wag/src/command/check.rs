//! `wag check`: preflight of a plan.

use crate::cli::CheckArgs;
use crate::config;
use anyhow::ensure;
use arm_model::Limits;
use arm_model::limits::{LimitKind, Margin, TOOL_SPEED_RATED_M_S};
use cli_output::{OrInput, Outcome, output, table};
use comfy_table::Table;
use planner::preflight::{Fence, JudgedArm, RuleMargin, arm_margins, first_stop, tool_contact_s};
use run_log::files::read_plan;
use serde_json::{Value, json};

/// What a limit is about, and what is left of it: of a range, the way to its end.
fn kind_and_left(m: &Margin) -> (&'static str, String) {
    let to_end = |rad: f64| format!("{:.1} deg", rad.to_degrees());
    let left = format!("{:.1} %", 100.0 * m.left);
    match m.kind {
        LimitKind::PositionMin => ("position, lower", to_end(m.value - m.limit)),
        LimitKind::PositionMax => ("position, upper", to_end(m.limit - m.value)),
        LimitKind::Velocity | LimitKind::TcpSpeed => ("speed", left),
        LimitKind::Acceleration => ("acceleration", left),
    }
}

fn margin_table(margins: &[Margin]) -> Table {
    let rows = margins.iter().map(|m| {
        let (kind, left) = kind_and_left(m);
        let who = match m.joint {
            0 => "tool".to_owned(),
            joint => format!("joint {joint}"),
        };
        [
            format!("{who} {kind}"),
            format!("{:.3}", m.value),
            format!("{:.3}", m.limit),
            format!("{:.3}", m.time_s),
            left,
        ]
    });
    table::numbers(["limit", "extreme", "allowed", "at (s)", "left"], 0, rows)
}

fn rule_table(margins: &[RuleMargin]) -> Table {
    let rows = margins.iter().map(|m| {
        let code = m.rule.code();
        [
            code.map_or_else(|| "-".to_owned(), |c| format!("C{c}")),
            m.rule.name().to_owned(),
            format!("{:.4}", m.value),
            format!("{:.4}", m.limit),
            format!("{:.3}", m.time_s),
            format!("{:.4} {}", m.left(), m.rule.unit()),
        ]
    });
    let header = ["arm", "judges", "extreme", "stops at", "at (s)", "left"];
    table::numbers(header, 0, rows)
}

/// Prints which of the limits, which are all kept, is nearest; returns it.
pub fn print_tightest(margins: &[Margin]) -> Option<&Margin> {
    let tightest = margins.iter().min_by(|a, b| a.left.total_cmp(&b.left));
    let words = tightest.map_or_else(String::new, Margin::describe);
    let count = margins.len();
    println!("All {count} limits are kept, and the arm would not stop. Tightest: {words}.");
    tightest
}

/// What the arm is set up to judge by.
fn judged_arm(args: &CheckArgs) -> anyhow::Result<JudgedArm> {
    ensure!(
        args.speed_factor > 0.0 && args.speed_factor <= TOOL_SPEED_RATED_M_S,
        "--speed-factor is {}, but must be above 0 and at most {TOOL_SPEED_RATED_M_S}: it is a \
         factor of 1 m/s",
        args.speed_factor
    );
    let fence = match args.fence.as_deref() {
        None => None,
        Some([x0, x1, y0, y1, z0, z1]) => Some(Fence::new([*x0, *x1, *y0, *y1, *z0, *z1])?),
        Some(sides) => anyhow::bail!("--fence takes 6 numbers, found {}", sides.len()),
    };
    Ok(JudgedArm {
        interface: args.interface,
        speed_factor: args.speed_factor,
        fence,
    })
}

pub fn run(args: &CheckArgs) -> Outcome<Option<Value>> {
    let arm = judged_arm(args).or_input()?;
    let plan = read_plan(&args.plan).or_input()?;
    let limits = config::here::<Limits>(args.limits.as_deref()).or_input()?;
    let cell = config::cell_for(&plan).or_input()?;
    let margins = limits.margins(&plan.trajectory);
    let is_broken = |m: &&Margin| m.left.is_nan() || m.left < 0.0;
    let broken = margins.iter().filter(is_broken).count();
    let judged = arm_margins(&plan.trajectory, &limits, &arm);
    println!("{}\n\n{}", margin_table(&margins), rule_table(&judged));
    let refuse = |what: String| {
        let error = format!("plan `{}` {what}", args.plan.display());
        output::object(&json!({
            "ok": false, "error": error, "command": "check", "interface": arm.interface,
            "margins": margins, "arm": judged,
        }));
        Err(failed!(error))
    };
    let stop = first_stop(&judged);
    let arm_says = stop.map_or_else(
        || "the controller would refuse it".to_owned(),
        |m| match m.rule.code() {
            Some(code) => format!("the arm would stop with C{code}: {}", m.describe()),
            None => format!("the controller would stop it: {}", m.describe()),
        },
    );
    if let Some(worst) = limits.worst_violation(&plan.trajectory) {
        return refuse(format!(
            "breaks {broken} of {} limits; the worst is {}; {arm_says}",
            margins.len(),
            worst.describe()
        ));
    }
    if stop.is_some() {
        return refuse(format!("keeps the limits, but {arm_says}"));
    }
    let contact_s = tool_contact_s(&plan.trajectory, &cell, limits.period_s());
    if let Some(contact_s) = contact_s {
        output::remark(format_args!(
            "warning: pole or wrist come within 5 mm of arm, column or floor at {contact_s:.3} s"
        ));
    }
    if let Err(swung) = plan.require_at_rest() {
        output::remark(format_args!("warning: {swung}"));
    }
    print_tightest(&margins);
    Ok(Some(json!({
        "ok": true, "command": "check", "interface": arm.interface, "margins": margins, "arm": judged,
        "tool_contact_s": contact_s,
    })))
}
