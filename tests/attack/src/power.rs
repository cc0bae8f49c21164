//! The power is cut behind every operation of a command, and the disk has what a file system may have of it
//! then (`disk.rs`). Afterwards final names have what was there or the whole of the new, and a call as a user
//! would make it writes all. A command that had ended with 0 has left everything on disk.

use crate::calls::Call;
use crate::case::{Case, once, try_all};
use crate::disk::{Disk, Kept};
use crate::ground::{Error, Ground, emptied};
use crate::kills::aftermath;
use crate::operations::{Fate, is_possible, supervise};
use crate::tally::say;
use crate::writers::{Writer, Written, compared, found};

const KEPT: [Kept; 6] = [Kept::Least, Kept::NamesAlone, Kept::BytesAlone, Kept::Some, Kept::Some, Kept::All];

/// A call, recorded.
struct Recorded<'a> {
    writer: &'a Writer,
    disk: Disk,
    before: Written,
    points: Vec<usize>,
}

pub(crate) fn attack(ground: &Ground) -> Result<(), Error> {
    if !is_possible(ground, "power") {
        return Ok(());
    }
    let of_studies = Writer::of_studies(ground)?;
    let mut recorded = Vec::new();
    for writer in Writer::all(ground)?.iter().chain(&of_studies) {
        recorded.push(record(ground, writer)?);
    }
    let states: Vec<(usize, usize, Kept)> = recorded
        .iter()
        .enumerate()
        .flat_map(|(command, recorded)| {
            let points = recorded.points.iter().flat_map(|point| KEPT.map(|kept| (*point, kept)));
            points.map(move |(point, kept)| (command, point, kept))
        })
        .collect();
    let chosen = ground.some_of(states.len(), ground.size.faults);
    try_all(ground, "power", "cuts", chosen.len(), |case| {
        let (command, point, kept) = states[chosen[case.number]];
        cut(case, &recorded[command], point, kept)
    })?;
    try_all(ground, "power", "cuts after the end", recorded.len(), |case| {
        let Recorded { writer, disk, .. } = &recorded[case.number];
        let folder = case.folder.clone();
        disk.cut(usize::MAX, Kept::Least, &mut case.random, &folder)?;
        let now = found(&folder)?.written;
        case.hold(
            now == writer.alone[0],
            &format!("{}: is not on disk when it has ended", writer.name),
            || compared(writer, &now),
        );
        Ok(())
    })
}

/// Records an undisturbed call.
fn record<'a>(ground: &Ground, writer: &'a Writer) -> Result<Recorded<'a>, Error> {
    let mut made = None;
    once(ground, "power", &format!("operations of {}", writer.name), |case| {
        let before = writer.set_up(case)?;
        let mut disk = Disk::of(&case.folder)?;
        let call = Call::new(&case.ground.program, &case.folder, writer.arguments(0))?;
        let supervised = supervise(call, &case.folder, true, |number, operation| {
            disk.record(number, operation);
            Fate::Proceeds
        })?;
        case.must_end_well(&supervised.outcome);
        case.hold(supervised.past.is_empty(), "operations go past the record", || supervised.past.join(", "));
        // The model has the same as the disk, if all operations are in it.
        let there = found(&case.folder)?.written;
        let replayed = case.path("replayed");
        disk.cut(usize::MAX, Kept::All, &mut case.random, &replayed)?;
        let modelled = found(&replayed)?.written;
        case.hold(there == modelled, "the record of operations differs from what they did", || {
            format!("{}\n{}", writer.name, compared(writer, &modelled))
        });
        let points = disk.points();
        made = Some(Recorded { writer, disk, before, points });
        Ok(())
    })?;
    let made = made.ok_or("no call was recorded")?;
    say(&format!("  power: {}: {} states", writer.name, made.points.len() * KEPT.len()));
    Ok(made)
}

fn cut(case: &mut Case<'_>, recorded: &Recorded<'_>, point: usize, kept: Kept) -> Result<(), Error> {
    let folder = case.folder.clone();
    emptied(&folder)?;
    recorded.disk.cut(point, kept, &mut case.random, &folder)?;
    let what = match kept {
        Kept::Least => "nothing on disk that was not synced",
        Kept::NamesAlone => "names on disk before bytes",
        Kept::BytesAlone => "bytes on disk before names",
        Kept::Some => "some of it on disk",
        Kept::All => "all on disk",
    };
    aftermath(case, recorded.writer, &recorded.before, &format!("power cut, {what}"))
}
