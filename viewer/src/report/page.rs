//! The page: style, script and data in one file.

use super::data::ReportData;

/// Most bytes of a report, so that it can be sent by mail.
pub(crate) const SIZE_MAX_BYTES: usize = 6_000_000;

const PAGE: &str = include_str!("../../assets/report/page.html");
/// Colours and layout, shared with the live page.
pub const STYLE: &str = include_str!("../../assets/report/style.css");
/// Arm, rope and target in space, shared with the live page.
pub const VIEW: &str = concat!(
    include_str!("../../assets/report/space.js"),
    include_str!("../../assets/report/handle.js"),
    include_str!("../../assets/report/view.js")
);
/// Curves, histograms, tables, shared with the live page.
pub const PLOTS: &str = include_str!("../../assets/report/plots.js");
const SCRIPT: &str = concat!(
    include_str!("../../assets/report/replay.js"),
    include_str!("../../assets/report/report.js")
);

/// The whole page. The parts of the program go in first and the run's data last, so
/// that nothing in a run can stand for one of them.
pub(crate) fn page(data: &ReportData) -> anyhow::Result<String> {
    let script = [VIEW, PLOTS, SCRIPT].join("\n");
    let frame = PAGE
        .replace("/*STYLE*/", STYLE)
        .replace("/*SCRIPT*/", &script);
    Ok(frame.replacen("/*DATA*/", &harmless(&serde_json::to_string(data)?), 1))
}

/// JSON that cannot end the element it stands in: the same text, with every
/// character that means something to HTML as an escape.
fn harmless(json: &str) -> String {
    json.replace('<', "\\u003c")
        .replace('>', "\\u003e")
        .replace('&', "\\u0026")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_page_asks_nobody_for_anything() {
        let whole = [PAGE, STYLE, VIEW, PLOTS, SCRIPT].concat();
        // Names of XML vocabularies are compared, never fetched.
        let left = whole.replace("http://www.w3.org/2000/svg", "");
        for word in [
            "http:",
            "https:",
            "fetch(",
            "XMLHttp",
            "import ",
            "url(",
            "innerHTML",
        ] {
            assert!(!left.contains(word), "`{word}` is in the page");
        }
        assert!(PAGE.contains("default-src 'none'"));
        for place in ["/*STYLE*/", "/*SCRIPT*/", "/*DATA*/"] {
            assert_eq!(PAGE.matches(place).count(), 1, "{place}");
        }
        assert!(![STYLE, VIEW, PLOTS, SCRIPT].concat().contains("/*DATA*/"));
    }
}
