//! A preview, computed without a run, agrees with runs while nothing slides.

use asperity_model::Preview;
use asperity_model::resolve;
use asperity_record::Record;
use asperity_run::{Begin, Observer, Task, run};

/// Largest relative difference of loads, and of the times at which they are reached. Samples are
/// interpolated, so the difference is inertia: a drive that starts at once leaves a vibration.
const OF_LOADS: f64 = 1e-4;

/// Largest relative difference of the time of the first slip: as coded, viscosity delays the shear on a
/// block by some `eta / k`, 0.4 ms of the 0.29 s here.
const OF_FIRST_SLIP: f64 = 1e-3;

/// When `F_T / F_N` first reaches a ratio, by interpolation between step records; its largest value; and
/// when a block first detaches.
struct Loads {
    ratio: f64,
    before: (f64, f64),
    reached_s: Option<f64>,
    largest: f64,
    detached_s: Option<f64>,
}

impl Observer for Loads {
    fn record(&mut self, record: &Record) {
        let Record::Step(step) = record else { return };
        let (time_s, load) = (step.time_s, step.load_ratio());
        if self.reached_s.is_none() && load >= self.ratio {
            let share = (self.ratio - self.before.1) / (load - self.before.1);
            self.reached_s = Some(self.before.0 + share * (time_s - self.before.0));
        }
        self.before = (time_s, load);
        self.largest = self.largest.max(load);
        if !step.switches.is_empty() {
            self.detached_s.get_or_insert(time_s);
        }
    }
}

fn made(name: &str, sets: &[&str]) -> (Preview, Loads) {
    let scenario = resolve(name, sets).unwrap_or_else(|errors| panic!("{errors}"));
    let mut loads = Loads {
        ratio: scenario.friction.dynamic_coefficient,
        before: (0.0, 0.0),
        reached_s: None,
        largest: 0.0,
        detached_s: None,
    };
    run(Task::new(&scenario), Begin::Anew, &|| false, &mut loads).expect("it runs to its end");
    (scenario.preview(), loads)
}

#[track_caller]
fn agree(what: &str, tolerance: f64, run: Option<f64>, preview: Option<f64>) {
    let (Some(run), Some(preview)) = (run, preview) else {
        panic!("{what}: {run:?} in the run, {preview:?} before")
    };
    assert!((run / preview - 1.0).abs() < tolerance, "{what}: {run} in the run, {preview} before");
}

/// Nothing slides before the load has reached `mu_d`, so high is `mu_s`.
const STUCK: &str = "friction.static_coefficient=100";

/// A coarse slab.
const SLAB: [&str; 5] =
    ["slider.blocks=15", "slider.rows=4", "slider.height_m=0.03", "drive.height_m=0.01", "time.step_s=5e-7"];

#[test]
fn loads_of_stuck_sliders_are_those_of_the_preview() {
    let unloading =
        ["drive.hold_from_s=1", "normal_load.schedule_s=[1,4]", "normal_load.schedule_n=[400,100]"];
    let chain = ["slider.blocks=20", "time.step_s=2e-7", "time.duration_s=4", STUCK];
    let softer = "friction.interfacial_stiffness_ratio=0.01";
    let shear = "prestress.ratio=0.2";
    let slab = [&SLAB[..], &["time.duration_s=0.3", STUCK]].concat();
    let slab_unloading =
        ["drive.hold_from_s=0.1", "normal_load.schedule_s=[0.1,0.3]", "normal_load.schedule_n=[1920,400]"];
    let cases: [(&str, &[&str], &[&str]); 9] = [
        ("default", &chain, &[]),
        ("default", &chain, &[softer, shear]),
        ("default", &chain, &["parameter_set=as-stated", "friction.law=rigid"]),
        ("default", &chain, &["drive.kind=top"]),
        ("default", &chain, &["drive.kind=top", "drive.decay_length_m=0.02", softer]),
        ("default", &chain, &unloading),
        ("default", &chain, &["initial_shear.poisson_ratio=0.35", "drive.kind=top", softer]),
        ("slab", &slab, &[]),
        ("slab", &slab, &slab_unloading),
    ];
    for (name, first, more) in cases {
        let sets = [first, more].concat();
        let (preview, loads) = made(name, &sets);
        let what = format!("{name} {more:?}");
        assert_eq!(loads.detached_s, None, "{what}: nothing slides");
        agree(&what, OF_LOADS, loads.reached_s, preview.dynamic_load_s);
        agree(&what, OF_LOADS, Some(loads.largest), preview.largest_load_ratio);
    }
}

#[test]
fn the_first_block_slips_when_the_preview_says_so() {
    let chain = ["parameter_set=as-coded", "slider.blocks=20", "time.step_s=2e-7"];
    let apart = ["drive.kind=left-right", "friction.reattach=two-way", "time.duration_s=0.5"];
    let cases: [(&str, &[&str], &[&str]); 5] = [
        ("default", &chain, &["time.duration_s=0.5"]),
        ("default", &chain, &apart),
        ("default", &chain, &["initial_shear.beta=0.3", "prestress.ratio=-0.1", "time.duration_s=1"]),
        ("unloading-top-driven", &chain, &["drive.tilt=0.3"]),
        ("slab", &SLAB, &["time.duration_s=0.4"]),
    ];
    for (name, first, more) in cases {
        let (preview, loads) = made(name, &[first, more].concat());
        agree(&format!("{name} {more:?}"), OF_FIRST_SLIP, loads.detached_s, preview.first_slip_s);
    }
}

#[test]
fn a_drive_that_stops_at_a_load_stops_there() {
    let sets = ["slider.blocks=20", "time.step_s=2e-7", "time.duration_s=3", STUCK];
    let (preview, loads) = made("default", &[&sets[..], &["drive.until_load_ratio=0.2"]].concat());
    assert_eq!((loads.reached_s, preview.dynamic_load_s), (None, None));
    agree("the load that stops it", OF_LOADS, Some(loads.largest), preview.largest_load_ratio);
}
