//! Scenario texts list the random offsets of friction, so that other programs need no generator.
//! The offsets follow from other keys, so any other list is refused.

use crate::disorder::Quantity;
use crate::keys::DRAWN_KEYS;
use crate::scenario::Scenario;
use crate::source::{Entries, LayerKind, ScenarioError, Written};

/// The keys that determine each list, besides its spread and, of coefficients, their mean.
const FOLLOWS_FROM: &[&str] = &[
    "slider.blocks",
    "slider.across",
    "slider.length_m",
    "friction.spread_seed",
    "friction.static_coefficient",
    "friction.dynamic_coefficient",
    "disorder.distribution",
    "disorder.weibull_modulus",
    "disorder.asperity_share",
    "disorder.correlation_length_m",
];

/// Refuses lists that differ from the drawn offsets, unless an override changes what is drawn.
pub(crate) fn check(scenario: &Scenario, entries: &Entries, errors: &mut Vec<ScenarioError>) {
    for (key, quantity) in DRAWN_KEYS.iter().zip(Quantity::ALL) {
        let (drawn, spread_key) = (quantity.drawn(scenario), quantity.spread_key());
        let Some(entry) = entries.values.get(key.path) else { continue };
        let is_override =
            |key: &str| entries.values.get(key).is_some_and(|entry| entry.layer == LayerKind::Override);
        if entry.layer != LayerKind::Override
            && FOLLOWS_FROM.iter().chain([&spread_key]).any(|key| is_override(key))
        {
            continue;
        }
        let Written::Numbers(written) = &entry.value else { continue };
        let problem = if written.len() != drawn.len() {
            format!(
                "{} numbers, where {spread_key} = {} draws {}",
                written.len(),
                quantity.spread(scenario),
                drawn.len()
            )
        } else {
            match written.iter().zip(&drawn).position(|(written, drawn)| written != drawn) {
                None => continue,
                Some(n) => format!(
                    "block {} has {}, where friction.spread_seed = {} draws {}",
                    n + 1,
                    written[n],
                    scenario.friction.spread_seed,
                    drawn[n]
                ),
            }
        };
        errors.push(ScenarioError {
            place: Some(entry.place.clone()),
            key: Some(key.path.to_owned()),
            problem,
            accepted: Some(format!(
                "what is drawn, or no such key; {} takes numbers of your own",
                quantity.offsets_key()
            )),
        });
    }
}

#[cfg(test)]
mod tests {
    use crate::{Plan, Scenario, ScenarioSource};

    fn resolve(source: &ScenarioSource) -> Result<Scenario, String> {
        Scenario::resolve(source).map_err(|errors| errors.to_string())
    }

    fn scattered() -> Scenario {
        let text = "slider.blocks = 4\nfriction.static_spread = 0.1\nfriction.spread_seed = 7";
        resolve(&ScenarioSource::new("mine.toml", text)).unwrap()
    }

    /// The lists of a shown scenario, parsed as another program would parse them.
    fn lists(shown: &str) -> toml::Table {
        let table: toml::Table = shown.parse().unwrap();
        table.get("drawn").map_or(toml::Table::new(), |drawn| drawn.as_table().unwrap().clone())
    }

    #[test]
    fn what_was_drawn_is_shown_to_the_last_digit() {
        let scenario = scattered();
        let drawn = lists(&scenario.to_commented_toml());
        assert_eq!(drawn.keys().collect::<Vec<_>>(), ["static_offsets"], "nothing else was drawn");
        let offsets: Vec<f64> =
            drawn["static_offsets"].as_array().unwrap().iter().map(|v| v.as_float().unwrap()).collect();
        let plan = Plan::new(&scenario);
        for (n, offset) in offsets.iter().enumerate() {
            let expected = (0.7 + 0.0 + offset) * plan.normal_load_n[n];
            assert_eq!(plan.friction.static_threshold_n[n], expected, "block {}", n + 1);
        }
        assert!(lists(&resolve(&ScenarioSource::new("", "")).unwrap().to_commented_toml()).is_empty());
    }

    #[test]
    fn texts_that_say_something_else_are_refused() {
        let shown = scattered().to_commented_toml();
        let as_shown = resolve(&ScenarioSource::new("mine.toml", &shown)).unwrap();
        assert_eq!(as_shown, scattered());
        let line =
            shown.lines().find(|line| line.starts_with("static_offsets = [") && line.len() > 30).unwrap();
        let other = shown.replace(line, "static_offsets = [0.01, 0.02, 0.03, 0.04]");
        for source in [ScenarioSource::new("mine.toml", &other), ScenarioSource::logged("mine.toml", &other)]
        {
            let error = resolve(&source).unwrap_err();
            assert!(
                error.contains(
                    "drawn.static_offsets: block 1 has 0.01, where friction.spread_seed = 7 draws "
                )
            );
            assert!(error.ends_with(
                "(accepted: what is drawn, or no such key; friction.static_offsets takes numbers of your own)"
            ));
        }
        let short = shown.replace(line, "static_offsets = [0.01]");
        let error = resolve(&ScenarioSource::new("mine.toml", short)).unwrap_err();
        assert!(error.contains("1 numbers, where friction.static_spread = 0.1 draws 4"), "{error}");
        let error = resolve(&ScenarioSource::new("mine.toml", "drawn.dynamic_offsets = [1]")).unwrap_err();
        assert!(error.contains("where friction.dynamic_spread = 0 draws 0"), "{error}");
        let error = resolve(&ScenarioSource::new("mine.toml", "drawn.dynamic_offsets = 1")).unwrap_err();
        assert!(error.contains("drawn.dynamic_offsets: 1 is not accepted (accepted: a list, "), "{error}");
        let error = resolve(&ScenarioSource::new("mine.toml", "drawn.offsets = [1]")).unwrap_err();
        assert!(error.contains("drawn.offsets: unknown key"), "{error}");
    }

    #[test]
    fn overrides_draw_anew() {
        let shown = scattered().to_commented_toml();
        for set in ["friction.spread_seed=8", "friction.static_spread=0", "slider.blocks=5"] {
            let anew = resolve(&ScenarioSource::logged("run.mcap", &shown).with_override(set)).unwrap();
            assert_ne!(anew.hash(), scattered().hash());
            assert_ne!(lists(&anew.to_commented_toml()), lists(&shown));
        }
        // The other coefficient and the duration leave the list unchanged.
        let source = ScenarioSource::logged("run.mcap", &shown).with_override("friction.dynamic_spread=0.01");
        let both = lists(&resolve(&source).unwrap().to_commented_toml());
        assert_eq!(both["static_offsets"], lists(&shown)["static_offsets"]);
        assert_eq!(both.len(), 2);
    }
}
