//! Figures on a page, each with its caption, its runs, and its claims.

use asperity_numbers::claim::Claim;
use base64::Engine;
use base64::engine::general_purpose::STANDARD;

use crate::claims::{beside, differs, link, numbered};
use crate::html::markup::text;
use crate::symbols::lettered;

/// A figure.
#[derive(Debug, Clone, PartialEq)]
pub struct Figure {
    /// Its file, from the folder of the page.
    pub path: String,
    /// Its title; where there is none, it is called by the first sentence of its caption.
    pub title: String,
    /// Its caption.
    pub caption: String,
    /// The runs that it shows.
    pub runs: Vec<String>,
    /// The picture.
    pub picture: Picture,
}

/// A picture of a kind, as `png`, for a place where HTML or SVG has an address.
pub fn data_url(kind: &str, bytes: &[u8]) -> String {
    format!("data:image/{kind};base64,{}", STANDARD.encode(bytes))
}

/// The picture of a figure.
#[derive(Debug, Clone, PartialEq)]
pub enum Picture {
    /// PNG.
    Png(Vec<u8>),
    /// SVG.
    Svg(Vec<u8>),
    /// It is not there.
    None,
}

impl Figure {
    /// Its name in headings.
    pub(crate) fn name(&self) -> String {
        name(&self.path, &self.title, &self.caption)
    }

    fn file(&self) -> &str {
        self.path.rsplit('/').next().unwrap_or_default()
    }

    /// Words that lead to it.
    fn link(&self, words: &str) -> String {
        format!("<a href=\"#{}\">{}</a>", text(place_of(&self.path)), lettered(words))
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

    /// The picture as HTML; `None` where there is none.
    fn image(&self) -> Option<String> {
        let (kind, bytes) = match &self.picture {
            Picture::Png(bytes) => ("png", bytes),
            Picture::Svg(bytes) => ("svg+xml", bytes),
            Picture::None => return None,
        };
        Some(format!(
            "<a href=\"{}\"><img alt=\"{}\" src=\"{}\"></a>",
            text(&self.path),
            text(self.alternative()),
            data_url(kind, bytes)
        ))
    }

    fn html<'a>(&self, claims: impl Iterator<Item = &'a Claim>) -> String {
        let about: Vec<&Claim> = claims.filter(|claim| self.is_meant_by(claim)).collect();
        let said = beside(&about);
        let said = if said.is_empty() { said } else { format!("<div class=\"said\">{said}</div>\n") };
        let image =
            self.image().unwrap_or_else(|| "<p class=\"soft\">This figure is not there.</p>".to_owned());
        let links: Vec<String> = self.runs.iter().take(8).map(|run| link(run)).collect();
        let more = match self.runs.len().saturating_sub(8) {
            0 => String::new(),
            more => format!(" and {more} more"),
        };
        let name = self.name();
        // A caption that begins with the name continues after it.
        let (end, rest) = match self.caption.strip_prefix(&name) {
            Some(rest) => ("", rest),
            None => (". ", self.caption.as_str()),
        };
        let runs = match self.runs.len() {
            0 => String::new(),
            1 => format!(" Run {}.", links[0]),
            _ => format!(" Runs {}{more}.", links.join(", ")),
        };
        format!(
            "<div class=\"figure{}\" id=\"{}\">\n<figure>{image}\n<figcaption><b>{}{}</b>{}{runs}</figcaption></figure>\n\
             {said}</div>\n",
            if said.is_empty() { " alone" } else { "" },
            text(place_of(&self.path)),
            lettered(&name),
            end,
            lettered(rest)
        )
    }
}

/// The number that the name of a figure's file has: chapter and figure.
fn number(path: &str) -> Option<(String, u32)> {
    numbered(stem(path).strip_prefix("figure-")?)
}

/// The name of a figure: its number in the source, its title, or the first sentence of its caption.
pub(crate) fn name(path: &str, title: &str, caption: &str) -> String {
    match number(path) {
        Some((chapter, number)) => format!("Figure {chapter}.{number}"),
        None if title.is_empty() => {
            caption.split(". ").next().unwrap_or_default().trim_end_matches('.').to_owned()
        }
        None => title.to_owned(),
    }
}

/// The name of a figure's file without folder and ending.
pub(crate) fn stem(path: &str) -> &str {
    let file = path.rsplit('/').next().unwrap_or_default();
    file.rsplit_once('.').map_or(file, |(stem, _)| stem)
}

/// The anchor of a figure on the page, unique whatever the name of its file.
pub(crate) fn place_of(path: &str) -> String {
    format!("figure-of-{}", stem(path))
}

/// The first figure, with the claims about it that do not differ: those that do stand beside it.
pub(crate) fn first(figures: &[Figure], claims: &[Claim]) -> String {
    let agreeing = || claims.iter().filter(|claim| !differs(claim));
    figures.first().map_or_else(String::new, |figure| figure.html(agreeing()))
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

    use super::{Figure, Picture, about, first};

    #[test]
    fn what_a_claim_is_about_leads_to_the_first_figure_that_shows_it() {
        let figure = |file: &str, title: &str| Figure {
            path: format!("figures/{file}"),
            title: title.to_owned(),
            caption: "Counts.".to_owned(),
            runs: Vec::new(),
            picture: Picture::None,
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
            path: "figures/figure-5.09.png".to_owned(),
            title: "Lengths".to_owned(),
            caption: "L_p/L against F_T/F_N.".to_owned(),
            runs: vec!["default".to_owned(), "tilted".to_owned()],
            picture: Picture::Png(b"png".to_vec()),
        };
        let html = first(std::slice::from_ref(&figure), &[]);
        assert!(html.contains("alt=\"Figure 5.9: L_p/L against F_T/F_N. Runs: default, tilted.\""), "{html}");
        assert!(html.contains("src=\"data:image/png;base64,cG5n\"") && html.contains("href=\"#run-tilted\""));
        assert!(html.contains(". </b>L<sub>p</sub>/L against F<sub>T</sub>/F<sub>N</sub>."), "{html}");
        let path = "figures/speed-over-c.png".to_owned();
        let gone = Figure { picture: Picture::None, path, ..figure };
        let html = first(std::slice::from_ref(&gone), &[]);
        assert!(html.contains("<b>Lengths. </b>") && html.contains("not there"), "{html}");
        let of = |caption: &str| Figure { title: String::new(), caption: caption.to_owned(), ..gone.clone() };
        assert_eq!(of("Lengths, and loads. More.").name(), "Lengths, and loads");
        assert!(first(&[of("A against b.")], &[]).contains("<b>A against b</b>."));
    }
}
