//! The known name nearest to one that is not.

/// Edits up to which a name counts as a slip of another.
const SLIP: usize = 3;

/// What a refusal of an unknown key should have said too, if a known one is near.
///
/// The refusal names the key and the known ones in backticks, as serde does.
pub(crate) fn suggestion(refusal: &str) -> Option<String> {
    let mut names = refusal
        .split_once("unknown field ")?
        .1
        .split('`')
        .skip(1)
        .step_by(2);
    let unknown = names.next()?;
    names
        .map(|known| (strsim::damerau_levenshtein(unknown, known), known))
        .filter(|(edits, known)| *edits <= SLIP && *edits < known.len())
        .min()
        .map(|(_, known)| format!("did you mean `{known}`?"))
}

#[cfg(test)]
mod tests {
    use super::suggestion;

    #[test]
    fn a_slip_is_told_and_a_stranger_is_not() {
        let refusal =
            "unknown field `populaton`, expected one of `dimensions`, `population`, `seed`";
        assert_eq!(
            suggestion(refusal).as_deref(),
            Some("did you mean `population`?")
        );
        let stranger = "unknown field `frobnicate`, expected `dimensions` or `seed`";
        assert_eq!(suggestion(stranger), None);
        assert_eq!(suggestion("missing field `seed`"), None);
    }
}
