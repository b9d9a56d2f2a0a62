//! The unit that a number was probably meant in.

/// Ends the refusal of a number far beyond `most`, the largest that makes sense, whose name
/// ends with its unit: it is probably in a smaller one.
#[must_use]
pub fn unit_hint(name: &str, value: f64, most: f64) -> &'static str {
    let is_far = value.is_finite() && value.abs() > 5.0 * most && !name.contains("_per_");
    let ends = |unit| is_far && name.ends_with(unit);
    if is_far && name.contains("_rad") {
        "; is it in degrees?"
    } else if ends("_m_s") {
        "; is it in mm/s?"
    } else if ends("_m") && value.abs() / 100.0 <= most {
        "; is it in cm or mm?"
    } else if ends("_m") {
        "; is it in mm?"
    } else if ends("_kg") {
        "; is it in g?"
    } else if ends("_s") {
        "; is it in ms?"
    } else {
        ""
    }
}
