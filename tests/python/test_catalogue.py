"""Catalogues of ruptures: read by ObsPy and SeismoStats, and computed again from exported tables."""

import io
from pathlib import Path

import numpy as np
import obspy
import pandas as pd
import pytest
from conftest import Command
from seismostats import Catalog
from seismostats.analysis import ClassicBValueEstimator

import asperity

# Blocks of the default slider: its length over 99 gaps, and its width.
BLOCK_M, WIDTH_M, MODULUS_PA = 0.1 / 99, 0.005, 2.5e9


@pytest.fixture(scope="module")
def catalogue(command: Command, default_log: Path) -> pd.DataFrame:
    return pd.read_csv(io.StringIO(command("--quiet", "catalogue", default_log)))


def test_columns_follow_from_exported_ruptures_and_arrivals(catalogue: pd.DataFrame, default_log: Path) -> None:
    run = asperity.open(default_log)
    ruptures, arrivals = run.ruptures.to_pandas(), run.arrivals.to_pandas()
    ruptures = ruptures[ruptures.end_s.notna()].sort_values(["onset_step", "rupture"]).reset_index(drop=True)
    assert len(catalogue) == len(ruptures) > 200
    for column in ("rupture", "onset_s", "moment_n_m", "potency_m2", "mean_slip_m", "largest_slip_m"):
        np.testing.assert_array_equal(catalogue[column], ruptures[column])
    np.testing.assert_array_equal(catalogue.duration_s, ruptures.end_s - ruptures.onset_s)
    np.testing.assert_allclose(catalogue.x_m, (ruptures.nucleation_block - 1) * BLOCK_M, rtol=1e-12)
    count = ruptures.last_block - ruptures.first_block + 1
    np.testing.assert_array_equal(catalogue.contacts, count)
    np.testing.assert_allclose(catalogue.length_m, count * BLOCK_M, rtol=1e-12)
    states = {step: of.tangential_force_n.to_numpy() for step, of in run.states.to_pandas().groupby("step")}
    tails = dropped = 0
    for row in catalogue.itertuples():
        of = arrivals[arrivals.rupture == row.rupture]
        slip, strength = of.slip_m.to_numpy(), (of.force_detach_n - of.force_attach_n).to_numpy()
        moment = MODULUS_PA * WIDTH_M * BLOCK_M * np.abs(slip).sum()
        assert row.moment_n_m == pytest.approx(moment, rel=1e-9)
        assert row.magnitude == pytest.approx(2 / 3 * (np.log10(moment) - 9.1), abs=1e-9)
        area = BLOCK_M * WIDTH_M
        size = np.abs(slip)
        stress = np.full(len(of), np.nan)
        rupture = ruptures.loc[row.Index]
        if not (row.overlapping or rupture.open) and rupture.onset_step in states and rupture.end_step in states:
            stress = (states[rupture.onset_step] - states[rupture.end_step])[of.block - 1]
            dropped += 1
        for kind, drop in (("strength", strength), ("stress", stress)):
            mean, weighted = getattr(row, f"{kind}_drop_pa"), getattr(row, f"slip_weighted_{kind}_drop_pa")
            assert mean == pytest.approx(drop.mean() / area, rel=1e-6, nan_ok=True)
            assert weighted == pytest.approx(np.average(drop, weights=size) / area, rel=1e-6, nan_ok=True)
        centred = of.block - np.average(of.block, weights=size)
        variance = np.average(centred**2, weights=size)
        if variance > 0:
            skewness = np.average(centred**3, weights=size) / variance**1.5
            assert row.slip_skewness == pytest.approx(skewness, rel=1e-9, abs=1e-9)
            tails += 1
        else:
            assert np.isnan(row.slip_skewness)
    assert tails > 100 and dropped > 100


