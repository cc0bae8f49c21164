//! Links from a page to the files beside it.

use std::path::{Component, Path, PathBuf};

use asperity_report::encoded;

/// The relative, encoded link from a page to a path; links to folders end in a slash.
pub fn relative_link(page: &Path, to: &Path) -> String {
    let (from, to) = (whole(page.parent().unwrap_or(Path::new(""))), whole(to));
    let (from, parts): (Vec<Component<'_>>, Vec<Component<'_>>) =
        (from.components().collect(), to.components().collect());
    let shared = from.iter().zip(&parts).take_while(|(a, b)| a == b).count();
    let up = std::iter::repeat_n("..".to_owned(), from.len() - shared);
    let down = parts[shared..].iter().map(|part| encoded(part.as_os_str().as_encoded_bytes()));
    let mut link = up.chain(down).collect::<Vec<_>>().join("/");
    if to.is_dir() && !link.is_empty() {
        link.push('/');
    }
    link
}

/// The absolute path without `.` and `..`, resolved by names alone, since browsers do not follow
/// symbolic links upwards.
fn whole(path: &Path) -> PathBuf {
    let there = if path.as_os_str().is_empty() { Path::new(".") } else { path };
    let mut whole = PathBuf::new();
    for part in std::path::absolute(there).unwrap_or_else(|_| there.to_owned()).components() {
        match part {
            Component::ParentDir => drop(whole.pop()),
            Component::CurDir => {}
            part => whole.push(part),
        }
    }
    whole
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::relative_link;

    #[test]
    fn links_lead_from_the_page_to_the_file() {
        let folder = asperity_testkit::folder();
        let path = folder.path();
        fs::create_dir_all(path.join("a b/runs")).unwrap();
        fs::create_dir_all(path.join("pages")).unwrap();
        fs::write(path.join("a b/runs/x.mcap"), "").unwrap();
        let page = path.join("pages/page.html");
        assert_eq!(relative_link(&page, &path.join("a b")), "../a%20b/");
        assert_eq!(relative_link(&page, &path.join("a b/runs/x.mcap")), "../a%20b/runs/x.mcap");
        assert_eq!(relative_link(&path.join("a b/report.html"), &path.join("a b")), "");
        assert_eq!(
            relative_link(&path.join("pages/../a b/report.html"), &path.join("a b/runs/x.mcap")),
            "runs/x.mcap"
        );
        #[cfg(unix)]
        {
            std::os::unix::fs::symlink("../a b", path.join("pages/in")).unwrap();
            assert_eq!(relative_link(&page, &path.join("pages/in/runs/x.mcap")), "in/runs/x.mcap");
        }
    }
}
