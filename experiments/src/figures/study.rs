//! What the documents' figures are made of: programs that are run, once or with one seed after the
//! other, and what is kept of each run.

use serde_json::{Map, Value, json};

/// One study.
#[derive(Debug)]
pub struct Study {
    pub name: &'static str,
    /// Which program is run.
    pub program: Program,
    /// Its arguments, beside seed and output.
    pub args: &'static [&'static str],
    /// Runs, each with the next seed.
    pub runs: u64,
    /// Busy threads beside it.
    pub load: u16,
    /// Whether it has a seed: else it is the same every time.
    pub has_seed: bool,
}

/// Programs of this project.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Program {
    /// `wag`: of each run a row is kept.
    Wag,
    /// The same with arm and camera of a `wag rig` beside it.
    WagBesideRig,
    /// `experiments`, once: its object is kept.
    Experiments,
}

/// All studies. A new one goes to the end: the place of a study gives its seeds.
pub const STUDIES: [Study; 20] = [
    throws("strike", &["demo", "--task", "strike"], 100, 0),
    throws("lob", &["demo", "--task", "lob"], 30, 0),
    throws("drape", &["demo", "--task", "drape"], 30, 0),
    throws("strike-loaded", &["demo", "--task", "strike"], 20, 8),
    once("sim-pipeline", &["sim-pipeline"]),
    once("lob-drape", &["lob-drape"]),
    once("full-pipeline", &["full-pipeline"]),
    once("sysid", &["sysid"]),
    once("sysid-nn", &["sysid", "--method", "nn"]),
    once("sysid-ood", &["sysid-ood", "--ropes", "128"]),
    once("wiggle-ablation", &["wiggle-ablation"]),
    once("motion-fidelity", &["motion-fidelity"]),
    Study {
        program: Program::WagBesideRig,
        ..throws("two-terminals", &["run", "strike", "--yes"], 10, 0)
    },
    once("lob-drape-nn", &["lob-drape", "--method", "nn"]),
    once("lob-drape-cmaes", &["lob-drape", "--method", "cmaes"]),
    once("robust", &["robust"]),
    once("parameter-importance", &["parameter-importance"]),
    once("rope-accuracy", &["rope-accuracy"]),
    Study {
        has_seed: false,
        ..once("contact-dynamics", &["contact-dynamics"])
    },
    Study {
        has_seed: false,
        ..once(
            "contact-dynamics-fine",
            &["contact-dynamics", "--step-ms", "0.1"],
        )
    },
];