def test_radiated_energy_closes_with_switches_and_steps(catalogue: pd.DataFrame, default_log: Path) -> None:
    """By the other side of the balance: what was released, less what friction took, from steps and switches alone."""
    run = asperity.open(default_log)
    steps = run.table("/step").to_pandas().set_index("step")
    switches = run.switches.to_pandas()
    # k_t = k = E (N - 1) L_y L_z / L_x.
    stiffness = MODULUS_PA * 99 * WIDTH_M * 0.02 / 0.1
    spring_j = stiffness / 2 * (switches.displacement_m - switches.stick_position_m) ** 2
    anchor_j = spring_j.where(switches.direction == "attach", -spring_j)
    ruptures = run.ruptures.to_pandas().set_index("rupture")
    alone = 0
    for row in catalogue.itertuples():
        rupture = ruptures.loc[row.rupture]
        if rupture.overlapping or rupture.open:
            assert np.isnan(row.radiated_energy_j) and np.isnan(row.radiation_efficiency)
            continue
        before, after = steps.loc[rupture.onset_step - 1], steps.loc[rupture.end_step - 1]
        within = switches.step.between(rupture.onset_step - 1, rupture.end_step - 1)
        own = within & switches.block.between(rupture.first_block, rupture.last_block)
        fracture = -anchor_j[own].sum()
        change = after - before
        # Springs between blocks and of the drive give what all springs give, less the jumps of friction springs.
        released = change.drive_work_j + change.prestress_work_j - (change.elastic_j - change.anchor_change_j)
        expected = released - change.friction_heat_j + change.scheme_work_j
        scale = abs(change.friction_heat_j) + abs(released)
        assert row.radiated_energy_j == pytest.approx(expected, rel=1e-6, abs=1e-9 * scale + 1e-15)
        if row.radiated_energy_j > 0 and fracture > 1e-12:
            assert row.radiation_efficiency == pytest.approx(
                row.radiated_energy_j / (row.radiated_energy_j + fracture), rel=1e-6
            )
            alone += 1
    assert alone > 50


def test_obspy_reads_quakeml(command: Command, catalogue: pd.DataFrame, default_log: Path, tmp_path: Path) -> None:
    text = command("--quiet", "catalogue", default_log, "--format", "quakeml")
    path = tmp_path / "default.xml"
    path.write_text(text)
    events = obspy.read_events(str(path))
    assert len(events) == len(catalogue)
    assert len({event.resource_id.id for event in events}) == len(events)
    for event, row in zip(events, catalogue.itertuples(), strict=True):
        origin, magnitude = event.preferred_origin(), event.preferred_magnitude()
        # ObsPy rounds times to microseconds.
        assert abs(round(row.onset_s * 1e9) - origin.time.ns) <= 500
        assert np.radians(origin.longitude) * 6_371_000 == pytest.approx(row.x_m, rel=1e-9, abs=1e-15)
        assert (magnitude.mag, magnitude.magnitude_type) == (row.magnitude, "Mw")
        tensor = event.preferred_focal_mechanism().moment_tensor
        assert tensor.scalar_moment == row.moment_n_m
        comments = event.preferred_focal_mechanism().comments
        assert len(comments) == (not np.isnan(row.stress_drop_pa))
        assert all(f": mean {float(row.stress_drop_pa)!r} Pa, " in comment.text for comment in comments)
        assert tensor.source_time_function.duration == row.duration_s


def test_seismostats_reads_the_table_and_finds_the_same_b(command: Command, tmp_path: Path) -> None:
    # A load on the far end: hundreds of ruptures of many sizes.
    log = tmp_path / "many.mcap"
    command("--quiet", "run", "load-on-far-end", "--set", "parameter_set=as-coded", "--out", log)
    table = tmp_path / "many.csv"
    table.write_text(command("--quiet", "catalogue", log))
    catalogue = Catalog(pd.read_csv(table, parse_dates=["time"]))
    assert str(catalogue.time.dtype).startswith("datetime64")
    completeness = -6.9
    above = catalogue.magnitude[catalogue.magnitude > completeness].to_numpy()
    expected = ClassicBValueEstimator().calculate(above, mc=completeness, delta_m=0)
    said = command("catalogue", log, "--format", "statistics", "--completeness", str(completeness))
    error = expected / np.sqrt(len(above))
    assert f"b = {expected:.3f} ± {error:.3f} above -6.900, n = {len(above)} " in said
