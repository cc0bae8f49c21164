//! Figures on a page, each with its caption, its runs, and its claims.

use asperity_numbers::claim::Claim;
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use serde::{Deserialize, Serialize};

use crate::claims::{self, beside, differs, links};
use crate::html::markup::{section, text};
use crate::symbols::lettered;

/// A figure.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Figure {
    /// Its file, from the folder of the record or, on a page, as a link from there.
    pub file: String,
    /// Its title; where there is none, it is called by the first sentence of its caption.
    pub title: String,
    /// Its caption.
    pub caption: String,
    /// The runs that it shows.
    pub runs: Vec<String>,
    /// The picture, as the address of its data; none if it is not there.
    #[serde(skip)]
    pub picture: Option<String>,
}

/// A picture of a kind, as `png`, for a place where HTML or SVG has an address.
pub(crate) fn data_url(kind: &str, bytes: &[u8]) -> String {
    format!("data:image/{kind};base64,{}", STANDARD.encode(bytes))
}

impl Figure {
    /// Its name in headings: its number in the thesis, its title, or the first sentence of its caption.
    pub(crate) fn name(&self) -> String {
        match self.stem().strip_prefix("figure-").and_then(numbered) {
            Some((chapter, number)) => format!("Figure {chapter}.{number}"),
            None if self.title.is_empty() => {
                self.caption.split(". ").next().unwrap_or_default().trim_end_matches('.').to_owned()
            }
            None => self.title.clone(),
        }
    }

    /// The name of its file without folder and ending.
    fn stem(&self) -> &str {
        let file = self.file();
        file.rsplit_once('.').map_or(file, |(stem, _)| stem)
    }

    /// Its anchor on the page, unique whatever the name of its file.
    pub(crate) fn place(&self) -> String {
        format!("figure-of-{}", self.stem())
    }

    fn file(&self) -> &str {
        self.file.rsplit('/').next().unwrap_or_default()
    }

    /// Words that lead to it.
    fn link(&self, words: &str) -> String {
        format!("<a href=\"#{}\">{}</a>", text(self.place()), lettered(words))
    }

    /// Whether it shows a claim.
    fn is_meant_by(&self, claim: &Claim) -> bool {
        claim.figures.iter().any(|file| file == self.file())
    }

    /// Its description, for sighted and blind readers.
    fn alternative(&self) -> String {
        let runs = match self.runs.as_slice() {
            [] => String::new(),
            [run] => format!(" Run: {run}."),
            runs if runs.len() <= 8 => format!(" Runs: {}.", runs.join(", ")),
            [first, .., last] => format!(" {} runs, {first} to {last}.", self.runs.len()),
        };
        format!("{}: {}{runs}", self.name(), self.caption)
    }

    fn html<'a>(&self, claims: impl Iterator<Item = &'a Claim>) -> String {
        let about: Vec<&Claim> = claims.filter(|claim| self.is_meant_by(claim)).collect();
        let said = beside(&about);
        let said = if said.is_empty() { said } else { format!("<div class=\"said\">{said}</div>\n") };
        let image = match &self.picture {
            Some(picture) => {
                // One that is in no folder is on the page alone.
                let is_file = self.file.contains('/');
                let link = if is_file { format!(" href=\"{}\"", text(&self.file)) } else { String::new() };
                format!("<a{link}><img alt=\"{}\" src=\"{picture}\"></a>", text(self.alternative()))
            }
            None => "<p class=\"soft\">This figure is not there.</p>".to_owned(),
        };
        let name = self.name();
        // A caption that begins with the name continues after it.
        let (end, rest) = match self.caption.strip_prefix(&name) {
            Some(rest) => ("", rest),
            None => (". ", self.caption.as_str()),
        };
        let runs = match self.runs.len() {
            0 => String::new(),
            1 => format!(" Run {}.", links(&self.runs)),
            _ => format!(" Runs {}.", links(&self.runs)),
        };
        format!(
            "<div class=\"figure{}\" id=\"{}\">\n<figure>{image}\n<figcaption><b>{}{}</b>{}{runs}</figcaption></figure>\n\
             {said}</div>\n",
            if said.is_empty() { " alone" } else { "" },
            text(self.place()),
            lettered(&name),
            end,
            lettered(rest)
        )
    }
}

