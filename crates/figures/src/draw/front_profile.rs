//! How fast the front of one rupture ran from block to block, beside the wave speed and the theory.

use asperity_model::theory::front::{Front, relative_prestress};
use asperity_numbers::front_speeds_m_per_s;
use asperity_numbers::fronts::crossing_s;
use asperity_numbers::required_data::RequiredData;
use asperity_numbers::run_data::{Load, RunData, load_at};
use asperity_numbers::states::States;
use asperity_record::{Arrival, Rupture};

use super::kind::{Figure, keys, of_one_run, place_name, wave_speed_name};
use super::rupture_selector::{RuptureSelector, picked};
use super::scale::Scale;
use super::sheet::{BLUE, Dash, GREEN, GREY, INK, Layer, Marker, Pen, Point, RED, Sheet};

keys! {
    FrontProfile: run;

    /// The number of the rupture, as in its table.
    rupture: Option<u64>,
    /// The rupture, where `rupture` gives no number; if absent the first global slip, or else the widest.
    which: Option<RuptureSelector>,
    /// The upper end of the axis of speeds, over `c`; faster fronts are marked there. By default, nineteen
    /// of twenty are below it.
    to_speed: Option<f64>,
}

impl Figure for FrontProfile {
    of_one_run!(RequiredData::fronts());

    fn part(&self, run: &RunData, _: Pen<'_>) -> Result<Sheet, String> {
        let has_global = run.ruptures.iter().flatten().any(|rupture| rupture.reached_every_block);
        let natural = if has_global { RuptureSelector::FirstGlobalSlip } else { RuptureSelector::Widest };
        let rupture = picked(run, self.rupture, Some(self.which.unwrap_or(natural)))?
            .ok_or_else(|| format!("run {} has no ruptures", run.name))?;
        let c_m_per_s = run.plan.spacing_m / crossing_s(run);
        let beginning = run.header.contacts().column(rupture.nucleation_block);
        let local = local(run.arrivals()?, rupture, beginning, c_m_per_s);
        if local.is_empty() {
            return Err(format!(
                "rupture {} of run {} has no front from block to block",
                rupture.rupture, run.name
            ));
        }
        let theory = theory(run, (run.loads()?, run.states()?), rupture);
        let speeds = local.iter().chain(&theory).map(|(_, speed)| *speed).filter(|speed| speed.is_finite());
        let mut speeds: Vec<f64> = speeds.collect();
        speeds.sort_by(f64::total_cmp);
        let nineteen_of_twenty = (speeds.len() * 19).div_ceil(20).saturating_sub(1);
        let nearly_largest = speeds.get(nineteen_of_twenty).copied().unwrap_or_default();
        let to = self.to_speed.unwrap_or(1.1 * nearly_largest.max(1.1));
        let (first, last) = (f64::from(rupture.first_block), f64::from(rupture.last_block));
        let beginning = f64::from(beginning);
        let about = if run.of_one_row().is_some() { "between neighbours" } else { "of each contact" };
        let c = wave_speed_name(run);
        let level = vec![(first, 1.0), (last, 1.0)];
        let mut layers = vec![Layer::line(format!("{c} = {c_m_per_s:.1} m/s"), level, Dash::Dashed, GREY)];
        let [up, down] = front_speeds_m_per_s(rupture, run.header.contacts(), Some(c_m_per_s));
        let whole = [(last, up), (first, down)].into_iter();
        let whole = whole.filter_map(|(end, speed)| Some((end, speed? / c_m_per_s)));
        let is_shown = |(_, speed): &Point| *speed <= to;
        let (whole, above): (Vec<Point>, Vec<Point>) = whole.partition(is_shown);
        layers.extend(whole.into_iter().map(|(end, speed)| {
            let course = vec![(beginning, speed), (end, speed)];
            Layer::line("of the whole front", course, Dash::Solid, RED)
        }));
        let edge =
            |above: Vec<Point>| above.into_iter().map(|(block, _)| (block, AT_THE_EDGE * to)).collect();
        layers.push(Layer::marks("", edge(above), Marker::Triangle, RED));
        if !theory.is_empty() {
            layers.push(Layer::line("theory, rigid contacts", theory, Dash::DotDashed, GREEN));
        }
        let (marks, above): (Vec<Point>, Vec<Point>) = local.into_iter().partition(is_shown);
        // Lines are hidden by many marks.
        let color = if marks.len() > MOST_MARKS { GREY } else { INK };
        if marks.len() > MOST_MARKS {
            layers.insert(0, Layer::discs(about, marks, 6.0, GREY));
        } else {
            layers.push(Layer::marks(about, marks, Marker::Circle, INK));
        }
        if !above.is_empty() {
            layers.push(Layer::marks("above the axis", edge(above), Marker::Triangle, color));
        }
        layers.push(Layer::line("nucleation", vec![(beginning, 0.0), (beginning, to)], Dash::Dotted, BLUE));
        let title = format!("rupture {}, F_T/F_N = {:.3} at its onset", rupture.rupture, rupture.ft_fn_onset);
        let x = Scale::between(place_name(run), first - 0.5, last + 0.5);
        let y = Scale::between(&format!("v/{c}"), 0.0, to);
        Ok(Sheet::single(x, y, layers).titled(title))
    }
}

