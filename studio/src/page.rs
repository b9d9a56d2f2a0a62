//! The page: that of `wag watch`, with what one works with beside it.

use std::sync::LazyLock;
use viewer::live;

pub(crate) const HTML: &str = include_str!("../assets/page.html");
const STYLE: &str = include_str!("../assets/studio.css");
const SCRIPTS: [&str; 3] = [
    include_str!("../assets/reach.js"),
    include_str!("../assets/hold.js"),
    include_str!("../assets/studio.js"),
];

pub(crate) fn script() -> &'static str {
    static WHOLE: LazyLock<String> =
        LazyLock::new(|| [live::script(), &SCRIPTS.join("\n")].join("\n"));
    &WHOLE
}

pub(crate) fn style() -> &'static str {
    static WHOLE: LazyLock<String> = LazyLock::new(|| [live::style(), STYLE].join("\n"));
    &WHOLE
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_loads_nothing_from_elsewhere_and_takes_no_text_for_markup() {
        let whole = [HTML, STYLE, &SCRIPTS.concat()].concat();
        for word in ["http:", "https:", "url(", "innerHTML", "eval(", "cookie"] {
            assert!(!whole.contains(word), "`{word}` is in the page");
        }
        // What the live page's script finds by name must be there.
        for id in live::IDS {
            let place = format!("id=\"{id}\"");
            assert_eq!(HTML.matches(&place).count(), 1, "{id}");
        }
    }
}
