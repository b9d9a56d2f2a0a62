//! An explanation as one page of text.

use super::cycle_sample::WorstJoint;
use super::explanation::{Explanation, Late, Row, Stop};
use super::margins::Margin;
use cli_output::table::{self, Column};
use comfy_table::Table;
use shared_types::FaultCode;
use std::fmt::Write;

/// Width of the names in front of each line.
const NAME: usize = 15;

/// The whole page.
pub fn show(found: &Explanation) -> String {
    let mut page = String::new();
    for (n, stop) in found.stops.iter().enumerate() {
        if n > 0 {
            page.push('\n');
        }
        show_stop(&mut page, stop);
    }
    if found.stops.is_empty() && found.cycles == 0 {
        page.push_str("NO CYCLES: the controller never ran a cycle\n");
    } else if found.stops.is_empty() {
        let (what, end) = if found.ended_in_order {
            ("NOT STOPPED", "the controller was ended in order")
        } else {
            let end = "the recording ends while the controller runs, so a stop may be missing";
            ("NO STOP RECORDED", end)
        };
        let _ = writeln!(
            page,
            "{what}: {} cycles in {:.3} s; {end}\n",
            found.cycles, found.duration_s
        );
        let _ = writeln!(page, "Smallest margins:\n{}", margins(&found.margins));
    }
    for flaw in &found.flaws {
        let _ = writeln!(page, "the recording is not whole: {flaw}");
    }
    page
}

fn show_stop(page: &mut String, stop: &Stop) {
    let _ = writeln!(
        page,
        "STOPPED: {:?} (code {}) in cycle {}, {:.3} s into the recording",
        stop.code, stop.number, stop.cycle, stop.time_s
    );
    let requested = if stop.arm_asked_to_stop {
        "; the arm was commanded to stop"
    } else {
        ""
    };
    let rest = match stop.rest_after_s {
        Some(s) => format!("; at rest after {:.0} ms", 1e3 * s),
        None if stop.mode.is_moving() => "; when the arm came to rest is not known".to_owned(),
        None => String::new(),
    };
    let reaction = format!("{}{requested}{rest}", stop.reaction);
    let while_stopping = |code: FaultCode| format!("{code:?}: {}", code.explain());
    let warned = (stop.arm_warning != 0).then(|| format!("W{}", stop.arm_warning));
    let lines = [
        ("what happened", Some(stop.what.clone())),
        ("by how much", Some(by_how_much(stop))),
        ("where", Some(place(stop))),
        ("reaction", Some(reaction)),
        ("while stopping", stop.second.map(while_stopping)),
        ("the arm says", stop.arm_error_meaning.clone()),
        ("arm's warning", warned),
        ("until then", counts(stop)),
        ("setpoints", stop.latest_setpoint.as_ref().map(lateness)),
        ("what to do", Some(stop.remedy.clone())),
    ];
    for (name, text) in lines {
        if let Some(text) = text {
            let _ = writeln!(page, "  {name:<NAME$} {text}");
        }
    }
    // An arm that is refused while it is brought up is stopped before the first cycle.
    if !stop.cycles_around.is_empty() {
        let _ = writeln!(page, "\n{}", around(&stop.cycles_around));
    }
}

fn by_how_much(stop: &Stop) -> String {
    let Some(exceeded) = &stop.limit_exceeded else {
        return "nothing to measure".to_owned();
    };
    let joint = exceeded
        .joint
        .map_or_else(String::new, |j| format!("joint {j}: "));
    let over = if exceeded.limit.abs() > 0.0 {
        let part = 100.0 * (exceeded.value.abs() / exceeded.limit.abs() - 1.0);
        format!(" ({part:+.1} %)")
    } else {
        String::new()
    };
    let unit = exceeded.unit;
    format!(
        "{joint}{} {unit}, allowed {} {unit}{over}",
        short(exceeded.value),
        short(exceeded.limit)
    )
}