/// Where a speed above the axis is marked, as a share of the axis: its mark is just inside the frame.
const AT_THE_EDGE: f64 = 0.98;

/// Speeds between more neighbours are dots behind the lines.
const MOST_MARKS: usize = 150;

/// Speed over `c` between neighbours, at the middle between the two; over an area those of each contact, in its
/// column.
fn local(arrivals: &[Arrival], rupture: &Rupture, beginning: u32, c_m_per_s: f64) -> Vec<(f64, f64)> {
    let of = arrivals.iter().filter(|arrival| arrival.rupture == rupture.rupture);
    let mut speeds: Vec<(f64, f64)> = of
        .filter_map(|arrival| {
            if let Some(column) = arrival.column {
                return Some((f64::from(column), arrival.local_speed_m_per_s? / c_m_per_s));
            }
            let speed = arrival.front_speed_m_per_s? / c_m_per_s;
            let from_below = arrival.block > beginning;
            let block = f64::from(arrival.block) + if from_below { -0.5 } else { 0.5 };
            (speed > 0.0).then_some((block, speed))
        })
        .collect();
    speeds.sort_by(|a, b| a.0.total_cmp(&b.0));
    speeds
}

/// Block by block the speed over `c` of a steady front under the force that the block bore before
/// the rupture: that in the state at the onset of the slip event in which it began, or the prestress
/// of a slider that nothing has moved yet. Where no front is driven there is no number.
fn theory(run: &RunData, (loads, states): (&[Load], &States), rupture: &Rupture) -> Vec<(f64, f64)> {
    let plan = &run.plan;
    let slip = run.slip_steps.event_at(rupture.onset_step);
    let at_onset = slip.and_then(|(_, onset)| states.at_precursor_onset(onset));
    let prestress = |n: usize| match at_onset {
        Some(state) => {
            // Over the load of the start; of this contact, where the state gives it.
            let course = match state.normal_load_n.get(n) {
                Some(load_n) => load_n / plan.normal_load_n[n],
                None => load_at(loads, state.step)?.normal_load_n / plan.total_normal_load_n,
            };
            let dynamic_n = course * plan.friction.dynamic_friction_n[n];
            let weakening_n = course * plan.friction.static_threshold_n[n] - dynamic_n;
            (weakening_n > 0.0).then(|| (state.tangential_force_n[n] - dynamic_n) / weakening_n)
        }
        None => relative_prestress(plan, n).filter(|_| Front::of(plan, n).is_some()),
    };
    if !plan.has_theory() {
        return Vec::new();
    }
    let front = |n: usize| Front::with_prestress(plan, n, prestress(n)?).speed_over_c();
    let blocks = rupture.first_block..=rupture.last_block;
    let speed = |n: usize| front(n).unwrap_or(f64::NAN);
    let speeds: Vec<(f64, f64)> = blocks.map(|block| (f64::from(block), speed(block as usize - 1))).collect();
    if speeds.iter().all(|(_, speed)| speed.is_nan()) { Vec::new() } else { speeds }
}

#[cfg(test)]
mod tests {
    use super::{Figure, FrontProfile, Pen, relative_prestress};
    use crate::draw::sheet::{INK, Marker, Shape, Sheet};
    use std::sync::Arc;

    use asperity_record::FieldRecord;
    use asperity_testkit::made_up;

    const FIGURE: FrontProfile = FrontProfile {
        file: String::new(),
        run: String::new(),
        title: String::new(),
        width_mm: None,
        rupture: None,
        which: None,
        to_speed: None,
    };

    fn marks(sheet: &Sheet) -> Vec<(f64, f64)> {
        let marks = sheet.layers().find_map(|layer| match &layer.shape {
            Shape::Marks(points, Marker::Circle) => Some(points.clone()),
            _ => None,
        });
        marks.expect("there are marks")
    }

