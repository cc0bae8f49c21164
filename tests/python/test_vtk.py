"""VTK reads the images that the command exports: the numbers are those of the tables, to the bit."""

from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pandas as pd
import pytest
import vtk
from conftest import Command
from numpy.typing import NDArray
from vtk.util.numpy_support import vtk_to_numpy

SLAB = ["slab", "slider.blocks=29", "slider.rows=16", "time.step_s=4e-7", "time.duration_s=0.02"]
SHEET = ["sheet-coarse", "time.duration_s=0.02"]
BODY = ["body-coarse", "time.duration_s=0.02"]


def read(file: Path) -> vtk.vtkImageData:
    reader = vtk.vtkXMLImageDataReader()
    reader.SetFileName(str(file))
    reader.Update()
    assert reader.GetErrorCode() == 0
    return reader.GetOutput()


def array(image: vtk.vtkImageData, name: str) -> NDArray[np.float64]:
    values: NDArray[np.float64] = vtk_to_numpy(image.GetPointData().GetArray(name))
    return values


@pytest.mark.parametrize(
    ("scenario", "counts", "length_m"),
    [(SLAB, (29, 1, 16), 0.14), (SHEET, (26, 6, 1), 0.1), (BODY, (29, 5, 16), 0.14)],
)
def test_vtk_reads_every_node(
    command: Command, tmp_path: Path, scenario: list[str], counts: tuple[int, int, int], length_m: float
) -> None:
    log = tmp_path / "run & more.mcap"
    sets = [word for key in scenario[1:] for word in ("--set", key)]
    command("--quiet", "run", scenario[0], *sets, "--solver", "plain", "--out", log)
    times = ["--nodes-at-s", "0.01", "--nodes-at-s", "0.02"]
    command("export", log, "--to", "vtk", *times, "--out", tmp_path / "vtk")
    command("export", log, "--to", "csv", "--topic", "/fields", *times, "--out", tmp_path / "csv")
    nodes = pd.read_csv(tmp_path / "csv" / "run & more.nodes.csv", float_precision="round_trip")
    states = pd.read_csv(tmp_path / "csv" / "run & more.fields.csv", float_precision="round_trip")

    collection = ElementTree.parse(tmp_path / "vtk" / "run & more.nodes.pvd")
    listed = {float(entry.attrib["timestep"]): entry.attrib["file"] for entry in collection.iter("DataSet")}
    assert sorted(listed) == sorted(nodes.time_s.unique())
    for time_s, file in listed.items():
        image = read(tmp_path / "vtk" / file)
        assert image.GetDimensions() == counts
        np.testing.assert_allclose(image.GetSpacing(), length_m / (counts[0] - 1), rtol=1e-15)
        assert vtk_to_numpy(image.GetFieldData().GetArray("TimeValue")) == [time_s]
        now = nodes[nodes.time_s == time_s]
        for name in ["displacement_m", "velocity_m_per_s"]:
            quantity, unit = name.split("_", 1)
            columns = [f"{quantity}_{axis}_{unit}" for axis in "xyz"]
            expected = np.column_stack([now.get(column, pd.Series(0.0, now.index)) for column in columns])
            np.testing.assert_array_equal(array(image, name), expected)

        contacts = read(tmp_path / "vtk" / file.replace(".nodes.", ".contacts."))
        assert contacts.GetDimensions() == (counts[0], counts[1], 1)
        count = counts[0] * counts[1]
        np.testing.assert_array_equal(array(contacts, "displacement_m"), array(image, "displacement_m")[:count])
        assert (array(contacts, "normal_load_n") > 0.0).all()
    last = states[states.step == states.step.max()]
    assert len(last) == count
    np.testing.assert_array_equal(array(contacts, "tangential_force_n")[:, 0], last.tangential_force_n)
    np.testing.assert_array_equal(array(contacts, "slides"), last.detached)
    if "normal_load_n" in last:
        np.testing.assert_array_equal(array(contacts, "normal_load_n"), last.normal_load_n)
