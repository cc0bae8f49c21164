//! A drawn page: paths with a fill or a stroke, and pixels, from back to front. SVG, PNG and PDF are
//! written of the same ones, so that they cannot differ in anything but their format.

use plotters::style::RGBAColor;

use super::raster::Raster;

/// Page units to an inch: pixels of the PNG.
pub(crate) const PER_INCH: f64 = 300.0;

/// Points to an inch, in which SVG and PDF give the size of a page.
pub(crate) const POINTS: f64 = 72.0;

/// Page units that are a whole number of points.
const WHOLE: u32 = 25;

/// A place on the page, in page units to the right and down.
pub(crate) type Point = (f64, f64);

/// A piece of an outline.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Segment {
    /// Begins a new outline.
    Move(Point),
    Line(Point),
    /// A cubic Bézier curve, by its two control points and its end.
    Curve(Point, Point, Point),
    Close,
}

/// How a path is painted.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Paint {
    Fill(RGBAColor),
    /// A line of a width, with a pattern of lengths on and off; solid if that is empty.
    Stroke {
        colour: RGBAColor,
        width: f64,
        dashes: Vec<f64>,
    },
    /// Pixels, which the path is the outline of.
    Raster(Raster),
}

/// What a path is on its page.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Role(pub(crate) &'static str);

impl Role {
    /// What is shown.
    pub(crate) const DATA: Role = Role("data");
    /// The frame of a panel, or of a colour bar.
    pub(crate) const FRAME: Role = Role("frame");
    /// A mark on an axis.
    pub(crate) const TICK: Role = Role("tick");
    /// The number beside a mark of the axis across.
    pub(crate) const NUMBER_ACROSS: Role = Role("number-across");
    /// The number beside a mark of the axis upwards.
    pub(crate) const NUMBER_UPWARDS: Role = Role("number-upwards");
    /// A title, or what an axis is called.
    pub(crate) const LABEL: Role = Role("label");
    /// A sample in a legend.
    pub(crate) const SAMPLE: Role = Role("sample");
    /// Words in a legend.
    pub(crate) const LEGEND: Role = Role("legend");
    /// The line at the foot.
    pub(crate) const FOOT: Role = Role("foot");

    /// The role of this name among those of words that charts draw: numbers beside marks, or else labels.
    pub(crate) fn named(word: &str) -> Role {
        let beside_axes = [Role::NUMBER_ACROSS, Role::NUMBER_UPWARDS];
        beside_axes.into_iter().find(|role| role.0 == word).unwrap_or(Role::LABEL)
    }
}

/// A path on a page.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Item {
    pub(crate) role: Role,
    /// What it says, if it is text.
    pub(crate) text: String,
    pub(crate) path: Vec<Segment>,
    pub(crate) paint: Paint,
}

impl Item {
    /// One that says nothing.
    pub(crate) fn new(role: Role, path: Vec<Segment>, paint: Paint) -> Item {
        Item { role, text: String::new(), path, paint }
    }
}

/// A page of a size in page units.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Page {
    pub(crate) width: u32,
    pub(crate) height: u32,
    pub(crate) items: Vec<Item>,
}

impl Page {
    /// A page of at least this size: of a whole number of points, which every program takes for as many
    /// pixels.
    pub(crate) fn new(width: u32, height: u32) -> Page {
        Page {
            width: width.next_multiple_of(WHOLE),
            height: height.next_multiple_of(WHOLE),
            items: Vec::new(),
        }
    }

    /// Makes it higher.
    pub(crate) fn grow(&mut self, by: f64) {
        self.height = (self.height + by.ceil() as u32).next_multiple_of(WHOLE);
    }

    /// Puts what is on another page upon it, with that page's corner at a place.
    pub(crate) fn paste(&mut self, other: Page, (left, top): Point) {
        let moved = |(x, y): Point| (x + left, y + top);
        for mut item in other.items {
            item.path = mapped(item.path, moved);
            if let Paint::Raster(raster) = &mut item.paint {
                raster.corner = (raster.corner.0 + left as i32, raster.corner.1 + top as i32);
            }
            self.add(item);
        }
    }