/// The number of a figure: of `5.09` chapter 5 and 9.
fn numbered(word: &str) -> Option<(&str, u32)> {
    let (chapter, number) = word.split_once('.')?;
    let is_chapter = !chapter.is_empty() && chapter.chars().all(char::is_alphanumeric);
    let number = number.trim_end_matches(|c: char| c.is_ascii_lowercase()).parse().ok()?;
    is_chapter.then_some((chapter, number))
}

/// What a study found, before what was asked: its first figure beside the claims that differ; with the figure are
/// those that do not.
pub(crate) fn result(figures: &[Figure], claims: &[Claim]) -> String {
    let agreeing = || claims.iter().filter(|claim| !differs(claim));
    let first = figures.first().map_or_else(String::new, |figure| figure.html(agreeing()));
    let differing = claims::differing(claims, &|claim| about(claim, figures));
    let parts = first + &section(claims::DIFFERING, &differing);
    if parts.is_empty() { parts } else { format!("<div class=\"result\">\n{parts}</div>\n") }
}

/// The figures after the first.
pub(crate) fn further(figures: &[Figure], claims: &[Claim]) -> String {
    let all: String = figures.iter().skip(1).map(|figure| figure.html(claims.iter())).collect();
    if all.is_empty() { all } else { format!("<div class=\"figures\">\n{all}</div>\n") }
}

/// What a claim is about, with a link to the first figure that shows it.
pub(crate) fn about(claim: &Claim, figures: &[Figure]) -> String {
    match figures.iter().find(|figure| figure.is_meant_by(claim)) {
        Some(figure) => figure.link(&claim.about),
        None => lettered(&claim.about),
    }
}

/// Whether a claim appears beside one of these figures.
pub(crate) fn is_beside_one(claim: &Claim, figures: &[Figure]) -> bool {
    figures.iter().any(|figure| figure.is_meant_by(claim))
}

#[cfg(test)]
mod tests {
    use asperity_numbers::claim::Claim;

    use super::{Figure, about, data_url, result};

    #[test]
    fn what_a_claim_is_about_leads_to_the_first_figure_that_shows_it() {
        let figure = |file: &str, title: &str| Figure {
            file: format!("figures/{file}"),
            title: title.to_owned(),
            caption: "Counts.".to_owned(),
            ..Figure::default()
        };
        let figures = [figure("a.png", "Slips"), figure("figure-5.09.png", "")];
        let of = |words: &str, files: &[&str]| {
            let files = files.iter().map(|file| (*file).to_owned()).collect();
            about(&Claim { about: words.to_owned(), figures: files, ..Claim::default() }, &figures)
        };
        assert_eq!(of("mu_s", &["a.png"]), "<a href=\"#figure-of-a\">μ<sub>s</sub></a>");
        assert_eq!(
            of("Figure 5.9", &["b.png", "figure-5.09.png"]),
            "<a href=\"#figure-of-figure-5.09\">Figure 5.9</a>"
        );
        assert_eq!(of("the F_T/F_N", &[]), "the F<sub>T</sub>/F<sub>N</sub>");
    }

    #[test]
    fn every_figure_has_words_for_those_who_do_not_see_it() {
        let figure = Figure {
            file: "figures/figure-5.09.png".to_owned(),
            title: "Lengths".to_owned(),
            caption: "L_p/L against F_T/F_N.".to_owned(),
            runs: vec!["default".to_owned(), "tilted".to_owned()],
            picture: Some(data_url("png", b"png")),
        };
        let html = result(std::slice::from_ref(&figure), &[]);
        assert!(html.contains("alt=\"Figure 5.9: L_p/L against F_T/F_N. Runs: default, tilted.\""), "{html}");
        assert!(html.contains("src=\"data:image/png;base64,cG5n\"") && html.contains("href=\"#run-tilted\""));
        assert!(html.contains(". </b>L<sub>p</sub>/L against F<sub>T</sub>/F<sub>N</sub>."), "{html}");
        let file = "figures/speed-over-c.png".to_owned();
        let gone = Figure { picture: None, file, ..figure };
        let html = result(std::slice::from_ref(&gone), &[]);
        assert!(html.contains("<b>Lengths. </b>") && html.contains("not there"), "{html}");
        let of = |caption: &str| Figure { title: String::new(), caption: caption.to_owned(), ..gone.clone() };
        assert_eq!(of("Lengths, and loads. More.").name(), "Lengths, and loads");
        assert!(result(&[of("A against b.")], &[]).contains("<b>A against b</b>."));
    }
}
