//! Formats a scenario as TOML to read and to edit, with comments from the key table.

use std::ops::Bound;

use asperity_record::TimeGrid;
use asperity_record::bounds::{LONGEST_TOML_BYTES, check_toml};
use toml::Value;

use crate::plan::derive::ADVISED_SHARE;
use crate::plan::disorder::Quantity;
use crate::scenario::Scenario;
use crate::scenario::choices::ParameterSet;
use crate::scenario::keys::{KEYS, Key, Kind, WINDOW, Window};
use crate::scenario::meaning;
use crate::scenario::source::{Entries, ScenarioError};
use crate::scenario::stand_ins;

impl Scenario {
    /// Formats the scenario as complete TOML, every key with its symbol, range and meaning.
    pub fn to_commented_toml(&self) -> String {
        self.write_toml(false)
    }

    /// Formats the scenario for editing: values that follow from the parameter set are commented
    /// out, so that they change with it. Written out, they would remain those of one set under the
    /// name of the other.
    pub fn to_editable_toml(&self) -> String {
        self.write_toml(true)
    }

    fn write_toml(&self, leave_to_parameter_set: bool) -> String {
        let values = self.values();
        let mut out = String::new();
        let mut table = "";
        for (key, found) in KEYS.iter().zip(&values) {
            let (section, name) = key.path.rsplit_once('.').unwrap_or(("", key.path));
            if section != table {
                out.push_str(&format!("\n[{section}]\n"));
                table = section;
            }
            let default = key.default_in(self.parameter_set == ParameterSet::AsCoded);
            let follows_set = key.follows_set()
                && default == Some(found)
                && (key.path != stand_ins::MASS || stand_ins::has_default_sides(&self.slider));
            let left_to = if leave_to_parameter_set && follows_set {
                Some("parameter_set")
            } else {
                // Left out, so that another law brings its own default.
                meaning::is_decided_by_law(key.path, self.friction.law, found).then_some("friction.law")
            };
            comment_and_value(&mut out, key, name, found, left_to);
            if leave_to_parameter_set && key.path == "time.step_s" && self.friction.law.sticks() {
                out.push_str(&self.comment_on_step());
            }
        }
        self.write_drawn(&mut out, if leave_to_parameter_set { "# " } else { "" });
        if leave_to_parameter_set && self.recording.window.is_empty() {
            out.push_str(&self.example_of_a_window());
        }
        for window in &self.recording.window {
            out.push_str("\n[[recording.window]]\n");
            for (key, found) in Window::keys().iter().zip(&window.values()) {
                comment_and_value(&mut out, key, key.path, found, None);
            }
        }
        out
    }
}

impl Scenario {
    /// The keys with their values: all but those that its friction law or a medium decides.
    pub fn stated(&self) -> impl Iterator<Item = (&'static Key, Value)> {
        let (law, is_in_medium) = (self.friction.law, self.slider.is_in_medium());
        KEYS.iter().zip(self.values()).filter(move |(key, value)| {
            let is_idle = is_in_medium && meaning::is_idle_in_a_medium(key.path);
            !is_idle && !meaning::is_decided_by_law(key.path, law, value)
        })
    }

    /// Lists what is drawn for each contact, so that other programs need no generator. Logs have it as a table, which
    /// nothing reads here; what is edited has it as comments.
    fn write_drawn(&self, out: &mut String, start: &str) {
        let mut heading = format!("\n{start}[drawn]\n");
        for (of, to) in Quantity::ALL.into_iter().zip(["mu_s", "mu_d", "k_t, over k_t", "p, over p"]) {
            let drawn = of.drawn(self);
            if drawn.is_empty() {
                continue;
            }
            out.push_str(&std::mem::take(&mut heading));
            let how = match of {
                Quantity::Static => {
                    "block by block, drawn with friction.spread_seed; for information, they cannot be set"
                }
                _ => "likewise",
            };
            let (spread, kind) = (of.spread_key(), Kind::Numbers(Bound::Unbounded, Bound::Unbounded));
            let about = format!("Offsets that {spread} adds to {to}, {how}. Accepted: {kind}.");
            out.push_str(&commented("# ", &about));
            let (_, name) = of.offsets_key().rsplit_once('.').expect("lists stand in sections");
            out.push_str(&format!("{start}{name} = {}\n", toml::Value::from(drawn)));
        }
    }

