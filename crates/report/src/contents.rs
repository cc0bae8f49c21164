//! The description of the page in the record of a pipeline (`reproduce.json`), and the page built from it
//! and the measurements. The result does not depend on whether the runs have just been made or are read
//! again.

use asperity_numbers::claim::Claim;
use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::figures::{Figure, data_url};
use crate::study::{Link, Run, Study};

/// The description of the page in a record.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Contents {
    /// The subject of the pipeline.
    pub title: String,
    /// Its figures, in the order of the page.
    pub figures: Vec<Figure>,
}

/// A record, as far as pages need it.
#[derive(Debug, Clone, Deserialize)]
pub struct Recorded {
    /// Its runs.
    pub runs: Vec<RecordedRun>,
    /// The files that were written with it, from its folder.
    pub files: Vec<String>,
    /// Its description of the page.
    pub page: Contents,
}

/// A run of a record.
#[derive(Debug, Clone, Deserialize)]
pub struct RecordedRun {
    /// Its name.
    pub name: String,
    /// Its header.
    pub run: Value,
}

impl Recorded {
    /// Reads one.
    ///
    /// # Errors
    /// If it is none, in words.
    pub fn read(text: &str) -> Result<Recorded, String> {
        #[derive(Deserialize)]
        struct By {
            format: String,
        }
        let By { format } = serde_json::from_str(text).map_err(|error| error.to_string())?;
        if format != "asperity-reproduce" {
            return Err(format!("format: {format:?} (accepted: \"asperity-reproduce\")"));
        }
        let recorded: Recorded = serde_json::from_str(text).map_err(|error| error.to_string())?;
        let refused =
            |key: &str, value: &str, accepted: &str| Err(format!("{key}: {value:?} (accepted: {accepted})"));
        if let Some(run) = recorded.runs.iter().find(|run| !is_plain(&run.name)) {
            return refused("runs.name", &run.name, PLAIN);
        }
        if let Some(file) = recorded.files.iter().find(|file| !file.split('/').all(is_plain)) {
            return refused("files", file, &format!("a path from the folder on, of {PLAIN}"));
        }
        let is_figure = |file: &str| {
            file.strip_prefix("figures/").is_some_and(|name| is_plain(name) && name.ends_with(".png"))
        };
        let mut figures = recorded.page.figures.iter();
        match figures.find(|figure| !is_figure(&figure.file)) {
            Some(figure) => {
                refused("page.figures.file", &figure.file, &format!("figures/NAME.png, of {PLAIN}"))
            }
            None => Ok(recorded),
        }
    }
}

/// Characters of names, as pipelines require.
const PLAIN: &str = "letters, digits, -, _ and dots inside";

/// Whether a name denotes a file directly in the searched folder, and nothing else when used in a link.
fn is_plain(name: &str) -> bool {
    let plain = |c: char| c.is_ascii_alphanumeric() || matches!(c, '-' | '_' | '.');
    !name.is_empty() && !name.starts_with('.') && name.chars().all(plain)
}

/// A picture of this size or less is embedded as SVG; a larger one as PNG, if there is one.
const SVG_MOST: usize = 600_000;

/// The candidate files of a picture: SVG beside PNG.
pub fn files_of_picture(png: &str) -> [String; 2] {
    let stem = png.rsplit_once('.').map_or(png, |(stem, _)| stem);
    [format!("{stem}.svg"), png.to_owned()]
}

/// Returns the contents of a file of a folder, given its path there; None if there is no such file.
pub type ReadFile<'a, E> = dyn Fn(&str) -> Result<Option<Vec<u8>>, E> + 'a;

/// The picture of a figure, as the address of its data: SVG if there is one beside the PNG and it has no more than 600 kB, else PNG.
/// Files that are no pictures are not shown, since the name may be a link to anything.
///
/// # Errors
/// That of `read`.
pub fn picture<E>(file: &str, read: &ReadFile<'_, E>) -> Result<Option<String>, E> {
    let [svg, png] = files_of_picture(file);
    let is_svg = |bytes: &Vec<u8>| {
        let text = std::str::from_utf8(bytes).unwrap_or_default();
        let root =
            text.strip_prefix("<?xml").and_then(|rest| rest.split_once("?>")).map_or(text, |parts| parts.1);
        bytes.len() <= SVG_MOST && root.trim_start().starts_with("<svg ")
    };
    let is_png = |bytes: &Vec<u8>| bytes.starts_with(b"\x89PNG\r\n\x1a\n");
    Ok(match read(&svg)?.filter(is_svg) {
        Some(svg) => Some(data_url("svg+xml", &svg)),
        None => read(&png)?.filter(is_png).map(|png| data_url("png", &png)),
    })
}

