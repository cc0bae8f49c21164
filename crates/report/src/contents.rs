//! What the record of a pipeline (`reproduce.json`) says of its page, and the page made of that and
//! of what was measured: the same whether the runs have just gone by or are read again.

use asperity_record::RunHeader;
use serde::{Deserialize, Serialize};

use crate::claims::Claim;
use crate::figures::{Figure, Picture};
use crate::study::{Link, Run, Study};

/// What a record says of the page.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Contents {
    /// What the pipeline is about.
    pub title: String,
    /// Its figures, in the order in which the page has them.
    pub figures: Vec<Shown>,
}

/// A figure of the record.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Shown {
    /// Its file, from the folder.
    pub file: String,
    /// What it shows.
    pub caption: String,
    /// The runs that it is made of.
    pub runs: Vec<String>,
}

/// A record, as far as pages need it.
#[derive(Debug, Clone, Deserialize)]
pub struct Recorded {
    /// Which command wrote it.
    pub format: String,
    /// Its runs.
    pub runs: Vec<RecordedRun>,
    /// The files that were written with it, from its folder.
    pub files: Vec<String>,
    /// What it says of the page; none in those of older versions.
    #[serde(default)]
    pub page: Option<Contents>,
}

/// A run of a record.
#[derive(Debug, Clone, Deserialize)]
pub struct RecordedRun {
    /// Its name.
    pub name: String,
    /// What it is.
    pub run: RunHeader,
}

impl Recorded {
    /// Reads one.
    ///
    /// # Errors
    /// If it is none, in words.
    pub fn read(text: &str) -> Result<Recorded, String> {
        let recorded: Recorded = serde_json::from_str(text).map_err(|error| error.to_string())?;
        if recorded.format == "asperity-reproduce" {
            Ok(recorded)
        } else {
            Err(format!("format: {:?} (accepted: \"asperity-reproduce\")", recorded.format))
        }
    }
}

/// A picture of this size or less is embedded as SVG; a larger one as PNG, if there is one.
const SVG_MOST: usize = 600_000;

/// The picture of a figure: SVG if there is one beside the PNG and it is no larger than half a
/// megabyte, else PNG. `read` gives what a file holds, if it is there.
pub fn picture(file: &str, read: &dyn Fn(&str) -> Option<Vec<u8>>) -> Picture {
    let stem = file.rsplit_once('.').map_or(file, |(stem, _)| stem);
    match read(&format!("{stem}.svg")).filter(|svg| svg.len() <= SVG_MOST) {
        Some(svg) => Picture::Svg(svg),
        None => read(file).map_or(Picture::None, Picture::Png),
    }
}

impl Study {
    /// The page of a folder: `runs` without links, `files` of its record, and `read` for what they hold.
    pub fn of(
        contents: &Contents,
        files: &[String],
        mut runs: Vec<Run>,
        claims: Vec<Claim>,
        read: &dyn Fn(&str) -> Option<Vec<u8>>,
        provenance: bool,
    ) -> Study {
        let name = |file: &str| file.rsplit('/').next().unwrap_or_default().to_owned();
        let tables: Vec<&String> = files.iter().filter(|file| file.starts_with("tables/")).collect();
        let is_of = |file: &str, run: &Run| {
            name(file).strip_prefix(&run.name).is_some_and(|rest| rest.starts_with('.'))
        };
        for run in &mut runs {
            let own = tables.iter().filter(|file| is_of(file, run));
            let mut links: Vec<Link> =
                own.map(|file| Link { path: (*file).clone(), words: name(file) }).collect();
            links.sort();
            let log = Link { path: format!("runs/{}.mcap", run.name), words: format!("{}.mcap", run.name) };
            links.insert(0, log);
            run.links = links;
        }
        let of_several = tables.iter().filter(|file| !runs.iter().any(|run| is_of(file, run)));
        let mut links: Vec<Link> =
            of_several.map(|file| Link { path: (*file).clone(), words: name(file) }).collect();
        links.sort();
        let figures = contents.figures.iter().map(|shown| Figure {
            path: shown.file.clone(),
            caption: shown.caption.clone(),
            runs: shown.runs.clone(),
            picture: picture(&shown.file, read),
        });
        Study { title: contents.title.clone(), figures: figures.collect(), runs, claims, links, provenance }
    }

    /// Puts the way from the page's folder to the study's before all links.
    pub fn lead(&mut self, way: &str) {
        let of_runs = self.runs.iter_mut().flat_map(|run| &mut run.links);
        for link in of_runs.chain(&mut self.links) {
            link.path.insert_str(0, way);
        }
        self.figures.iter_mut().for_each(|figure| figure.path.insert_str(0, way));
    }
}

/// A path as the target of a link: what means something else there is spelled out.
pub fn encoded(path: &[u8]) -> String {
    let plain = |byte: u8| byte.is_ascii_alphanumeric() || b"/-_.~".contains(&byte);
    path.iter()
        .map(|&byte| if plain(byte) { char::from(byte).to_string() } else { format!("%{byte:02X}") })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::{Recorded, SVG_MOST, encoded, picture};
    use crate::figures::Picture;

    #[test]
    fn a_figure_is_shown_as_svg_where_that_is_small() {
        let both = |svg: usize| {
            move |file: &str| Some(if file.ends_with(".svg") { vec![b's'; svg] } else { b"png".to_vec() })
        };
        assert!(matches!(picture("figures/a.png", &both(9)), Picture::Svg(_)));
        assert_eq!(picture("figures/a.png", &both(SVG_MOST + 1)), Picture::Png(b"png".to_vec()));
        assert_eq!(picture("figures/a.png", &|_| None), Picture::None);
    }

    #[test]
    fn a_record_is_one_of_a_pipeline() {
        let text = r#"{"format": "asperity-reduce", "version": 1, "runs": [], "files": []}"#;
        assert!(Recorded::read(text).unwrap_err().contains("(accepted: \"asperity-reproduce\")"));
        assert!(Recorded::read(&text.replace("reduce", "reproduce")).unwrap().page.is_none());
        assert!(Recorded::read("{").is_err());
    }

    #[test]
    fn whatever_a_folder_is_called_its_links_lead_there() {
        assert_eq!(encoded("../a b/50%#1/µ.mcap".as_bytes()), "../a%20b/50%25%231/%C2%B5.mcap");
    }
}
