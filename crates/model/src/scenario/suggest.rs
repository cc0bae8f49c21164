//! Suggestions for a name that does not exist.
//!
//! Keys are matched by their symbol in the thesis (`mu_s`), then by the last part of their path
//! (`tilt`), then by a word of that part (`duration`), and finally by spelling; other names by
//! spelling, then by their parts.

use std::borrow::Borrow;

use crate::scenario::key::Key;
use crate::scenario::stand_ins;

/// Names longer than this, in bytes, get no suggestion: no key is nearly as long.
const LONGEST: usize = 100;

/// One letter in this many may be wrong.
const LETTERS_FOR_ONE_WRONG: usize = 3;

/// Most letters that may be wrong.
const MOST_WRONG: usize = 3;

/// Most names to suggest.
const MOST_SUGGESTED: usize = 3;

/// Shorter words are not searched for inside keys, where they would match units.
const SHORTEST_PART: usize = 3;

/// Symbols in use for keys besides those of the thesis' text.
const OTHER_SYMBOLS: &[(&str, &str)] = &[
    ("mu_k", "friction.dynamic_coefficient"),
    ("L", "slider.length_m"),
    ("l0", "friction.decay_length_m"),
    ("speed", "drive.velocity_m_per_s"),
    ("force", "normal_load.total_n"),
    ("force_n", "normal_load.total_n"),
    ("force", "drive.course_n"),
];

/// Names from other programs, with their equivalents here.
const MEANT: [(&str, &str); 2] = [("z", "colour"), ("value", "colour")];

/// Words in names with nearly the same meaning.
const ALIKE: [(&str, &str); 3] = [("load", "ft"), ("slip", "rupture"), ("time", "onset")];

/// Most names that are listed where one of them is accepted.
const MOST_LISTED: usize = 12;

/// Names listed of a longer list: those spelt most alike.
const NEAREST: usize = 5;

/// Returns the known names that may be meant: the one spelt most like `written`, if it is close enough to
/// be a slip; or those that contain it (`front_speed`, without the unit); or those that share most of its
/// parts, two at least.
pub(crate) fn names<'a>(written: &str, known: impl IntoIterator<Item = &'a str>) -> Vec<&'a str> {
    if written.len() > LONGEST {
        return Vec::new();
    }
    let plain = |name: &str| name.to_lowercase().replace(['-', ' ', '.'], "_");
    let known: Vec<(&str, String)> = known.into_iter().map(|name| (name, plain(name))).collect();
    let written = plain(written);
    let is_known = |meant: &str| known.iter().any(|(name, _)| *name == meant);
    if let Some((_, meant)) = MEANT.iter().find(|(other, meant)| *other == written && is_known(meant)) {
        return vec![meant];
    }
    let spelt = known.iter().filter_map(|(name, plain)| Some((wrong_letters(&written, plain)?, *name)));
    if let Some((_, name)) = spelt.min_by_key(|(wrong, _)| *wrong) {
        return vec![name];
    }
    let contains = |name: &str| format!("_{name}_").contains(&format!("_{written}_"));
    let mut found: Vec<&str> = Vec::new();
    if written.len() >= SHORTEST_PART {
        found.extend(known.iter().filter(|(_, plain)| contains(plain)).map(|(name, _)| *name));
    }
    if found.is_empty() {
        let is_alike = |part: &str, of: &str| part == of || ALIKE.contains(&(part, of));
        let shared = |plain: &str| {
            written.split('_').filter(|part| plain.split('_').any(|of| is_alike(part, of))).count()
        };
        let most = known.iter().map(|(_, plain)| shared(plain)).max().filter(|most| *most >= 2);
        let shares = |plain: &str| Some(shared(plain)) == most;
        found.extend(known.iter().filter(|(_, plain)| shares(plain)).map(|(name, _)| *name));
    }
    found.truncate(MOST_SUGGESTED);
    found
}

