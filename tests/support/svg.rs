//! The elements of one of our SVG files: a path or a picture per line.

/// A rectangle along the axes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Bounds {
    pub(crate) left: f64,
    pub(crate) top: f64,
    pub(crate) right: f64,
    pub(crate) bottom: f64,
}

impl Bounds {
    fn about(points: impl Iterator<Item = (f64, f64)>) -> Bounds {
        let none = Bounds { left: f64::MAX, top: f64::MAX, right: f64::MIN, bottom: f64::MIN };
        points.fold(none, |all, (x, y)| all.with(&Bounds { left: x, top: y, right: x, bottom: y }))
    }

    pub(crate) fn with(&self, other: &Bounds) -> Bounds {
        Bounds {
            left: self.left.min(other.left),
            top: self.top.min(other.top),
            right: self.right.max(other.right),
            bottom: self.bottom.max(other.bottom),
        }
    }

    pub(crate) fn wider(&self, by: f64) -> Bounds {
        Bounds { left: self.left - by, top: self.top - by, right: self.right + by, bottom: self.bottom + by }
    }

    pub(crate) fn width(&self) -> f64 {
        self.right - self.left
    }

    pub(crate) fn height(&self) -> f64 {
        self.bottom - self.top
    }

    pub(crate) fn middle(&self) -> (f64, f64) {
        ((self.left + self.right) / 2.0, (self.top + self.bottom) / 2.0)
    }

    pub(crate) fn is_within(&self, other: &Bounds) -> bool {
        self.left >= other.left
            && self.right <= other.right
            && self.top >= other.top
            && self.bottom <= other.bottom
    }

    pub(crate) fn meets(&self, other: &Bounds) -> bool {
        self.left < other.right
            && other.left < self.right
            && self.top < other.bottom
            && other.top < self.bottom
    }
}

/// A path, or the outline of a picture.
#[derive(Debug, Clone)]
pub(crate) struct Item {
    pub(crate) class: String,
    /// Its text, if any.
    pub(crate) words: String,
    pub(crate) stroke_width: Option<f64>,
    /// Whether it is a picture.
    pub(crate) is_image: bool,
    /// Of the outlines, ends of curves included and their bends left out.
    outlines: Vec<Vec<(f64, f64)>>,
    pub(crate) bounds: Bounds,
}

impl Item {
    fn read(line: &str) -> Item {
        let value = |name: &str| {
            let (_, rest) = line.split_once(&format!(" {name}=\""))?;
            rest.split_once('"').map(|(value, _)| value)
        };
        let number = |name: &str| {
            value(name).map(|number| number.parse::<f64>().unwrap_or_else(|_| panic!("{name} of {line}")))
        };
        let is_image = line.starts_with("<image ");
        let outlines = if is_image {
            let [left, top, width, height] =
                ["x", "y", "width", "height"].map(|name| number(name).expect("a picture has its place"));
            let (right, bottom) = (left + width, top + height);
            vec![vec![(left, top), (right, top), (right, bottom), (left, bottom), (left, top)]]
        } else {
            Item::outlines(value("d").expect("a path has its course"))
        };
        let bounds = Bounds::about(outlines.iter().flatten().copied());
        Item {
            class: value("class").expect("everything has a class").to_owned(),
            words: value("aria-label").unwrap_or_default().to_owned(),
            stroke_width: number("stroke-width"),
            is_image,
            outlines,
            bounds,
        }
    }

    /// The outlines of a path.
    fn outlines(path: &str) -> Vec<Vec<(f64, f64)>> {
        let mut outlines: Vec<Vec<(f64, f64)>> = Vec::new();
        // A letter, and the numbers behind it.
        let letters = || path.char_indices().filter(|(_, c)| c.is_ascii_alphabetic()).map(|(at, _)| at);
        for (from, to) in letters().zip(letters().skip(1).chain([path.len()])) {
            let command = &path[from..to];
            let (letter, numbers) = command.split_at(1);
            let numbers: Vec<f64> = numbers
                .split_whitespace()
                .map(|number| number.parse().expect("coordinates are numbers"))
                .collect();
            match (letter, &numbers[..]) {
                ("M", &[x, y]) => outlines.push(vec![(x, y)]),
                ("L", &[x, y]) | ("C", &[.., x, y]) => {
                    outlines.last_mut().expect("a path begins with M").push((x, y));
                }
                ("Z", []) => {
                    let outline = outlines.last_mut().expect("a path begins with M");
                    outline.push(outline[0]);
                }
                _ => panic!("no part of a path: {command}"),
            }
        }
        outlines
    }

    /// The item on another course.
    pub(crate) fn at(self, course: &[(f64, f64)]) -> Item {
        Item { outlines: vec![course.to_vec()], bounds: Bounds::about(course.iter().copied()), ..self }
    }

    fn change(&mut self, change: impl Fn((f64, f64)) -> (f64, f64)) {
        for point in self.outlines.iter_mut().flatten() {
            *point = change(*point);
        }
        self.bounds = Bounds::about(self.outlines.iter().flatten().copied());
    }

    /// Moves it.
    pub(crate) fn shift(&mut self, right: f64, down: f64) {
        self.change(|(x, y)| (x + right, y + down));
    }

    /// Makes it narrower, towards the left.
    pub(crate) fn squeeze(&mut self, to: f64) {
        self.change(|(x, y)| (250.0 + (x - 250.0) * to, y));
    }

    /// Whether it passes through a rectangle.
    pub(crate) fn passes(&self, through: &Bounds) -> bool {
        let is_inside =
            |(x, y): (f64, f64)| Bounds { left: x, top: y, right: x, bottom: y }.is_within(through);
        self.outlines.iter().any(|outline| {
            outline.windows(2).any(|ends| {
                // As closely as a pixel, but not where both ends are far away on the same side.
                if !Bounds::about(ends.iter().copied()).wider(0.5).meets(through) {
                    return false;
                }
                let (dx, dy) = (ends[1].0 - ends[0].0, ends[1].1 - ends[0].1);
                let steps = dx.abs().max(dy.abs()).ceil().max(1.0);
                (0..=steps as usize).any(|n| {
                    let share = n as f64 / steps;
                    is_inside((ends[0].0 + share * dx, ends[0].1 + share * dy))
                })
            })
        })
    }
}

/// A figure.
pub(crate) struct Drawing {
    pub(crate) page: Bounds,
    pub(crate) items: Vec<Item>,
}

impl Drawing {
    pub(crate) fn read(svg: &str) -> Drawing {
        let (_, page) = svg.split_once("viewBox=\"0 0 ").expect("an SVG says how large it is");
        let page: Vec<f64> = page
            .split('"')
            .next()
            .into_iter()
            .flat_map(str::split_whitespace)
            .map(|number| number.parse().expect("a size is a number"))
            .collect();
        let is_drawn = |line: &&str| line.starts_with("<path ") || line.starts_with("<image ");
        let items = svg.lines().filter(is_drawn).map(Item::read).collect();
        Drawing { page: Bounds { left: 0.0, top: 0.0, right: page[0], bottom: page[1] }, items }
    }

    /// The paths of a class.
    pub(crate) fn of(&self, class: &str) -> impl Iterator<Item = &Item> {
        self.items.iter().filter(move |item| item.class == class)
    }
}
