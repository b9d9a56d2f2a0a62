//! `experiments figures`: the figures of README and book, from runs that are kept, and the check
//! that the documents say what the runs gave.

mod args;
mod make;
mod numbers;
mod record;
mod rig;
mod study;
mod template;

use anyhow::Context;
pub use args::FiguresCommand;
use args::{FillFiguresArgs, MakeFiguresArgs};
use cli_output::{OrInput, Outcome};
use record::Record;
use run_log::files;
use serde_json::{Value, json};
use std::collections::BTreeMap;
use study::STUDIES;

/// Makes figures, writes them into documents or checks these. The value is what `--json` prints.
pub fn run(command: &FiguresCommand) -> Outcome<Option<Value>> {
    match command {
        FiguresCommand::Make(args) => make(args),
        FiguresCommand::Write(args) => fill(args, true),
        FiguresCommand::Check(args) => fill(args, false),
    }
}

fn make(args: &MakeFiguresArgs) -> Outcome<Option<Value>> {
    let known = || STUDIES.map(|study| study.name).join(", ");
    for name in &args.studies {
        if STUDIES.iter().all(|study| study.name != name) {
            return Err(bad_input!("no study `{name}`; there are {}", known()));
        }
    }
    let commit = make::commit().or_input()?;
    cli_output::watch_interrupts().or_failed()?;
    let asked = |name: &str| args.studies.is_empty() || args.studies.iter().any(|s| s == name);
    let mut made = Vec::new();
    for (index, study) in STUDIES.iter().enumerate() {
        if asked(study.name) {
            made.push(make::make(args, study, &commit, index)?);
        }
    }
    println!("`experiments figures write` brings them into the documents");
    Ok(Some(
        json!({"ok": true, "command": "figures make", "commit": commit, "studies": made}),
    ))
}

/// Makes the blocks of figures anew, and writes them or says where a document has others.
fn fill(args: &FillFiguresArgs, write: bool) -> Outcome<Option<Value>> {
    let mut known: BTreeMap<String, Value> = BTreeMap::new();
    let mut numbers = |study: &str| -> anyhow::Result<Value> {
        if let Some(found) = known.get(study) {
            return Ok(found.clone());
        }
        let found = Record::read(&args.records, study)?.numbers()?;
        known.insert(study.to_owned(), found.clone());
        Ok(found)
    };
    let mut blocks = 0;
    for path in &args.documents {
        let name = || format!("`{}`", path.display());
        let document = files::read_text(path).or_input()?;
        let (made, found) = template::fill(&document, &mut numbers)
            .with_context(name)
            .or_input()?;
        if found == 0 {
            return Err(bad_input!("{} has no block of figures", name()));
        }
        blocks += found;
        if made == document {
            continue;
        }
        if write {
            files::write_atomic(path, made.as_bytes()).or_failed()?;
            println!("{} written", name());
        } else {
            return Err(failed!("{}", difference(&name(), &document, &made)));
        }
    }
    println!("{blocks} blocks of figures are those of the records");
    let command = if write {
        "figures write"
    } else {
        "figures check"
    };
    Ok(Some(
        json!({"ok": true, "command": command, "blocks": blocks}),
    ))
}

/// The first line in which a document is not what the records give.
fn difference(name: &str, document: &str, made: &str) -> String {
    let mut pairs = document.lines().zip(made.lines()).enumerate();
    let (line, said, given) = match pairs.find(|(_, (said, given))| said != given) {
        Some((i, (said, given))) => (i + 1, said, given),
        None => (document.lines().count(), "(its end)", "(its end)"),
    };
    format!(
        "{name}, line {line}, says\n  {said}\nthe records give\n  {given}\n`experiments figures write` mends it"
    )
}
