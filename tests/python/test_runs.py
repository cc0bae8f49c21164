"""Runs of the package are those of the command, to the bit; and whatever ends them leaves a log to resume."""

import multiprocessing
import multiprocessing.pool
import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import asperity
import numpy as np
import polars as pl
import pytest
from conftest import ROOT, SMALL, Command, overrides

TOPICS = {
    "events.slip": "/events/slip",
    "events.onset": "/events/onset",
    "events.global": "/events/global",
    "events.rupture": "/events/rupture",
    "events.arrival": "/events/arrival",
    "step": "/step",
    "switch": "/switch",
    "fields": "/fields",
}

# Takes seconds: long enough to be broken off.
LONG = {"time.duration_s": 60.0}


def test_every_table_is_that_of_the_command(
    command: Command, default_log: Path, default_run: asperity.Run, tmp_path: Path
) -> None:
    command("--quiet", "export", default_log, "--to", "parquet", "--out", tmp_path)
    opened = asperity.open(default_log)
    for part, topic in TOPICS.items():
        exported = pl.read_parquet(tmp_path / f"default.{part}.parquet")
        assert exported.height > 0
        for run in (default_run, opened):
            found = pl.DataFrame(run.table(topic))
            assert found.schema == exported.schema
            assert found.equals(exported), topic


def test_a_log_has_the_digest_of_the_command(default_log: Path, tmp_path: Path) -> None:
    log = tmp_path / "mine.mcap"
    run = asperity.run("default", log=log)
    assert run.digest == asperity.open(log).digest == asperity.open(default_log).digest
    assert run.verdict == "whole" and run.check(again=True).is_complete
    assert not asperity.diff(run, default_log)


def test_the_summary_is_that_of_the_command(command: Command, default_log: Path, default_run: asperity.Run) -> None:
    import json

    theirs = json.loads(command("summary", default_log, "--format", "json"))
    assert theirs.pop("convergence")["precursor_count"] == "one draw"
    for run in (default_run, asperity.open(default_log)):
        assert dict(run.summary) == theirs
    assert default_run.summary.precursor_count == theirs["precursor_count"] > 10
    assert default_run.summary.unit("front_speed_m_per_s") == "m/s"
    assert "precursor" in default_run.summary.about("precursor_count")
    for run in (default_run, asperity.open(default_log)):
        assert len(run.precursors) == theirs["precursor_count"]
        assert run.precursors["last_block"].max() / 100 == theirs["longest_precursor_ratio"]
    with pytest.raises(AttributeError, match="precursor_count"):
        default_run.summary.precursors


def test_other_rules_find_the_events_of_a_replay(
    command: Command, default_log: Path, default_run: asperity.Run, tmp_path: Path
) -> None:
    rules = tmp_path / "rules.toml"
    rules.write_text("link_time_ratio = 30.0\n")
    command("--quiet", "replay", default_log, "--detectors", rules, "--out", tmp_path / "replayed")
    theirs = pl.read_csv(tmp_path / "replayed/default.ruptures.csv", infer_schema_length=None)
    for run in (default_run, asperity.open(default_log)):
        events = run.detect(link_time_ratio=30)
        assert events.ruptures["onset_s"].tolist() == theirs["onset_s"].to_list()
        assert len(events.ruptures) > len(run.ruptures)
        assert len(events.events) == len(run.events)
    with pytest.raises(asperity.Refused, match="link_time_ratio = 0 .accepted: a number above 0"):
        default_run.detect(link_time_ratio=0)


def run_in(folder: Path, code: str) -> "subprocess.Popen[bytes]":
    """Starts another interpreter in a folder."""
    return subprocess.Popen([sys.executable, "-c", code], cwd=folder, stderr=subprocess.PIPE)


def wait_for_checkpoint(folder: Path) -> None:
    """Waits until the run can be resumed: its first checkpoint is written after a second."""
    partial = folder / "long.mcap.partial"
    while not partial.exists() or b'"pace"' not in partial.read_bytes():
        assert not (folder / "long.mcap").exists(), "the run is over"
        time.sleep(0.02)
    time.sleep(0.3)


