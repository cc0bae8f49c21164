//! Bounds on memory that the manual states, at a million events.

use std::fmt::Write;
use std::fs;
use std::path::Path;

use crate::streaming::peak_mb;
use crate::support::binary::text;
use crate::support::many_events;
use asperity_testkit::folder;

/// A quarter of a million slip events of one block are a million events: an onset, a slip event, a rupture and an
/// arrival each. It took 455 MB when all of them were in memory.
#[test]
#[ignore = "takes a minute: cargo xtask ci"]
fn a_log_of_a_million_events_is_reduced_in_less_than_300_mb() {
    let folder = folder();
    let (log, out) = (folder.path().join("many.mcap"), folder.path().join("many"));
    many_events::log(&log, 250_000);
    let peak = peak_mb(&["reduce", text(&log), "--out", text(&out)]);
    for table in ["events.csv", "ruptures.csv"] {
        let table = fs::read_to_string(out.join(table)).expect("the table is there");
        assert_eq!(table.lines().count(), 250_001, "{}", &table[..100]);
    }
    assert!(peak < 300.0, "{peak} MB");
}

/// With doubles alone it took 285 MB.
#[test]
#[ignore = "takes some seconds: cargo xtask ci"]
fn two_tables_of_a_million_events_are_compared_in_less_than_250_mb() {
    let folder = folder();
    let [old, new] = ["old.csv", "new.csv"].map(|name| folder.path().join(name));
    let write = |path: &Path, later: u64| {
        let mut table = "onset_s,end_s,first_block,last_block,max_sliding,ft_fn_onset,ft_fn_end,event,onset_step,end_step,\
                         blocks_slipped,nucleation_block,ft_fn_min,ft_fn_max,open\n"
            .to_owned();
        for event in 0..1_000_000 {
            let onset = 45 * event + if event % 1000 == 7 { later } else { 0 };
            let (onset_s, end_s, load, block) =
                (onset as f64 * 1e-8, (onset + 9) as f64 * 1e-8, 0.3 + event as f64 * 1e-8, event % 500 + 1);
            writeln!(
                table,
                "{onset_s},{end_s},{block},{block},1,{load},{load},{event},{onset},{},1,{block},{load},{load},false",
                onset + 9
            )
            .expect("texts grow");
        }
        fs::write(path, table).expect("the table can be written");
    };
    write(&old, 0);
    write(&new, 3);
    let policy = folder.path().join("policy.toml");
    fs::write(&policy, "[allow]\nshifted = 1000\n").expect("the policy can be written");
    let peak = peak_mb(&["diff", text(&old), text(&new), "--policy", text(&policy)]);
    assert!(peak < 250.0, "{peak} MB");
}