fn lateness(late: &Late) -> String {
    let mut text = format!(
        "setpoint {} was sent {:.1} ms late, the latest of the second before",
        late.cycle, late.late_ms
    );
    if let (Some(covered_ms), Some(after_ms)) = (late.next_covered_ms, late.next_came_after_ms) {
        let _ = write!(
            text,
            "; the next came {after_ms:.1} ms later and covered {covered_ms:.1} ms of motion"
        );
    }
    text
}

/// Four figures, enough to compare and short enough to read.
fn short(value: f64) -> String {
    if value.fract() == 0.0 && value.abs() < 1e6 {
        return format!("{value:.0}");
    }
    match value.abs() {
        v if v >= 100.0 => format!("{value:.1}"),
        v if v >= 1.0 => format!("{value:.3}"),
        _ => format!("{value:.4}"),
    }
}

fn place(stop: &Stop) -> String {
    let mut text = format!("{:?}", stop.mode).to_lowercase();
    if let Some(motion) = stop.motion {
        let _ = write!(text, ", motion {motion}");
    }
    if let Some(t) = stop.motion_s {
        let _ = write!(text, ", {t:.3} s into it");
    }
    if let Some(operating_mode) = stop.operating_mode {
        let _ = write!(text, "; armed for {operating_mode}");
    }
    text
}

fn counts(stop: &Stop) -> Option<String> {
    let c = &stop.counts;
    let named = [
        (c.missed, "cycles missed"),
        (c.skipped, "setpoints not sent"),
        (c.duplicates, "replies twice"),
        (c.out_of_order, "replies out of order"),
        (c.broken_reports, "broken reports"),
        (c.clock_resyncs, "clock resyncs"),
        (c.warnings, "cycles with a warning"),
    ];
    let found: Vec<String> = named
        .iter()
        .filter(|(n, _)| *n > 0)
        .map(|(n, what)| format!("{n} {what}"))
        .collect();
    (!found.is_empty()).then(|| found.join(", "))
}

fn percent(worst: &WorstJoint) -> String {
    if worst.joint == 0 {
        return "-".to_owned();
    }
    format!("{:.0} % J{}", 100.0 * worst.fraction(), worst.joint)
}

fn or_dash(value: Option<f64>, decimals: usize) -> String {
    value.map_or_else(|| "-".to_owned(), |v| format!("{v:.decimals$}"))
}

fn around(rows: &[Row]) -> Table {
    let columns: [Column<Row>; 12] = [
        ("until ms", |r| format!("{:.0}", r.until_ms)),
        ("motion s", |r| or_dash(r.figures.motion_s, 3)),
        ("speed override", |r| {
            format!("{:.2}", r.figures.speed_override)
        }),
        ("joint speed", |r| percent(&r.figures.speed)),
        ("joint acc.", |r| percent(&r.figures.acceleration)),
        ("tool m/s", |r| format!("{:.3}", r.figures.tool_m_s)),
        ("allowed", |r| format!("{:.2}", r.figures.tool_max_m_s)),
        ("link ms", |r| format!("{:.1}", r.figures.link_ms)),
        ("report ms", |r| or_dash(r.figures.report_ms, 1)),
        ("late ms", |r| or_dash(r.figures.late_ms, 1)),
        ("missed", |r| r.figures.missed.to_string()),
        ("mode", |r| format!("{:?}", r.figures.mode).to_lowercase()),
    ];
    table::columns(columns, 1, rows)
}

fn margins(margins: &[Margin]) -> Table {
    let columns: [Column<Margin>; 7] = [
        ("limit", |m| m.what.to_owned()),
        ("used", |m| format!("{:.1} %", 100.0 * m.part)),
        ("value", |m| short(m.value)),
        ("allowed", |m| short(m.limit)),
        ("at s", |m| format!("{:.3}", m.time_s)),
        ("joint", |m| {
            m.joint.map_or("-".to_owned(), |j| j.to_string())
        }),
        ("unit", |m| m.unit.to_owned()),
    ];
    table::columns(columns, 1, margins)
}
