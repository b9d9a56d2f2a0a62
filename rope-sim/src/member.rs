//! A rope among those advanced side by side.

use crate::base_path::BasePath;
use crate::extras::RopeExtras;
use shared_types::RopeParams;

/// One rope of a group.
pub(crate) struct Member<'a> {
    pub(crate) rope: &'a RopeParams,
    pub(crate) path: &'a BasePath,
    pub(crate) extras: RopeExtras,
    /// Paths of the arm links that carry obstacles.
    pub(crate) arm: Vec<BasePath>,
    /// Attitudes of the links at the start, scalar first.
    pub(crate) links: Vec<[f64; 4]>,
}