BEGIN = f"import asperity; asperity.run(asperity.Scenario('default', {LONG!r}), log='long.mcap')"


@pytest.fixture(scope="module")
def unbroken(tmp_path_factory: pytest.TempPathFactory) -> asperity.Run:
    log = tmp_path_factory.mktemp("unbroken") / "long.mcap"
    return asperity.run(asperity.Scenario("default", LONG), log=log)


def test_a_killed_interpreter_leaves_a_log_that_resumes(unbroken: asperity.Run, tmp_path: Path) -> None:
    process = run_in(tmp_path, BEGIN)
    wait_for_checkpoint(tmp_path)
    process.kill()
    process.wait()
    assert not (tmp_path / "long.mcap").exists()
    left = asperity.open(tmp_path / "long.mcap.partial")
    assert left.verdict == "incomplete" and left.notes
    resumed = asperity.resume(tmp_path / "long.mcap")
    assert any("resumes" in note for note in resumed.notes)
    assert resumed.digest == unbroken.digest


def test_ctrl_c_raises_keyboard_interrupt_and_the_log_resumes(unbroken: asperity.Run, tmp_path: Path) -> None:
    process = run_in(tmp_path, BEGIN)
    wait_for_checkpoint(tmp_path)
    process.send_signal(signal.SIGINT)
    _, said = process.communicate(timeout=60)
    assert b"KeyboardInterrupt" in said
    resumed = asperity.resume(tmp_path / "long.mcap")
    assert resumed.digest == unbroken.digest


def test_ctrl_c_ends_a_run_whose_next_record_is_far_away(tmp_path: Path) -> None:
    rare = {"drive.velocity_m_per_s": 1e-9, "time.duration_s": 1000, "recording.sample_s": 0, "recording.fields_s": 0}
    code = f"import asperity; asperity.run('chain-junctions', {rare}, log='rare.mcap')"
    process = run_in(tmp_path, code)
    while not (tmp_path / "rare.mcap.partial").exists():
        time.sleep(0.02)
    process.send_signal(signal.SIGINT)
    _, said = process.communicate(timeout=30)
    assert b"KeyboardInterrupt" in said
    assert asperity.open(tmp_path / "rare.mcap.partial").verdict == "incomplete"


@pytest.mark.parametrize("call", ["run('default', detectors=Endless())", "open('a.mcap').detect(Endless())"])
def test_ctrl_c_ends_a_detector_that_does_not(call: str, tmp_path: Path) -> None:
    asperity.run(asperity.Scenario("default", SMALL), log=tmp_path / "a.mcap")
    code = f"""
import asperity
class Endless:
    def observe(self, record):
        open('begun', 'w')
        while True:
            pass
asperity.{call}
"""
    process = run_in(tmp_path, code)
    while not (tmp_path / "begun").exists():
        time.sleep(0.02)
    process.send_signal(signal.SIGINT)
    _, said = process.communicate(timeout=60)
    assert said.rstrip().endswith(b"KeyboardInterrupt")


@pytest.mark.parametrize("bytes_left", [0, 8, 300, 20_000, 40_000])
def test_a_log_that_was_cut_in_its_beginning_is_begun_again(bytes_left: int, tmp_path: Path) -> None:
    log = tmp_path / "a.mcap"
    scenario = asperity.Scenario("ten-blocks", {"time.step_s": 1e-6, "time.duration_s": 0.5})
    whole = asperity.run(scenario, log=log, solver="plain")
    partial = tmp_path / "a.mcap.partial"
    log.rename(partial)
    assert partial.read_bytes().index(b"scenario.toml") + len(scenario.toml) in range(20_000, 40_000)
    os.truncate(partial, bytes_left)
    if bytes_left > 20_000:
        with pytest.raises(asperity.Refused, match="unfinished run .accepted: asperity.resume"):
            asperity.run(scenario, log=log)
        assert asperity.resume(log).digest == whole.digest
    else:
        with pytest.raises(asperity.Refused, match="ends before its scenario .accepted: asperity.run.SCENARIO, log="):
            asperity.resume(log)
        assert asperity.run(scenario, log=log, solver="plain").digest == whole.digest


