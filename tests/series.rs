//! Series as solved: rows at the solver's own steps, the same however a run was made, and their export.

use std::fs;

use asperity_record::{Record, Series, SeriesBlock};
use asperity_runlog::LogItem;
use asperity_testkit::{folder, read_log};

use crate::support::binary::{ends, goes_on, outcome, rows, run, succeed, text, with_sets};

/// A run of two slips, with the sets of its series.
fn with_series<'a>(sets: &[&'a str]) -> Vec<&'a str> {
    with_sets(&["rate-and-state", "--quiet"], &[&["time.duration_s=1.3"], sets].concat())
}

#[test]
fn rows_are_accepted_steps_at_exact_times_and_change_nothing() {
    let folder = folder();
    let path = |name: &str| folder.path().join(name);
    run(&with_series(&[]), &path("none.mcap"));
    run(&with_series(&["recording.series_every=1", "recording.series_blocks=[1,16]"]), &path("all.mcap"));
    run(&with_series(&["recording.series_every=100"]), &path("some.mcap"));
    let [none, all, some] =
        ["none", "all", "some"].map(|name| read_log(&path(&format!("{name}.mcap"))).unwrap());
    for topic in ["/step", "/switch", "/fields", "/events/slip", "/events/rupture"] {
        assert_eq!(all.1.topic_digests[topic], none.1.topic_digests[topic], "{topic}");
    }
    assert!(!none.1.message_counts.contains_key("/series"));
    let series = |items: &[LogItem]| -> Vec<Series> {
        let row = |item: &LogItem| match item {
            LogItem::Record(Record::Row(row)) => row.values.get::<Series>().cloned(),
            _ => None,
        };
        items.iter().filter_map(row).collect()
    };
    let [each, hundredth] = [&all.0, &some.0].map(|items| series(items));
    // The last accepted step ends behind the run.
    assert_eq!(each.len() as u64 + 1, all.1.solver.counts["adaptive_steps"]);
    for (number, pair) in (1..).zip(each.windows(2)) {
        assert_eq!((pair[0].solver_step, pair[1].solver_step), (number, number + 1));
        let length_s = pair[1].time_s - pair[0].time_s;
        assert!((length_s / pair[1].step_s - 1.0).abs() < 1e-6 || length_s < 1e-8, "{pair:?}");
    }
    let last = each.len() as u64;
    let is_due = |row: &&Series| [1, last].contains(&row.solver_step) || row.solver_step.is_multiple_of(100);
    assert_eq!(hundredth, each.iter().filter(is_due).cloned().collect::<Vec<_>>());
    // A step is between the records of the grid: V, and so the slip, are those of the fields.
    let peak = each.iter().map(|row| row.v_max_m_per_s).fold(0.0, f64::max);
    assert!(peak > 0.1, "{peak} m/s");
    let blocks: Vec<SeriesBlock> = (all.0.iter())
        .filter_map(|item| match item {
            LogItem::Record(Record::Row(row)) => row.values.get::<SeriesBlock>().cloned(),
            _ => None,
        })
        .collect();
    assert_eq!(blocks.len(), 2 * each.len());
    let fields = all.0.iter().filter_map(|item| match item {
        LogItem::Record(Record::Fields(fields)) => Some(fields),
        _ => None,
    });
    let mut compared = 0;
    for fields in fields.filter(|fields| fields.step > 0) {
        let last: Vec<&SeriesBlock> = blocks.iter().filter(|row| row.block == 16).collect();
        let at = last.partition_point(|row| row.time_s <= fields.time_s);
        let (Some(before), Some(after)) = (last.get(at.wrapping_sub(1)), last.get(at)) else { continue };
        let between = |a: f64, b: f64, x: f64| a.min(b) - 1e-12 <= x && x <= a.max(b) + 1e-12;
        assert!(between(before.slip_m, after.slip_m, fields.displacement_m[15]), "{before:?} {after:?}");
        assert!(
            (before.state.min(after.state) - 0.01..before.state.max(after.state) + 0.01)
                .contains(&fields.state[15])
        );
        compared += 1;
    }
    assert!(compared > 30, "{compared}");
    let first = &blocks[0];
    // psi = f_0 + b ln(V_0 theta / D_c), and F = a asinh[(V / 2 V_0) exp(psi / a)] p.
    let scenario = asperity_model::resolve("rate-and-state", &["time.duration_s=1.3"]).unwrap();
    let plan = asperity_model::Plan::new(&scenario);
    let law = plan.friction.law.rate_and_state().unwrap();
    let (n, v0) = (first.block as usize - 1, law.reference_velocity_m_per_s);
    let ln = (v0 * first.theta_s / law.critical_slip_m).ln();
    let psi = law.reference_coefficient + plan.friction.evolution_effects[n] * ln;
    assert!((psi - first.state).abs() < 1e-12);
    assert!((law.coefficient(first.velocity_m_per_s, first.state) - first.friction_ratio).abs() < 1e-9);
    assert!((first.friction_n / plan.normal_load_n[n] - first.friction_ratio).abs() < 1e-12);

    // As text of the benchmarks.
    let (all, out) = (path("all.mcap"), path("seas"));
    succeed(&["export", text(&all), "--to", "seas", "--out", text(&out)]);
    let lines = |name: &str| -> Vec<String> {
        let text = fs::read_to_string(out.join(name)).expect("it is there");
        text.lines().filter(|line| !line.starts_with('#')).map(str::to_owned).collect()
    };
    let (global, block) = (lines("global.txt"), lines("fltst_b016.txt"));
    assert_eq!(
        (&*global[0], &*block[0]),
        ("t max_slip_rate moment_rate", "t slip slip_rate shear_stress state")
    );
    assert_eq!([global.len(), block.len()], [each.len() + 1; 2]);
    let numbers = |line: &str| line.split_whitespace().map(|x| x.parse().unwrap()).collect::<Vec<f64>>();
    let row = &blocks[1];
    let stress_mpa = row.friction_n / (0.01 * scenario.slider.width_m) / 1e6;
    let expected = [row.time_s, row.slip_m, row.velocity_m_per_s.log10(), stress_mpa, row.theta_s.log10()];
    for (found, expected) in numbers(&block[1]).iter().zip(expected) {
        assert!((found / expected - 1.0).abs() < 1e-6, "{found} {expected}");
    }
    assert_eq!(numbers(&global[1]).len(), 3);
    succeed(&["export", text(&all), "--to", "csv", "--topic", "/series_block", "--out", text(&out)]);
    let table = fs::read(out.join("all.series_block.csv")).expect("it is there");
    assert_eq!(rows(&table).len(), blocks.len());
    succeed(&["check", "--again", text(&all)]);
    succeed(&["replay", text(&all)]);
    let none = path("none.mcap");
    ends(
        2,
        &["export", text(&none), "--to", "seas", "--out", text(&out)],
        &["none.mcap has no series (accepted: "],
    );
    let choice = ["export", text(&all), "--to", "seas", "--from-s", "1", "--out", text(&out)];
    ends(2, &choice, &["--to seas: --from-s chooses rows of tables"]);
    let both = ["export", text(&all), text(&none), "--to", "seas", "--out", text(&out)];
    ends(2, &both, &["would both be exported as global.txt"]);
}

