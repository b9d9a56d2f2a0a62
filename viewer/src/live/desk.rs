//! What a page of the server offers beside looking on; who offers it knows what it means.

use super::http::Reply;
use std::fmt::Debug;

/// A request of a page that has the token.
#[derive(Debug, Clone, Copy)]
pub struct Asked<'a> {
    /// GET or POST.
    pub method: &'a str,
    /// What stands behind the token.
    pub path: &'a str,
    /// What follows a `?`.
    pub query: &'a str,
    /// Whether it came from this machine.
    pub is_local: bool,
}

impl<'a> Asked<'a> {
    /// A value of the query, as it stands there.
    #[must_use]
    pub fn value(&self, key: &str) -> Option<&'a str> {
        let mut pairs = self
            .query
            .split('&')
            .filter_map(|pair| pair.split_once('='));
        pairs.find_map(|(name, value)| (name == key).then_some(value))
    }
}

/// Answers before the server's own pages do; called by many threads at once.
pub trait Desk: Send + Sync + Debug {
    /// The answer; `None` where the request is not for it.
    fn answer(&self, asked: &Asked<'_>) -> Option<Reply>;
}
