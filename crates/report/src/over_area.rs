//! The map over the area of contact of a run: when the front of a rupture came to each contact.
//!
//! The page holds the map of the widest rupture, which is complete without scripts. The script colours a copy of it
//! for whichever rupture is picked, with data from [`data`].

use std::collections::BTreeMap;

use asperity_model::Plan;
use asperity_record::rounded as round;
use serde::Serialize;

use crate::html::Part;
use crate::html::markup::text;
use crate::page_collector::{Cell, CollectedRupture};
use crate::study::Run;
use crate::symbols::{lettered, rounded, spelled};

/// Style and script, for pages with a run over an area.
pub(crate) const PART: Part =
    Part { style: include_str!("over_area.css"), script: include_str!("over_area.js") };

/// Number of colours: their edges are isochrones.
const BANDS: f64 = 12.0;
/// Width of a map at most, and height, in dots.
const WIDTH: f64 = 760.0;
const HEIGHT: f64 = 420.0;
/// What is beside the driven edge, in spacings.
const MARGIN: f64 = 1.5;

/// Data of a run over an area for the script.
#[derive(Debug, Serialize)]
pub(crate) struct OverArea {
    /// Columns of the map, and how far apart they are.
    columns: u32,
    stride: u32,
    /// Of each rupture of the page: how many contacts slid.
    slipped: Vec<u32>,
    /// By rupture: its contacts on the map.
    maps: BTreeMap<u64, MapRow>,
}

/// The first place on the map and then the steps from place to place; steps from the onset to the arrival; the slip, µm.
type MapRow = (Vec<u32>, Vec<u64>, Vec<Option<f64>>);

/// Whether a page has a run over an area.
pub(crate) fn is_needed(runs: &[Run]) -> bool {
    runs.iter().any(|run| run.header.contacts().is_area())
}

/// The data of a run for the script; none in a single row.
pub(crate) fn data(run: &Run) -> Option<OverArea> {
    let stride = run.collected.cell_stride;
    let map = |seen: &CollectedRupture| -> Option<(u64, MapRow)> {
        let cells = seen.cells.as_ref()?;
        let mut last = 0;
        let places = cells.iter().map(|cell| cell.place - std::mem::replace(&mut last, cell.place)).collect();
        let since = |cell: &Cell| cell.arrival_step.saturating_sub(seen.rupture.onset_step);
        let slip_um = |cell: &Cell| cell.slip_m.map(|slip_m| round(slip_m * 1e6, 3));
        let row = (places, cells.iter().map(since).collect(), cells.iter().map(slip_um).collect());
        Some((seen.rupture.rupture, row))
    };
    run.header.contacts().is_area().then(|| OverArea {
        columns: run.header.contacts().columns().div_ceil(stride),
        stride,
        slipped: run.collected.ruptures.iter().map(|seen| seen.rupture.slipped()).collect(),
        maps: run.collected.ruptures.iter().filter_map(map).collect(),
    })
}

/// Where the script puts the map of the rupture that is picked; nothing on a page without a run over an area.
pub(crate) fn place_of_script(runs: &[Run]) -> &'static str {
    if !is_needed(runs) {
        return "";
    }
    "<figure id=\"over-area\" class=\"over-area needs-script\" hidden><p><label>over the area of contact <select \
     id=\"over-area-shows\"><option value=\"arrival\">arrival of the front</option><option \
     value=\"slip\">slip</option></select></label></p><div></div><figcaption></figcaption></figure>\n"
}

/// The map of the widest rupture of a run; nothing where there is none.
pub(crate) fn figure(run: &Run) -> String {
    let with_map =
        run.collected.ruptures.iter().filter(|seen| seen.cells.as_ref().is_some_and(|c| !c.is_empty()));
    // The first of several.
    let widest = with_map.rev().max_by_key(|seen| seen.rupture.slipped());
    let Some((seen, cells)) = widest.and_then(|seen| Some((seen, seen.cells.as_ref()?))) else {
        return String::new();
    };
    let contacts = run.header.contacts();
    let stride = run.collected.cell_stride;
    let (columns, rows) = (contacts.columns().div_ceil(stride), contacts.rows().div_ceil(stride));
    let since = |cell: &Cell| cell.arrival_step.saturating_sub(seen.rupture.onset_step);
    let last = cells.iter().map(since).max().unwrap_or(0);
    let by_place: BTreeMap<u32, &Cell> = cells.iter().map(|cell| (cell.place, cell)).collect();
    let (mut paths, mut marks) = (String::new(), String::new());
    for place in 0..columns * rows {
        let (column, up) = (place % columns, rows - 1 - place / columns);
        let share = by_place.get(&place).map(|cell| since(cell) as f64 / last.max(1) as f64);
        let class = share.map_or("n".to_owned(), band);
        paths += &format!("<path d=\"M{column} {up}h1v1h-1z\" class=\"{class}\"/>");
        if by_place.get(&place).is_some_and(|cell| since(cell) == 0) {
            marks += &format!("<circle cx=\"{column}.5\" cy=\"{up}.5\" r=\".22\"/>");
        }
    }
    let plan = Plan::new(&run.scenario);
    let driven = plan.driven_rows().map(|[first, lasts]| {
        let at = |row: u32| rows - row.min(rows * stride) / stride;
        format!(
            "<path class=\"driven\" d=\"M-.3 {}V{}\"/>",
            at(first - 1),
            at(lasts.div_ceil(stride) * stride)
        )
    });
    let (wide, tall) = (f64::from(columns) + MARGIN + 0.1, f64::from(rows) + 0.2);
    let words = format!(
        "Map over the area of contact, {} columns by {} rows: the arrival of the front of rupture {} at each contact.",
        contacts.columns(),
        contacts.rows(),
        seen.rupture.rupture
    );
    let to = rounded(last as f64 * run.header.time_step_s * 1e6, 4);
    let size = |count: u32| spelled(f64::from(count - 1) * plan.spacing_m, "m");
    let bands: String =
        (0..BANDS as u32).map(|n| format!("<i class=\"{}\"></i>", band(f64::from(n) / BANDS))).collect();
    format!(
        "<figure class=\"over-area\"><svg width=\"{:.0}\" viewBox=\"-{MARGIN} -.1 {wide:.1} {tall:.1}\" \
         role=\"img\" aria-label=\"{}\"><g class=\"cells\">{paths}</g>{}<g class=\"first\">{marks}</g></svg>\n\
         <div class=\"bar\"><span>0</span>{bands}<span class=\"to\">{to} µs</span></div>\n\
         <figcaption><span class=\"about\">Rupture {}, the widest: when its front came to each contact, after its \
         onset.</span> Rings: where it began. {}Seen from above, {} × {}, to scale: x to the right, y upwards.\
         </figcaption></figure>\n",
        WIDTH.min(HEIGHT * wide / tall),
        text(words),
        driven.as_deref().unwrap_or_default(),
        seen.rupture.rupture,
        if driven.is_some() { "Red: driven edge. " } else { "" },
        lettered(&size(contacts.columns())),
        lettered(&size(contacts.rows())),
    )
}

/// The class of the band that has this share of the largest value.
fn band(share: f64) -> String {
    format!("b{}", (share * BANDS).floor().min(BANDS - 1.0))
}
