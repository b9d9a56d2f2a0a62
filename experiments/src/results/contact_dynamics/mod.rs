//! `experiments contact-dynamics`: ropes that touch a board, a domino, a wall or a floor, beside
//! the same ropes in MuJoCo.
//!
//! Both engines are also run with half the step: what that changes is their own error, and a
//! difference between them below it means nothing.

pub(super) mod engines;
mod motion;
mod row;
pub(super) mod scenes;

use super::other_reality::child::Mujoco;
use crate::args::ContactDynamicsArgs;
use crate::program::program;
use crate::report::print_table;
use anyhow::ensure;
use cli_output::{OrInput, Outcome, Stage};
use engines::{ours, theirs};
use experiments::trials::in_parallel;
use row::{AFTER_S, Row, TABLE, Verdict, WITHIN_M};
use run_log::files;
use scenes::TouchScene;
use serde_json::{Value, json};
use shared_types::VERSION;

const NAME: &str = "contact-dynamics";
/// MuJoCo's step (s).
const THEIR_STEP_S: f64 = 1e-4;

/// One scene in both engines, each with its step and with half of it.
fn compare(mujoco: &Mujoco, scene: &TouchScene, step_s: f64) -> anyhow::Result<(Row, String)> {
    let our = [ours(scene, step_s)?, ours(scene, step_s / 2.0)?];
    let their = |step_s, stays| theirs(mujoco, scene, step_s, stays);
    let (coarse, _) = their(THEIR_STEP_S, false)?;
    let (fine, version) = their(THEIR_STEP_S / 2.0, false)?;
    let stays = match scene.scene.domino {
        Some(_) => Some(their(THEIR_STEP_S, true)?.0),
        None => None,
    };
    Ok((
        Row::of(scene.name, &our, &[coarse, fine], stays.as_ref())?,
        version,
    ))
}

/// The scenes asked for, in the order of the table.
fn chosen(names: &[String]) -> anyhow::Result<Vec<TouchScene>> {
    let all = scenes::all();
    for name in names {
        let known: Vec<&str> = all.iter().map(|scene| scene.name).collect();
        ensure!(
            known.contains(&name.as_str()),
            "--scene: there is no `{name}`; there are {}",
            known.join(", ")
        );
    }
    let is_chosen = |scene: &TouchScene| names.is_empty() || names.iter().any(|n| n == scene.name);
    Ok(all.into_iter().filter(is_chosen).collect())
}

pub(super) fn run(args: &ContactDynamicsArgs) -> Outcome<Option<Value>> {
    let mujoco = Mujoco::from_environment().or_input()?;
    let scenes = chosen(&args.scenes).or_input()?;
    if let Some(path) = &args.out {
        files::check_writable(path).or_input()?;
    }
    let step_s = 1e-3 * args.step_ms;
    let stage = Stage::begin(NAME);
    let numbers: Vec<u64> = (0..scenes.len() as u64).collect();
    let compared = in_parallel("scene", &numbers, usize::from(args.threads), |number| {
        compare(&mujoco, &scenes[number as usize], step_s)
    });
    let (rows, versions): (Vec<Row>, Vec<String>) = compared.or_failed()?.into_iter().unzip();
    let met = rows
        .iter()
        .filter(|row| row.verdict == Verdict::Met)
        .count();
    let described: Vec<Value> = scenes
        .iter()
        .map(|s| json!({ "name": s.name, "rope": s.rope, "motion": s.motion, "horizon_s": s.horizon_s }))
        .collect();
    let value = json!({
        "ok": true, "command": NAME, "version": VERSION, "program": program().or_failed()?,
        "mujoco": versions.first(), "step_s": { "rope_sim": step_s, "mujoco": THEIR_STEP_S },
        "after_s": AFTER_S, "within_m": WITHIN_M, "met": met, "rows": rows, "scenes": described,
        "out": args.out,
    });
    stage.done(&format!("{} scenes", rows.len()));
    print_table(&rows, 3, TABLE);
    println!(
        "\n{met} of {} scenes within {} mm before the first contact and {} mm {AFTER_S} s after it, the domino alike",
        rows.len(),
        1e3 * WITHIN_M[0],
        1e3 * WITHIN_M[1]
    );
    if let Some(out) = &args.out {
        files::write_json(out, &value).or_failed()?;
        println!("written to `{}`", out.display());
    }
    Ok(Some(value))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scenes_are_ten_of_different_names_and_known_by_them() {
        let all = chosen(&[]).unwrap();
        let mut names: Vec<&str> = all.iter().map(|scene| scene.name).collect();
        names.sort_unstable();
        names.dedup();
        assert_eq!(names.len(), 10);
        let two = chosen(&["drape".to_owned(), "lob-nudges".to_owned()]).unwrap();
        assert_eq!(two.len(), 2);
        let refused = chosen(&["drop".to_owned()]).unwrap_err().to_string();
        assert!(refused.contains("no `drop`") && refused.contains("lay-on-floor"));
    }

    /// A drape, a swing into a wall, a domino that is nudged, two that fall, and a lead that
    /// lands aslant, in steps of throws or of the rig.
    #[test]
    fn ropes_touch_as_they_do_in_mujoco() {
        let Some(mujoco) = Mujoco::for_tests() else {
            return;
        };
        let scenes = [
            ("drape", 5e-4),
            ("swing-into-wall", 5e-4),
            ("lob-nudges", 5e-4),
            ("lob-fells-askew", 5e-4),
            ("lob-fells", 1e-4),
            ("lay-on-floor", 5e-4),
        ];
        for (name, step_s) in scenes {
            let scene = chosen(&[name.to_owned()]).unwrap().remove(0);
            let ours = ours(&scene, step_s).unwrap();
            let (theirs, _) = theirs(&mujoco, &scene, THEIR_STEP_S, false).unwrap();
            let [ours, theirs] = [ours, theirs].map(|course| [course.clone(), course]);
            let row = Row::of(scene.name, &ours, &theirs, None).unwrap();
            println!("{row:?}");
            assert_eq!(row.verdict, Verdict::Met, "{row:?}");
            let [our_s, their_s] = row.first_s;
            assert!((our_s - their_s).abs() < 1e-3, "{row:?}");
            let falls = name.starts_with("lob-fells");
            let fell = |row: &Row| row.domino.is_some_and(|d| d[0].down_at_s.is_some());
            assert_eq!(fell(&row), falls, "{row:?}");
        }
    }
}
