//! The model of a slab, drawn: its lattice, the surface, drive and normal load.

use asperity_model::{DriveKind, Lattice, Plan};

use crate::pen::{Pen, length_label, load_label, velocity_label};

const HEIGHT: f64 = 236.0;
/// Position of the lattice.
const LEFT: f64 = 180.0;
const RIGHT: f64 = 540.0;
const BOTTOM: f64 = 196.0;
/// Number of columns and rows drawn; the drive is drawn at its height.
const DRAWN: [usize; 2] = [13, 5];
/// Arrows of the load.
const ARROW: f64 = 22.0;

/// Where the drive pulls, in words.
pub(crate) fn drive(plan: &Plan, kind: DriveKind) -> &'static str {
    match kind {
        _ if plan.drive.springs.is_empty() => "no drive",
        DriveKind::Top => "springs drive it from the top",
        DriveKind::Side | DriveKind::LeftRight | DriveKind::Force => "a spring drives it from the side",
    }
}

/// The sketch of a slab as SVG, with words for those who do not see it.
pub(crate) fn sketch(plan: &Plan, lattice: &Lattice, kind: DriveKind) -> String {
    let drive = drive(plan, kind);
    let words = format!(
        "The model: a lattice of {} by {} nodes, joined by springs; those of the bottom row rub, each held by a \
         friction spring while it sticks; {drive}; the normal load presses on the top row.",
        lattice.columns, lattice.rows
    );
    let columns = lattice.columns.min(DRAWN[0]);
    let rows = lattice.rows.min(DRAWN[1]);
    let pitch = (RIGHT - LEFT) / (columns - 1) as f64;
    let height = (pitch * (rows - 1) as f64).min(112.0);
    let x = |column: usize| LEFT + column as f64 * pitch;
    let z = |row: usize| BOTTOM - height * row as f64 / (rows - 1) as f64;
    let surface = BOTTOM + 8.0;
    let mut pen = Pen::default();
    pen.surface([LEFT - 60.0, RIGHT + 60.0], surface);
    let (mut straight, mut diagonal, mut held) = (String::new(), String::new(), String::new());
    for row in 0..rows {
        straight += &format!("M{:.1} {:.1}H{:.1}", LEFT, z(row), RIGHT);
        for column in 0..columns {
            if row == 0 {
                straight += &format!("M{:.1} {BOTTOM}V{:.1}", x(column), z(rows - 1));
                held += &format!("M{:.1} {BOTTOM}v8", x(column));
                continue;
            }
            if column > 0 {
                let (left, right, below, above) = (x(column - 1), x(column), z(row - 1), z(row));
                diagonal += &format!(
                    "M{left:.1} {below:.1}L{right:.1} {above:.1}M{left:.1} {above:.1}L{right:.1} {below:.1}"
                );
            }
        }
    }
    pen.path("s", &straight);
    pen.path("f", &diagonal);
    pen.path("s", &held);
    // The load, from above.
    let top = z(rows - 1);
    let most = plan.top_load_n.iter().fold(0.0, |most: f64, load_n| most.max(*load_n));
    for column in 0..columns {
        let load_n = plan.top_load_n[column * (lattice.columns - 1) / (columns - 1)];
        let length = (ARROW * load_n / most).max(2.0);
        pen.path("s", &format!("M{:.1} {:.1}V{:.1}", x(column), top - 4.0 - length, top - 4.0));
        pen.path("h", &format!("M{0:.1} {1:.1}l-2.5 -6h5Z", x(column), top - 4.0));
    }
    let is_top = kind == DriveKind::Top;
    let at = plan.drive.springs.first().map(|spring| {
        let share = (spring.block / lattice.columns) as f64 / (lattice.rows - 1) as f64;
        if is_top { top - ARROW - 12.0 } else { BOTTOM - share * height }
    });
    let mut labels = Vec::new();
    if let Some(at) = at {
        let zigzag: String = (0..8)
            .map(|n| {
                format!("L{:.1} {:.1}", LEFT - 48.0 + 5.0 * f64::from(n), at + [4.0, -4.0][n as usize % 2])
            })
            .collect();
        if is_top {
            pen.path("g", &format!("M{:.1} {at:.1}H{:.1}", LEFT - 20.0, RIGHT + 20.0));
        } else {
            pen.path("s", &format!("M{:.1} {at:.1}{zigzag}L{LEFT:.1} {at:.1}", LEFT - 56.0));
        }
        pen.path("s", &format!("M{:.1} {at:.1}h-34", LEFT - 60.0));
        pen.path("h", &format!("M{:.1} {at:.1}l-7 -3v6Z", LEFT - 60.0));
        labels.push((LEFT - 156.0, at - 24.0, velocity_label(plan)));
        labels.push((LEFT - 36.0, at - 8.0, "<tspan class=\"i\">K</tspan>".to_owned()));
    }
    labels.push((RIGHT + 12.0, top - 12.0, load_label(plan)));
    let size = format!("{} × {}", lattice.columns, lattice.rows);
    labels.push((RIGHT + 12.0, (top + BOTTOM) / 2.0, size));
    labels.push((LEFT, surface + 24.0, length_label(plan)));
    for (x, y, html) in labels {
        pen.words(x, y, "start", &html);
    }
    pen.svg(top - ARROW - 34.0, HEIGHT, &words)
}

#[cfg(test)]
mod tests {
    use asperity_model::{Plan, resolve};

    use super::sketch;

    #[test]
    fn slabs_have_sketches_of_their_own() {
        let of = |set: &[&str]| {
            let scenario = resolve("slab", set).unwrap();
            let plan = Plan::new(&scenario);
            sketch(&plan, &plan.elastic.as_lattice(), scenario.drive.kind)
        };
        let side = of(&[]);
        assert!(side.contains("a lattice of 57 by 31 nodes") && side.contains("from the side"), "{side}");
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