/// Returns the keys that an unknown dotted path may mean, in the order of the table.
pub(crate) fn keys(written: &str, known: &[&Key]) -> Vec<&'static str> {
    if written.len() > LONGEST {
        return Vec::new();
    }
    let (table, last) = split(written);
    let paths = |is_meant: &dyn Fn(&Key) -> bool| -> Vec<&'static str> {
        let all: Vec<&str> = known.iter().filter(|key| is_meant(key)).map(|key| key.path).collect();
        // Where a table was written, keys of that table take precedence.
        let is_inside = |path: &&str| wrong_letters(table, split(path).0).is_some();
        let inside: Vec<&str> = all.iter().copied().filter(is_inside).collect();
        if inside.is_empty() || table.is_empty() { all } else { inside }
    };
    let mut found = paths(&|key| split(key.path).1 == last || stands_for(last, key));
    if found.is_empty() && last.len() >= SHORTEST_PART {
        found = paths(&|key| format!("_{}_", split(key.path).1).contains(&format!("_{last}_")));
    }
    let spelt_like = |wrong: &dyn Fn(&Key) -> Option<usize>| {
        let least = known.iter().filter_map(|key| wrong(key)).min();
        paths(&|key| least.is_some() && wrong(key) == least)
    };
    if found.is_empty() {
        found = spelt_like(&|key| wrong_letters(written, key.path));
    }
    if found.is_empty() {
        found = spelt_like(&|key| wrong_letters(last, split(key.path).1));
    }
    if found.is_empty() {
        // Without its unit.
        found = spelt_like(&|key| {
            let parts = split(key.path).1.match_indices('_');
            parts.filter_map(|(end, _)| wrong_letters(last, &split(key.path).1[..end])).min()
        });
    }
    found.truncate(MOST_SUGGESTED);
    found
}

/// Formats `; did you mean ...?`, to append to an error message; empty without names.
pub(crate) fn did_you_mean<T: Borrow<str>>(names: &[T]) -> String {
    if names.is_empty() { String::new() } else { format!("; did you mean {}?", names.join(" or ")) }
}

/// `; did you mean ...?` of the known names that may be meant; empty if none is close enough.
pub fn suggestion<'a>(written: &str, known: impl IntoIterator<Item = &'a str>) -> String {
    did_you_mean(&names(written, known))
}

/// `; did you mean ...?` of the scenario keys that may be meant; empty if none is close enough.
pub fn key_suggestion(written: &str) -> String {
    did_you_mean(&keys(written, &stand_ins::ALL_KEYS))
}

/// `; did you mean ...? (accepted: ...)` for a name that is not among those known. For a long list, gives
/// the nearest names and the place of the full list.
pub fn among(written: &str, known: &[&str], listed_in: &str) -> String {
    let meant = suggestion(written, known.iter().copied());
    if known.len() <= MOST_LISTED {
        return format!("{meant} (accepted: {})", known.join(", "));
    }
    let mut nearest = known.to_vec();
    if written.len() <= LONGEST {
        nearest.sort_by_key(|name| strsim::osa_distance(written, name));
    }
    nearest.truncate(NEAREST);
    let more = known.len() - NEAREST;
    format!("{meant} (accepted: {} and {more} others, see {listed_in})", nearest.join(", "))
}

/// Splits a path into its tables and its last part.
fn split(path: &str) -> (&str, &str) {
    path.rsplit_once('.').unwrap_or(("", path))
}

/// Whether `written` is the symbol of a key, or the numerator of a symbol that is a ratio.
fn stands_for(written: &str, key: &Key) -> bool {
    let without_spaces = |text: &str| text.replace(' ', "");
    let (written, symbol) = (without_spaces(written), without_spaces(key.symbol));
    let numerator = symbol.split('/').next().unwrap_or(&symbol);
    !written.is_empty()
        && (written == symbol || written == numerator || OTHER_SYMBOLS.contains(&(&written, key.path)))
}

/// Counts letters that are missing, added, changed or swapped with their neighbour; `None` if there
/// are too many for a slip.
fn wrong_letters(written: &str, meant: &str) -> Option<usize> {
    if written.len() > LONGEST {
        return None;
    }
    let count = written.chars().count();
    let most = (count / LETTERS_FOR_ONE_WRONG).min(MOST_WRONG);
    if count.abs_diff(meant.chars().count()) > most {
        return None;
    }
    Some(strsim::osa_distance(written, meant)).filter(|wrong| *wrong <= most)
}

#[cfg(test)]
mod tests {
    use super::{among, did_you_mean, keys, names};
    use crate::scenario::keys::KEYS;
    use crate::scenario::keys::Window;
    use crate::scenario::stand_ins::ALL_KEYS;

