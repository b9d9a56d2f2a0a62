//! What came of a run, in one line.

use super::data::Errors;
use serde_json::Value;

/// Radius of the target ball of a strike (m), as the page draws it.
const BALL_RADIUS_M: f64 = 0.02;

/// The line: what the throw came to, or what else was done or stopped it. `tip_radius_m` is
/// that of the rope's lead.
pub(crate) fn headline(errors: &Errors, summary: &Value, tip_radius_m: f64) -> String {
    let text = |key: &str| summary[key].as_str();
    let planned = errors.planned_m.map(|m| format!("planned {}", length(m)));
    let closest = errors.true_m.or(errors.camera_m);
    let verdict = ["true_verdict", "camera_verdict"]
        .iter()
        .find_map(|key| summary[key]["success"].as_bool());
    let is_thrown = summary["stages"]["throw_s"]
        .as_f64()
        .is_none_or(|s| s > 0.0);
    let Some(closest_m) = closest else {
        let unseen = &summary["camera_verdict"]["unseen"][0];
        if let (Some(task), Some(unseen)) = (text("task"), unseen.as_str()) {
            let said = format!("{} not wholly seen ({unseen})", capital(task));
            return with(&said, planned);
        }
        if let (Some(task), Some(is_done)) = (text("task"), verdict) {
            let said = match is_done {
                true => format!("{} done", capital(task)),
                false => format!("{} failed ({})", capital(task), unmet(summary)),
            };
            return with(&said, planned);
        }
        let what = match text("task").filter(|_| planned.is_some() && is_thrown) {
            Some(_) => "throw, its distance to the target not measured",
            None => text("command").unwrap_or("run"),
        };
        let said = match summary["ok"].as_bool() {
            Some(false) => format!("Failed: {}", text("error").unwrap_or(what)),
            _ => capital(what),
        };
        return with(&said, planned.filter(|_| is_thrown));
    };
    let said = match (text("task"), verdict) {
        (None | Some("strike"), _) if closest_m <= tip_radius_m + BALL_RADIUS_M => {
            format!("Hit: {}", length(closest_m))
        }
        (None | Some("strike"), _) => format!("Missed by {}", length(closest_m)),
        (Some(task), Some(true)) => format!("{} done: {}", capital(task), length(closest_m)),
        (Some(task), Some(false)) => {
            let unmet = unmet(summary);
            format!("{} failed ({unmet}): {}", capital(task), length(closest_m))
        }
        (Some(task), None) => format!("{}: {}", capital(task), length(closest_m)),
    };
    with(&said, planned)
}

/// The conditions of the task that were not met.
fn unmet(summary: &Value) -> String {
    let told = ["true_verdict", "camera_verdict"]
        .iter()
        .find_map(|key| summary[key]["conditions"].as_array());
    let unmet = |c: &&Value| c["met"] == false;
    let name = |c: &Value| format!("not met: {}", c["name"].as_str().unwrap_or("a condition"));
    let list: Vec<String> = told.into_iter().flatten().filter(unmet).map(name).collect();
    list.join(", ")
}

fn with(said: &str, planned: Option<String>) -> String {
    planned.map_or_else(|| said.to_owned(), |planned| format!("{said} ({planned})"))
}

fn capital(word: &str) -> String {
    let mut letters = word.chars();
    let first = letters.next().map(|c| c.to_uppercase().to_string());
    first.unwrap_or_default() + letters.as_str()
}

/// A length (m) in words.
fn length(m: f64) -> String {
    if m < 5e-5 {
        "under 0.1 mm".to_owned()
    } else if m < 0.01 {
        format!("{:.1} mm", 1e3 * m)
    } else {
        format!("{:.1} cm", 1e2 * m)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    fn errors(planned_m: Option<f64>, true_m: Option<f64>, camera_m: Option<f64>) -> Errors {
        Errors {
            planned_m,
            true_m,
            camera_m,
            ..Errors::default()
        }
    }

    #[test]
    fn a_strike_hits_when_the_lead_touches_the_ball() {
        let strike = json!({ "task": "strike", "ok": true });
        let said = |m: f64| headline(&errors(Some(4e-7), None, Some(m)), &strike, 0.023);
        assert_eq!(said(0.0010), "Hit: 1.0 mm (planned under 0.1 mm)");
        assert_eq!(said(0.0425), "Hit: 4.2 cm (planned under 0.1 mm)");
        assert_eq!(said(0.0440), "Missed by 4.4 cm (planned under 0.1 mm)");
        // What a simulator knows counts more than what its camera saw.
        let both = errors(Some(0.002), Some(0.051), Some(0.001));
        assert_eq!(
            headline(&both, &strike, 0.02),
            "Missed by 5.1 cm (planned 2.0 mm)"
        );
    }

    #[test]
    fn other_tasks_are_judged_by_their_conditions() {
        let mut lob = json!({ "task": "lob", "true_verdict": { "success": false, "conditions": [
            { "name": "domino down", "met": false }, { "name": "stay", "met": true } ] } });
        let found = errors(Some(0.0196), Some(0.0274), None);
        assert_eq!(
            headline(&found, &lob, 0.02),
            "Lob failed (not met: domino down): 2.7 cm (planned 2.0 cm)"
        );
        let unmeasured = errors(Some(0.0196), None, None);
        assert_eq!(
            headline(&unmeasured, &lob, 0.02),
            "Lob failed (not met: domino down) (planned 2.0 cm)"
        );
        lob["true_verdict"]["success"] = json!(true);
        assert_eq!(
            headline(&found, &lob, 0.02),
            "Lob done: 2.7 cm (planned 2.0 cm)"
        );
    }

    #[test]
    fn a_run_without_a_measured_throw_claims_no_hit() {
        let none = errors(None, None, None);
        let wiggle = json!({ "command": "wiggle", "task": "strike", "ok": true });
        assert_eq!(headline(&none, &wiggle, 0.0), "Wiggle");
        let failed = json!({ "command": "wiggle", "ok": false, "error": "interrupted" });
        assert_eq!(headline(&none, &failed, 0.0), "Failed: interrupted");
        let thrown = json!({ "command": "throw", "task": "strike", "ok": true });
        let planned = errors(Some(0.002), None, None);
        assert_eq!(
            headline(&planned, &thrown, 0.02),
            "Throw, its distance to the target not measured (planned 2.0 mm)"
        );
        assert_eq!(headline(&none, &Value::Null, 0.0), "Run");
    }
}
