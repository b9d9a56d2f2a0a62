//! `wag config`: which configuration holds here, and which file says so.

use crate::cli::{ConfigCheckArgs, ConfigCommand, ConfigShowArgs};
use crate::config::{self, Kind, Layers};
use anyhow::anyhow;
use clap::ValueEnum;
use cli_output::{Failure, OrInput, Outcome, table};
use serde_json::{Value, json};

pub fn run(command: &ConfigCommand, quiet: bool) -> Outcome<Option<Value>> {
    match command {
        ConfigCommand::Show(args) => show(args, quiet),
        ConfigCommand::Check(args) => check(args, quiet),
    }
}

fn files_of(layers: &Layers) -> Vec<Value> {
    layers
        .layers()
        .iter()
        .map(|layer| json!({ "layer": layer.name, "file": layer.path }))
        .collect()
}

fn show(args: &ConfigShowArgs, quiet: bool) -> Outcome<Option<Value>> {
    let layers = config::layers(args.kind, args.run.as_deref()).or_input()?;
    let told = layers.told();
    if !quiet && args.origin {
        let rows = told.iter().map(|t| {
            [
                t.key.clone(),
                t.value.to_string(),
                t.layer.name.to_owned(),
                t.layer.path.display().to_string(),
            ]
        });
        println!(
            "{}",
            table::numbers(["key", "value", "layer", "file"], 3, rows)
        );
    } else if !quiet {
        print!("{}", toml::to_string(&layers.merged()).or_failed()?);
    }
    let values: Vec<Value> = told
        .iter()
        .map(|t| {
            json!({
                "key": t.key,
                "value": t.value,
                "layer": t.layer.name,
                "file": t.layer.path,
            })
        })
        .collect();
    Ok(Some(json!({
        "kind": args.kind.name(),
        "layers": files_of(&layers),
        "values": values,
    })))
}

fn check(args: &ConfigCheckArgs, quiet: bool) -> Outcome<Option<Value>> {
    let kinds = args
        .kind
        .map_or(Kind::value_variants().to_vec(), |kind| vec![kind]);
    let (mut checked, mut wrong) = (Vec::new(), Vec::new());
    for kind in kinds {
        match config::layers(kind, args.run.as_deref()) {
            Ok(layers) => {
                let files: Vec<String> = layers
                    .layers()
                    .iter()
                    .map(|layer| format!("{} ({})", layer.name, layer.path.display()))
                    .collect();
                if !quiet {
                    println!("✔ {:10} {}", kind.name(), files.join(", "));
                }
                checked.push(json!({ "kind": kind.name(), "layers": files_of(&layers) }));
            }
            Err(error) => wrong.push(format!("{error:#}")),
        }
    }
    if wrong.is_empty() {
        return Ok(Some(json!({ "ok": true, "checked": checked })));
    }
    Err(Failure::input(anyhow!("{}", wrong.join("; "))))
}
