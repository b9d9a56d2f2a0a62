//! `wag config`: which configuration holds here, and which file says so.

use crate::cli::ConfigCommand;
use crate::config::{self, Kind, Layers};
use clap::ValueEnum;
use cli_output::{Failure, OrInput, Outcome, table};
use serde_json::{Value, json};
use std::path::Path;

pub fn run(command: &ConfigCommand) -> Outcome<Option<Value>> {
    match command {
        ConfigCommand::Show { kind, run, origin } => show(*kind, run.as_deref(), *origin),
        ConfigCommand::Check { kind, run } => check(kind.as_ref(), run.as_deref()),
    }
}

fn files_of(layers: &Layers) -> Vec<Value> {
    let layers = layers.layers.iter();
    layers
        .map(|layer| json!({ "layer": layer.name, "file": layer.path }))
        .collect()
}

fn show(kind: Kind, run: Option<&Path>, origin: bool) -> Outcome<Option<Value>> {
    let layers = config::layers(kind, run).or_input()?;
    let values = layers.effective_values();
    if origin {
        let rows = values.iter().map(|t| {
            let file = t.layer.path.display().to_string();
            let (value, layer) = (t.value.to_string(), t.layer.name.to_owned());
            [t.key.clone(), value, layer, file]
        });
        let header = ["key", "value", "layer", "file"];
        println!("{}", table::numbers(header, 3, rows));
    } else {
        print!("{}", toml::to_string(&layers.merged()).or_failed()?);
    }
    let values = values.iter().map(
        |t| json!({ "key": t.key, "value": t.value, "layer": t.layer.name, "file": t.layer.path }),
    );
    let values: Vec<Value> = values.collect();
    Ok(Some(json!({
        "kind": kind.name(), "layers": files_of(&layers), "values": values,
    })))
}

fn check(kind: Option<&Kind>, run: Option<&Path>) -> Outcome<Option<Value>> {
    let all = Kind::value_variants();
    let kinds = kind.map_or(all, std::slice::from_ref);
    let (mut checked, mut wrong) = (Vec::new(), Vec::new());
    for kind in kinds {
        let layers = match config::layers(*kind, run) {
            Ok(layers) => layers,
            Err(error) => {
                wrong.push(Failure::input(error).to_string());
                continue;
            }
        };
        let files = layers.layers.iter();
        let files = files.map(|layer| format!("{} ({})", layer.name, layer.path.display()));
        let files: Vec<String> = files.collect();
        println!("✔ {:10} {}", kind.name(), files.join(", "));
        checked.push(json!({ "kind": kind.name(), "layers": files_of(&layers) }));
    }
    if wrong.is_empty() {
        return Ok(Some(json!({ "ok": true, "checked": checked })));
    }
    Err(bad_input!("{}", wrong.join("; ")))
}
