//! Figures of a run.

use std::path::PathBuf;

use asperity_figures::draw::of_one_run::{Kind, OneFigure, Target};
use asperity_files::{Existing, FileSet, Inputs};
use asperity_model::among;
use asperity_numbers::run_data::{Collector, RunData};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyString};

use crate::attend::{Callbacks, attend};
use crate::errors::{failed, refused};
use crate::source::Source;
use crate::values::{assigned, items};

/// The kinds of figures that `Run.draw` draws: name and what they show (docs/gallery.md).
#[pyfunction]
pub(crate) fn figures() -> Vec<(String, String)> {
    Kind::all().map(|kind| (kind.name.to_owned(), kind.shows())).collect()
}

/// A figure, which notebooks show.
#[pyclass(frozen, module = "asperity")]
pub(crate) struct Figure {
    figure: OneFigure,
    data: RunData,
    svg: String,
}

impl Figure {
    /// Draws a figure of a run.
    pub(crate) fn draw(
        py: Python<'_>,
        kind: &str,
        keys: Option<&Bound<'_, PyDict>>,
        source: &Source,
    ) -> PyResult<Figure> {
        let Source { name, header, .. } = source;
        let scenario = source.scenario()?;
        let kind = Kind::find(kind).ok_or_else(|| {
            let known: Vec<&str> = Kind::all().map(|kind| kind.name).collect();
            refused(format!("{kind} is no kind of figure{}", among(kind, &known, "`asperity.figures()`")))
        })?;
        let keys = keys.map_or_else(|| Ok(Vec::new()), |keys| items(keys.as_mapping()))?;
        let set = keys.iter().map(|(key, value)| assigned(key, value)).collect::<PyResult<Vec<_>>>()?;
        let figure = py.detach(|| kind.of_run(name, header, scenario, &set)).map_err(refused)?;
        let required = figure.required_data();
        let collector = Collector::new(name, header.clone(), scenario.clone(), required);
        let (mut collector, has_ruptures, end) = source.observe(py, |_| collector)?;
        let at_s = collector.nodes_at_s();
        if !at_s.is_empty() {
            source.nodes(py, &at_s)?.into_iter().for_each(|state| collector.nodes(state));
        }
        let data = py.detach(|| collector.finish(has_ruptures, end.as_ref()));
        // A notebook says itself where its figures are from; only files bear a line about it.
        let svg = attend(py, &Callbacks::default(), |_| figure.bytes(&[&data], false, "svg"))?;
        let (svg, _) = svg.map_err(failed)?;
        let svg = String::from_utf8(svg).map_err(failed)?;
        Ok(Figure { figure, data, svg })
    }
}

#[pymethods]
impl Figure {
    /// Its kind, of `asperity.figures()`.
    #[getter]
    fn kind(&self) -> &str {
        self.figure.kind.name
    }

    /// The figure as SVG.
    #[getter]
    fn svg(&self) -> &str {
        &self.svg
    }

    /// Writes it as PNG, SVG or PDF, as the path ends; replaces a file there.
    fn save(&self, py: Python<'_>, path: PathBuf) -> PyResult<PathBuf> {
        let target = Target::of(&path);
        if !matches!(target, Target::File(_)) {
            return Err(refused(format!(
                "{} (accepted: a name that ends in .png, .svg or .pdf)",
                path.display()
            )));
        }
        let files = FileSet::new(Existing::Replace, Inputs::default());
        let draw = || {
            self.figure.draw(&self.data, true, &files, &target).map_err(failed)?;
            files.publish().map_err(failed)
        };
        attend(py, &Callbacks::default(), |_| draw())??;
        Ok(path)
    }

    fn _repr_svg_<'py>(&self, py: Python<'py>) -> Bound<'py, PyString> {
        PyString::new(py, &self.svg)
    }

    fn __repr__(&self) -> String {
        format!("Figure({:?} of {})", self.figure.kind.name, self.data.name)
    }
}