const fn throws(name: &'static str, args: &'static [&'static str], runs: u64, load: u16) -> Study {
    let program = Program::Wag;
    Study {
        name,
        program,
        args,
        runs,
        load,
        has_seed: true,
    }
}

const fn once(name: &'static str, args: &'static [&'static str]) -> Study {
    let program = Program::Experiments;
    Study {
        name,
        program,
        args,
        runs: 1,
        load: 0,
        has_seed: true,
    }
}

/// What is kept of each throw by its place in the report of `wag demo` or `wag run`.
const KEPT: [(&str, &str); 9] = [
    ("ok", "/ok"),
    ("error", "/error"),
    ("miss_m", "/true_tip_target_distance_m"),
    ("camera_miss_m", "/stereo_tip_target_distance_m"),
    ("robot_touched", "/truth/rope_touched_robot"),
    ("simulations", "/identified/simulations"),
    ("identify_s", "/stages/identify_s"),
    ("plan_s", "/stages/plan_s"),
    ("wall_s", "/wall_s"),
];

/// What is measured, its truth, and its interval: the length is the second of the parameters.
const MEASURED: [(&str, &str, &str, &str); 2] = [
    (
        "camera",
        "/stereo_tip_target_distance_m",
        "/true_tip_target_distance_m",
        "/score/interval_m",
    ),
    (
        "length",
        "/identified/params/length_m",
        "/truth/rope/length_m",
        "/identified/posterior/interval_90/1",
    ),
];

/// What is kept of a throw on the rig: how it ended, how far it was off by truth and by camera, the
/// judgement of each condition, and what it cost. What a run does not have is left out; one that
/// failed met no condition.
pub fn throw(seed: u64, report: &Value) -> Value {
    let at = |pointer: &str| report.pointer(pointer).filter(|v| !v.is_null());
    let number = |pointer: &str| at(pointer).and_then(Value::as_f64);
    let mut row = Map::from_iter([("seed".to_owned(), json!(seed))]);
    for (name, pointer) in KEPT {
        row.extend(at(pointer).map(|value| (name.to_owned(), value.clone())));
    }
    for (name, found, truth, interval) in MEASURED {
        let (Some(found), Some(truth)) = (number(found), number(truth)) else {
            continue;
        };
        row.insert(format!("{name}_error_m"), json!((found - truth).abs()));
        let [low, high] = [0, 1].map(|end| number(&format!("{interval}/{end}")));
        let held = low
            .zip(high)
            .map(|(low, high)| low <= truth && truth <= high);
        row.extend(held.map(|held| (format!("{name}_interval_held"), held.into())));
    }
    let verdicts = [("", "/true_verdict"), ("camera_", "/camera_verdict")];
    for (prefix, verdict) in verdicts {
        let success = at(&format!("{verdict}/success"));
        row.extend(success.map(|value| (format!("{prefix}success"), value.clone())));
        let conditions = at(&format!("{verdict}/conditions")).and_then(Value::as_array);
        for condition in conditions.into_iter().flatten() {
            let name = condition["name"].as_str().unwrap_or_default();
            let name = format!("{prefix}{}", name.replace(' ', "_"));
            row.insert(name, condition["met"].clone());
        }
    }
    if row.get("ok") != Some(&Value::Bool(true)) {
        for name in ["success", "target_hit"] {
            row.insert(name.to_owned(), false.into());
        }
    }
    // A camera that did not see all that it takes does not judge.
    if let Some(unseen) = at("/camera_verdict/unseen").and_then(Value::as_array) {
        row.insert("camera_judged".to_owned(), unseen.is_empty().into());
        if unseen.is_empty() {
            let [truth, camera] = verdicts.map(|(_, verdict)| at(&format!("{verdict}/success")));
            row.insert("verdicts_agree".to_owned(), (truth == camera).into());
        }
    }
    Value::Object(row)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn of_a_throw_its_end_its_misses_and_its_conditions_are_kept() {
        let report = json!({
            "ok": true, "wall_s": 40.0, "true_tip_target_distance_m": 0.25,
            "stereo_tip_target_distance_m": 0.5, "score": {"interval_m": [0.3, 0.6]},
            "truth": {"rope": {"length_m": 0.5}, "rope_touched_robot": false},
            "identified": {"params": {"length_m": 0.75}, "posterior": {"interval_90": [[20, 22], [0.4, 0.8]]}},
            "true_verdict": {"success": true, "conditions": [{"name": "domino down", "met": true}]},
            "camera_verdict": {"success": false, "unseen": [], "conditions": [{"name": "domino down", "met": false}]},
        });
        let expected = json!({
            "seed": 7, "ok": true, "wall_s": 40.0, "miss_m": 0.25, "camera_miss_m": 0.5,
            "camera_error_m": 0.25, "camera_interval_held": false, "robot_touched": false,
            "length_error_m": 0.25, "length_interval_held": true,
            "success": true, "domino_down": true, "camera_success": false,
            "camera_domino_down": false, "camera_judged": true, "verdicts_agree": false,
        });
        assert_eq!(throw(7, &report), expected);
        let mut undecided = report;
        undecided["camera_verdict"]["unseen"] = json!(["domino down"]);
        let row = throw(7, &undecided);
        assert_eq!(
            (&row["camera_judged"], row.get("verdicts_agree")),
            (&json!(false), None)
        );
        let stopped = json!({"ok": false, "error": "stopped", "true_verdict": null});
        assert_eq!(
            throw(8, &stopped),
            json!({
                "seed": 8, "ok": false, "error": "stopped", "success": false, "target_hit": false,
            })
        );
    }

    #[test]
    fn names_are_told_apart() {
        for (i, study) in STUDIES.iter().enumerate() {
            assert!(STUDIES[..i].iter().all(|other| other.name != study.name));
        }
    }
}
