//! The model of a scenario, drawn: blocks, springs, contacts, drive and normal load.

use asperity_model::{DriveKind, Plan, Scenario};

use crate::lattice_sketch;
use crate::pen::{Pen, WIDTH, length_label, load_label, velocity_label};

const HEIGHT: f64 = 216.0;
/// Where the surface is, and how large a block is.
const SURFACE: f64 = 170.0;
const BLOCK: [f64; 2] = [44.0, 34.0];
/// Height of the blocks if they stick to springs.
const TOP: f64 = 108.0;
/// The longest arrow of a normal load.
const LONGEST: f64 = 30.0;
/// Number of blocks drawn one by one.
const DRAWN: usize = 7;

/// The sketch of a scenario as SVG, with words for those who do not see it.
pub(crate) fn sketch(scenario: &Scenario) -> String {
    let plan = Plan::new(scenario);
    if is_lattice(&plan) {
        return lattice_sketch::sketch(&plan, scenario.slider.height_m, scenario.drive.kind);
    }
    if plan.medium.is_some() {
        return fault_line(&plan, scenario.slider.medium.word(), scenario.drive.kind);
    }
    let words = words(&plan, scenario.drive.kind);
    Sketch::of(&plan, scenario.drive.kind).svg(&words)
}

/// The sketch with the style that a page of this crate gives it, in the colours of the page that it is put into.
pub fn sketch_alone(scenario: &Scenario) -> String {
    const COLOURS: &str = "--ink: currentColor; --shade: #8882; --rule: #888; --paper: transparent";
    let style = include_str!("sketch.css");
    format!("<style>{style}</style><div style=\"{COLOURS}\">{}</div>", sketch(scenario))
}

/// Features that distinguish the sketches of scenarios: where the drive pulls, and how blocks stick.
pub(crate) fn kind(scenario: &Scenario) -> (&'static str, String) {
    let plan = Plan::new(scenario);
    if is_lattice(&plan) {
        return (lattice_sketch::body(&plan), lattice_sketch::drive(&plan, scenario.drive.kind));
    }
    let what = plan.medium.as_ref().map_or(contact(&plan), |_| scenario.slider.medium.word());
    (what, drive(&plan, scenario.drive.kind).to_owned())
}

/// A fault line downwards, seen along strike, thick where it slips as the drive.
fn fault_line(plan: &Plan, medium: &str, kind: DriveKind) -> String {
    let (mut pen, x, nodes, drive) = (Pen::default(), WIDTH / 2.0, plan.blocks, drive(plan, kind));
    let reach = if medium == "half-space" { 200.0 } else { 0.0 };
    pen.surface([x - reach, x + reach], 24.0);
    pen.path("s", &format!("M{x} 24V156"));
    pen.path("g", &format!("M{x} 156V{HEIGHT}"));
    pen.words(x + 14.0, 90.0, "start", &length_label(plan));
    pen.words(x + 14.0, 190.0, "start", &velocity_label(plan));
    pen.svg(0.0, HEIGHT, &format!("The model: a fault line of {nodes} nodes, {medium}; {drive}."))
}

/// Whether it is a slab, a sheet or a body, and no chain.
fn is_lattice(plan: &Plan) -> bool {
    plan.elastic.layout().is_area() || plan.elastic.has_inside()
}

fn contact(plan: &Plan) -> &'static str {
    if !plan.friction.law.word().sticks() {
        "each always sliding, however slowly"
    } else if plan.friction.law.holds() {
        "each stuck or sliding, without a friction spring"
    } else {
        "each held by a friction spring while it sticks"
    }
}

fn drive(plan: &Plan, kind: DriveKind) -> &'static str {
    match kind {
        DriveKind::Force => "a force drives block 1 from the side",
        DriveKind::Plate => "what is below them drives them",
        _ if plan.drive.springs.is_empty() => "no drive",
        DriveKind::Side => "a spring drives block 1 from the side",
        DriveKind::LeftRight => "springs pull block 1 backwards and the last block forwards",
        DriveKind::Top => "springs drive the blocks from the top",
    }
}

/// The description of the sketch.
fn words(plan: &Plan, kind: DriveKind) -> String {
    let (contact, drive) = (contact(plan), drive(plan, kind));
    let [first, last] = [0, plan.blocks - 1].map(|block| plan.normal_load_n[block]);
    let load = if (first - last).abs() <= 1e-9 * first.abs().max(last.abs()) {
        "evenly"
    } else if first > last {
        "more towards block 1"
    } else {
        "more towards the last block"
    };
    if plan.blocks == 1 {
        return format!("The model: 1 block, {contact}; {drive}.");
    }
    format!(
        "The model: {} blocks in a row, joined by springs, {contact}; {drive}; normal load spread {load}.",
        plan.blocks
    )
}

