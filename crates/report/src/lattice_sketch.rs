//! The model of a slab, sheet or body, drawn to scale as seen obliquely from the driven side: its lattice, the surface,
//! drive and normal load. A slab is a body with one row across.

use asperity_model::{DriveKind, Lattice, Plan};

use crate::pen::{Pen, length_label, load_label, velocity_label};
use crate::symbols::spelled;

/// Largest width and height of the lattice, and its lower right corner in front.
const SIZE: [f64; 2] = [370.0, 150.0];
const RIGHT: f64 = 560.0;
const BOTTOM: f64 = 196.0;
const HEIGHT: f64 = 236.0;
/// What is across the sliding direction goes back to the left, by so much of its length, and up: a sheet is seen
/// from farther above.
const BACK: [[f64; 2]; 2] = [[0.7, 0.75], [0.55, 0.4]];
/// Number of columns, rows across and layers drawn at most.
const DRAWN: [usize; 3] = [13, 5, 5];
/// Arrows of the load, and the springs of the drive, which are one where there is no room for two.
const ARROW: f64 = 18.0;
const SPRING: f64 = 44.0;
const BETWEEN_SPRINGS: f64 = 24.0;

/// Where the drive pulls, in words.
pub(crate) fn drive(plan: &Plan, kind: DriveKind) -> String {
    let rows = plan.elastic.lanes as u32;
    match (kind, plan.driven_rows()) {
        _ if plan.drive.springs.is_empty() => "no drive".to_owned(),
        (DriveKind::Top, _) => "springs drive it from the top".to_owned(),
        _ if rows == 1 => "a spring drives it from the side".to_owned(),
        (_, Some([first, last])) if last - first + 1 < rows => {
            format!("a spring drives row {first} of one side")
        }
        _ => "springs drive one side".to_owned(),
    }
}

/// What it is, and which of its nodes rub.
pub(crate) fn body(plan: &Plan) -> &'static str {
    match plan.elastic {
        Lattice { rows: 1, .. } => "a lattice all of whose nodes rub",
        Lattice { lanes: 1, .. } => "a lattice whose bottom row rubs",
        _ => "a lattice whose bottom layer rubs",
    }
}

/// Where points of the lattice are on the sketch.
struct View {
    scale: f64,
    back: [f64; 2],
    size_m: [f64; 3],
}

impl View {
    fn of(size_m: [f64; 3], is_sheet: bool) -> View {
        let [x, y, z] = size_m;
        let back = BACK[usize::from(!is_sheet)];
        let scale = (SIZE[0] / (x + back[0] * y)).min(SIZE[1] / (z + back[1] * y));
        View { scale, back, size_m }
    }

    /// By shares of the length, the width and the height.
    fn at(&self, share: [f64; 3]) -> [f64; 2] {
        let [x, y, z] = [0, 1, 2].map(|axis| share[axis] * self.size_m[axis] * self.scale);
        let left = RIGHT - self.size_m[0] * self.scale;
        [left + x - self.back[0] * y, BOTTOM - z - self.back[1] * y]
    }

    fn line(&self, from: [f64; 3], to: [f64; 3]) -> String {
        let ([x, y], [to_x, to_y]) = (self.at(from), self.at(to));
        format!("M{x:.1} {y:.1}L{to_x:.1} {to_y:.1}")
    }
}