    /// Why the text in its log would be longer than any reader accepts; `None` if it is not.
    pub(crate) fn too_long_for_a_log(&self, entries: &Entries) -> Option<ScenarioError> {
        let values = self.values();
        let drawn = Quantity::ALL.iter().filter(|of| of.spread(self) != 0.0).count();
        // Most are far from it, which takes no text to see.
        let most_bytes = values.iter().map(most_bytes).sum::<usize>()
            + drawn * self.slider.contacts() as usize * LONGEST_NUMBER_BYTES;
        if most_bytes <= LONGEST_TOML_BYTES / 2 {
            return None;
        }
        let too_long = check_toml(&self.to_commented_toml()).err()?;
        let own = KEYS.iter().zip(&values).map(|(key, value)| (value.to_string().len(), key.path));
        let of_draws = Quantity::ALL.iter().map(|of| {
            let drawn: Vec<String> = of.drawn(self).iter().map(f64::to_string).collect();
            (drawn.join(", ").len(), of.spread_key())
        });
        let windows = values.last().map_or(0, |windows| windows.to_string().len());
        let (bytes, key) = own.chain(of_draws).chain([(windows, WINDOW)]).max()?;
        let problem = format!("with {bytes} bytes for it, a log of this scenario would hold {too_long}");
        Some(entries.error(key, problem, "fewer blocks, times or windows, or shorter numbers"))
    }

    /// Formats a dense window over the whole run and all blocks, commented out.
    fn example_of_a_window(&self) -> String {
        let grid = TimeGrid::new(self.time.step_s);
        let every_steps = (grid.nearest_step(self.time.duration_s) / 1000).max(1);
        let example = |key: &str| match key {
            "to_s" => toml::Value::Float(self.time.duration_s),
            "every_s" => toml::Value::Float(grid.time_s(every_steps)),
            "first_block" => toml::Value::Integer(1),
            "last_block" => toml::Value::Integer(i64::from(self.slider.blocks)),
            _ => toml::Value::Float(0.0),
        };
        let mut out = "\n# Dense windows record chosen blocks at short intervals; there may be any number.\n\
                       # This one is an example; uncomment its lines for a window.\n# [[recording.window]]\n"
            .to_owned();
        for key in Window::keys() {
            out.push_str(&commented("#   ", &format!("{} Accepted: {}.", key.doc, key.kind)));
            out.push_str(&format!("# {} = {}\n", key.path, example(key.path)));
        }
        out
    }

    /// Formats the ratio of the time step to the limit of stability.
    fn comment_on_step(&self) -> String {
        let longest_s = self.longest_stable_step_s();
        let share = self.time.step_s / longest_s;
        let advice = match share > ADVISED_SHARE {
            true => {
                "; above this, blocks that switch pump energy into the slider: compare with a shorter one"
            }
            false => "",
        };
        let text = format!(
            "dt_max = {longest_s:.3e} s: from there on the scheme is unstable even if no block switches. This step is \
             {share:.2e} dt_max; at most {ADVISED_SHARE} is advised{advice}."
        );
        commented("# ", &text)
    }
}

/// The longest number as TOML, which has no exponents: 1e-30 with 17 digits and a sign, and what separates numbers.
const LONGEST_NUMBER_BYTES: usize = 54;