struct Sketch<'a> {
    plan: &'a Plan,
    kind: DriveKind,
    /// The blocks that are drawn, from 0, and the position that a gap precedes.
    blocks: Vec<usize>,
    gap_before: Option<usize>,
    pen: Pen,
}

impl Sketch<'_> {
    fn of(plan: &Plan, kind: DriveKind) -> Sketch<'_> {
        let last = plan.blocks - 1;
        let (blocks, gap_before) = if plan.blocks <= DRAWN {
            ((0..plan.blocks).collect(), None)
        } else {
            (vec![0, 1, 2, 3, last - 1, last], Some(4))
        };
        Sketch { plan, kind, blocks, gap_before, pen: Pen::default() }
    }

    fn svg(mut self, words: &str) -> String {
        self.pen.surface([70.0, WIDTH - 70.0], SURFACE);
        self.chain();
        self.loads();
        self.drive();
        // Without a driving bar nothing is drawn above the loads.
        let from = if self.has_top_drive() { 0.0 } else { self.top() - 5.0 - LONGEST - 10.0 };
        self.pen.svg(from, HEIGHT, words)
    }

    /// The middle of the block in a place.
    fn x(&self, place: usize) -> f64 {
        let places = self.blocks.len() + usize::from(self.gap_before.is_some());
        let shift = usize::from(self.gap_before.is_some_and(|gap| place >= gap));
        let pitch = (WIDTH - 260.0) / (places.max(2) - 1) as f64;
        130.0 + (place + shift) as f64 * pitch
    }

    /// Whether blocks rest on springs.
    fn on_springs(&self) -> bool {
        self.plan.friction.interfacial_stiffness_n_per_m > 0.0
    }

    fn top(&self) -> f64 {
        if self.on_springs() { TOP } else { SURFACE - BLOCK[1] - 1.0 }
    }

    fn chain(&mut self) {
        let (top, middle) = (self.top(), self.top() + BLOCK[1] / 2.0);
        for place in 0..self.blocks.len() {
            let x = self.x(place);
            if place > 0 {
                let before = self.x(place - 1) + BLOCK[0] / 2.0;
                let next = x - BLOCK[0] / 2.0;
                if self.gap_before == Some(place) {
                    self.pen.words((before + next) / 2.0, middle + 4.0, "middle", "· · ·");
                } else {
                    self.pen.spring([before, middle], [next, middle]);
                    if place == 1 {
                        self.pen.words(
                            (before + next) / 2.0,
                            middle - 10.0,
                            "middle",
                            "<tspan class=\"i\">k</tspan>",
                        );
                    }
                }
            }
            let left = x - BLOCK[0] / 2.0;
            self.pen.out += &format!(
                "<rect x=\"{left:.1}\" y=\"{top:.1}\" width=\"{}\" height=\"{}\"/>",
                BLOCK[0], BLOCK[1]
            );
            let number = (self.blocks[place] + 1).to_string();
            self.pen.words(x, middle + 4.5, "middle", &number);
            if self.on_springs() {
                self.pen.spring([x, top + BLOCK[1]], [x, SURFACE]);
                if place == 0 {
                    let label = "<tspan class=\"i\">k</tspan><tspan class=\"d\" dy=\"3\">t</tspan>";
                    self.pen.words(x + 10.0, (top + BLOCK[1] + SURFACE) / 2.0 + 5.0, "start", label);
                }
            }
        }
        let last = self.x(self.blocks.len() - 1);
        let end = "μ<tspan class=\"d\" dy=\"3\">s</tspan><tspan dy=\"-3\">, μ</tspan><tspan class=\"d\" dy=\"3\">d</tspan>";
        self.pen.words(last + 30.0, SURFACE - 6.0, "start", end);
        // The length is that between the first and the last block.
        if self.plan.blocks == 1 {
            return;
        }
        let (from, to, span) = (self.x(0), last, SURFACE + 30.0);
        self.pen.path(
            "f",
            &format!(
                "M{from:.1} {:.1}v8M{to:.1} {:.1}v8M{from:.1} {span:.1}H{to:.1}",
                span - 4.0,
                span - 4.0
            ),
        );
        let length = length_label(self.plan);
        self.pen.out += &format!(
            "<text class=\"over\" x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{length}</text>",
            (from + to) / 2.0,
            span + 4.5
        );
    }

    fn loads(&mut self) {
        let most = self.plan.normal_load_n.iter().fold(0.0, |most: f64, load| most.max(load.abs()));
        if most == 0.0 {
            return;
        }
        let foot = self.top() - 5.0;
        // Beside the driving springs, where these come from above.
        let beside = if self.has_top_drive() { 14.0 } else { 0.0 };
        for place in 0..self.blocks.len() {
            let share = self.plan.normal_load_n[self.blocks[place]].abs() / most;
            let x = self.x(place) + beside;
            self.pen.arrow([x, foot - (LONGEST * share).max(2.0)], [x, foot]);
        }
        let last = self.x(self.blocks.len() - 1);
        self.pen.words(last + 30.0, foot - 12.0, "start", &load_label(self.plan));
    }

    /// Whether a bar above the blocks pulls them.
    fn has_top_drive(&self) -> bool {
        self.kind == DriveKind::Top && !self.plan.drive.springs.is_empty()
    }

    fn drive(&mut self) {
        let middle = self.top() + BLOCK[1] / 2.0;
        let velocity = velocity_label(self.plan);
        if self.has_top_drive() {
            let (left, right) = (self.x(0) - 34.0, self.x(self.blocks.len() - 1) + 34.0);
            let bar = 22.0;
            self.pen.path("g", &format!("M{left:.1} {bar}H{right:.1}"));
            let stiffness = self.plan.drive.stiffness_n_per_m(self.plan.blocks);
            for place in 0..self.blocks.len() {
                if stiffness[self.blocks[place]] > 0.0 {
                    let x = self.x(place);
                    self.pen.spring([x - 12.0, bar], [x - 6.0, self.top()]);
                }
            }
            self.pen.words(left - 4.0, bar + 30.0, "end", "<tspan class=\"i\">K</tspan>");
            self.pen.arrow([left - 44.0, bar], [left - 8.0, bar]);
            self.pen.words(left - 48.0, bar - 8.0, "start", &velocity);
            return;
        }
        for (n, spring) in self.plan.drive.springs.iter().enumerate() {
            let (place, side) = if spring.block == 0 { (0, -1.0) } else { (self.blocks.len() - 1, 1.0) };
            let edge = self.x(place) + side * BLOCK[0] / 2.0;
            let point = edge + side * 64.0;
            self.pen.spring([point, middle], [edge, middle]);
            self.pen.path("g", &format!("M{point:.1} {:.1}v20", middle - 10.0));
            let above = middle - 22.0;
            let ahead = 14.0 * spring.direction;
            self.pen.arrow([point - ahead, above], [point + ahead, above]);
            // Below the spring; where blocks lie on the surface there is no room but above.
            let beside = if self.on_springs() { middle + 22.0 } else { middle - 9.0 };
            self.pen.words((point + edge) / 2.0, beside, "middle", "<tspan class=\"i\">K</tspan>");
            if n == 0 {
                self.pen.words(point - 30.0, above - 12.0, "start", &velocity);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use asperity_model::resolve;

    use super::sketch;

    #[test]
    fn each_drive_and_law_has_its_sketch() {
        let of = |set: &[&str]| sketch(&resolve("default", set).unwrap());
        let side = of(&[]);
        assert!(side.contains("100 blocks in a row") && side.contains("drives block 1 from the side"));
        // Six blocks, and a gap.
        assert_eq!((side.matches("<rect").count(), side.matches("· · ·").count()), (6, 1));
        let few = of(&["slider.blocks=5", "normal_load.tilt=0.5"]);
        assert_eq!((few.matches("<rect").count(), few.matches("· · ·").count()), (5, 0));
        assert!(few.contains("more towards"), "{few}");
        assert!(of(&["drive.kind='top'"]).contains("from the top"));
        assert!(
            of(&["drive.kind='left-right'", "friction.reattach='two-way'"]).contains("block 1 backwards")
        );
        // However few blocks there are: a bar above, and a spring to each.
        for (blocks, springs) in [("slider.blocks=2", 5), ("slider.blocks=3", 8)] {
            let top = of(&[blocks, "drive.kind='top'"]);
            assert!(top.contains("from the top") && top.contains("M96.0 22"), "{blocks}: {top}");
            // Between blocks, below them and above them.
            assert_eq!(
                top.matches("class=\"s\"").count() - top.matches("class=\"h\"").count(),
                springs,
                "{blocks}"
            );
        }
        let one = of(&["slider.blocks=1"]);
        assert!(one.contains("1 block, each held by a friction spring") && one.matches("<rect").count() == 1);
        let rigid = of(&["friction.law='rigid'"]);
        let letter = |svg: &str| -> f64 {
            let (before, _) = svg.split_once(">K<").map(|(before, rest)| (before.to_owned(), rest)).unwrap();
            before.rsplit("y=\"").next().unwrap().split('"').next().unwrap().parse().unwrap()
        };
        assert!(letter(&side) < super::SURFACE - 10.0 && letter(&rigid) < super::SURFACE - 10.0);
        assert!(rigid.contains("without a friction spring") && rigid.len() < side.len());
        let fault = sketch(&resolve::<&str>("seas-bp1-qd", &[]).unwrap());
        assert!(fault.contains("1600 nodes, half-space; what is below") && !fault.contains("<rect"));
        for svg in [side, few, one, rigid, fault] {
            assert!(!svg.contains("NaN") && !svg.contains("inf"), "{svg}");
        }
    }
}
