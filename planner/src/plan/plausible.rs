//! Ropes that can be simulated but hardly thrown: more than the arm carries, or values that look
//! like another unit's.

use super::PlanError;
use shared_types::RopeParams;
use shared_types::rope::RANGES;

/// Rated payload of an xArm 7 (kg).
const PAYLOAD_KG: f64 = 3.5;
/// Factor beyond the end of a range from which a value is pointed out.
const FAR: f64 = 2.0;

/// Refuses a rope that the arm does not carry.
pub(super) fn check_payload(rope: &RopeParams) -> Result<(), PlanError> {
    let mass_kg = rope.mass_per_length_kg_per_m * rope.length_m + rope.lead_mass_kg;
    if mass_kg <= PAYLOAD_KG {
        return Ok(());
    }
    Err(PlanError::Payload {
        mass_kg,
        payload_kg: PAYLOAD_KG,
    })
}

/// Points out each parameter far beyond its range: a plan for it may be exact, and yet be one for
/// no rope that anybody has.
pub(super) fn far_outside(rope: &RopeParams) -> impl Iterator<Item = String> {
    let values = RANGES.iter().zip(rope.to_array());
    let far = values.filter(|(range, value)| *value > FAR * range.max || *value < range.min / FAR);
    far.map(|(range, value)| {
        format!(
            "the rope's `{}` is {value}, far from the {} to {} {} of ropes that throws were checked with: is it right, and in this unit?",
            range.key, range.min, range.max, range.unit
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ropes::random_rope;

    #[test]
    fn ropes_of_the_ranges_are_fine_and_others_are_pointed_out_by_key() {
        for seed in 0..100 {
            let rope = random_rope(seed);
            assert!(check_payload(&rope).is_ok());
            assert_eq!(far_outside(&rope).count(), 0);
        }
        let said = |rope: RopeParams| far_outside(&rope).collect::<Vec<_>>().join("; ");
        let large = RopeParams {
            lead_radius_m: 0.2,
            ..random_rope(1)
        };
        assert!(said(large).contains("`lead_radius_m` is 0.2, far from"));
        let heavy = RopeParams {
            lead_mass_kg: 3.0,
            ..large
        };
        assert!(check_payload(&heavy).is_ok() && said(heavy).contains("`lead_mass_kg` is 3"));
    }
}