@pytest.mark.parametrize("late", ["observe", "finish", "progress"])
def test_an_exception_leaves_a_log_that_resumes(late: str, tmp_path: Path) -> None:
    class Late:
        def observe(self, record: asperity.StepRecord) -> None:
            assert late != "observe"

        def finish(self) -> None:
            assert late != "finish"

    def progress(done: int, total: int) -> None:
        assert late != "progress" or done < total

    log = tmp_path / "a.mcap"
    with pytest.raises(AssertionError):
        asperity.run(asperity.Scenario("default", SMALL), log=log, detectors=Late(), progress=progress)
    assert asperity.resume(log).digest == asperity.run(asperity.Scenario("default", SMALL), log=tmp_path / "b.mcap").digest


def test_a_forked_process_does_not_keep_a_log(tmp_path: Path) -> None:
    log, begun, over = tmp_path / "a.mcap", threading.Event(), threading.Event()

    class Begun:
        def observe(self, record: asperity.StepRecord) -> None:
            begun.set()

    def make() -> None:
        with pytest.raises(asperity.Interrupted):
            asperity.run(asperity.Scenario("default", LONG), log=log, detectors=Begun(), stop=over.is_set)

    thread = threading.Thread(target=make)
    thread.start()
    begun.wait()
    child = os.fork()
    if child == 0:
        time.sleep(600)
        os._exit(0)
    over.set()
    thread.join()
    try:
        with pytest.raises(asperity.Interrupted):
            asperity.resume(log, stop=lambda: True)
    finally:
        os.kill(child, signal.SIGKILL)
        os.waitpid(child, 0)


def test_stop_ends_a_run_and_resume_continues_it(unbroken: asperity.Run, tmp_path: Path) -> None:
    log = tmp_path / "long.mcap"
    begun = time.monotonic()
    with pytest.raises(asperity.Interrupted) as raised:
        asperity.run(unbroken.scenario, log=log, stop=lambda: time.monotonic() > begun + 0.5)
    assert raised.value.log == tmp_path / "long.mcap.partial"
    with pytest.raises(asperity.Refused, match="unfinished run .accepted: asperity.resume"):
        asperity.run(unbroken.scenario, log=log)
    assert asperity.resume(log).digest == unbroken.digest


def test_progress_reaches_the_end_and_may_stop_the_run(tmp_path: Path) -> None:
    calls: list[tuple[int, int]] = []
    asperity.run(asperity.Scenario("default", {"time.duration_s": 20.0}), progress=lambda *call: calls.append(call))
    assert calls[-1][0] == calls[-1][1] == 2_000_000_000
    assert calls == sorted(calls)

    def fail(done: int, total: int) -> None:
        raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        asperity.run(asperity.Scenario("default", {"time.duration_s": 20.0}), progress=fail, log=tmp_path / "a.mcap")


def test_two_threads_run_at_once_and_others_go_on(default_run: asperity.Run) -> None:
    found: list[asperity.Run] = []
    threads = [threading.Thread(target=lambda: found.append(asperity.run("default"))) for _ in range(2)]
    for thread in threads:
        thread.start()
    turns = 0
    while any(thread.is_alive() for thread in threads):
        turns += 1
    assert turns > 1000, "the interpreter stood still"
    expected = pl.DataFrame(default_run.events)
    assert len(found) == 2 and all(pl.DataFrame(run.events).equals(expected) for run in found)


@pytest.mark.parametrize("call", ["initial", "plan", "html"])
def test_others_go_on_while_a_scenario_is_resolved(call: str, unbroken: asperity.Run) -> None:
    sheet = asperity.Scenario("sheet", slider={"blocks": 300, "across": 300, "width_m": 0.1}, time={"step_s": 1e-8})
    beats, over = [time.monotonic()], threading.Event()

    def beat() -> None:
        while not over.wait(0.005):
            beats.append(time.monotonic())

    thread = threading.Thread(target=beat)
    thread.start()
    match call:
        case "initial":
            asperity.Scenario("default", {"initial.from": str(unbroken.log), "time.duration_s": 61.0})
        case "plan":
            assert sheet.plan
        case _:
            assert sheet.replace({"name": "other"})._repr_html_()
    beats.append(time.monotonic())
    over.set()
    thread.join()
    pauses = [later - earlier for earlier, later in zip(beats, beats[1:])]
    # A call this short makes no one wait.
    assert sum(pauses) < 0.1 or max(pauses) < sum(pauses) / 2, "the interpreter stood still"


