//! `experiments rooms` and `experiments track-rooms`: wiggles filmed in drawn rooms, and
//! how the tracker fares with them.

mod fate;
mod folder;
mod score;
mod summary;
pub mod track;

use crate::args::{FilmArgs, KindName, RoomsArgs};
use cli_output::{Machine, OrInput, Outcome, Stage};
use experiments::trials::in_parallel;
use rig_sim::room::Kind;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

impl From<KindName> for Kind {
    fn from(name: KindName) -> Self {
        match name {
            KindName::Ordinary => Self::Ordinary,
            KindName::Hard => Self::Hard,
        }
    }
}

/// Folder of a seed's film.
fn folder_of(out: &Path, kind: Kind, seed: u64) -> PathBuf {
    out.join(format!("{}-{seed}", kind.name()))
}

/// Does `work` for the seed of each film, in their order.
fn each<T: Send>(
    films: &FilmArgs,
    work: impl Fn(u64) -> anyhow::Result<T> + Sync,
) -> anyhow::Result<Vec<T>> {
    let threads = films.threads.map_or(Machine::here().cores, usize::from);
    let seeds: Vec<u64> = films.seeds.clone().collect();
    in_parallel("seed", &seeds, threads, work)
}

/// Renders films. The value is what `--json` prints.
pub fn run(args: &RoomsArgs) -> Outcome<Option<Value>> {
    let kind = Kind::from(args.which.kind);
    let stage = Stage::begin("rooms");
    let films = each(&args.which, |seed| {
        folder::write(&folder_of(&args.out, kind, seed), seed, kind)
    })
    .or_failed()?
    .len();
    let seconds = stage.done(&format!("{films} films in `{}`", args.out.display()));
    Ok(Some(json!({
        "ok": true, "command": "rooms", "kind": kind, "films": films,
        "out": args.out, "seconds": seconds,
    })))
}
