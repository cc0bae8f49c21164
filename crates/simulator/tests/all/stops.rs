//! A stop ends a call after bounded work, and changes nothing.

use asperity_model::Plan;
use asperity_model::resolve;
use asperity_record::Record;
use asperity_simulator::{Next, SolverKind, Stop};

/// Most numbers of single steps between two looks, with one step more, and what a step costs besides its numbers.
const NUMBERS_BETWEEN_LOOKS: u64 = (1 << 22) + (1 << 17);
const NUMBERS_OF_A_STEP: u64 = 64;

/// Stopped at each look, with another solver from its state where there is one, a run has the same records to the bit;
/// between two looks there are few steps, or one leap. Without looks between records, none of these runs stops.
#[test]
fn a_stop_ends_each_solver_after_bounded_work_and_changes_nothing() {
    let slab = "slider.blocks=9 slider.rows=5 slider.height_m=0.07 drive.height_m=0.0175";
    let sheet = "slider.blocks=7 slider.across=4 slider.width_m=0.05";
    let body = "slider.blocks=5 slider.across=4 slider.rows=3 slider.width_m=0.105 slider.height_m=0.07 \
                slider.mass_kg=7.56 drive.height_m=0.035";
    let (plain, fast, adaptive) = (SolverKind::Plain, SolverKind::Fast, SolverKind::Adaptive);
    for (scenario, kind, sets, duration_s, least_stops) in [
        ("ten-blocks", plain, "", 0.003, 4),
        ("ten-blocks", fast, "", 1.5, 50),
        ("default", fast, "slider.blocks=600", 0.05, 50),
        ("rigid-contacts", fast, "slider.blocks=10", 1.0, 20),
        ("slab", plain, slab, 0.02, 3),
        ("slab", fast, slab, 0.5, 100),
        ("sheet-coarse", fast, sheet, 3.0, 20),
        ("body-coarse", fast, body, 0.6, 10),
        ("chain-junctions", fast, "time.step_s=1e-7", 0.002, 10),
        ("spring-slider", adaptive, "slider.blocks=200 drive.kind=top", 100.0, 5),
        ("seas-bp1-qd-coarse", adaptive, "recording.stations_m=[] recording.series_every=0", 6.13e9, 4),
    ] {
        let rare = format!("{sets} time.duration_s={duration_s} recording.sample_s=0 recording.fields_s=0");
        let sets: Vec<&str> = rare.split_whitespace().collect();
        let plan = Plan::new(&resolve(scenario, &sets).unwrap_or_else(|error| panic!("{error}")));
        let case = format!("{scenario} {rare} {}", kind.name());
        let mut whole = kind.start(plan.clone());
        let records: Vec<Record> = std::iter::from_fn(|| whole.next_record().unwrap()).collect();

        let mut solver = kind.start(plan.clone());
        let (mut found, mut stops, mut restored) = (Vec::new(), 0_u64, 0);
        // The modes of a lattice take many looks, and start again after each stop.
        let mut patience = 1_u64;
        loop {
            let (before, looks) = (solver.counters(), std::cell::Cell::new(0));
            let asks = || {
                looks.set(looks.get() + 1);
                looks.get() == patience
            };
            let next = solver.next_record_unless(&Stop::when(&asks)).unwrap();
            let after = solver.counters();
            let singly =
                after.plain_steps - before.plain_steps + 64 * (after.adaptive_steps - before.adaptive_steps);
            let numbers = singly * (NUMBERS_OF_A_STEP + plan.elastic.freedoms() as u64);
            let leaps = after.jumps + after.windows - before.jumps - before.windows;
            assert!(numbers <= patience * NUMBERS_BETWEEN_LOOKS, "{case}: {singly} steps");
            assert!(leaps <= patience, "{case}: {leaps} leaps");
            match next {
                Next::Record(record) => found.push(record),
                Next::End => break,
                Next::Stopped => {
                    stops += 1;
                    patience = if after.steps() == before.steps() && kind == fast { 2 * patience } else { 1 };
                    if solver.is_between_records() && after.steps() > before.steps() {
                        let mut other = kind.start(plan.clone());
                        other.restore(&solver.snapshot());
                        (solver, restored) = (other, restored + 1);
                    }
                }
            }
        }
        assert!(stops >= least_stops, "{case}: {stops} stops");
        assert!(restored > 0 || kind == adaptive, "{case}: never restored");
        let differs = found.iter().zip(&records).position(|(found, record)| found != record);
        assert_eq!((differs, found.len()), (None, records.len()), "{case}");
    }
}
