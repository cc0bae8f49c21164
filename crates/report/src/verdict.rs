//! The main facts of a run: when it slipped, its precursors, the speed of its fronts, and the slider.

use crate::html::markup::{counted, text};
use crate::measured::{are_forces, fell};
use crate::page_collector::CollectedRupture;
use crate::runs::Places;
use crate::study::Run;
use crate::symbols::{rounded, time};

/// The verdict on a run: four answers, each with its question; of forces alone how they fell.
pub(crate) fn verdict(run: &Run) -> String {
    // No rupture reaches the end of a fault line, nor does it begin at a driven end.
    let [first, second] = match Places::of(run).filter(|_| run.scenario.slider.is_in_medium()) {
        None => [("first global slip", global_slip(run)), ("precursors", precursors(run))],
        Some(places) => [("first rupture", first_rupture(run, &places)), ("ruptures", widest(run, &places))],
    };
    let answers = [
        first,
        second,
        ("front speed", front_speed(run)),
        if run.header.parts().recording { ("load drops", fell(run)) } else { ("slider", slider(run)) },
    ];
    let lacked = if are_forces(std::slice::from_ref(run)) { 3 } else { 0 };
    let rows = answers.into_iter().skip(lacked).map(|(question, [short, more])| {
        let more = if more.is_empty() { more } else { format!("<span>{more}</span>") };
        format!("<div><dt>{question}</dt><dd><b>{short}</b>{more}</dd></div>\n")
    });
    format!("<dl class=\"answers\">\n{}</dl>\n", rows.collect::<String>())
}

/// Digits of speeds and of v/c, so that one follows from the other as they are printed.
pub(crate) const SPEED_DIGITS: usize = 4;

/// Why a number of ruptures is not known.
const NO_RUPTURES: &str = "the log has no ruptures, and lacks some of the step records that contain them";

fn global_slip(run: &Run) -> [String; 2] {
    let summary = &run.summary;
    let symbol = if run.scenario.has_state() { "f<sub>0</sub>" } else { "μ<sub>d</sub>" };
    let coefficient = match run.header.parts().recording {
        true => String::new(),
        false => format!(", {symbol} = {}", rounded(run.scenario.mean_coefficients()[1], 4)),
    };
    let ratio = "F<sub>T</sub>/F<sub>N</sub>";
    match (summary.first_global_rupture_onset_s, summary.global_rupture_count) {
        // By its digits and not by decimals: short runs slip within microseconds.
        (Some(onset_s), _) => {
            let load = summary
                .first_global_rupture_ft_fn
                .map(|load| format!("at {ratio} = {}{coefficient}", rounded(load, 4)));
            let front = link(run, |seen| seen.rupture.reached_every_block);
            [time(onset_s, summary.simulated_s), [load.unwrap_or_default(), front].concat()]
        }
        (None, Some(_)) => {
            let reached = summary.largest_ft_fn.map_or_else(String::new, |load| {
                format!("; {ratio} reached {}{coefficient}", rounded(load, 4))
            });
            ["none".to_owned(), format!("in {}{reached}", time(summary.simulated_s, summary.simulated_s))]
        }
        (None, None) => ["unknown".to_owned(), NO_RUPTURES.to_owned()],
    }
}

fn first_rupture(run: &Run, places: &Places) -> [String; 2] {
    let simulated_s = run.summary.simulated_s;
    match run.collected.ruptures.first().map(|seen| &seen.rupture) {
        Some(first) => {
            let front = link(run, |seen| seen.rupture.rupture == first.rupture);
            let at = format!("at a depth of {} km{front}", places.at(first.nucleation_block));
            [time(first.onset_s, simulated_s), at]
        }
        None => ["none".to_owned(), format!("in {}", time(simulated_s, simulated_s))],
    }
}

fn widest(run: &Run, places: &Places) -> [String; 2] {
    let Some(count) = run.summary.rupture_count else {
        return ["unknown".to_owned(), NO_RUPTURES.to_owned()];
    };
    let widest = run.collected.ruptures.iter().map(|seen| &seen.rupture).max_by_key(|one| one.slipped());
    let reach =
        widest.map(|one| format!("the widest from {} km", places.span(one.first_block, one.last_block)));
    [count.to_string(), reach.unwrap_or_default()]
}