impl Study {
    /// The page of a folder: `runs` without links, `files` of its record, and `read` for their contents.
    ///
    /// # Errors
    /// That of `read`.
    pub fn of<E>(
        contents: &Contents,
        files: &[String],
        mut runs: Vec<Run>,
        claims: Vec<Claim>,
        read: &ReadFile<'_, E>,
        provenance: bool,
    ) -> Result<Study, E> {
        let name = |file: &str| file.rsplit('/').next().unwrap_or_default().to_owned();
        let link = |file: &str| Link { path: encoded(file.as_bytes()), words: name(file) };
        let tables: Vec<&String> = files.iter().filter(|file| file.starts_with("tables/")).collect();
        let is_of = |file: &str, run: &Run| {
            name(file).strip_prefix(&run.name).is_some_and(|rest| rest.starts_with('.'))
        };
        for run in &mut runs {
            let own = tables.iter().filter(|file| is_of(file, run));
            run.links = own.map(|file| link(file)).collect();
            run.links.sort();
            run.links.insert(0, link(&format!("runs/{}.mcap", run.name)));
        }
        let of_several = tables.iter().filter(|file| !runs.iter().any(|run| is_of(file, run)));
        let mut links: Vec<Link> = of_several.map(|file| link(file)).collect();
        links.sort();
        let figures = contents.figures.iter().map(|figure| {
            let (file, picture) = (encoded(figure.file.as_bytes()), picture(&figure.file, read)?);
            Ok(Figure { file, picture, ..figure.clone() })
        });
        let figures = figures.collect::<Result<_, E>>()?;
        Ok(Study { title: contents.title.clone(), figures, runs, claims, links, provenance })
    }

    /// Puts the way from the page's folder to the study's before all links.
    pub fn lead(&mut self, way: &str) {
        let of_runs = self.runs.iter_mut().flat_map(|run| &mut run.links);
        for link in of_runs.chain(&mut self.links) {
            link.path.insert_str(0, way);
        }
        self.figures.iter_mut().for_each(|figure| figure.file.insert_str(0, way));
    }
}

/// A path as the target of a link, with special characters escaped.
pub fn encoded(path: &[u8]) -> String {
    let plain = |byte: u8| byte.is_ascii_alphanumeric() || b"/-_.~".contains(&byte);
    path.iter()
        .map(|&byte| if plain(byte) { char::from(byte).to_string() } else { format!("%{byte:02X}") })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::{ReadFile, Recorded, SVG_MOST, encoded, picture};
    use crate::figures::data_url;

    const PNG: &[u8] = b"\x89PNG\r\n\x1a\n";

    #[test]
    fn a_figure_is_shown_as_svg_where_that_is_small() {
        let shown = |read: &ReadFile<'_, &'static str>| picture("figures/a.png", read);
        let both = |svg: usize| {
            let head = b"<?xml version=\"1.0\"?>\n<svg ";
            let svg = [head.to_vec(), vec![b' '; svg - head.len()]].concat();
            move |file: &str| Ok(Some(if file.ends_with(".svg") { svg.clone() } else { PNG.to_vec() }))
        };
        let is_svg = |url: String| url.starts_with("data:image/svg+xml;base64,");
        assert!(shown(&both(99)).unwrap().is_some_and(is_svg));
        assert!(shown(&both(SVG_MOST)).unwrap().is_some_and(is_svg));
        assert_eq!(shown(&both(SVG_MOST + 1)), Ok(Some(data_url("png", PNG))));
        assert_eq!(shown(&|_| Ok(None)), Ok(None));
        assert_eq!(shown(&|_| Err("unreadable")), Err("unreadable"));
        // Any other file with such a name.
        assert_eq!(shown(&|_| Ok(Some(b"PRETTY_NAME=\"x\"".to_vec()))), Ok(None));
    }

    #[test]
    fn a_record_is_one_of_a_pipeline() {
        let text = r#"{"format": "asperity-reduce", "version": 1, "runs": [], "files": []}"#;
        assert!(Recorded::read(text).unwrap_err().contains("(accepted: \"asperity-reproduce\")"));
        assert!(Recorded::read(&text.replace("reduce", "reproduce")).unwrap_err().contains("`page`"));
        assert!(Recorded::read("{").is_err());
    }

    /// A folder may come from anywhere, and pages are meant to be shared.
    #[test]
    fn a_record_names_files_of_its_folder_alone() {
        let of = |file: &str, figure: &str| {
            let record = serde_json::json!({
                "format": "asperity-reproduce", "runs": [], "files": [file],
                "page": { "title": "", "figures": [{ "file": figure, "title": "", "caption": "", "runs": [] }] },
            });
            Recorded::read(&record.to_string())
        };
        assert!(of("tables/a.load.csv", "figures/figure-5.09.png").is_ok());
        for file in
            ["/etc/os-release", "../a.csv", "tables/../../a", "tables//a", "javascript:alert(1)", "", "a/.b"]
        {
            let error = of(file, "figures/a.png").unwrap_err();
            assert!(
                error.starts_with(&format!("files: {file:?} (accepted: a path from the folder on")),
                "{error}"
            );
        }
        for file in
            ["/etc/os-release", "figures/../a.png", "javascript:alert(1)//a.png", "figures/a.svg", "a.png"]
        {
            let error = of("a", file).unwrap_err();
            assert!(
                error.starts_with(&format!("page.figures.file: {file:?} (accepted: figures/NAME.png")),
                "{error}"
            );
        }
    }

    #[test]
    fn whatever_a_folder_is_called_its_links_lead_there() {
        assert_eq!(encoded("../a b/50%#1/µ.mcap".as_bytes()), "../a%20b/50%25%231/%C2%B5.mcap");
    }
}