/// Bytes that the value of a key has at most in the text of a scenario, with its comments.
fn most_bytes(value: &toml::Value) -> usize {
    1000 + match value {
        // Control characters are written as six.
        toml::Value::String(text) => 6 * text.len(),
        toml::Value::Array(values) if values.iter().all(|value| !value.is_table()) => {
            values.len() * LONGEST_NUMBER_BYTES
        }
        toml::Value::Array(windows) => windows.len() * 1000 * Window::keys().len(),
        _ => LONGEST_NUMBER_BYTES,
    }
}

/// Writes a key with its meaning, commented out where another key decides its value.
fn comment_and_value(
    out: &mut String,
    key: &Key,
    name: &str,
    value: &toml::Value,
    left_to: Option<&'static str>,
) {
    let symbol = if key.symbol.is_empty() { String::new() } else { format!("{}: ", key.symbol) };
    out.push_str(&commented("# ", &format!("{symbol}{} Accepted: {}.", key.doc, key.kind)));
    match left_to {
        Some(other) => {
            out.push_str(&format!("# {name} = {value}  # from {other}; uncomment to fix it\n"));
        }
        None => out.push_str(&format!("{name} = {value}\n")),
    }
}

/// A text as lines of at most 100 characters, each behind `start`.
fn commented(start: &str, text: &str) -> String {
    let mut out = String::new();
    let mut width = usize::MAX;
    for word in text.split_whitespace() {
        width = width.saturating_add(1 + word.len());
        if width > 100 {
            out.push_str(&format!("\n{start}"));
            width = start.len() + word.len();
        } else {
            out.push(' ');
        }
        out.push_str(word);
    }
    format!("{}\n", out.trim_start())
}

#[cfg(test)]
mod tests {
    use crate::scenario::Scenario;
    use crate::scenario::source::{ScenarioErrors, ScenarioSource};

    fn resolve(text: &str) -> Result<Scenario, ScenarioErrors> {
        Scenario::resolve(&ScenarioSource::new("test.toml", text))
    }

    #[test]
    fn shown_scenarios_resolve_to_themselves() {
        for (name, text) in crate::scenario::builtin::all() {
            let scenario = resolve(text).unwrap_or_else(|errors| panic!("{name}: {errors}"));
            assert_eq!(scenario.name, name);
            assert!(!scenario.summary.is_empty(), "{name} has no summary");
            assert_eq!(resolve(&scenario.to_editable_toml()).unwrap(), scenario);
            let source = ScenarioSource::logged("run.mcap", scenario.to_commented_toml());
            assert_eq!(Scenario::resolve(&source).unwrap(), scenario);
        }
    }

    #[test]
    fn what_was_drawn_is_listed_to_the_last_digit_and_passed_over_in_logs() {
        let text = "slider.blocks = 4\nfriction.static_spread = 0.1\nfriction.spread_seed = 7";
        let scenario = resolve(text).unwrap();
        let logged = scenario.to_commented_toml();
        let table: toml::Table = logged.parse().unwrap();
        let drawn = table["drawn"].as_table().unwrap();
        assert_eq!(drawn.keys().collect::<Vec<_>>(), ["static_offsets"], "nothing else was drawn");
        let offsets = drawn["static_offsets"].as_array().unwrap().iter().map(|v| v.as_float().unwrap());
        let plan = crate::Plan::new(&scenario);
        for (n, offset) in offsets.enumerate() {
            let expected = (0.7 + 0.0 + offset) * plan.normal_load_n[n];
            assert_eq!(plan.friction.static_threshold_n[n], expected, "block {}", n + 1);
        }
        let list =
            &logged[logged.find("\nstatic_offsets = [0").or(logged.find("\nstatic_offsets = [-")).unwrap()..];
        assert!(scenario.to_editable_toml().contains(&list.replace('\n', "\n# ")[..60]));
        let refused = resolve("drawn.static_offsets = [0.1]").unwrap_err().to_string();
        assert!(
            refused.contains("drawn.static_offsets: unknown key, set to [0.1]; did you mean friction.static")
        );
        for (set, is_same) in [("friction.spread_seed=8", false), ("friction.dynamic_spread=0.01", true)] {
            let source = ScenarioSource::logged("run.mcap", &logged).with_override(set);
            let again: toml::Table = Scenario::resolve(&source).unwrap().to_commented_toml().parse().unwrap();
            assert_eq!(again["drawn"]["static_offsets"] == drawn["static_offsets"], is_same, "{set}");
        }
    }

