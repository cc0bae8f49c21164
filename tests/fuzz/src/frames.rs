//! Disassembles plans and segments of studies, and reassembles them with correct checksums. The forms are
//! those of `docs/rules.md`.

/// A segment: the line with its version and plan, and its results.
#[derive(Debug, Clone)]
pub struct Segment {
    pub first_line: Vec<u8>,
    pub frames: Vec<Frame>,
}

/// A result in a segment.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Frame {
    /// 1 if the run is done.
    pub kind: u8,
    pub run: u64,
    pub content: Vec<u8>,
}

/// The bytes of a frame before its content.
const HEAD: usize = 17;

impl Frame {
    /// A frame of a run that is done, with this text in it.
    pub fn done(run: u64, text: &[u8]) -> Frame {
        Frame { kind: 1, run, content: zstd::bulk::compress(text, 1).expect("it compresses") }
    }

    /// The unpacked content.
    pub fn text(&self) -> String {
        let unpacked = zstd::bulk::decompress(&self.content, 1 << 26).expect("it is a sound one");
        String::from_utf8(unpacked).expect("it is a sound one")
    }

    pub fn bytes(&self) -> Vec<u8> {
        let mut bytes = vec![self.kind];
        bytes.extend(self.run.to_le_bytes());
        bytes.extend((self.content.len() as u32).to_le_bytes());
        bytes.extend(&self.content);
        [&crc32fast::hash(&bytes).to_le_bytes()[..], &bytes].concat()
    }
}

impl Segment {
    /// Takes a segment apart, as far as its frames are whole.
    pub fn read(bytes: &[u8]) -> Segment {
        let end = bytes.iter().position(|byte| *byte == b'\n').map_or(bytes.len(), |end| end + 1);
        let first_line = bytes[..end].to_vec();
        let mut frames = Vec::new();
        let mut left = &bytes[end..];
        while let Some((head, behind)) = left.split_first_chunk::<HEAD>() {
            let run = u64::from_le_bytes(*head[5..].first_chunk().expect("there are seventeen"));
            let length = u32::from_le_bytes(*head[13..].first_chunk().expect("there are seventeen"));
            let Some((content, behind)) = behind.split_at_checked(length as usize) else { break };
            frames.push(Frame { kind: head[4], run, content: content.to_vec() });
            left = behind;
        }
        Segment { first_line, frames }
    }

    /// The segment with these results for another plan.
    pub fn of_plan(&self, plan: &str) -> Segment {
        let first_line = format!("asperity sweep segment 3 {}\n", hash_of(plan)).into_bytes();
        Segment { first_line, frames: self.frames.clone() }
    }

    pub fn bytes(&self) -> Vec<u8> {
        let frames = self.frames.iter().flat_map(Frame::bytes);
        self.first_line.iter().copied().chain(frames).collect()
    }
}

/// The lines of a plan, without the last one.
pub fn body(plan: &str) -> &str {
    plan.trim_end().rsplit_once('\n').map_or("", |(body, _)| body)
}

/// A plan of these lines, with the last one made right.
pub fn sealed(body: &str) -> String {
    let body = format!("{body}\n");
    let hash = blake3::hash(body.as_bytes()).to_hex();
    format!("{body}{{\"rows\":{},\"blake3\":\"{hash}\"}}\n", body.lines().count().saturating_sub(1))
}

/// The name of a plan in segments.
fn hash_of(plan: &str) -> String {
    let end = plan.trim_end().rsplit_once("\"blake3\":\"").map_or("", |(_, end)| end);
    end.trim_end_matches("\"}").to_owned()
}
