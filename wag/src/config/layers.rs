//! Reading layers, laying one over the other, and telling which said what.

use super::kind::{Configured, Kind};
use anyhow::{Context, anyhow, bail};
use arm_model::Cell;
use run_log::files::{located, read_text};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use toml::{Table, Value};

/// Folder of a whole site's files.
const SITE: &str = "/etc/wag";
/// Environment variable that names the folder of a rig's files.
pub const RIG_FOLDER: &str = "WAG_CONFIG";

/// Where files of a site and of a rig are looked for.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Folders {
    pub site: Option<PathBuf>,
    pub rig: Option<PathBuf>,
}

impl Folders {
    /// Those of this machine and user: `/etc/wag`, and the folder named by `WAG_CONFIG`,
    /// else `wag` in the user's folder of configurations.
    pub fn here() -> anyhow::Result<Self> {
        let set = |name: &str| std::env::var_os(name).filter(|v| !v.is_empty());
        let rig = match set(RIG_FOLDER).map(PathBuf::from) {
            Some(named) if !named.is_dir() => bail!(
                "{RIG_FOLDER} names `{}`, which is not a folder; correct or unset it",
                named.display()
            ),
            Some(named) => Some(named),
            None => set("XDG_CONFIG_HOME")
                .map(PathBuf::from)
                .or_else(|| set("HOME").map(|home| Path::new(&home).join(".config")))
                .map(|folder| folder.join("wag")),
        };
        Ok(Self {
            site: Some(PathBuf::from(SITE)),
            rig,
        })
    }
}

#[derive(Debug, Clone, PartialEq)]
pub struct Layer {
    /// `built in`, `site`, `rig` or `run`.
    pub name: &'static str,
    pub path: PathBuf,
    table: Table,
}

/// The layers of one kind, the strongest last.
#[derive(Debug, Clone, PartialEq)]
pub struct Layers {
    kind: Kind,
    pub layers: Vec<Layer>,
    /// Tables `cell` of files of another kind: they set nothing.
    cells: Vec<(PathBuf, Table)>,
}

/// One value that holds.
#[derive(Debug, Clone, PartialEq)]
pub struct EffectiveValue<'a> {
    /// Tables and key, with dots.
    pub key: String,
    pub value: Value,
    pub layer: &'a Layer,
}

impl Layers {
    /// Reads the layers that are there. A site's and a rig's file may be missing, the
    /// run's may not.
    ///
    /// # Errors
    /// A file that cannot be read or says what its kind does not know: with its name.
    pub fn read(kind: Kind, folders: &Folders, run: Option<&Path>) -> anyhow::Result<Self> {
        let shipped = kind.built_in();
        let built_in = Layer {
            name: "built in",
            path: PathBuf::from(shipped.path),
            table: toml::from_str(shipped.text)
                .with_context(|| format!("the built-in `{}` is damaged", shipped.path))?,
        };
        let mut out = Self {
            kind,
            layers: vec![built_in],
            cells: Vec::new(),
        };
        for (name, folder) in [("site", &folders.site), ("rig", &folders.rig)] {
            let file = folder.as_ref().map(|folder| folder.join(shipped.file));
            if let Some(path) = file.filter(|path| path.exists()) {
                out.add(name, &path)?;
            }
        }
        if let Some(path) = run {
            out.add("run", path)?;
        }
        Ok(out)
    }

    /// Lays a file over what is there, which it must fit.
    fn add(&mut self, name: &'static str, path: &Path) -> anyhow::Result<()> {
        let file = || format!("{} file `{}`", self.kind.name(), path.display());
        let text = read_text(path)?;
        let mut table: Table = toml::from_str(&text).with_context(file)?;
        if self.kind.has_cell()
            && let Some(Value::Table(cell)) = table.get("cell").cloned()
        {
            table.remove("cell");
            self.cells.push((path.to_owned(), cell));
        }
        let layer = Layer {
            name,
            path: path.to_owned(),
            table,
        };
        let mut merged = self.merged();
        lay_over(&mut merged, &layer.table);
        if let Err(refusal) = self.kind.check(merged) {
            // Alone it may lack what lower layers say.
            let alone = toml::Deserializer::parse(&text).and_then(|text| self.kind.check(text));
            return Err(anyhow!(located(refusal, alone)).context(file()));
        }
        self.layers.push(layer);
        Ok(())
    }

    /// Refuses a file whose table `cell` says something else than the cell that holds
    /// `here`: runs write that table, but the cell has a file of its own.
    pub fn refuse_other_cell(&self, here: fn() -> anyhow::Result<Cell>) -> anyhow::Result<()> {
        for (path, reported) in &self.cells {
            let file = || format!("{} file `{}`", self.kind.name(), path.display());
            let cell = here()?;
            let mut merged = Table::try_from(cell)?;
            lay_over(&mut merged, reported);
            let reported: Cell = merged.try_into().with_context(file)?;
            if let Some(differs) = difference(&reported, &cell)? {
                return Err(anyhow!(
                    "`cell` has a file of its own, and {differs}; remove [cell], or pass that \
                     cell's file (a run's is RUN/config/cell.toml) with --cell"
                )
                .context(file()));
            }
        }
        Ok(())
    }

