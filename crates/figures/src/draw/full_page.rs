//! A page of pictures, one above or beside the other, with a table of numbers.

use plotters::prelude::IntoDrawingArea;

use super::of_study::paper::{Key, Paper};
use super::plot::{Area, Dash, INK, Keys, LABEL_TEXT, Layout, Picture, TICK_TEXT, Told, stroke};
use super::print::canvas::Canvas;
use super::print::page::Page;
use super::text::{self, Align};

/// A page of the format A4 upright, 300 dots per inch.
const SIZE: (i32, i32) = (2480, 3508);
const MARGIN: i32 = 60;
const TITLE: i32 = 130;

/// Width of the lines above and below the table.
const RULE_WIDTH: u32 = 2;

/// Height of a row of the table.
const ROW: i32 = 66;

/// What stands on a page, from top to bottom.
#[derive(Debug)]
pub(super) struct FullPage {
    pub(super) title: String,
    /// Each over the whole width.
    pub(super) wide: Vec<Paper>,
    /// Side by side below them.
    pub(super) beside: Vec<Paper>,
    /// At the foot: what a number is of, and the number.
    pub(super) numbers: Vec<(String, String)>,
}

impl Picture for FullPage {
    fn page(&self, layout: Layout<'_>) -> Result<Page, String> {
        let mut page = Page::new(SIZE.0 as u32, SIZE.1 as u32 + layout.foot_height());
        {
            let root = Canvas(&mut page).into_drawing_area();
            self.draw(&root, layout.keys)?;
            let at = (f64::from(MARGIN), f64::from(SIZE.1));
            layout.footer(&root, at, f64::from(SIZE.0 - 2 * MARGIN))?;
        }
        Ok(page)
    }

    fn told(&self) -> Told {
        let mut told = Told { titles: vec![self.title.clone()], ..Told::default() };
        self.wide.iter().chain(&self.beside).for_each(|paper| told.add(paper.told()));
        told
    }
}

impl FullPage {
    fn draw(&self, root: &Area<'_>, keys: Keys) -> Result<(), String> {
        let width = SIZE.0 - 2 * MARGIN;
        text::draw(root, &self.title, (SIZE.0 / 2, MARGIN + TITLE / 2), LABEL_TEXT, Align::Center, false)?;
        let rows = self.numbers.len().div_ceil(2) as i32;
        let table = ROW * rows + ROW;
        let pictures = self.wide.len() as i32 + i32::from(!self.beside.is_empty());
        let height = (SIZE.1 - 2 * MARGIN - TITLE - table) / pictures.max(1);
        let mut top = MARGIN + TITLE;
        // Keys of one width, so that the panels have one as well.
        let beside = keys == Keys::Beside || self.wide.iter().any(|paper| paper.bar.is_some());
        let key = self.wide.iter().map(Paper::key_width).max().unwrap_or(0);
        let key = if beside { Key::Beside(key) } else { Key::InLines };
        for paper in &self.wide {
            paper.draw(root, (MARGIN, top), (width, height), key)?;
            top += height;
        }
        let share = width / self.beside.len().max(1) as i32;
        let key_rows = self.beside.iter().map(|paper| paper.rows.len() as i32).max().unwrap_or(0);
        for (n, paper) in self.beside.iter().enumerate() {
            paper.draw(root, (MARGIN + share * n as i32, top), (share, height), Key::Below(key_rows))?;
        }
        self.table(root, SIZE.1 - MARGIN - table + ROW / 2, rows)
    }

    /// In two columns, filled one after the other.
    fn table(&self, root: &Area<'_>, top: i32, rows: i32) -> Result<(), String> {
        let rule =
            |y: i32| stroke(root, vec![(MARGIN, y), (SIZE.0 - MARGIN, y)], Dash::Solid, INK, RULE_WIDTH);
        let half = (SIZE.0 - 2 * MARGIN) / 2;
        for (n, (of, number)) in self.numbers.iter().enumerate() {
            let (column, row) = (n as i32 / rows.max(1), n as i32 % rows.max(1));
            let left = MARGIN + column * half + 20;
            let y = top + row * ROW + ROW / 2;
            text::draw(root, of, (left, y), TICK_TEXT, Align::Left, false)?;
            text::draw(root, number, (left + half * 9 / 20, y), TICK_TEXT, Align::Left, false)?;
        }
        rule(top)?;
        rule(top + rows * ROW)
    }
}