/// The sketch as SVG, with words for those who do not see it.
pub(crate) fn sketch(plan: &Plan, height_m: f64, kind: DriveKind) -> String {
    let lattice = plan.elastic;
    let Lattice { columns, lanes, rows, .. } = lattice;
    let spacing = |count: usize| (count - 1) as f64 * plan.spacing_m;
    let view = View::of([plan.length_m, spacing(lanes), height_m], rows == 1);
    let count = match (lanes, rows) {
        (1, other) | (other, 1) => format!("{columns} × {other}"),
        _ => format!("{columns} × {lanes} × {rows}"),
    };
    let words = format!(
        "The model: {}, {count} nodes joined by springs, each that rubs held by a friction spring while it sticks; {}; \
         the normal load presses from above.",
        body(plan),
        drive(plan, kind)
    );
    let drawn = [columns.min(DRAWN[0]), lanes.min(DRAWN[1]), rows.min(DRAWN[2])];
    // A sheet is thin: its nodes are on its upper face.
    let shares = |axis: usize| {
        let last = drawn[axis].max(2) - 1;
        (0..=last).map(move |n| n as f64 / last as f64)
    };
    let mut pen = Pen::default();
    pen.surface([view.at([0.0, 0.0, 0.0])[0] - 30.0, RIGHT + 40.0], BOTTOM + 8.0);
    let (mut straight, mut held) = (String::new(), String::new());
    for x in shares(0) {
        if rows > 1 || x == 0.0 || x == 1.0 {
            straight += &view.line([x, 0.0, 0.0], [x, 0.0, 1.0]);
        }
        straight += &view.line([x, 0.0, 1.0], [x, 1.0, 1.0]);
        let [left, bottom] = view.at([x, 0.0, 0.0]);
        held += &format!("M{left:.1} {bottom:.1}v8");
    }
    for y in shares(1).take(lanes) {
        if rows > 1 || y == 0.0 || y == 1.0 {
            straight += &view.line([0.0, y, 0.0], [0.0, y, 1.0]);
        }
        straight += &view.line([0.0, y, 1.0], [1.0, y, 1.0]);
    }
    for z in shares(2) {
        straight += &view.line([0.0, 0.0, z], [1.0, 0.0, z]);
        straight += &view.line([0.0, 0.0, z], [0.0, 1.0, z]);
    }
    pen.path("s", &straight);
    pen.path("f", &diagonals(&view, drawn));
    pen.path("s", &held);
    // The load on the middle of the upper face.
    let loads_n = if plan.top_load_n.is_empty() { &plan.normal_load_n } else { &plan.top_load_n };
    let most = loads_n.iter().fold(0.0, |most: f64, load_n| most.max(*load_n));
    for x in shares(0).filter(|_| most > 0.0) {
        let column = (x * (columns - 1) as f64).round() as usize;
        let [left, foot] = view.at([x, 0.5, 1.0]);
        pen.arrow([left, foot - (ARROW * loads_n[column] / most).max(2.0)], [left, foot]);
    }
    let top = view.at([0.0, 1.0, 1.0])[1];
    let mut labels = vec![(RIGHT + 12.0, view.at([1.0, 0.0, 1.0])[1] - 10.0, load_label(plan))];
    labels.push((RIGHT + 12.0, BOTTOM - 8.0, count));
    let size = match lanes {
        1 => length_label(plan),
        lanes => format!("{}, {} wide", length_label(plan), spelled(spacing(lanes), "m")),
    };
    labels.push((view.at([0.0, 0.0, 0.0])[0], BOTTOM + 32.0, size));
    let velocity = velocity_label(plan);
    let spring = "<tspan class=\"i\">K</tspan>".to_owned();
    match (plan.driven_rows(), plan.drive.springs.first()) {
        (Some([first, last]), Some(of)) => {
            let height = lattice.place(of.block)[2] as f64 / (rows.max(2) - 1) as f64;
            let z = if rows == 1 { 1.0 } else { height };
            let share = |row: u32| f64::from(row - 1) / (lanes.max(2) - 1) as f64;
            let ends = [first, last].map(|row| view.at([0.0, share(row), z]));
            let middle = [0, 1].map(|axis| (ends[0][axis] + ends[1][axis]) / 2.0);
            let is_one = (ends[0][1] - ends[1][1]).abs() < BETWEEN_SPRINGS;
            for [x, y] in if is_one { vec![middle] } else { ends.to_vec() } {
                pen.spring([x - SPRING, y], [x, y]);
            }
            // The drive point, a bar along the driven edge.
            let reach = if first == last { 7.0 } else { 4.0 };
            let [front, back] = ends.map(|[x, y]| [x - SPRING, y]);
            pen.path(
                "g",
                &format!("M{:.1} {:.1}L{:.1} {:.1}", front[0], front[1] + reach, back[0], back[1] - reach),
            );
            let [x, y] = [middle[0] - SPRING, middle[1]];
            pen.arrow([x - 40.0, y], [x - 6.0, y]);
            pen.words(x - 48.0, y + 5.0, "end", &velocity);
            let (at, beside) = if is_one { (middle, -9.0) } else { (ends[0], 20.0) };
            pen.words(at[0] - SPRING / 2.0, at[1] + beside, "middle", &spring);
        }
        (None, Some(_)) => {
            let [left, right] = [view.at([0.0, 0.5, 1.0])[0] - 20.0, view.at([1.0, 0.5, 1.0])[0] + 20.0];
            let bar = top - ARROW - 14.0;
            pen.path("g", &format!("M{left:.1} {bar:.1}H{right:.1}"));
            for x in [0.25, 0.5, 0.75] {
                let [at, foot] = view.at([x, 0.5, 1.0]);
                pen.spring([at - 8.0, bar], [at - 2.0, foot]);
            }
            pen.arrow([left - 44.0, bar], [left - 6.0, bar]);
            pen.words(left - 50.0, bar + 5.0, "end", &velocity);
            pen.words(right + 8.0, bar + 5.0, "start", &spring);
        }
        (_, None) => {}
    }
    for (x, y, html) in labels {
        pen.words(x, y, "start", &html);
    }
    pen.svg(top - ARROW - 40.0, HEIGHT, &words)
}

