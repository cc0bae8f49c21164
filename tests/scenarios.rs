//! Every scenario that comes with the program: it runs, its log is whole, and a replay finds
//! the same events.

use crate::support::binary::{run, succeed, text};

#[test]
fn every_scenario_runs_checks_and_replays() {
    let list = succeed(&["scenario", "list"]);
    let names: Vec<&str> = list.lines().filter_map(|line| line.split_whitespace().next()).collect();
    assert!(names.len() >= 17, "{list}");
    let folder = asperity_testkit::folder();
    let one = |name: &str| {
        let log = folder.path().join(format!("{name}.mcap"));
        // The slab takes a minute; up to its first precursor is enough here.
        let sets: &[&str] = if name == "slab" { &["--set", "time.duration_s=0.2"] } else { &[] };
        run(&[&[name], sets].concat(), &log);
        let said = succeed(&["check", text(&log)]);
        assert!(said.contains(": whole: "), "{said}");
        assert!(succeed(&["replay", text(&log)]).contains("the same as logged"), "{name}");
        // All but those that are about damping alone slip.
        let slips = succeed(&["events", text(&log)]).lines().count() - 1;
        assert!(slips > 0 || name == "ring-down", "{name}: no slip events");
    };
    let half = names.len() / 2;
    std::thread::scope(|scope| {
        for part in [&names[..half], &names[half..]] {
            scope.spawn(|| part.iter().for_each(|name| one(name)));
        }
    });
}
