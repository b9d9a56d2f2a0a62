//! What runs the scripts of shards.

use super::shards::Shards;

/// An engine that exists already. Dropped, it gives up what has not begun.
pub trait Engine {
    /// Hands over shards by their numbers, which rise.
    fn submit(&mut self, shards: &Shards, numbers: &[u64]) -> anyhow::Result<()>;

    /// Whether all that was handed over has ended, well or badly.
    fn is_over(&mut self, shards: &Shards) -> anyhow::Result<bool>;
}
