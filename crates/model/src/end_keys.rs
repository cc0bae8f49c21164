//! Rules of the ends of a chain: `slider.left_end`, `slider.right_end`.

use crate::choices::End;
use crate::lattice_keys::Refusal;
use crate::laws::FrictionLaw;
use crate::scenario::Scenario;

/// Checks the rules. Free ends are accepted.
pub(crate) fn refused(scenario: &Scenario) -> Vec<Refusal> {
    let slider = &scenario.slider;
    let (ends, law) = ([slider.left_end, slider.right_end], scenario.friction.law);
    let why = if slider.is_lattice() {
        let what = scenario.elastic().table.name;
        let chain = if slider.is_over_area() { "slider.across = 1" } else { "slider.rows = 1" };
        Some((format!("is an end of a chain, and a {what} has sides"), chain.to_owned()))
    } else if slider.blocks == 1 {
        Some(("is an end of a chain, and one block has none".to_owned(), "slider.blocks from 2".to_owned()))
    } else if !law.sticks() || law == FrictionLaw::Junctions {
        let known = [FrictionLaw::InterfacialSprings, FrictionLaw::Rigid, FrictionLaw::VelocityWeakening];
        let words = known.map(|law| format!("{:?}", law.word())).join(" or ");
        let problem = format!("is not derived for friction.law = {:?}", law.word());
        Some((problem, format!("friction.law = {words}")))
    } else {
        None
    };
    let keys = ["slider.left_end", "slider.right_end"].into_iter().zip(ends);
    if let Some((problem, accepted)) = why {
        let not_free = keys.filter(|(_, end)| *end != End::Free);
        return not_free
            .map(|(key, end)| {
                (key, format!("{:?} {problem}", end.word()), format!("\"free\", or {accepted}"))
            })
            .collect();
    }
    let is_joined = ends.map(|end| end == End::Periodic);
    if is_joined[0] == is_joined[1] {
        return Vec::new();
    }
    let alone = keys.zip(is_joined).find(|(_, is_joined)| *is_joined);
    let other = if is_joined[0] { "slider.right_end" } else { "slider.left_end" };
    alone
        .map(|((key, _), _)| {
            let problem = format!("\"periodic\" joins both ends, and {other} is another");
            (key, problem, format!("{other} = \"periodic\" as well, or another end"))
        })
        .into_iter()
        .collect()
}