fn precursors(run: &Run) -> [String; 2] {
    let summary = &run.summary;
    let Some(count) = summary.precursor_count else { return ["unknown".to_owned(), NO_RUPTURES.to_owned()] };
    let first = run.collected.ruptures.iter().find(|seen| seen.is_precursor).map(|seen| {
        let (rupture, at) = (&seen.rupture, time(seen.rupture.onset_s, summary.simulated_s));
        let lasted = rupture.end_s.map_or_else(String::new, |end_s| match end_s - rupture.onset_s {
            short_s if short_s < 1e-3 => format!(" for {} µs", rounded(short_s * 1e6, 3)),
            long_s => format!(" for {} ms", rounded(long_s * 1e3, 3)),
        });
        format!("the first at {at}{lasted}, {}; ", span(run, rupture.first_block, rupture.last_block))
    });
    let longest = summary.longest_precursor_ratio.filter(|_| count > 0).map(|ratio| {
        let longest = run.collected.ruptures.iter().filter(|seen| seen.is_precursor);
        let blocks = longest.map(|seen| seen.rupture.last_block).max();
        let front = link(run, |seen| seen.is_precursor && Some(seen.rupture.last_block) == blocks);
        format!("the longest L<sub>p</sub>/L = {}{front}", rounded(ratio, 3))
    });
    let creeps = match (summary.creeps, summary.creep_front_block) {
        (Some(true), Some(block)) => format!("; {} crept before", span(run, 1, block)),
        _ => String::new(),
    };
    [count.to_string(), first.unwrap_or_default() + &longest.unwrap_or_default() + &creeps]
}

/// From one block to another, in mm; of a recording from sensor to sensor.
fn span(run: &Run, first: u32, last: u32) -> String {
    Places::of(run).map_or_else(
        || format!("sensors {first} to {last}"),
        |places| format!("x = {} mm", places.span(first, last)),
    )
}

fn front_speed(run: &Run) -> [String; 2] {
    let summary = &run.summary;
    match (summary.front_speed_over_wave_speed_ratio, summary.front_speed_m_per_s) {
        (Some(ratio), Some(speed)) => {
            let c = summary.wave_speed_m_per_s.unwrap_or(speed / ratio);
            // The median says little of a run in which precursors and global slips run at different speeds.
            let first = summary.first_global_rupture_front_speed_m_per_s.map_or_else(String::new, |first| {
                format!("; first global slip: <i>v</i>/<i>c</i> = {}", rounded(first / c, SPEED_DIGITS))
            });
            [
                format!("<i>v</i>/<i>c</i> = {}", rounded(ratio, SPEED_DIGITS)),
                format!(
                    "median of all fronts: v = {} m/s, c = {} m/s{first}",
                    rounded(speed, SPEED_DIGITS),
                    rounded(c, SPEED_DIGITS)
                ),
            ]
        }
        _ => ["none".to_owned(), "no front ran over four blocks in one direction".to_owned()],
    }
}

fn slider(run: &Run) -> [String; 2] {
    let c = run.summary.wave_speed_m_per_s;
    let c = c.map_or_else(String::new, |c| format!("c = {} m/s; ", rounded(c, SPEED_DIGITS)));
    let blocks = counted(u64::from(run.summary.blocks), "block");
    if let Some(as_coded) = run.scenario.as_coded_in_words() {
        return [text(&as_coded), blocks];
    }
    let slider = &run.scenario.slider;
    let size = match slider.is_in_medium() {
        true => format!("{} km", rounded(slider.length_m / 1e3, 6)),
        false => format!("{} kg", rounded(slider.mass_kg, 6)),
    };
    [size, format!("{c}{blocks}")]
}

/// A link to the front of the first rupture on the page that this is true of.
fn link(run: &Run, is_meant: impl Fn(&CollectedRupture) -> bool) -> String {
    run.collected.ruptures.iter().find(|seen| is_meant(seen)).map_or_else(String::new, |seen| {
        let name = text(&run.name);
        format!(
            " <a class=\"needs-script\" href=\"#run={name}&amp;rupture={0}\" data-run=\"{name}\" \
             data-rupture=\"{0}\">its front</a>",
            seen.rupture.rupture
        )
    })
}
