//! One bit of a log that is not as it was written: `asperity check` sees it, wherever it is,
//! or it changes nothing that is read.

use std::collections::BTreeMap;
use std::fs;
use std::io::Write;
use std::path::Path;

use crate::support::binary::{asperity, text};
use crate::support::small;
use asperity_record::{RunEnd, RunHeader};
use asperity_runlog::{LogError, LogItem, RunReader, Topics};
use asperity_testkit::Random;

/// How many bits are flipped, each in a log of its own.
const FLIPS: usize = 1000;

/// How many logs are given to one `check`.
const AT_ONCE: usize = 250;

/// All that can be read out of a log.
#[derive(Debug, PartialEq)]
struct Content {
    header: RunHeader,
    scenario: String,
    checkpoint: Option<String>,
    items: Vec<LogItem>,
    end: Option<RunEnd>,
}

fn read(path: &Path) -> Result<Content, LogError> {
    let mut reader = RunReader::open(path, Topics::ALL)?;
    let mut items = Vec::new();
    while let Some(item) = reader.next_item()? {
        items.push(item);
    }
    Ok(Content {
        header: reader.header().clone(),
        scenario: reader.scenario_toml().to_owned(),
        checkpoint: reader.checkpoint().map(str::to_owned),
        items,
        end: reader.end().cloned(),
    })
}

/// The kind of top-level record that each byte of a file is in; that of the magics is 0.
fn kinds(bytes: &[u8]) -> Vec<u8> {
    let mut kinds = vec![0; bytes.len()];
    let mut at = 8;
    while at + 9 < bytes.len() {
        let length = u64::from_le_bytes(bytes[at + 1..at + 9].try_into().expect("eight bytes")) as usize;
        kinds[at..at + 9 + length].fill(bytes[at]);
        at += 9 + length;
    }
    kinds
}

#[test]
fn of_a_thousand_flipped_bits_every_one_is_seen_or_changes_nothing() {
    let folder = asperity_testkit::folder();
    let sound = folder.path().join("sound.mcap");
    small::run(&sound);
    let bytes = fs::read(&sound).expect("the log can be read");
    let content = read(&sound).expect("the log is whole");
    let kinds = kinds(&bytes);
    // By size nearly all of a log is one record; half of the flips go into the others.
    let outside: Vec<usize> =
        (0..bytes.len()).filter(|&place| kinds[place] != mcap::records::op::CHUNK).collect();
    assert!(outside.len() > 1000 && outside.len() < bytes.len());

    let mut random = Random::new(2026);
    let flips: Vec<(usize, u32)> = (0..FLIPS)
        .map(|number| {
            let place = match number % 2 {
                0 => random.below(bytes.len() as u64) as usize,
                _ => outside[random.below(outside.len() as u64) as usize],
            };
            (place, random.below(8) as u32)
        })
        .collect();
    let mut verdicts: BTreeMap<&str, usize> = BTreeMap::new();
    let mut flipped: BTreeMap<u8, usize> = BTreeMap::new();
    let mut unseen = Vec::new();
    for batch in flips.chunks(AT_ONCE) {
        let paths: Vec<_> = batch
            .iter()
            .enumerate()
            .map(|(number, &(place, bit))| {
                let path = folder.path().join(format!("flipped-{number}.mcap"));
                let mut copy = bytes.clone();
                copy[place] ^= 1 << bit;
                fs::write(&path, copy).expect("the folder can be written");
                *flipped.entry(kinds[place]).or_insert(0) += 1;
                path
            })
            .collect();
        let mut arguments = vec!["check"];
        arguments.extend(paths.iter().map(|path| text(path)));
        let output = asperity(&arguments);
        let said = String::from_utf8(output.stdout).expect("the binary writes UTF-8");
        assert!(output.stderr.is_empty(), "{}", String::from_utf8_lossy(&output.stderr));
        for (path, &(place, bit)) in paths.iter().zip(batch) {
            let start = format!("{}: ", text(path));
            let verdict = said.lines().find_map(|line| line.strip_prefix(&start)?.split(':').next());
            let verdict = ["whole", "by other code or detectors", "incomplete", "not a run log", "damaged"]
                .into_iter()
                .find(|known| verdict == Some(known));
            let verdict = verdict.unwrap_or_else(|| panic!("bit {bit} of byte {place}: no verdict\n{said}"));
            *verdicts.entry(verdict).or_insert(0) += 1;
            if matches!(verdict, "whole" | "by other code or detectors")
                && read(path).ok().as_ref() != Some(&content)
            {
                unseen.push(format!(
                    "bit {bit} of byte {place}, in a record of the kind 0x{:02x}",
                    kinds[place]
                ));
            }
        }
    }
    writeln!(
        std::io::stdout(),
        "{FLIPS} bits flipped in {} bytes, by kind of record: {flipped:x?}; called {verdicts:?}",
        bytes.len()
    )
    .expect("it is open");
    assert!(unseen.is_empty(), "called whole and read otherwise:\n{}", unseen.join("\n"));
    assert_eq!(verdicts.values().sum::<usize>(), FLIPS);
}
