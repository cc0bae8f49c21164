//! Claims as they were judged, and their table, `tables/claims.csv`.
//!
//! The columns are listed once, in [`columns`], for writing the table, and [`read`] finds them by the same
//! names.

use std::io::Read;

use crate::claims::{Kind, Speaker, Verdict};
use asperity_record::{Cell, CellValue, Column, ColumnKind};

/// A claim, the measured value, and the verdict.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Claim {
    /// Its subject: a figure, equation or section.
    pub about: String,
    /// The files of the figures that show it.
    pub figures: Vec<String>,
    /// Its author.
    pub of: Speaker,
    /// The run that it is measured in.
    pub run: String,
    /// Its words.
    pub quote: String,
    /// The number that is measured.
    pub measure: String,
    /// The number stated, as it is written; empty where there are words alone.
    pub stated: String,
    /// The measured value.
    pub own: Judgement,
    /// The measured number minus the stated one.
    pub deviation: Option<f64>,
    /// The kind of evidence that an agreement gives.
    pub kind: Kind,
    /// A remark for readers.
    pub note: String,
    /// The judgement in runs with the parameter set `as-stated`.
    pub as_stated: Option<Judgement>,
}

/// The measured value, and its comparison with the claim.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Judgement {
    /// The number; none where the run does not have it.
    pub ours: Option<f64>,
    /// Its standard error; none of a number that is no statistic.
    pub error: Option<f64>,
    /// The rule in words.
    pub rule: String,
    /// How it compares.
    pub verdict: Verdict,
}