    /// What holds.
    pub fn merged(&self) -> Table {
        let mut out = Table::new();
        for layer in &self.layers {
            lay_over(&mut out, &layer.table);
        }
        out
    }

    /// What holds, as the type of its kind.
    pub fn get<T: Configured>(&self) -> anyhow::Result<T> {
        self.merged()
            .try_into()
            .with_context(|| format!("{} configuration", self.kind.name()))
    }

    /// Every value that holds, with the layer it comes from.
    pub fn effective_values(&self) -> Vec<EffectiveValue<'_>> {
        let mut values: BTreeMap<String, EffectiveValue<'_>> = BTreeMap::new();
        for layer in &self.layers {
            for (key, value) in leaves(&layer.table) {
                values.insert(key.clone(), EffectiveValue { key, value, layer });
            }
        }
        // A table that a value takes the place of, or the other way round, holds no more.
        let held: BTreeMap<_, _> = leaves(&self.merged()).into_iter().collect();
        values.retain(|key, _| held.contains_key(key));
        values.into_values().collect()
    }
}

/// The first value in which a cell differs from the one that holds, in words.
pub fn difference(reported: &Cell, here: &Cell) -> anyhow::Result<Option<String>> {
    let [reported, here] = [reported, here].map(Table::try_from);
    let pairs = leaves(&reported?).into_iter().zip(leaves(&here?));
    let mut differing = pairs.filter(|((_, reported), (_, here))| reported != here);
    Ok(differing.next().map(|((key, reported), (_, here))| {
        format!("its {key} = {reported} is not the {here} of the cell that holds here")
    }))
}

/// Values of `upper` in place of those of `lower`, table by table; a list is one value.
fn lay_over(lower: &mut Table, upper: &Table) {
    for (key, value) in upper {
        match (lower.get_mut(key), value) {
            (Some(Value::Table(below)), Value::Table(above)) => lay_over(below, above),
            _ => {
                lower.insert(key.clone(), value.clone());
            }
        }
    }
}

/// Values with their keys, before which stand the names of their tables and dots.
fn leaves(table: &Table) -> Vec<(String, Value)> {
    let of = |(key, value): (&String, &Value)| match value {
        Value::Table(inner) => {
            let inner = leaves(inner).into_iter();
            inner.map(|(k, v)| (format!("{key}.{k}"), v)).collect()
        }
        leaf => vec![(key.clone(), leaf.clone())],
    };
    table.iter().flat_map(of).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::ValueEnum;
    use planner::PlannerConfig;

    /// A site's and a rig's folder with these planner files.
    fn folders(site: &str, rig: &str) -> (tempfile::TempDir, Folders) {
        let dir = tempfile::tempdir().unwrap();
        let folder = |name: &str, text: &str| {
            let folder = dir.path().join(name);
            std::fs::create_dir(&folder).unwrap();
            std::fs::write(folder.join("planner.toml"), text).unwrap();
            Some(folder)
        };
        let folders = Folders {
            site: folder("site", site),
            rig: folder("rig", rig),
        };
        (dir, folders)
    }

    #[test]
    fn each_layer_changes_what_it_says_and_nothing_else() {
        let (dir, folders) = folders(
            "[search]\npopulation = 40\nsearches = 2\n",
            "[search]\npopulation = 50\n[lob.throw]\ntail_s = 1.25\n",
        );
        let run = dir.path().join("mine.toml");
        std::fs::write(&run, "[search]\nsearches = 5\n").unwrap();
        let layers = Layers::read(Kind::Planner, &folders, Some(&run)).unwrap();
        let config: PlannerConfig = layers.get().unwrap();
        let mut expected = PlannerConfig::default();
        expected.search.population = 50;
        expected.search.searches = 5;
        expected.lob.throw.tail_s = 1.25;
        assert_eq!(config, expected);

        let values = layers.effective_values();
        let layer_of = |key: &str| values.iter().find(|t| t.key == key).unwrap().layer.name;
        assert_eq!(layer_of("search.population"), "rig");
        assert_eq!(layer_of("search.searches"), "run");
        assert_eq!(layer_of("lob.throw.tail_s"), "rig");
        assert_eq!(layer_of("lob.throw.observed_s"), "built in");
    }

    #[test]
    fn nothing_but_what_is_built_in_are_the_defaults() {
        for kind in Kind::value_variants() {
            Layers::read(*kind, &Folders::default(), None).unwrap();
        }
        let planner = Layers::read(Kind::Planner, &Folders::default(), None).unwrap();
        let config: PlannerConfig = planner.get().unwrap();
        assert_eq!(config, PlannerConfig::default());
    }
}
