//! The schema of binary messages: a `FileDescriptorSet` of Protocol Buffers with one file and one message, whose
//! fields have what they mean as comments. Only what a message of numbers needs of
//! [descriptor.proto](https://github.com/protocolbuffers/protobuf/blob/main/src/google/protobuf/descriptor.proto),
//! which numbers all of this.

use asperity_record::BulkField;
use prost::Message;

/// The package of the messages.
pub(crate) const PACKAGE: &str = "asperity";

#[derive(Message)]
struct FileDescriptorSet {
    #[prost(message, required, tag = 1)]
    file: File,
}

#[derive(Message)]
struct File {
    #[prost(string, tag = 1)]
    name: String,
    #[prost(string, tag = 2)]
    package: String,
    #[prost(message, required, tag = 4)]
    message_type: Type,
    #[prost(message, required, tag = 9)]
    source_code_info: Source,
    #[prost(string, tag = 12)]
    syntax: String,
}

#[derive(Message)]
struct Type {
    #[prost(string, tag = 1)]
    name: String,
    #[prost(message, repeated, tag = 2)]
    field: Vec<Field>,
}

#[derive(Message)]
struct Field {
    #[prost(string, tag = 1)]
    name: String,
    #[prost(int32, tag = 3)]
    number: i32,
    #[prost(int32, tag = 4)]
    label: i32,
    #[prost(int32, tag = 5)]
    kind: i32,
}

#[derive(Message)]
struct Source {
    #[prost(message, repeated, tag = 1)]
    location: Vec<Location>,
}

#[derive(Message)]
struct Location {
    /// From the file on, the number of a field of its description, and the place in it.
    #[prost(int32, repeated, tag = 1)]
    path: Vec<i32>,
    /// Line, column and end: there is no text that has them.
    #[prost(int32, repeated, tag = 2)]
    span: Vec<i32>,
    #[prost(string, tag = 3)]
    leading_comments: String,
}

/// The schema of a message of that name in [`PACKAGE`] with these fields.
///
/// # Panics
/// At a type other than those of [`BulkField`].
pub(crate) fn schema(name: &str, fields: &[&BulkField]) -> Vec<u8> {
    let field = |field: &&BulkField| Field {
        name: field.name.to_owned(),
        number: field.number,
        label: if field.is_repeated { 3 } else { 1 },
        kind: match field.kind {
            "double" => 1,
            "uint64" => 4,
            "bytes" => 12,
            "uint32" => 13,
            other => panic!("{}: {other}", field.name),
        },
    };
    let comment = |(place, field): (usize, &&BulkField)| Location {
        path: vec![4, 0, 2, place as i32],
        span: vec![place as i32, 0, 0],
        leading_comments: field.about.to_owned(),
    };
    let file = File {
        name: format!("{PACKAGE}/{name}.proto"),
        package: PACKAGE.to_owned(),
        message_type: Type { name: name.to_owned(), field: fields.iter().map(field).collect() },
        source_code_info: Source { location: fields.iter().enumerate().map(comment).collect() },
        syntax: "proto3".to_owned(),
    };
    FileDescriptorSet { file }.encode_to_vec()
}
