//! Catalogues as QuakeML 1.2 (BED): <https://quake.ethz.ch/quakeml>, as ObsPy reads it.
//!
//! An event has an origin, a moment magnitude, and a focal mechanism with its scalar moment and duration. Ruptures
//! without a magnitude are left out.

use std::fmt::Write;

use asperity_numbers::catalogue::Entry;
use chrono::DateTime;

use crate::exit::Failure;

/// A run of a catalogue.
pub(crate) struct OfRun {
    /// The number of the path given, from 1.
    pub(crate) given: usize,
    /// The study that it belongs to, if that was given.
    pub(crate) study: Option<String>,
    /// Its name: that of its log, or its number in a study.
    pub(crate) name: String,
    /// Its id, by which names of events are unique.
    pub(crate) id: String,
    pub(crate) entries: Vec<Entry>,
}

impl OfRun {
    /// The name of what was given: a study, or a log.
    pub(crate) fn of(&self) -> &str {
        self.study.as_ref().unwrap_or(&self.name)
    }
}

const BEGIN: &str = "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<q:quakeml \
                     xmlns=\"http://quakeml.org/xmlns/bed/1.2\" xmlns:q=\"http://quakeml.org/xmlns/quakeml/1.2\">\n";

/// The document of some runs.
///
/// # Errors
/// If a rupture begins after the year 9999.
pub(crate) fn document(runs: &[OfRun]) -> Result<String, Failure> {
    let mut text = BEGIN.to_owned();
    let mut add = |line: String| {
        text.push_str(&line);
        text.push('\n');
    };
    add("<eventParameters publicID=\"smi:asperity/catalogue\">".to_owned());
    for run in runs {
        for entry in &run.entries {
            let Some(magnitude) = entry.magnitude() else { continue };
            let id = format!("smi:asperity/{}/{}", run.id, entry.rupture.rupture);
            let time = dated(entry)?;
            let mut event = format!("<event publicID=\"{id}\">");
            let mut say = |part: std::fmt::Arguments<'_>| event.write_fmt(part).expect("a text takes more");
            say(format_args!("<preferredOriginID>{id}/origin</preferredOriginID>"));
            say(format_args!("<preferredMagnitudeID>{id}/magnitude</preferredMagnitudeID>"));
            say(format_args!("<preferredFocalMechanismID>{id}/mechanism</preferredFocalMechanismID>"));
            say(format_args!("<type>other event</type>"));
            say(format_args!("<description><text>{}</text></description>", escaped(&run.name)));
            say(format_args!("<origin publicID=\"{id}/origin\"><time><value>{time}</value></time>"));
            say(format_args!("<longitude><value>{}</value></longitude>", longitude_degrees(entry.x_m)));
            say(format_args!(
                "<latitude><value>0</value></latitude><depth><value>0</value></depth></origin>"
            ));
            say(format_args!("<magnitude publicID=\"{id}/magnitude\"><mag><value>{magnitude}</value></mag>"));
            say(format_args!("<type>Mw</type><originID>{id}/origin</originID></magnitude>"));
            say(format_args!("<focalMechanism publicID=\"{id}/mechanism\">"));
            say(format_args!(
                "<momentTensor publicID=\"{id}/tensor\"><derivedOriginID>{id}/origin</derivedOriginID>"
            ));
            say(format_args!("<scalarMoment><value>{}</value></scalarMoment>", entry.moment_n_m.abs()));
            if let Some(duration_s) = entry.duration_s() {
                let time_function = format_args!("<type>unknown</type><duration>{duration_s}</duration>");
                say(format_args!("<sourceTimeFunction>{time_function}</sourceTimeFunction>"));
            }
            say(format_args!("</momentTensor></focalMechanism></event>"));
            add(event);
        }
    }
    add("</eventParameters>\n</q:quakeml>".to_owned());
    Ok(text)
}

/// The time of an entry, as UTC.
pub(crate) fn dated(entry: &Entry) -> Result<String, Failure> {
    let onset_s = entry.rupture.onset_s;
    utc(onset_s).ok_or_else(|| {
        Failure::Failed(format!(
            "rupture {} begins at {onset_s} s, after the year 9999 (accepted: up to 2.5e11 s)",
            entry.rupture.rupture
        ))
    })
}

/// Degrees of longitude on the equator of a sphere of 6371 km: readers of catalogues know no other place.
pub(crate) fn longitude_degrees(x_m: f64) -> f64 {
    (x_m / 6_371_000.0).to_degrees()
}

/// Seconds after the begin of 1970, as UTC to the nanosecond; none after the year 9999.
fn utc(time_s: f64) -> Option<String> {
    let whole_s = time_s.floor();
    let nanoseconds = ((time_s - whole_s) * 1e9).round() as u64;
    let seconds = whole_s as i64 + i64::from(nanoseconds == 1_000_000_000);
    let time = DateTime::from_timestamp(seconds, (nanoseconds % 1_000_000_000) as u32)?;
    let text = time.format("%Y-%m-%dT%H:%M:%S%.9fZ").to_string();
    // Later years have a sign and five digits.
    (!text.starts_with('+')).then_some(text)
}

/// A text between tags. What XML does not allow at all becomes a question mark.
fn escaped(text: &str) -> String {
    let mut escaped = String::new();
    for character in text.chars() {
        match character {
            '&' => escaped.push_str("&amp;"),
            '<' => escaped.push_str("&lt;"),
            '>' => escaped.push_str("&gt;"),
            character if character.is_control() || matches!(character, '\u{fffe}' | '\u{ffff}') => {
                escaped.push('?');
            }
            character => escaped.push(character),
        }
    }
    escaped
}

#[cfg(test)]
mod tests {
    use super::{escaped, utc};

    #[test]
    fn names_of_logs_are_texts_of_xml() {
        assert_eq!(escaped("a<b>&\u{1}\"é"), "a&lt;b&gt;&amp;?\"é");
    }

    #[test]
    fn seconds_are_times_of_1970_and_later() {
        assert_eq!(utc(0.0).as_deref(), Some("1970-01-01T00:00:00.000000000Z"));
        assert_eq!(utc(86_399.999_999_999_9).as_deref(), Some("1970-01-02T00:00:00.000000000Z"));
        assert_eq!(utc(951_782_400.25).as_deref(), Some("2000-02-29T00:00:00.250000000Z"));
        assert_eq!(utc(253_402_300_799.0).as_deref(), Some("9999-12-31T23:59:59.000000000Z"));
        assert_eq!([utc(253_402_300_800.0), utc(1e300)], [None, None]);
    }
}
