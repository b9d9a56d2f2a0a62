//! The words of a study, read before anything is started.

use crate::args::{Cli, Command, ResultCommand, SubmitArgs};
use clap::builder::StyledStr;
use clap::error::{ContextKind, ContextValue};
use clap::{CommandFactory, Error};
use cli_output::Outcome;

/// Arguments that are this command's to give.
const OWN: [&str; 5] = ["--out", "--shard", "--shards", "--threads", "--json"];

/// Refuses a study that no shard could make; its number of trials, where that is known without
/// beginning it.
pub fn check(args: &SubmitArgs) -> Outcome<Option<u64>> {
    let own = |word: &&String| OWN.contains(&word.split('=').next().unwrap_or_default());
    match args.study.iter().find(own) {
        Some(shard) if shard.starts_with("--shard") => {
            return Err(bad_input!(
                "`{shard}` after --: this command cuts the shards itself; `--shards N` before -- gives their number"
            ));
        }
        Some(own) => {
            return Err(bad_input!(
                "`{own}` after -- is this command's own: give it before --"
            ));
        }
        None => {}
    }
    let name = args.study.iter().find(|word| !word.starts_with('-'));
    let program = Cli::command();
    let command = name.and_then(|name| program.find_subcommand(name));
    if let Some(command) = command.filter(|c| c.get_arguments().all(|arg| arg.get_id() != "shard"))
    {
        return Err(bad_input!("`{}` has no shards", command.get_name()));
    }
    let out = args.out.as_os_str();
    let words = args.study.iter().map(Into::into);
    let words = std::iter::once(program.get_name().into()).chain(words);
    let cli: Cli =
        cli_output::parse(words.chain(["--out".into(), out.into()])).map_err(|error| {
            if error.use_stderr() {
                bad_input!("the study after --: {}", in_short(&error))
            } else {
                bad_input!("the study after -- asks for help or a version only: ask without submit")
            }
        })?;
    Ok(match cli.command {
        Command::Result(
            ResultCommand::Sysid(study)
            | ResultCommand::SimPipeline(study)
            | ResultCommand::LobDrape(study)
            | ResultCommand::Robust(study)
            | ResultCommand::ParameterImportance(study)
            | ResultCommand::SensitivityMaps(study),
        ) => study.ropes,
        // Others make several trials of a rope, or as many as they will.
        _ => None,
    })
}

/// What is wrong and how to mend it, in a line; not the usage.
fn in_short(error: &Error) -> String {
    let said = error.to_string();
    let lines = said.lines().map(str::trim);
    let lines =
        lines.take_while(|line| !line.starts_with("Usage:") && !line.starts_with("For more"));
    let lines: Vec<&str> = lines.filter(|line| !line.is_empty()).collect();
    let said = lines.join("; ");
    said.strip_prefix("error: ").unwrap_or(&said).to_owned()
}

/// An error of this program's command line, with a hint where -- was left out before a study.
pub fn with_hint(mut error: Error) -> Error {
    let is_study = match error.get(ContextKind::InvalidArg) {
        Some(ContextValue::String(word)) => Cli::command().find_subcommand(word).is_some(),
        _ => false,
    };
    if is_study && std::env::args().any(|word| word == "submit") {
        let hint = StyledStr::from("put -- before the study");
        error.insert(ContextKind::Suggested, ContextValue::StyledStrs(vec![hint]));
    }
    error
}