def small_events(_: int) -> asperity.Table:
    return asperity.run(asperity.Scenario("default", SMALL)).events


def small_run(_: int) -> asperity.Run:
    return asperity.run(asperity.Scenario("default", SMALL))


def no_log(_: int) -> asperity.Run:
    return asperity.open(__file__)


@pytest.mark.parametrize("method", ["fork", "spawn", "forkserver"])
def test_worker_processes_run(method: str) -> None:
    expected = pl.DataFrame(small_events(0))
    with multiprocessing.get_context(method).Pool(2) as pool:
        assert all(pl.DataFrame(events).equals(expected) for events in pool.map(small_events, range(4)))
        with pytest.raises(multiprocessing.pool.MaybeEncodingError, match="a run is not pickled .accepted: its tables"):
            pool.map(small_run, [0])
        with pytest.raises(asperity.LogError) as raised:
            pool.map_async(no_log, [0]).get(timeout=60)
        assert raised.value.verdict == "not a run log"


def test_two_runs_on_one_log(tmp_path: Path) -> None:
    log = tmp_path / "long.mcap"
    process = run_in(tmp_path, BEGIN)
    begun = tmp_path / "long.mcap.partial"
    # An empty one may not be locked yet.
    while not begun.exists() or begun.stat().st_size == 0:
        time.sleep(0.02)
    with pytest.raises(asperity.Error):
        asperity.run(asperity.Scenario("default", SMALL), log=log)
    with pytest.raises(asperity.Error):
        asperity.resume(log)
    process.kill()
    process.wait()


def test_a_log_removed_or_replaced_under_a_run(tmp_path: Path) -> None:
    log = tmp_path / "a.mcap"
    run = asperity.run(asperity.Scenario("default", SMALL), log=log)
    assert len(run.loads) > 0
    log.unlink()
    assert len(run.loads) > 0 and len(run.events) > 0
    with pytest.raises(asperity.LogError, match="there is no such file"):
        run.switches
    asperity.run(asperity.Scenario("default", SMALL, slider={"blocks": 10}), log=log)
    for ask in (
        lambda: run.switches,
        lambda: run.field(rupture=1),
        lambda: run.detect(),
        lambda: run.check(),
        lambda: run.draw("load"),
        lambda: asperity.diff(run, log),
    ):
        with pytest.raises(asperity.Error, match="another run now"):
            ask()


def test_a_log_stays_where_it_is_when_the_folder_changes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    runs = [asperity.run(asperity.Scenario("default", SMALL), log="a.mcap"), asperity.open("a.mcap")]
    monkeypatch.chdir("/")
    assert all(len(run.loads) > 0 and run.log == tmp_path / "a.mcap" for run in runs)


