//! What a studio works with.

use arm_model::JointTrajectory;
use run_log::CellHere;
use shared_types::Task;
use std::path::PathBuf;

/// The arm and camera that runs are made with.
#[derive(Debug, Clone)]
pub enum Cell {
    /// A simulated rig that belongs to the studio.
    Simulated {
        /// Seed of its rope and noise.
        seed: u64,
        /// What its camera is to see.
        task: Task,
    },
    /// What is there.
    Real {
        /// Arguments of `wag run` and `wag wiggle` that name arm and camera.
        reached_by: Vec<String>,
        /// Colour of the target, R,G,B.
        target_rgb: Option<String>,
        /// Shared-memory domain of the camera; none for a device.
        domain: Option<String>,
    },
}

impl Cell {
    /// Whether the arm is reached by a controller that runs already.
    pub(crate) fn is_service(&self) -> bool {
        match self {
            Self::Simulated { .. } => false,
            Self::Real { reached_by, .. } => reached_by.iter().any(|word| word == "--controller"),
        }
    }
}

/// What a studio works with.
#[derive(Debug)]
pub struct Settings {
    /// Arm and camera.
    pub cell: Cell,
    /// File of the cell, for every command.
    pub cell_file: Option<PathBuf>,
    /// Folder of the runs.
    pub runs: PathBuf,
    /// The arm's surroundings, where a run does not tell its own.
    pub here: CellHere,
    /// The wiggle, to look at.
    pub wiggle: JointTrajectory,
}

impl Settings {
    /// Arguments of every command.
    pub(crate) fn of_all(&self) -> Vec<String> {
        let file = self.cell_file.iter().map(|file| file.display().to_string());
        file.flat_map(|file| ["--cell".to_owned(), file]).collect()
    }
}