/// The diagonal bonds on the upper face of a sheet, and on the front of a slab or a body.
fn diagonals(view: &View, [columns, lanes, rows]: [usize; 3]) -> String {
    let (others, axis) = if rows == 1 { (lanes, 1) } else { (rows, 2) };
    let share = |n: usize, count: usize| n as f64 / (count - 1) as f64;
    let mut d = String::new();
    for (column, other) in (1..columns).flat_map(|column| (1..others).map(move |other| (column, other))) {
        let at = |column: usize, other: usize| {
            let mut place = [share(column, columns), 0.0, 1.0];
            place[axis] = share(other, others);
            place
        };
        d += &view.line(at(column - 1, other - 1), at(column, other));
        d += &view.line(at(column - 1, other), at(column, other - 1));
    }
    d
}

#[cfg(test)]
mod tests {
    use asperity_model::Plan;
    use asperity_model::resolve;

    use super::sketch;

    #[test]
    fn sheets_and_bodies_have_sketches_to_scale() {
        let of = |name: &str, set: &[&str]| {
            let scenario = resolve(name, set).unwrap();
            sketch(&Plan::new(&scenario), scenario.slider.height_m, scenario.drive.kind)
        };
        let sheet = of("sheet-coarse", &[]);
        assert!(sheet.contains("all of whose nodes rub, 26 × 6 nodes") && sheet.contains("drive one side"));
        let body = of("body-coarse", &[]);
        assert!(body.contains("whose bottom layer rubs, 29 × 5 × 16 nodes"), "{body}");
        let corner = of("sheet-coarse", &["drive.across=1"]);
        assert!(corner.contains("a spring drives row 1 of one side"), "{corner}");
        let top = of("body-coarse", &["drive.kind=top", "drive.height_m=0"]);
        assert!(top.contains("springs drive it from the top"));
        let small = "slider.blocks=2,slider.across=2,slider.length_m=0.02".split(',').collect::<Vec<_>>();
        let few = of("sheet-coarse", &[&small[..], &["normal_load.tilt=0.4"]].concat());
        for svg in [sheet, body, corner, top, few] {
            assert!(!svg.contains("NaN") && !svg.contains("inf"), "{svg}");
        }
    }

    #[test]
    fn slabs_are_drawn_as_bodies_of_one_row() {
        let of = |set: &[&str]| {
            let scenario = resolve("slab", set).unwrap();
            sketch(&Plan::new(&scenario), scenario.slider.height_m, scenario.drive.kind)
        };
        let side = of(&[]);
        assert!(
            side.contains("whose bottom row rubs, 57 × 31 nodes") && side.contains("from the side"),
            "{side}"
        );
        assert!(!side.contains("blocks in a row"));
        // At any height, the highest too.
        assert!(of(&["drive.height_m=0.075"]).contains("from the side"));
        let top = of(&["drive.kind=top", "drive.height_m=0"]);
        assert!(top.contains("springs drive it from the top"));
        let few = of(&["slider.blocks=3", "slider.rows=2", "slider.height_m=0.07", "normal_load.tilt=0.3"]);
        for svg in [side, top, few] {
            assert!(!svg.contains("NaN") && !svg.contains("inf"), "{svg}");
        }
    }
}
