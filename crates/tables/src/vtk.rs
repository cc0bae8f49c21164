//! Fields over an area or a body as files of VTK, which ParaView opens: an image (`.vti`) per time, and a
//! collection (`.pvd`) that lists them with their times.
//!
//! An image is a grid with equal spacings, whose points are counted along the sliding direction first, then across,
//! then upwards, as the nodes of a lattice are. Its numbers are the doubles themselves, little-endian behind their
//! count in bytes, in base64: [VTK's XML formats](https://docs.vtk.org/en/latest/vtk_file_formats/vtkxml_file_format.html).

use std::fmt::Write;

use base64::Engine;
use base64::prelude::BASE64_STANDARD;

/// A grid of points, and numbers at them.
#[derive(Debug, Clone)]
pub struct Image<'a> {
    /// Points along the sliding direction, across it, and upwards.
    pub counts: [usize; 3],
    /// Distance of neighbours, m.
    pub spacing_m: f64,
    /// The time, s.
    pub time_s: f64,
    /// What is known of the points.
    pub arrays: Vec<Array<'a>>,
}

/// A quantity at every point.
#[derive(Debug, Clone)]
pub struct Array<'a> {
    /// Its name, with the unit.
    pub name: &'static str,
    /// Its components, each with a number for every point. A vector has three; those along axes on which nothing
    /// moves are none, and are written as 0.
    pub components: Vec<Option<&'a [f64]>>,
}

impl<'a> Array<'a> {
    /// A single number at each point.
    pub fn of(name: &'static str, values: &'a [f64]) -> Array<'a> {
        Array { name, components: vec![Some(values)] }
    }

    /// A vector at each point, from values along these axes one after the other: 0 is along the sliding direction,
    /// 1 across, 2 upwards.
    pub fn vectors(name: &'static str, axes: &[usize], values: &'a [f64]) -> Array<'a> {
        let points = values.len() / axes.len();
        let along = |axis: usize| {
            let place = axes.iter().position(|known| *known == axis)?;
            Some(&values[place * points..][..points])
        };
        Array { name, components: (0..3).map(along).collect() }
    }

    /// The numbers of a point after those of the one before, in base64 behind their count in bytes.
    fn encoded(&self, points: usize) -> String {
        let count = (points * self.components.len() * size_of::<f64>()) as u64;
        let mut bytes = count.to_le_bytes().to_vec();
        for point in 0..points {
            for component in &self.components {
                bytes.extend(component.map_or(0.0, |values| values[point]).to_le_bytes());
            }
        }
        BASE64_STANDARD.encode(bytes)
    }
}

impl Image<'_> {
    /// The text of its file.
    ///
    /// # Panics
    /// If an array has fewer numbers than there are points.
    pub fn vti(&self) -> String {
        let [columns, across, rows] = self.counts;
        let extent = format!("0 {} 0 {} 0 {}", columns - 1, across - 1, rows - 1);
        let (spacing_m, time_s) = (self.spacing_m, self.time_s);
        let mut text = format!(
            "<?xml version=\"1.0\"?>\n\
             <VTKFile type=\"ImageData\" version=\"1.0\" byte_order=\"LittleEndian\" header_type=\"UInt64\">\n\
             <ImageData WholeExtent=\"{extent}\" Origin=\"0 0 0\" Spacing=\"{spacing_m} {spacing_m} {spacing_m}\">\n\
             <FieldData>\n\
             <DataArray type=\"Float64\" Name=\"TimeValue\" NumberOfTuples=\"1\" format=\"ascii\">{time_s}</DataArray>\n\
             </FieldData>\n\
             <Piece Extent=\"{extent}\">\n\
             <PointData>\n"
        );
        for array in &self.arrays {
            let (name, components) = (array.name, array.components.len());
            let encoded = array.encoded(columns * across * rows);
            writeln!(
                text,
                "<DataArray type=\"Float64\" Name=\"{name}\" NumberOfComponents=\"{components}\" \
                 format=\"binary\">{encoded}</DataArray>"
            )
            .expect("texts take everything");
        }
        text + "</PointData>\n</Piece>\n</ImageData>\n</VTKFile>\n"
    }
}

/// The text of a collection of files beside it, with their times, s.
pub fn pvd<'a>(files: impl IntoIterator<Item = (f64, &'a str)>) -> String {
    let mut text = String::from(
        "<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"1.0\" byte_order=\"LittleEndian\">\n<Collection>\n",
    );
    for (time_s, file) in files {
        let file = file.replace('&', "&amp;").replace('<', "&lt;").replace('"', "&quot;");
        writeln!(text, "<DataSet timestep=\"{time_s}\" part=\"0\" file=\"{file}\"/>")
            .expect("texts take everything");
    }
    text + "</Collection>\n</VTKFile>\n"
}

#[cfg(test)]
mod tests {
    use base64::Engine;
    use base64::prelude::BASE64_STANDARD;

    use super::{Array, Image, pvd};

    #[test]
    fn an_image_has_its_numbers_point_by_point() {
        let (along, load) =
            ([1.0, 2.0, 3.0, 4.0, -1.0, -2.0, -3.0, -4.0], [0.5, f64::MIN_POSITIVE, -0.0, 1e300]);
        let image = Image {
            counts: [2, 2, 1],
            spacing_m: 0.0025,
            time_s: 0.19,
            arrays: vec![
                Array::vectors("displacement_m", &[0, 2], &along),
                Array::of("normal_load_n", &load),
            ],
        };
        let text = image.vti();
        assert!(
            text.contains("WholeExtent=\"0 1 0 1 0 0\"") && text.contains("Spacing=\"0.0025 0.0025 0.0025\"")
        );
        assert!(text.contains(">0.19</DataArray>"), "{text}");
        let numbers = |name: &str| -> Vec<f64> {
            let (_, rest) = text.split_once(&format!("Name=\"{name}\"")).expect("it is there");
            let (_, rest) = rest.split_once('>').expect("it is open");
            let bytes =
                BASE64_STANDARD.decode(rest.split_once('<').expect("it is closed").0).expect("base64");
            assert_eq!(bytes[..8], (bytes.len() as u64 - 8).to_le_bytes());
            bytes[8..].as_chunks().0.iter().map(|number| f64::from_le_bytes(*number)).collect()
        };
        let expected = [1.0, 0.0, -1.0, 2.0, 0.0, -2.0, 3.0, 0.0, -3.0, 4.0, 0.0, -4.0];
        assert_eq!(numbers("displacement_m"), expected);
        let bits = |of: &[f64]| of.iter().map(|number| number.to_bits()).collect::<Vec<u64>>();
        assert_eq!(bits(&numbers("normal_load_n")), bits(&load));
    }

    #[test]
    fn a_collection_names_its_files() {
        let text = pvd([(0.19, "a&b.vti"), (0.2, "c.vti")]);
        assert!(text.contains("<DataSet timestep=\"0.19\" part=\"0\" file=\"a&amp;b.vti\"/>"), "{text}");
        assert_eq!(text.matches("<DataSet").count(), 2);
    }
}