#[test]
fn a_run_with_series_goes_on_and_is_salvaged_and_branched() {
    let sets = ["recording.series_every=3", "recording.series_blocks=[2]", "recording.sample_s=0"];
    goes_on(&[&["run"], &with_series(&sets)[..]].concat(), &[2, 5, 7]);
    let folder = folder();
    let path = |name: &str| folder.path().join(name);
    run(&[&with_series(&sets)[..], &["--checkpoint-s", "0.002"]].concat(), &path("run.mcap"));
    let mut bytes = fs::read(path("run.mcap")).expect("it is there");
    let cut = path("cut.mcap.partial");
    fs::write(&cut, &bytes[..bytes.len() / 2]).expect("the folder can be written");
    let middle = bytes.len() / 2;
    bytes[middle..middle + 3000].fill(0x55);
    fs::write(path("damaged.mcap"), bytes).expect("the folder can be written");
    succeed(&["salvage", text(&path("damaged.mcap")), "--out", text(&path("salvaged.mcap"))]);
    let (_, out, said) = outcome(&["check", "--again", text(&path("salvaged.mcap"))]);
    assert!([out, said].concat().contains("salvaged with gaps"));
    // A branch has the rest of the rows, and their numbers.
    let from = format!("initial.from={}", text(&cut));
    run(&[&with_series(&sets)[..], &["--set", &from]].concat(), &path("branch.mcap"));
    let numbers = |name: &str| -> Vec<(u64, f64)> {
        let (items, _) = read_log(&path(name)).expect("it is whole");
        let row = |item: LogItem| match item {
            LogItem::Record(Record::Row(row)) => {
                row.values.get::<Series>().map(|row| (row.solver_step, row.time_s))
            }
            _ => None,
        };
        items.into_iter().filter_map(row).filter(|(number, _)| number.is_multiple_of(3)).collect()
    };
    let (whole, rest) = (numbers("run.mcap"), numbers("branch.mcap"));
    assert!(rest.len() > 10 && whole.ends_with(&rest), "{} of {}", rest.len(), whole.len());
}
