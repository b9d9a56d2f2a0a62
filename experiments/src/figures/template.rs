//! Figures in documents: a block's template, in a comment that readers do not see, and below it what
//! becomes of it with the figures of the records.
//!
//! `{strike.miss_m.median:cm2}` is the field `median` of `miss_m` of the study `strike`, in
//! centimetres with two decimals. Units: `cm` and `mm` of metres, `ms` of seconds, `%` of a
//! fraction, or none.

use anyhow::{Context, anyhow, bail};
use serde_json::Value;

const BEGIN: &str = "<!-- figures\n";
const BODY: &str = "\n-->\n";
const END: &str = "<!-- end of figures -->";

/// The document with every block made anew; `numbers` gives the figures of a study. Also how many
/// blocks there are.
pub fn fill(
    document: &str,
    mut numbers: impl FnMut(&str) -> anyhow::Result<Value>,
) -> anyhow::Result<(String, usize)> {
    let mut made = String::with_capacity(document.len());
    let mut rest = document;
    let mut blocks = 0;
    while let Some((before, after)) = rest.split_once(BEGIN) {
        let line = document[..document.len() - after.len()]
            .matches('\n')
            .count();
        let fail = || format!("block of figures that begins in line {line}");
        let unended = || format!("has no `{}` or no `{END}`", BODY.trim());
        let split = after.split_once(BODY).and_then(|(template, body)| {
            let (_, rest) = body.split_once(END)?;
            Some((template, rest))
        });
        let (template, after) = split.with_context(unended).with_context(fail)?;
        let text = render(template, &mut numbers).with_context(fail)?;
        made += &[before, BEGIN, template, BODY, &text, "\n", END].concat();
        rest = after;
        blocks += 1;
    }
    Ok((made + rest, blocks))
}

fn render(
    template: &str,
    numbers: &mut impl FnMut(&str) -> anyhow::Result<Value>,
) -> anyhow::Result<String> {
    let mut text = String::new();
    let mut rest = template;
    while let Some((before, after)) = rest.split_once('{') {
        let (place, after) = after.split_once('}').context("a `{` without its `}`")?;
        let (path, format) = place.split_once(':').unwrap_or((place, ""));
        let (study, field) = path
            .split_once('.')
            .with_context(|| format!("`{{{place}}}` is not {{STUDY.FIELD:FORMAT}}"))?;
        let found = numbers(study)?;
        let value = found
            .pointer(&format!("/{}", field.replace('.', "/")))
            .with_context(|| format!("the study `{study}` has no figure `{field}`"))?;
        text += before;
        text += &formatted(value, format).with_context(|| format!("`{{{place}}}`"))?;
        rest = after;
    }
    Ok(text + rest)
}

fn formatted(value: &Value, format: &str) -> anyhow::Result<String> {
    let unit = format.trim_end_matches(|c: char| c.is_ascii_digit());
    let digits = &format[unit.len()..];
    let factor = match unit {
        "" => 1.0,
        "cm" | "%" => 100.0,
        "mm" | "ms" => 1000.0,
        _ => bail!("unit `{unit}`: cm, mm, ms, % or none"),
    };
    match (value, digits) {
        (Value::String(text), "") if unit.is_empty() => Ok(text.clone()),
        (Value::Number(number), "") if unit.is_empty() => Ok(number.to_string()),
        (Value::Number(number), _) => {
            let number = number.as_f64().context("not a number that can be shown")?;
            let digits: usize = digits
                .parse()
                .map_err(|_e| anyhow!("decimals are missing"))?;
            Ok(format!("{:.digits$}", factor * number))
        }
        _ => bail!("is no figure that can be shown so: {value}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    fn numbers(study: &str) -> anyhow::Result<Value> {
        anyhow::ensure!(study == "strike", "no study `{study}`");
        Ok(json!({ "n": 30, "commit": "c3b4e48", "ok": {"rate": 0.95}, "miss_m": {"max": 0.0123} }))
    }

    #[test]
    fn blocks_are_filled_and_what_is_around_them_stays() {
        let document = "before\n<!-- figures\n| n | {strike.n} at {strike.commit} | {strike.miss_m.max:cm2} cm | {strike.ok.rate:%0} % |\n-->\nold\nlines\n<!-- end of figures -->\nafter\n";
        let (made, blocks) = fill(document, numbers).unwrap();
        assert_eq!(blocks, 1);
        assert!(
            made.contains("-->\n| n | 30 at c3b4e48 | 1.23 cm | 95 % |\n<!-- end"),
            "{made}"
        );
        assert!(made.starts_with("before\n<!--") && made.ends_with("-->\nafter\n"));
        assert!(!made.contains("old"));
        assert_eq!(fill(&made, numbers).unwrap(), (made, 1));
    }

    #[test]
    fn what_cannot_be_filled_is_named_with_its_line() {
        let told = |template: &str| {
            let document = format!("one\n<!-- figures\n{template}\n-->\n<!-- end of figures -->\n");
            format!("{:#}", fill(&document, numbers).unwrap_err())
        };
        for (template, words) in [
            ("{lob.n}", "no study `lob`"),
            ("{strike.hit}", "no figure `hit`"),
            ("{strike.n", "without its"),
            ("{strike}", "STUDY.FIELD"),
            ("{strike.miss_m.max:km2}", "unit `km`"),
            ("{strike.miss_m.max:cm}", "decimals"),
            ("{strike.miss_m}", "no figure that can be shown"),
        ] {
            let error = told(template);
            assert!(error.contains("line 2") && error.contains(words), "{error}");
        }
        let error = format!(
            "{:#}",
            fill("<!-- figures\n{strike.n}\n", numbers).unwrap_err()
        );
        assert!(error.contains("end of figures"), "{error}");
    }
}
