//! Pages: single HTML files that fetch nothing, so they can be sent and kept.
//!
//! Words and tables of a page need no scripts; scripts add interaction. The look (`look.css`: light, dark
//! and print, distinguishable without colours) and the components are shared by all pages.
//!
//! ```
//! use asperity_report::html::{Document, markup};
//!
//! let page = Document {
//!     title: "Runs & ruptures".to_owned(),
//!     main: markup::paragraph("F_T/F_N < μ_s"),
//!     data: vec![],
//!     parts: &[],
//! };
//! let html = page.html();
//! assert!(html.contains("<title>Runs &amp; ruptures</title>"));
//! assert!(html.contains("<p>F_T/F_N &lt; μ_s</p>"));
//! assert!(html.contains("default-src 'none'"));
//! ```
//!
//! In reading order:
//!
//! - [`markup`]: text, tables and numbers as HTML.
//! - [`document`]: the page around them, and its parts: the space-time map ([`MAP`]), curves
//!   ([`CURVES`]) and long tables ([`LONG_TABLE`]).

pub mod document;
pub mod markup;

pub use document::{CURVES, Document, LONG_TABLE, MAP, Part};