def test_what_is_whole_resumes_with_its_detectors_and_what_is_cut_is_refused(
    default_log: Path, tmp_path: Path
) -> None:
    class Steps:
        def observe(self, record: asperity.StepRecord) -> dict[str, int]:
            return {"step": record.step}

    log = tmp_path / "a.mcap"
    run = asperity.run(asperity.Scenario("default", SMALL), log=log, detectors=[Steps()])
    assert len(asperity.resume(log, detectors=Steps()).found["Steps"]) == len(run.found["Steps"]) > 0
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(default_log.read_bytes()[: default_log.stat().st_size // 2])
    with pytest.raises(asperity.LogError, match="only a log with the ending .partial resumes"):
        asperity.resume(cut)


@pytest.mark.parametrize("call", ["check", "diff", "field"])
def test_a_signal_ends_what_takes_long(call: str, unbroken: asperity.Run) -> None:
    work = {
        "check": "run.check(again=True)",
        "diff": "asperity.diff(run, run)",
        "field": "asperity.run(run.scenario.replace({'time.duration_s': 900.0})).field(t=(800.0, 800.1))",
    }[call]
    code = f"import asperity; run = asperity.open({str(unbroken.log)!r}); print('begun', flush=True); {work}; print('over')"
    process = subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    assert process.stdout is not None and process.stdout.readline() == b"begun\n"
    time.sleep(0.2)
    process.send_signal(signal.SIGINT)
    said = process.communicate(timeout=120)
    assert b"KeyboardInterrupt" in said[1] and b"over" not in said[0]


def test_values_that_are_no_values() -> None:
    nested: list[object] = []
    nested.append(nested)
    for value in ["\ud800", nested, {}, [[[[[[[[[[1]]]]]]]]]], b"x", 10**30, float("inf")]:
        with pytest.raises((TypeError, ValueError, UnicodeEncodeError)):
            asperity.Scenario("default", {"friction.static_coefficient": value})
        with pytest.raises((TypeError, ValueError, UnicodeEncodeError)):
            asperity.sweep("ten-blocks", {"friction.static_coefficient": [value]})


def test_scenarios_are_values(tmp_path: Path) -> None:
    import copy
    import pickle
    from types import MappingProxyType

    scenario = asperity.Scenario("default", MappingProxyType({"slider.blocks": 20}), time={"duration_s": 0.5})
    for other in (pickle.loads(pickle.dumps(scenario)), copy.copy(scenario), asperity.Scenario(scenario)):
        assert other == scenario and other.hash == scenario.hash
    assert "slider.blocks" in scenario and "slider.blokcs" not in scenario
    swept = asperity.sweep(scenario, {"friction.spread_seed": [1, 2]}, set={"friction.static_spread": 0.1}, keep="events")
    assert pl.DataFrame(swept.runs)["blocks"].to_list() == [20, 20]
    for arguments, says in [
        ({"keep": ["evnts"]}, "keep = .evnts. is not accepted; did you mean events. .accepted: events"),
        ({"jobs": 0}, "jobs = 0 .accepted: a whole number from 1"),
    ]:
        with pytest.raises(asperity.Refused, match=says):
            asperity.sweep("ten-blocks", {"friction.spread_seed": [1]}, **arguments)  # type: ignore[arg-type]
    with pytest.raises(asperity.Refused, match="/fields has more than 10000000 rows, too many for memory"):
        asperity.run("default", {"recording.fields_s": 1e-7, "time.duration_s": 0.02}).states


def test_foreign_and_damaged_files(tmp_path: Path) -> None:
    from importlib.metadata import version

    assert version("asperity")
    text = tmp_path / "text.mcap"
    text.write_text("no log")
    with pytest.raises(asperity.LogError) as raised:
        asperity.open(text)
    assert raised.value.verdict == "not a run log" and str(text) in str(raised.value)
    with pytest.raises(FileNotFoundError, match="none.mcap"):
        asperity.open(tmp_path / "none.mcap")
    log = tmp_path / "a.mcap"
    asperity.run(asperity.Scenario("default", SMALL), log=log)
    hurt = bytearray(log.read_bytes())
    hurt[len(hurt) // 2] ^= 1
    log.write_bytes(hurt)
    with pytest.raises(asperity.LogError) as raised:
        asperity.open(log)
    assert raised.value.verdict == "damaged"


def test_misuse_is_refused_with_what_is_accepted(default_run: asperity.Run, tmp_path: Path) -> None:
    with pytest.raises(asperity.ScenarioError) as raised:
        asperity.Scenario("default", friction={"static_coefficent": 0.5}, time={"step_s": -1.0})
    faults = {fault["key"]: fault for fault in raised.value.faults}
    assert "did you mean friction.static_coefficient" in faults["friction.static_coefficent"]["problem"]
    assert "above 0" in (faults["time.step_s"]["accepted"] or "")
    assert faults["time.step_s"]["place"] == "given"
    with pytest.raises(asperity.ScenarioError, match="did you mean"):
        asperity.Scenario("defualt")
    with pytest.raises(TypeError, match="time.step_s = .*accepted: a number, a text"):
        asperity.Scenario("default", {"time.step_s": object()})
    with pytest.raises(asperity.Refused, match="time.step_s = nan .accepted: a finite number"):
        asperity.Scenario("default", {"time.step_s": float("nan")})
    with pytest.raises(asperity.Refused, match='"fast", "plain"'):
        asperity.run("default", solver="quick")  # type: ignore[arg-type]
    with pytest.raises(TypeError):
        asperity.run(7)  # type: ignore[arg-type]
    with pytest.raises(KeyError, match="did you mean onset_s"):
        default_run.events["onset"]
    with pytest.raises(asperity.Refused, match="displacement, velocity, tangential_force"):
        default_run.field("speed", rupture=1)  # type: ignore[arg-type]
    with pytest.raises(asperity.Refused, match="rupture = 100000 .accepted: 0 to"):
        default_run.field(rupture=100_000)
    with pytest.raises(asperity.Refused, match="accepted: a range in 0 to 5 s"):
        default_run.field(t=(4.0, 6.0), every=1e-3)
    with pytest.raises(asperity.Refused, match="GB .accepted: at most"):
        default_run.field(t=(0.0, 5.0), every=1e-8)
    with pytest.raises(asperity.Refused, match="has no log"):
        default_run.check()
    with pytest.raises(asperity.Refused, match="accepted: a run of a slab"):
        default_run.nodes(0.0)
    with pytest.raises(asperity.Refused, match="no kind of figure; did you mean lengths"):
        default_run.draw("lenghts")
    with pytest.raises(TypeError, match="name = None .accepted: a number, a text"):
        asperity.Scenario("default", {"name": None})
    for rules, says in [({"min_blocks": 2**62}, "from 1 to 4294967295"), ({"link_time_ratio": float("nan")}, "above 0")]:
        with pytest.raises(asperity.Refused, match=f"{next(iter(rules))} = .*{says}"):
            default_run.detect(**rules)  # type: ignore[arg-type]
    for name in ("x.h5", "x.mcap.partial", "x.mcap.resumed"):
        with pytest.raises(asperity.Refused, match=f"{name}: the output is a run log .accepted: .*/x.mcap"):
            asperity.run("default", log=tmp_path / name)
    taken = tmp_path / "taken.mcap"
    taken.write_text("mine")
    with pytest.raises(asperity.Refused, match="exists already"):
        asperity.run("default", log=taken)
    assert taken.read_text() == "mine"


def test_names_are_any_text_and_paths_any_bytes(tmp_path: Path) -> None:
    name = "<img src=x onerror=alert(1)>\x7f"
    scenario = asperity.Scenario("default", {**SMALL, "name": name})
    assert scenario.name == name

    class Tag:
        def observe(self, record: asperity.StepRecord) -> dict[str, object]:
            return {"<img>": "<img>"}

    log = Path(os.fsdecode(os.fsencode(tmp_path) + b"/<img>\xff.mcap"))
    with pytest.raises(asperity.Interrupted) as raised:
        asperity.run(scenario.replace(LONG), log=log, stop=lambda: True)
    assert raised.value.log is not None and raised.value.log.exists()
    raised.value.log.unlink()
    run = asperity.run(scenario, log=log, detectors=Tag())
    log.rename(f"{log}.partial")
    assert asperity.resume(f"{log}.partial").log == log
    for shown in (run, asperity.open(log), run.found["Tag"], scenario, run.summary):
        assert "<img" not in shown._repr_html_()
    assert "<img" not in run.draw("load", title=name).svg
    with pytest.raises(asperity.Refused, match="accepted: a path in UTF-8"):
        asperity.sweep(os.fsdecode(b"\xfe.toml"), {"friction.spread_seed": [1]})


def test_nothing_prints(tmp_path: Path) -> None:
    code = "import asperity as a; r = a.run(log='a.mcap'); a.open('a.mcap').draw(); r.field(rupture=3); r.check()"
    process = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, check=True)
    assert (process.stdout, process.stderr) == (b"", b"")


def test_the_scenario_of_a_run_comes_back(default_log: Path) -> None:
    opened = asperity.open(default_log)
    assert opened.scenario == asperity.Scenario("default") and opened.scenario.hash
    changed = opened.scenario.replace({"friction.static_coefficient": np.float64(0.6)}, slider={"blocks": np.int64(50)})
    assert changed["friction.static_coefficient"] == 0.6 and changed["slider.blocks"] == 50
    assert changed != opened.scenario
    assert asperity.Scenario("slab").plan.wave_speed_m_per_s > 0
    assert "<svg" in changed._repr_html_()


def test_a_sweep_has_the_tables_of_the_command(command: Command, tmp_path: Path) -> None:
    study = tmp_path / "tilts.toml"
    study.write_text(
        'title = "Tilts"\nscenario = "ten-blocks"\nset = ["time.duration_s=1", "friction.static_spread=0.05"]\n'
        '[[axis]]\nkey = "normal_load.tilt"\nvalues = [0.0, 0.5]\n[[axis]]\nkey = "friction.spread_seed"\nvalues = [1, 2, 3]\n'
    )
    command("--quiet", "sweep", "go", study, "--out", tmp_path / "theirs", "--to", "parquet")
    mine = asperity.sweep(study, out=tmp_path / "mine")
    axes = {"normal_load.tilt": [0.0, 0.5], "friction.spread_seed": range(1, 4)}
    given = asperity.sweep("ten-blocks", axes, set={"time.duration_s": 1, "friction.static_spread": 0.05})
    again = asperity.sweep(tmp_path / "theirs")
    tables = next((tmp_path / "theirs").glob("**/runs.parquet")).parent
    for name in ("runs", "events", "ruptures"):
        theirs = pl.read_parquet(tables / f"{name}.parquet")
        for sweep in (mine, given, again):
            assert pl.DataFrame(getattr(sweep, name)).equals(theirs), name
    assert mine.folder == tmp_path / "mine" and given.folder is None
    # What was begun here, the command completes, and the reverse.
    command("--quiet", "sweep", "status", tmp_path / "mine")
    with pytest.raises(asperity.Refused, match="plan of another study"):
        asperity.sweep("default", {"slider.blocks": [10, 11]}, out=tmp_path / "mine")
    with pytest.raises(asperity.Refused, match="did you mean friction.spread_seed"):
        asperity.sweep("ten-blocks", {"friction.spred_seed": [1]})


def test_a_study_is_reproduced_and_drawn(command: Command, tmp_path: Path) -> None:
    runs = '[[run]]\nname = "small"\nscenario = "ten-blocks"\nset = ["time.duration_s=0.7"]\n'
    pipeline = f'title = "Small"\n{runs}[[figure.load]]\nfile = "load.png"\nrun = "small"\nsliding = true\n'
    (tmp_path / "small.toml").write_text(pipeline)
    command("--quiet", "reproduce", tmp_path / "small.toml", "--out", tmp_path / "theirs")
    numbers = asperity.reproduce(pipeline, tmp_path / "mine", set={"time.duration_s": 0.7})
    assert numbers["small"].event_count > 0
    for name in ("tables/small.events.csv", "figures/load.png", "report.html"):
        assert (tmp_path / "mine" / name).is_file() == (tmp_path / "theirs" / name).is_file(), name
    events = "tables/small.events.csv"
    assert (tmp_path / "mine" / events).read_bytes() == (tmp_path / "theirs" / events).read_bytes()
    with pytest.raises(asperity.Interrupted, match="contains the runs so far"):
        asperity.reproduce(tmp_path / "small.toml", tmp_path / "none", stop=lambda: True)
    with pytest.raises(asperity.Refused, match="solver = .slow. .accepted"):
        asperity.reproduce(tmp_path / "small.toml", tmp_path / "none", solver="slow")  # type: ignore[arg-type]
    study = asperity.sweep("ten-blocks", {"normal_load.tilt": [0, 0.5]}, set={"time.duration_s": 0.5}, out=tmp_path / "tilts")
    with pytest.raises(asperity.Refused, match="asks for no figures"):
        study.draw()
    axis = '[[axis]]\nkey = "normal_load.tilt"\nvalues = [0, 0.5]\n'
    figure = '[[figure.family]]\nfile = "count.png"\nx = "normal_load.tilt"\ny = "event_count"\n'
    (tmp_path / "tilts.toml").write_text(f'title = "Tilts"\nscenario = "ten-blocks"\n{axis}{figure}')
    drawn = study.draw(tmp_path / "tilts.toml", out=tmp_path / "drawn")
    assert {path.name for path in drawn} == {"count.png", "count.svg", "count.pdf"} and all(path.is_file() for path in drawn)


def test_a_refinement_has_the_table_of_the_command(command: Command, tmp_path: Path) -> None:
    values = {"parameter_set": "as-stated", "time.duration_s": 1, "time.step_s": 1e-7}
    given = [word for key, value in values.items() for word in ("--set", f"{key}={value}")]
    command("--quiet", "refine", "ten-blocks", "--out", tmp_path / "theirs", *given)
    theirs = pl.read_parquet(tmp_path / "theirs/tables/refinement.parquet")
    mine = asperity.refine("ten-blocks", tmp_path / "mine", set=values)
    assert pl.DataFrame(mine).equals(theirs) and "of the mesh" in set(theirs["found"])
    assert (tmp_path / "mine/figures/refinement.png").is_file()
    # It goes on with the runs of the command; without a folder they are temporary.
    again = asperity.refine(asperity.Scenario("ten-blocks", values), tmp_path / "theirs", stop=lambda: True)
    assert pl.DataFrame(again).equals(theirs)
    with pytest.raises(asperity.Interrupted, match="contains the runs so far"):
        asperity.refine("ten-blocks", set=values, stop=lambda: True)
    with pytest.raises(asperity.Refused, match="a single block has no mesh"):
        asperity.refine("spring-slider")


def test_a_stopped_sweep_continues(tmp_path: Path) -> None:
    axes = {"friction.spread_seed": range(1, 201)}
    given = {"friction.static_spread": 0.05, "time.duration_s": 0.5}
    with pytest.raises(asperity.Interrupted, match="contains the runs so far"):
        asperity.sweep("ten-blocks", axes, set=given, out=tmp_path, stop=lambda: True)
    done = asperity.sweep("ten-blocks", axes, set=given, out=tmp_path)
    assert (done.runs["run"] == np.arange(1, 201)).all()
    assert set(pl.DataFrame(done.runs)["status"]) == {"done"}


def test_figures_are_those_of_the_command(command: Command, default_log: Path, tmp_path: Path) -> None:
    run = asperity.open(default_log)
    command("--quiet", "draw", default_log, "--kind", "lengths", "--out", tmp_path / "theirs.svg")
    saved = run.draw("lengths").save(tmp_path / "mine.svg")
    assert saved.read_bytes() == (tmp_path / "theirs.svg").read_bytes()
    with pytest.raises(asperity.Refused, match="png, .svg or .pdf"):
        run.draw("lengths").save(tmp_path / "mine.gif")
    assert len(asperity.figures()) > 20
    titled = run.draw("space-time", rupture=7, title="One rupture")
    assert "One rupture" in titled.svg and titled._repr_svg_() == titled.svg
    assert os.listdir(tmp_path).count("mine.svg") == 1


def test_the_wheel_serves_every_python_from_3_11_on() -> None:
    import asperity._native as native

    assert native.__file__ is not None and native.__file__.endswith("_native.abi3.so")
    from importlib.metadata import distribution

    wheel = distribution("asperity").read_text("WHEEL") or ""
    assert "Tag: cp311-abi3-linux_x86_64" in wheel


def test_the_stubs_are_those_of_the_module() -> None:
    for arguments in (["mypy.stubtest", "asperity"], ["mypy", "--strict", str(ROOT / "crates/python/python/asperity")]):
        checked = subprocess.run([sys.executable, "-m", *arguments], capture_output=True, text=True, check=False)
        assert checked.returncode == 0, checked.stdout + checked.stderr


def test_overrides_are_those_of_the_command(command: Command, tmp_path: Path) -> None:
    command("--quiet", "run", "default", *overrides(SMALL), "--out", tmp_path / "a.mcap")
    mine = asperity.run(asperity.Scenario("default", SMALL), log=tmp_path / "b.mcap")
    assert mine.digest == asperity.open(tmp_path / "a.mcap").digest
