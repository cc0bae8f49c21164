"""The cost of the package beside the command of the same wheel, as ratios within one run of this program.

    target/python/bin/python tests/python/bench.py [PAIRS]

Leave the machine idle meanwhile. CPU time is user and system; pairs are run in turn.
"""

import os
import resource
import statistics
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable
from pathlib import Path

import asperity

COMMAND = Path(sys.executable).with_name("asperity")
STUDY = """title = "bench"
scenario = "ten-blocks"
set = ["friction.static_spread=0.05"]
[[axis]]
key = "friction.spread_seed"
from = 1
to = 1000
count = 1000
"""


def measured(work: Callable[[], object]) -> tuple[float, float]:
    """Wall time and CPU time, also of processes that were waited for."""

    def cpu() -> float:
        whose = (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)
        return sum(usage.ru_utime + usage.ru_stime for usage in map(resource.getrusage, whose))

    begun, used = time.perf_counter(), cpu()
    work()
    return time.perf_counter() - begun, cpu() - used


def compare(what: str, pairs: int, theirs: Callable[[int], object], ours: Callable[[int], object]) -> None:
    """Prints the medians of the ratios of pairs."""
    ratios = []
    for pair in range(pairs):
        command = measured(lambda: theirs(pair))
        package = measured(lambda: ours(pair))
        ratios.append([mine / other for mine, other in zip(package, command, strict=True)])
    wall, cpu = (statistics.median(column) for column in zip(*ratios, strict=True))
    print(f"{what:50} wall {wall:.3f}, CPU {cpu:.3f} of the other's")


def call(*arguments: str | Path) -> None:
    subprocess.run([COMMAND, "--quiet", *arguments], check=True, stdout=subprocess.DEVNULL)


def main() -> None:
    pairs = int(sys.argv[1]) if len(sys.argv) > 1 else 20
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        study = folder / "study.toml"
        study.write_text(STUDY)
        compare(
            "default run with a log, to the command",
            pairs,
            lambda pair: call("run", "default", "--out", folder / f"command-{pair}.mcap"),
            lambda pair: asperity.run("default", log=folder / f"package-{pair}.mcap"),
        )
        compare(
            "study of 1,000 runs of ten blocks, to the command",
            max(pairs // 5, 1),
            lambda pair: call("sweep", "go", study, "--out", folder / f"command-{pair}", "--to", "csv"),
            lambda pair: asperity.sweep(study, out=folder / f"package-{pair}"),
        )

        def twice() -> None:
            threads = [threading.Thread(target=asperity.run) for _ in range(2)]
            for thread in threads:
                thread.start()
            for thread in threads:
                thread.join()

        compare("two runs in two threads, to one run", pairs, lambda _: asperity.run(), lambda _: twice())
    code = "import time; t = time.perf_counter(); import asperity; print(time.perf_counter() - t)"
    times = [float(subprocess.check_output([sys.executable, "-c", code], env=os.environ)) for _ in range(pairs)]
    print(f"{'import':50} {statistics.median(times):.3f} s")


if __name__ == "__main__":
    main()