    #[test]
    fn keys_are_found_by_symbol_last_part_part_and_spelling() {
        for (written, meant) in [
            // Symbols, of the thesis' text and of its figures.
            ("mu_s", "friction.static_coefficient"),
            ("friction.mu_s", "friction.static_coefficient"),
            ("friction.mu_d", "friction.dynamic_coefficient"),
            ("friction.mu_k", "friction.dynamic_coefficient"),
            ("friction.l0", "friction.decay_length_m"),
            ("drive.speed", "drive.velocity_m_per_s"),
            ("normal_load.force_n", "normal_load.total_n"),
            ("drive.force", "drive.course_n"),
            ("k_t", "friction.interfacial_stiffness_ratio"),
            ("k_t/k", "friction.interfacial_stiffness_ratio"),
            ("friction.k_t / k", "friction.interfacial_stiffness_ratio"),
            ("N", "slider.blocks"),
            ("beta", "initial_shear.beta"),
            ("theta", "normal_load.tilt"),
            ("V", "drive.velocity_m_per_s"),
            ("K", "drive.stiffness_n_per_m"),
            ("eta", "slider.relative_damping"),
            ("dt", "time.step_s"),
            ("F_N", "normal_load.total_n"),
            ("F_T", "drive.until_load_ratio"),
            // Without its table, or in another.
            ("blocks", "slider.blocks"),
            ("friction.blocks", "slider.blocks"),
            ("fricton.law", "friction.law"),
            ("tilt", "drive.tilt normal_load.tilt"),
            // A symbol of two keys: the table selects one.
            ("E", "slider.youngs_modulus_pa friction.radiation_kg_per_s"),
            ("slider.E", "slider.youngs_modulus_pa"),
            // Part of it, as without the unit.
            ("time.duration", "time.duration_s"),
            ("damping", "slider.relative_damping"),
            ("poisson", "initial_shear.poisson_ratio"),
            ("drive.stiffness", "drive.stiffness_n_per_m"),
            // Misspelt.
            ("slider.blokcs", "slider.blocks"),
            ("blokcs", "slider.blocks"),
            ("normal_laod.tlit", "normal_load.tilt"),
            ("normal_laod.tilt", "normal_load.tilt"),
            ("parameter-set", "parameter_set"),
            // Misspelt and without its unit.
            ("drive.velocty", "drive.velocity_m_per_s"),
            ("drive.stifness", "drive.stiffness_n_per_m"),
            // None is near.
            ("colour", ""),
            ("m", ""),
            ("", ""),
            ("slider.", ""),
        ] {
            assert_eq!(keys(written, &ALL_KEYS).join(" "), meant, "{written:?}");
        }
        assert_eq!(keys("form_s", &Window::keys().iter().collect::<Vec<_>>()), ["from_s"]);
        assert_eq!(keys("block", &Window::keys().iter().collect::<Vec<_>>()), ["first_block", "last_block"]);
    }

    #[test]
    fn every_symbol_leads_to_its_key() {
        for key in KEYS.iter().filter(|key| !key.symbol.is_empty()) {
            assert!(keys(key.symbol, &ALL_KEYS).contains(&key.path), "{}", key.symbol);
        }
    }

    #[test]
    fn names_of_other_programs_lead_to_those_known_here() {
        assert_eq!(names("z", ["x", "y", "colour"]), ["colour"]);
        assert_eq!(names("value", ["x", "y"]), [""; 0]);
        let known = ["first_global_rupture_onset_s", "first_global_rupture_ft_fn", "first_slip_ft_fn"];
        assert_eq!(names("first_global_slip_load", known), ["first_global_rupture_ft_fn"]);
        assert_eq!(names("first_global_slip_time", known), ["first_global_rupture_onset_s"]);
    }

    #[test]
    fn names_are_found_where_few_letters_are_wrong() {
        let known = ["default", "ten-blocks", "unload-400", "unload-600", "first_slip_s", "first_slip_ft_fn"];
        for (written, meant) in [
            ("defualt", "default"),
            ("Default", "default"),
            ("tenblocks", "ten-blocks"),
            ("unload-60", "unload-600"),
            // By their parts.
            ("unload", "unload-400 unload-600"),
            ("slip", "first_slip_s first_slip_ft_fn"),
            ("first_slip_time", "first_slip_s first_slip_ft_fn"),
            ("first", "first_slip_s first_slip_ft_fn"),
            // By words with nearly the same meaning.
            ("first_slip_load", "first_slip_ft_fn"),
            ("mine.toml", ""),
            ("s", ""),
            (&"default".repeat(1_000_000), ""),
        ] {
            assert_eq!(names(written, known).join(" "), meant);
        }
        assert_eq!(keys(&"tilt".repeat(1_000_000), &ALL_KEYS), [""; 0]);
    }

    #[test]
    fn suggestions_are_asked_as_a_question() {
        assert_eq!(did_you_mean::<&str>(&[]), "");
        assert_eq!(did_you_mean(&["a", "b", "c"]), "; did you mean a or b or c?");
    }

    #[test]
    fn a_long_list_is_its_nearest_names() {
        assert_eq!(among("lead", &["load", "sizes"], ""), "; did you mean load? (accepted: load, sizes)");
        let many: Vec<String> = (10..45).map(|n| format!("name-{n}")).collect();
        let many: Vec<&str> = many.iter().map(String::as_str).collect();
        assert_eq!(
            among("name_44", &many, "the manual"),
            "; did you mean name-44? (accepted: name-44, name-14, name-24, name-34, name-40 and 30 others, see the manual)"
        );
    }
}
