//! Catalogues as QuakeML 1.2 (BED): <https://quake.ethz.ch/quakeml>, as ObsPy reads it.
//!
//! An event has an origin, a moment magnitude, and a focal mechanism with its scalar moment and duration, and with its
//! stress drop in a comment, since the format has no element for it. Ruptures without a magnitude are left out, unless
//! their moments are per metre of strike: these have a comment instead of magnitude and scalar moment.

use std::io::Write;

use asperity_numbers::catalogue::Entry;
use chrono::DateTime;

use crate::exit::Failure;

/// A run of a catalogue.
pub(crate) struct OfRun {
    /// Its name: that of its log, or its number in a study.
    pub(crate) name: String,
    /// What the names of its events begin with, which is unique and needs no escape in XML.
    pub(crate) events: String,
    /// Its ruptures.
    pub(crate) entries: Vec<Entry>,
}

const BEGIN: &str = "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<q:quakeml \
                     xmlns=\"http://quakeml.org/xmlns/bed/1.2\" xmlns:q=\"http://quakeml.org/xmlns/quakeml/1.2\">\n\
                     <eventParameters publicID=\"smi:asperity/catalogue\">\n";
const END: &str = "</eventParameters>\n</q:quakeml>\n";

/// Writes the document of some runs.
///
/// # Errors
/// If it cannot be written, or a rupture begins after the year 9999.
pub(crate) fn write<'a>(mut out: impl Write, runs: impl Iterator<Item = &'a OfRun>) -> Result<(), Failure> {
    out.write_all(BEGIN.as_bytes())?;
    for run in runs {
        for entry in &run.entries {
            let magnitude = entry.magnitude();
            if magnitude.is_none() && entry.depth_m.is_none() {
                continue;
            }
            let id = format!("smi:asperity/{}/{}", run.events, entry.rupture.rupture);
            let (time, name) = (dated(entry)?, escaped(&run.name));
            let (longitude, moment_n_m) = (longitude_degrees(entry.x_m), entry.moment_n_m.abs());
            let drop_pa = entry.stress_drop_pa.zip(entry.slip_weighted_stress_drop_pa);
            let mut comment = drop_pa.map_or(String::new(), |(mean_pa, weighted_pa)| {
                format!(
                    "<comment><text>stress drop, before less after: mean {mean_pa} Pa, weighted by slip \
                     {weighted_pa} Pa</text></comment>"
                )
            });
            if magnitude.is_none() {
                comment +=
                    &format!("<comment><text>moment per metre of strike: {moment_n_m} N</text></comment>");
            }
            let [preferred, sized, moment] = magnitude.map_or_else(Default::default, |magnitude| {
                [
                    format!("<preferredMagnitudeID>{id}/magnitude</preferredMagnitudeID>"),
                    format!(
                        "<magnitude publicID=\"{id}/magnitude\"><mag><value>{magnitude}</value></mag>\
                         <type>Mw</type><originID>{id}/origin</originID></magnitude>"
                    ),
                    format!("<scalarMoment><value>{moment_n_m}</value></scalarMoment>"),
                ]
            });
            write!(
                out,
                "<event publicID=\"{id}\"><preferredOriginID>{id}/origin</preferredOriginID>{preferred}\
                 <preferredFocalMechanismID>{id}/mechanism</preferredFocalMechanismID>\
                 <type>other event</type><description><text>{name}</text></description>\
                 <origin publicID=\"{id}/origin\"><time><value>{time}</value></time>\
                 <longitude><value>{longitude}</value></longitude><latitude><value>0</value></latitude>\
                 <depth><value>{depth_m}</value></depth></origin>{sized}\
                 <focalMechanism publicID=\"{id}/mechanism\">{comment}<momentTensor publicID=\"{id}/tensor\">\
                 <derivedOriginID>{id}/origin</derivedOriginID>{moment}",
                depth_m = entry.depth_m.unwrap_or(0.0)
            )?;
            if let Some(duration_s) = entry.duration_s() {
                write!(
                    out,
                    "<sourceTimeFunction><type>unknown</type><duration>{duration_s}</duration></sourceTimeFunction>"
                )?;
            }
            writeln!(out, "</momentTensor></focalMechanism></event>")?;
        }
    }
    out.write_all(END.as_bytes())?;
    Ok(out.flush()?)
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

/// Seconds after the beginning of 1970, as UTC to the nanosecond; none after the year 9999.
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
