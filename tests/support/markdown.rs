//! The parts of Markdown pages that tests need.

/// A fenced block.
pub(crate) struct Block {
    /// The line on which it starts, counted from 1.
    pub(crate) line: usize,
    /// The text after its opening fence.
    pub(crate) language: String,
    /// The text between its fences.
    pub(crate) text: String,
    /// The last line of text before it.
    pub(crate) before: String,
}

/// The fenced blocks of a page, in order.
pub(crate) fn blocks(page: &str) -> Vec<Block> {
    let mut blocks: Vec<Block> = Vec::new();
    let mut is_open = false;
    let mut before = "";
    for (line, number) in page.lines().zip(1..) {
        match (line.strip_prefix("```"), is_open) {
            (Some(language), false) => {
                let (language, before) = (language.to_owned(), before.to_owned());
                blocks.push(Block { line: number, language, text: String::new(), before });
                is_open = true;
            }
            (Some(_), true) => is_open = false,
            (None, true) => {
                let block = blocks.last_mut().expect("a block is open");
                block.text.push_str(line);
                block.text.push('\n');
            }
            (None, false) => {}
        }
        if !line.trim().is_empty() {
            before = line;
        }
    }
    assert!(!is_open, "the last block is not closed");
    blocks
}

/// The lines of a page outside its fenced blocks, each with its number, counted from 1.
pub(crate) fn prose(page: &str) -> impl Iterator<Item = (usize, &str)> {
    let mut is_open = false;
    (1..).zip(page.lines()).filter(move |(_, line)| {
        let fence = line.starts_with("```");
        is_open ^= fence;
        !fence && !is_open
    })
}

/// The paragraphs of a page outside its fenced blocks, each on one line, with the number of its
/// first line. Headings and rows of tables are paragraphs of their own.
pub(crate) fn paragraphs(page: &str) -> Vec<(usize, String)> {
    let mut paragraphs: Vec<(usize, String)> = Vec::new();
    let mut last = None;
    for (number, line) in prose(page) {
        let is_alone = line.starts_with(['|', '#', '!']);
        match (&mut last, paragraphs.last_mut()) {
            (Some(last), Some((_, paragraph))) if !is_alone && *last + 1 == number => {
                paragraph.push(' ');
                paragraph.push_str(line.trim());
            }
            _ => paragraphs.push((number, line.trim().to_owned())),
        }
        last = (!is_alone && !line.trim().is_empty()).then_some(number);
    }
    paragraphs.retain(|(_, paragraph)| !paragraph.is_empty());
    paragraphs
}

/// The anchors of the page's headings, as in links on GitHub.
pub(crate) fn anchors(page: &str) -> Vec<String> {
    let mut anchors: Vec<String> = Vec::new();
    for (_, line) in prose(page) {
        let Some((level, heading)) = line.split_once(' ') else { continue };
        if level.is_empty() || level.chars().any(|c| c != '#') {
            continue;
        }
        let kept = |c: &char| c.is_alphanumeric() || matches!(c, ' ' | '-' | '_');
        let anchor: String = heading.trim().to_lowercase().chars().filter(kept).collect();
        let anchor = anchor.replace(' ', "-");
        let same = anchors.iter().filter(|known| **known == anchor).count();
        anchors.push(if same == 0 { anchor } else { format!("{anchor}-{same}") });
    }
    anchors
}

/// The targets of the links and pictures in a paragraph.
pub(crate) fn links(paragraph: &str) -> impl Iterator<Item = &str> {
    paragraph.split("](").skip(1).filter_map(|rest| rest.split(')').next())
}

/// The text in backquotes in a paragraph.
pub(crate) fn code(paragraph: &str) -> impl Iterator<Item = &str> {
    paragraph.split('`').skip(1).step_by(2)
}
