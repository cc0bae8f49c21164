//! Parquet by hand: a table of events where a run length of a few bytes represents any number of equal
//! rows. No library writes such a file; every library reads it.

/// The physical types of the format.
const INT32: i64 = 1;
const DOUBLE: i64 = 5;
/// The logical type of a block's number.
const UNSIGNED: i64 = 13;

/// The columns that a table of events must have, with the one value of each.
const COLUMNS: [(&str, i64, [u8; 8], usize); 4] = [
    ("onset_s", DOUBLE, 0.5f64.to_le_bytes(), 8),
    ("end_s", DOUBLE, 0.625f64.to_le_bytes(), 8),
    ("first_block", INT32, [1, 0, 0, 0, 0, 0, 0, 0], 4),
    ("last_block", INT32, [7, 0, 0, 0, 0, 0, 0, 0], 4),
];

/// Structures of the compact protocol of Thrift, in which Parquet describes itself.
#[derive(Default)]
struct Thrift {
    out: Vec<u8>,
    last: Vec<i16>,
}

impl Thrift {
    fn structure(fill: impl FnOnce(&mut Thrift)) -> Vec<u8> {
        let mut thrift = Thrift { out: Vec::new(), last: vec![0] };
        fill(&mut thrift);
        thrift.out.push(0);
        thrift.out
    }

    fn varint(&mut self, mut value: u64) {
        while value >= 0x80 {
            self.out.push(value as u8 | 0x80);
            value >>= 7;
        }
        self.out.push(value as u8);
    }

    fn field(&mut self, id: i16, kind: u8) {
        let last = self.last.last_mut().expect("it is in a structure");
        let step = (id - *last) as u8;
        *last = id;
        self.out.push(step << 4 | kind);
    }

    fn signed(&mut self, value: i64) {
        self.varint((value << 1 ^ value >> 63) as u64);
    }

    fn i32(&mut self, id: i16, value: i64) {
        self.field(id, 5);
        self.signed(value);
    }

    fn i64(&mut self, id: i16, value: i64) {
        self.field(id, 6);
        self.signed(value);
    }

    fn text(&mut self, id: i16, text: &str) {
        self.field(id, 8);
        self.bytes(text);
    }

    fn bytes(&mut self, text: &str) {
        self.varint(text.len() as u64);
        self.out.extend(text.as_bytes());
    }

    /// A list of less than 15 things of a kind.
    fn list(&mut self, id: i16, kind: u8, count: usize) {
        self.field(id, 9);
        self.out.push((count as u8) << 4 | kind);
    }

    /// A structure in a list, or, behind its field's head, in a field.
    fn inner(&mut self, fill: impl FnOnce(&mut Thrift)) {
        self.last.push(0);
        fill(self);
        self.last.pop();
        self.out.push(0);
    }
}

/// A table of that many equal events.
pub(crate) fn equal_rows(rows: u32) -> Vec<u8> {
    let rows = i64::from(rows);
    let mut out = b"PAR1".to_vec();
    let mut chunks = Vec::new();
    for (name, kind, value, bytes) in COLUMNS {
        let start = out.len() as i64;
        let page = |kind, size: usize, fill: &dyn Fn(&mut Thrift)| {
            Thrift::structure(|page| {
                page.i32(1, kind);
                page.i32(2, size as i64);
                page.i32(3, size as i64);
                fill(page);
            })
        };
        out.extend(page(2, bytes, &|page| {
            page.field(7, 12);
            page.inner(|dictionary| {
                dictionary.i32(1, 1);
                dictionary.i32(2, 0);
            });
        }));
        out.extend(&value[..bytes]);
        let data_start = out.len() as i64;
        // Indexes of one bit, in one run.
        let mut run = Thrift::default();
        run.varint((rows as u64) << 1);
        let data = [&[1][..], &run.out, &[0]].concat();
        out.extend(page(0, data.len(), &|page| {
            page.field(5, 12);
            page.inner(|header| {
                header.i32(1, rows);
                header.i32(2, 8);
                header.i32(3, 3);
                header.i32(4, 3);
            });
        }));
        out.extend(data);
        chunks.push((name, kind, start, data_start, out.len() as i64 - start));
    }
    let footer = Thrift::structure(|file| {
        file.i32(1, 1);
        file.list(2, 12, 1 + COLUMNS.len());
        file.inner(|root| {
            root.text(4, "root");
            root.i32(5, COLUMNS.len() as i64);
        });
        for (name, kind, ..) in COLUMNS {
            file.inner(|column| {
                column.i32(1, kind);
                column.i32(3, 0);
                column.text(4, name);
                if kind == INT32 {
                    column.i32(6, UNSIGNED);
                }
            });
        }
        file.i64(3, rows);
        file.list(4, 12, 1);
        file.inner(|group| {
            group.list(1, 12, chunks.len());
            for (name, kind, start, data_start, size) in &chunks {
                group.inner(|chunk| {
                    chunk.i64(2, *start);
                    chunk.field(3, 12);
                    chunk.inner(|about| {
                        about.i32(1, *kind);
                        about.list(2, 5, 2);
                        about.signed(0);
                        about.signed(8);
                        about.list(3, 8, 1);
                        about.bytes(name);
                        about.i32(4, 0);
                        about.i64(5, rows);
                        about.i64(6, *size);
                        about.i64(7, *size);
                        about.i64(9, *data_start);
                        about.i64(11, *start);
                    });
                });
            }
            group.i64(2, chunks.iter().map(|chunk| chunk.4).sum());
            group.i64(3, rows);
        });
    });
    out.extend(&footer);
    out.extend((footer.len() as u32).to_le_bytes());
    out.extend(b"PAR1");
    out
}
