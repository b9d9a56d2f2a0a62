//! The page: the scene, histograms and colours of the report, with a script of its own.

use crate::report::{PLOTS, STYLE, VIEW};
use std::sync::LazyLock;

/// What the scripts of the live page find by name in the page that loads them.
pub const IDS: [&str; 17] = [
    "title",
    "note",
    "asking",
    "asks",
    "asknote",
    "answer",
    "stages",
    "view",
    "eyebuttons",
    "viewnote",
    "eye",
    "picture",
    "picturenote",
    "controller",
    "loopnote",
    "jitter",
    "pair",
];

pub(crate) const HTML: &str = include_str!("../../assets/watch/page.html");
const OWN_STYLE: &str = include_str!("../../assets/watch/watch.css");
const OWN_SCRIPT: &str = include_str!("../../assets/watch/watch.js");

/// The scripts of the live page, in the order in which they are loaded.
pub fn script() -> &'static str {
    static WHOLE: LazyLock<String> = LazyLock::new(|| [VIEW, PLOTS, OWN_SCRIPT].join("\n"));
    &WHOLE
}

/// Colours and layout of the live page.
pub fn style() -> &'static str {
    static WHOLE: LazyLock<String> = LazyLock::new(|| [STYLE, OWN_STYLE].join("\n"));
    &WHOLE
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_loads_nothing_from_elsewhere_and_takes_no_text_for_markup() {
        let whole = [HTML, style(), script()].concat();
        let left = whole.replace("http://www.w3.org/2000/svg", "");
        for word in [
            "http:",
            "https:",
            "//cdn",
            "url(",
            "innerHTML",
            "eval(",
            "document.cookie",
        ] {
            assert!(!left.contains(word), "`{word}` is in the page");
        }
        for line in HTML
            .lines()
            .filter(|l| l.contains("src=") || l.contains("href="))
        {
            assert!(!line.contains("=\"/") && !line.contains("://"), "{line}");
        }
    }
}