    /// The example of a dense window is valid: uncommented, it is accepted and describes what it
    /// shows.
    #[test]
    fn the_window_shown_as_an_example_is_a_window() {
        for (name, text) in crate::scenario::builtin::all().step_by(4) {
            let scenario = resolve(text).unwrap();
            let shown = scenario.to_editable_toml();
            if !scenario.recording.window.is_empty() {
                assert!(!shown.contains("# [[recording.window]]"), "{name}");
                continue;
            }
            let is_of_example = |line: &str| {
                line.starts_with("# [[") || line.split(' ').nth(2) == Some("=") && !line.contains("uncomment")
            };
            let from = shown.find("\n# Dense windows").unwrap();
            let lines = shown[from..].lines();
            let lines = lines.map(|line| if is_of_example(line) { &line[2..] } else { line });
            let uncommented = shown[..from].to_owned() + &lines.collect::<Vec<&str>>().join("\n");
            let windows =
                resolve(&uncommented).unwrap_or_else(|errors| panic!("{name}: {errors}")).recording.window;
            assert_eq!(windows.len(), 1, "{name}");
            assert_eq!(
                (windows[0].to_s, windows[0].last_block),
                (scenario.time.duration_s, scenario.slider.blocks)
            );
        }
        assert!(!resolve("").unwrap().to_commented_toml().contains("Dense windows"), "logs have no examples");
    }

    /// Each list at its longest and with the longest numbers, alone and with the others.
    #[test]
    fn what_is_accepted_is_accepted_again_as_a_log_has_it() {
        let long = |text: &str| vec![text; 100_000].join(",");
        let (offsets, ratios) = (long("-1.2345678901234567e-30"), long("1.2345678901234567e-30"));
        let mut text = String::from("slider.blocks = 100000\ntime.step_s = 1e-10\ntime.duration_s = 1e-9\n");
        let mut refused = 0;
        for key in [
            "friction.static_offsets",
            "disorder.stiffness_offsets",
            "disorder.load_offsets",
            "prestress.profile",
        ] {
            let numbers = if key.contains("offsets") { &offsets } else { &ratios };
            text.push_str(&format!("{key} = [{numbers}]\n"));
            match resolve(&text) {
                Ok(scenario) => {
                    let source = ScenarioSource::logged("run.mcap", scenario.to_commented_toml());
                    assert_eq!(Scenario::resolve(&source).unwrap(), scenario, "{key}");
                }
                Err(errors) => {
                    assert!(errors.to_string().contains(" a log of this scenario would hold "), "{errors}");
                    refused += 1;
                }
            }
        }
        assert!(refused > 0);
    }

    /// With mass and damping written out, the set as-coded once ran under the name of the set
    /// as-stated.
    #[test]
    fn an_edited_scenario_follows_its_parameter_set() {
        let shown = resolve("").unwrap().to_editable_toml();
        let source = ScenarioSource::new("mine.toml", shown).with_override("parameter_set=as-stated");
        let stated = resolve("parameter_set = \"as-stated\"").unwrap();
        assert_eq!(Scenario::resolve(&source).unwrap(), stated);
        // Values set on purpose stay.
        let heavy = resolve("slider.mass_kg = 3").unwrap().to_editable_toml();
        let source = ScenarioSource::new("mine.toml", heavy).with_override("parameter_set=as-stated");
        assert_eq!(Scenario::resolve(&source).unwrap().slider.mass_kg, 3.0);
    }
}