    /// Puts a path in front of all others; one of nothing is left out.
    pub(crate) fn add(&mut self, mut item: Item) {
        if item.path.len() < 2 {
            return;
        }
        item.path = mapped(item.path, rounded);
        self.items.push(item);
    }
}

/// A path with its points elsewhere.
pub(crate) fn mapped(path: Vec<Segment>, place: impl Fn(Point) -> Point) -> Vec<Segment> {
    let moved = |segment| match segment {
        Segment::Move(to) => Segment::Move(place(to)),
        Segment::Line(to) => Segment::Line(place(to)),
        Segment::Curve(a, b, to) => Segment::Curve(place(a), place(b), place(to)),
        Segment::Close => Segment::Close,
    };
    path.into_iter().map(moved).collect()
}

/// A hundredth of a unit is what all formats are given.
fn rounded((x, y): Point) -> Point {
    ((x * 100.0).round() / 100.0, (y * 100.0).round() / 100.0)
}

/// A number with no more decimals than it has.
pub(crate) fn short(value: f64) -> String {
    let text = format!("{value:.2}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" { "0".to_owned() } else { text.to_owned() }
}

/// An open path through points.
pub(crate) fn through(points: &[Point]) -> Vec<Segment> {
    let mut points = points.iter().copied();
    let first = points.next().map(Segment::Move);
    first.into_iter().chain(points.map(Segment::Line)).collect()
}

/// A closed path through points.
pub(crate) fn around(points: &[Point]) -> Vec<Segment> {
    let mut path = through(points);
    path.push(Segment::Close);
    path
}

/// A circle.
pub(crate) fn circle((x, y): Point, r: f64) -> Vec<Segment> {
    // How far control points are from the ends of a quarter, over the radius.
    let k = 0.552_284_75 * r;
    vec![
        Segment::Move((x + r, y)),
        Segment::Curve((x + r, y + k), (x + k, y + r), (x, y + r)),
        Segment::Curve((x - k, y + r), (x - r, y + k), (x - r, y)),
        Segment::Curve((x - r, y - k), (x - k, y - r), (x, y - r)),
        Segment::Curve((x + k, y - r), (x + r, y - k), (x + r, y)),
        Segment::Close,
    ]
}

/// The corners of the least rectangle about a path's points.
pub(crate) fn bounds(path: &[Segment]) -> Option<(Point, Point)> {
    let points = path.iter().flat_map(|segment| match *segment {
        Segment::Move(to) | Segment::Line(to) => vec![to],
        Segment::Curve(a, b, to) => vec![a, b, to],
        Segment::Close => Vec::new(),
    });
    points.fold(None, |bounds, (x, y)| {
        let ((left, top), (right, bottom)) = bounds.unwrap_or(((x, y), (x, y)));
        Some(((left.min(x), top.min(y)), (right.max(x), bottom.max(y))))
    })
}

#[cfg(test)]
mod tests {
    use plotters::style::{BLACK, Color};

    use super::{Item, Page, Paint, Role, Segment, around, bounds, short};

    #[test]
    fn pages_keep_hundredths_and_leave_nothing_out_but_nothing() {
        let mut page = Page::new(10, 30);
        assert_eq!((page.width, page.height), (25, 50));
        let item = |path| Item::new(Role::DATA, path, Paint::Fill(BLACK.to_rgba()));
        page.add(item(around(&[(0.123_456, 1.0), (2.0, 3.0)])));
        page.add(item(vec![Segment::Move((1.0, 1.0))]));
        assert_eq!(page.items.len(), 1);
        assert_eq!(page.items[0].path[0], Segment::Move((0.12, 1.0)));
        assert_eq!(bounds(&page.items[0].path), Some(((0.12, 1.0), (2.0, 3.0))));
    }

    #[test]
    fn numbers_are_short() {
        assert_eq!([1.0, 0.25, -0.001, -2.5, 100.0].map(short), ["1", "0.25", "0", "-2.5", "100"]);
    }
}
