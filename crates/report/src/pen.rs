//! Drawing primitives for the sketches of all bodies: lines, springs, arrows, the surface, and labels.

use asperity_model::Plan;

use crate::html::markup::text;
use crate::symbols::spelled;

/// Width of a sketch.
pub(crate) const WIDTH: f64 = 720.0;

/// An SVG that is being drawn.
#[derive(Debug, Default)]
pub(crate) struct Pen {
    pub(crate) out: String,
}

impl Pen {
    /// A path of a class of the style sheet: `s` a line, `h` an arrow's head, `g` a thick line, `f` a faint
    /// one.
    pub(crate) fn path(&mut self, class: &str, d: &str) {
        self.out += &format!("<path class=\"{class}\" d=\"{d}\"/>");
    }

    /// A label, as markup.
    pub(crate) fn words(&mut self, x: f64, y: f64, anchor: &str, html: &str) {
        self.out += &format!("<text x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"{anchor}\">{html}</text>");
    }

    /// The surface at a height, hatched below.
    pub(crate) fn surface(&mut self, [left, right]: [f64; 2], y: f64) {
        self.path("g", &format!("M{left} {y}H{right}"));
        let mut d = String::new();
        let mut x = left + 6.0;
        while x < right {
            d += &format!("M{x:.0} {y}l-6 7");
            x += 12.0;
        }
        self.path("f", &d);
    }

    /// A zigzag from one point to another.
    pub(crate) fn spring(&mut self, from: [f64; 2], to: [f64; 2]) {
        let along = [to[0] - from[0], to[1] - from[1]];
        let length = along[0].hypot(along[1]);
        let (unit, across) =
            ([along[0] / length, along[1] / length], [-along[1] / length, along[0] / length]);
        let straight = 0.16 * length;
        let (turns, size) = (8, if length > 30.0 { 5.0 } else { 3.5 });
        let mut d = format!("M{:.1} {:.1}", from[0], from[1]);
        for turn in 0..=turns {
            let at = straight + (length - 2.0 * straight) * f64::from(turn) / f64::from(turns);
            let side = match turn {
                0 => 0.0,
                turn if turn == turns => 0.0,
                turn if turn % 2 == 0 => -size,
                _ => size,
            };
            let point =
                [from[0] + unit[0] * at + across[0] * side, from[1] + unit[1] * at + across[1] * side];
            d += &format!("L{:.1} {:.1}", point[0], point[1]);
        }
        d += &format!("L{:.1} {:.1}", to[0], to[1]);
        self.path("s", &d);
    }

    /// An arrow from one point to another.
    pub(crate) fn arrow(&mut self, from: [f64; 2], to: [f64; 2]) {
        let length = (to[0] - from[0]).hypot(to[1] - from[1]);
        let unit = [(to[0] - from[0]) / length, (to[1] - from[1]) / length];
        let head = length.min(7.0);
        let side = |sign: f64| {
            [
                to[0] - unit[0] * head - sign * unit[1] * head * 0.45,
                to[1] - unit[1] * head + sign * unit[0] * head * 0.45,
            ]
        };
        let (a, b) = (side(1.0), side(-1.0));
        self.path("s", &format!("M{:.1} {:.1}L{:.1} {:.1}", from[0], from[1], to[0], to[1]));
        let head = format!("M{:.1} {:.1}L{:.1} {:.1}L{:.1} {:.1}Z", to[0], to[1], a[0], a[1], b[0], b[1]);
        self.path("h", &head);
    }

    /// The SVG from a height down, with words for those who do not see it.
    pub(crate) fn svg(self, from: f64, height: f64, words: &str) -> String {
        format!(
            "<svg class=\"sketch\" viewBox=\"0 {from} {WIDTH} {}\" role=\"img\" aria-label=\"{}\">{}</svg>\n",
            height - from,
            text(words),
            self.out
        )
    }
}

/// `V` of a plan's drive.
pub(crate) fn velocity_label(plan: &Plan) -> String {
    format!("<tspan class=\"i\">V</tspan> = {}", spelled(plan.drive.velocity_m_per_s, "m/s"))
}

/// `F_N` of a plan.
pub(crate) fn load_label(plan: &Plan) -> String {
    let load = spelled(plan.total_normal_load_n, "N");
    format!(
        "<tspan class=\"i\">F</tspan><tspan class=\"d\" dy=\"3\">N</tspan><tspan dy=\"-3\"> = {load}</tspan>"
    )
}

/// `L` of a plan.
pub(crate) fn length_label(plan: &Plan) -> String {
    format!("<tspan class=\"i\">L</tspan> = {}", spelled(plan.length_m, "m"))
}