/// A column of the table, and its cell of a claim.
pub type ClaimColumn = (Column, &'static dyn Fn(&Claim) -> Cell);

/// The columns of the table in order. Those of the second judgement are there if a claim has one.
pub fn columns(claims: &[Claim]) -> Vec<ClaimColumn> {
    const fn word(name: &'static str, about: &'static str) -> Column {
        Column::new(name, ColumnKind::Word, about)
    }
    // In the unit of the number that is measured.
    fn number(name: &'static str, about: &'static str) -> Column {
        Column { unit: None, ..Column::with_unit(name, ColumnKind::Number, "1", about) }
    }
    fn second(claim: &Claim, text: fn(&Judgement) -> &str) -> Cell {
        Cell::word(claim.as_stated.as_ref().map_or("", text))
    }
    let own: [ClaimColumn; 14] = [
        (word("about", "Figure, equation or section."), &|claim| Cell::word(&claim.about)),
        (word("of", "The author of the claim."), &|claim| Cell::word(claim.of.word())),
        (word("run", "The run that it is measured in."), &|claim| Cell::word(&claim.run)),
        (word("quote", "Its words."), &|claim| Cell::word(&claim.quote)),
        (word("measure", "The number that is measured."), &|claim| Cell::word(&claim.measure)),
        (word("stated", "The number stated, as it is written."), &|claim| Cell::word(&claim.stated)),
        (number("ours", "The measured number."), &|claim| claim.own.ours.cell()),
        (number("standard_error", "Its standard error."), &|claim| claim.own.error.cell()),
        (number("deviation", "`ours` minus the stated number."), &|claim| claim.deviation.cell()),
        (word("rule", "The rule of the comparison."), &|claim| Cell::word(&claim.own.rule)),
        (word("verdict", "Whether they agree."), &|claim| Cell::word(claim.own.verdict.word())),
        (word("kind", "What an agreement is evidence of."), &|claim| Cell::word(claim.kind.word())),
        (word("note", "A remark."), &|claim| Cell::word(&claim.note)),
        (word("figures", "The figures that show it."), &|claim| Cell::word(&claim.figures.join(" "))),
    ];
    let as_stated: [ClaimColumn; 4] = [
        (number("as_stated_ours", "`ours` of the parameter set as-stated."), &|claim| {
            claim.as_stated.as_ref().and_then(|second| second.ours).cell()
        }),
        (number("as_stated_standard_error", "Its standard error."), &|claim| {
            claim.as_stated.as_ref().and_then(|second| second.error).cell()
        }),
        (word("as_stated_rule", "The rule there."), &|claim| second(claim, |second| &second.rule)),
        (word("as_stated_verdict", "The verdict there."), &|claim| {
            second(claim, |second| second.verdict.word())
        }),
    ];
    let has_second = claims.iter().any(|claim| claim.as_stated.is_some());
    own.into_iter().chain(as_stated.into_iter().filter(|_| has_second)).collect()
}

/// The columns by which a table of claims is recognised.
const NEEDED: [&str; 8] = ["about", "of", "run", "quote", "measure", "ours", "verdict", "kind"];

/// Reads a table of claims. Cells of columns that it lacks are empty.
///
/// # Errors
/// A message, if it is no such table.
pub fn read(source: impl Read) -> Result<Vec<Claim>, String> {
    let mut reader = csv::Reader::from_reader(source);
    let said = |error: csv::Error| error.to_string();
    let headings = reader.headers().map_err(said)?.clone();
    let place = |column: &str| headings.iter().position(|name| name == column);
    if let Some(column) = NEEDED.into_iter().find(|column| place(column).is_none()) {
        return Err(format!("there is no column {column} (accepted: a table of claims)"));
    }
    let claim = |row: csv::StringRecord| {
        let cell = |column| place(column).and_then(|place| row.get(place)).unwrap_or_default();
        let text = |column| cell(column).to_owned();
        let refused = |column, accepted: &str| {
            let line = row.position().map_or(0, csv::Position::line);
            format!("line {line}: {column}: {:?} is not accepted (accepted: {accepted})", cell(column))
        };
        let number = |column| match cell(column) {
            "" => Ok(None),
            value => value.parse().map(Some).map_err(|_| refused(column, "a number")),
        };
        let word = |column, words: &[&str]| {
            let found = words.iter().position(|word| *word == cell(column));
            found.ok_or_else(|| refused(column, &words.join(", ")))
        };
        let judgement = |[ours, error, rule, verdict]: [&'static str; 4]| {
            Ok::<_, String>(Judgement {
                ours: number(ours)?,
                error: number(error)?,
                rule: text(rule),
                verdict: Verdict::ALL[word(verdict, &Verdict::ALL.map(|all| all.1))?].0,
            })
        };
        let second = ["as_stated_ours", "as_stated_standard_error", "as_stated_rule", "as_stated_verdict"];
        Ok(Claim {
            about: text("about"),
            figures: cell("figures").split_whitespace().map(str::to_owned).collect(),
            of: Speaker::ALL[word("of", &Speaker::ALL.map(|all| all.1))?].0,
            run: text("run"),
            quote: text("quote"),
            measure: text("measure"),
            stated: text("stated"),
            own: judgement(["ours", "standard_error", "rule", "verdict"])?,
            deviation: number("deviation")?,
            kind: Kind::ALL[word("kind", &Kind::ALL.map(|all| all.1))?].0,
            note: text("note"),
            as_stated: (!cell(second[3]).is_empty()).then(|| judgement(second)).transpose()?,
        })
    };
    reader.records().map(|row| claim(row.map_err(said)?)).collect()
}

#[cfg(test)]
mod tests {
    use super::{Claim, Judgement, columns, read};
    use crate::claims::{Speaker, Verdict};

    /// The table as CSV; no cell here needs quotes.
    fn csv(claims: &[Claim]) -> String {
        let columns = columns(claims);
        let heading: Vec<&str> = columns.iter().map(|(column, _)| &*column.name).collect();
        let row =
            |claim| columns.iter().map(|(_, cell)| cell(claim).to_string()).collect::<Vec<_>>().join(",");
        [heading.join(",")].into_iter().chain(claims.iter().map(row)).collect::<Vec<_>>().join("\n")
    }

    #[test]
    fn claims_read_back_as_they_were_written() {
        let judged =
            |ours| Judgement { ours, error: Some(0.5), rule: "2 %".to_owned(), verdict: Verdict::Agrees };
        let claim = |as_stated| Claim {
            about: "Figure 5.9".to_owned(),
            of: Speaker::Thesis,
            figures: vec!["a.png".to_owned(), "b.png".to_owned()],
            run: "default".to_owned(),
            quote: "it slips".to_owned(),
            own: judged(Some(0.1 + 0.2)),
            deviation: Some(-1.0),
            as_stated,
            ..Claim::default()
        };
        for claims in [vec![claim(None)], vec![claim(Some(judged(None))), claim(None)]] {
            let text = csv(&claims);
            assert_eq!(text.contains("as_stated"), claims.len() == 2);
            assert_eq!(read(text.as_bytes()).unwrap(), claims);
        }
    }

    #[test]
    fn what_is_no_table_of_claims_is_refused() {
        let refused = |text: &str| read(text.as_bytes()).unwrap_err().to_string();
        assert_eq!(refused("about,run\n"), "there is no column of (accepted: a table of claims)");
        let short = "about,of,run,quote,measure,ours,verdict,kind\n";
        assert_eq!(
            refused(&format!("{short}a,the thesis,r,q,m,much,agrees,simulated\n")),
            "line 2: ours: \"much\" is not accepted (accepted: a number)"
        );
        assert_eq!(
            refused(&format!("{short}a,us,r,q,m,1,agrees,simulated\n")),
            "line 2: of: \"us\" is not accepted (accepted: the thesis, this project)"
        );
        let claims = read(format!("{short}a,the thesis,r,q,m,,not reached,selection\n").as_bytes()).unwrap();
        assert_eq!((claims[0].own.ours, claims[0].own.verdict), (None, Verdict::NotReached));
    }
}