    #[test]
    fn speeds_are_over_that_of_waves_and_stand_between_the_blocks() {
        let mut run = made_up::pulse(12, "prestress.ratio = 0.6");
        let crossing_s = (12.0 / 12.0 / 2.75e7f64).sqrt();
        // From block 3 to both sides; block 5 comes with block 4.
        made_up::with_ruptures(
            &mut run,
            &[&[(3, 1000, None), (2, 1100, None), (4, 1300, None), (5, 1300, None)]],
        );
        // By the way from the neighbour.
        run.arrivals[2].front_speed_m_per_s = Some(run.plan.spacing_m / 3e-7);
        let sheet = FIGURE.part(&run, Pen::nth(0, "")).unwrap();
        let found = marks(&sheet);
        assert_eq!(found.iter().map(|(block, _)| *block).collect::<Vec<f64>>(), [2.5, 3.5]);
        assert!((found[0].1 - crossing_s / 1e-7).abs() < 1e-9, "{found:?}");
        assert!((found[1].1 - crossing_s / 3e-7).abs() < 1e-9, "{found:?}");
        let labels = sheet.labels();
        assert!(labels.contains(&"theory, rigid contacts".to_owned()), "{labels:?}");
        assert!(labels.contains(&format!("c = {:.1} m/s", run.plan.spacing_m / crossing_s)), "{labels:?}");
        let refused = FrontProfile { rupture: Some(7), ..FIGURE }.part(&run, Pen::nth(0, "")).unwrap_err();
        assert_eq!(refused, "run test has no rupture 7 (accepted: 0 to 0)");
    }

    /// A speed that the axis does not reach was dropped without a word.
    #[test]
    fn what_is_above_the_axis_is_marked_at_its_edge() {
        let mut run = made_up::pulse(12, "prestress.ratio = 0.6");
        let arrivals = [(3, 1000, None), (2, 1100, None), (4, 1300, None)];
        made_up::with_ruptures(&mut run, &[&arrivals]);
        let all = marks(&FIGURE.part(&run, Pen::nth(0, "")).unwrap());
        let to = (all[0].1 * all[1].1).sqrt();
        let sheet = FrontProfile { to_speed: Some(to), ..FIGURE }.part(&run, Pen::nth(0, "")).unwrap();
        let (lower, higher) = if all[0].1 < all[1].1 { (all[0], all[1]) } else { (all[1], all[0]) };
        assert_eq!(marks(&sheet), [lower]);
        let triangles = sheet.layers().find_map(|layer| match &layer.shape {
            Shape::Marks(points, Marker::Triangle) if layer.colour == INK => Some(points.clone()),
            _ => None,
        });
        assert_eq!(triangles, Some(vec![(higher.0, super::AT_THE_EDGE * to)]));
        let says = |sheet: &Sheet| sheet.labels().contains(&"above the axis".to_owned());
        assert!(says(&sheet) && !says(&FIGURE.part(&run, Pen::nth(0, "")).unwrap()));
    }

    /// Under a held top drive with rigid contacts the theory of the whole front holds for each block.
    #[test]
    fn the_theory_is_that_of_the_force_on_each_block() {
        let mut run = made_up::pulse(12, "prestress.ratio = 0.6");
        made_up::with_ruptures(&mut run, &[&[(1, 30, None), (2, 60, None), (3, 90, None)]]);
        let speed = asperity_numbers::fronts::theory(&run).unwrap().speed_over_c().unwrap();
        let rupture = &run.ruptures.clone().unwrap()[0];
        assert_eq!(
            super::theory(&run, (&run.loads, &run.states), rupture),
            [(1.0, speed), (2.0, speed), (3.0, speed)]
        );
        // Twice the load of block 2 in a state, and the force that is as far from the threshold there.
        let onset = run.ruptures.as_ref().unwrap()[0].onset_step;
        run.run.slip_steps = Default::default();
        Arc::make_mut(&mut run.run.slip_steps).push(&asperity_testkit::slip_event(onset, 1000, 1..=3));
        let relative = relative_prestress(&run.plan, 0).unwrap();
        let factor = |n: usize| if n == 1 { 2.0 } else { 1.0 };
        let friction = &run.plan.friction;
        let force = |n: usize| {
            let dynamic_n = friction.dynamic_friction_n[n];
            factor(n) * (dynamic_n + relative * (friction.static_threshold_n[n] - dynamic_n))
        };
        let state = FieldRecord {
            step: onset,
            tangential_force_n: (0..12).map(force).collect(),
            normal_load_n: (0..12).map(|n| factor(n) * run.plan.normal_load_n[n]).collect(),
            ..FieldRecord::default()
        };
        let mut states = run.clone();
        made_up::with_states(&mut states, &[state]);
        let found = super::theory(&states, (&states.loads, &states.states), rupture);
        assert!(
            found.len() == 3 && found.iter().all(|(_, found)| (found / speed - 1.0).abs() < 1e-9),
            "{found:?}"
        );
        // A drive that moves leaves nothing to say, unless the forces are known.
        run.plan.drive.velocity_m_per_s = 1.0;
        assert_eq!(super::theory(&run, (&run.loads, &run.states), rupture), []);
    }
}
