"""Finds ruptures in exported switches by the definition of docs/ruptures.md, and compares them
with those that the log holds.

    ruptures.py TABLES

TABLES is what `asperity export RUN.mcap --to csv -o TABLES` has written. Knows that page and the
columns of docs/outputs.md, and nothing of how asperity finds ruptures: all detachments are at
hand, and those that are near enough are compared pair by pair. Prints how many ruptures there
are; exits with a traceback at the first that differs. Needs no packages.
"""

import collections
import csv
import fractions
import json
import math
import pathlib
import statistics
import sys

MOST_BLOCKS_OF_A_ROW = 256
MOST_PAIRS = 16 * MOST_BLOCKS_OF_A_ROW**2
# For what is summed or divided in an order that the page leaves open; for sums that may cancel.
TOLERANCE = 1e-12
TOLERANCE_OF_SPRINGS = 1e-9

ENERGIES = {
    "drive_work_j": "drive_work_j",
    "prestress_work_j": "prestress_work_j",
    "friction_heat_j": "friction_heat_j",
    "anchor_change_j": "anchor_change_j",
    "viscous_loss_j": "viscous_loss_j",
    "kinetic_change_j": "kinetic_j",
    "elastic_change_j": "elastic_j",
    "scheme_work_j": "scheme_work_j",
}


class Slide:
    """A block that slides: its detachment, and the switch back to stick, if there is one."""

    def __init__(self, detachment):
        self.step = int(detachment["step"])
        self.block = int(detachment["block"])
        self.detachment = detachment
        self.attachment = None

    def stop_step(self):
        return None if self.attachment is None else int(self.attachment["step"]) + 1


def rows(tables, topic):
    (path,) = tables.glob(f"*.{topic}.csv")
    with open(path, newline="") as file:
        return list(csv.DictReader(file))


def find_slides(switches):
    slides, sliding = [], {}
    for switch in switches:
        if switch["direction"] == "detach":
            slide = Slide(switch)
            assert slide.block not in sliding, switch
            sliding[slide.block] = slide
            slides.append(slide)
        else:
            sliding.pop(int(switch["block"])).attachment = switch
    return slides


def components(slides, step_s, link_s, neighbours):
    """The connected components of the graph of links, as lists of slides."""
    root = list(range(len(slides)))

    def find(i):
        while root[i] != i:
            root[i] = root[root[i]]
            i = root[i]
        return i

    of_block = collections.defaultdict(list)
    for i, slide in enumerate(slides):
        of_block[slide.block].append(i)
    for block, own in of_block.items():
        for other in neighbours(block):
            theirs, first = of_block.get(other, []), 0
            for i in own:
                step = slides[i].step
                while first < len(theirs) and (step - slides[theirs[first]].step) * step_s > link_s:
                    first += 1
                for j in theirs[first:]:
                    if (slides[j].step - step) * step_s > link_s:
                        break
                    root[find(i)] = find(j)
    found = collections.defaultdict(list)
    for i in range(len(slides)):
        found[find(i)].append(slides[i])
    return list(found.values())


def front_speed(passed, spacing):
    """The method of Theil and Sen over the blocks of one side: (row, distance from nucleation, time)."""
    of_row = collections.defaultdict(list)
    for row, distance, time in sorted(passed):
        of_row[row].append((distance, time))
    longest = max(map(len, of_row.values()))
    if longest < 4:
        return None
    most = next(n for n in range(MOST_BLOCKS_OF_A_ROW, 3, -1) if len(of_row) * n**2 <= MOST_PAIRS or n == 4)
    each = math.ceil(longest / most)
    slowness = []
    for times in of_row.values():
        times = [(distance, time) for distance, time in times if distance % each == 0]
        slowness += [(t - s) / (b - a) for i, (a, s) in enumerate(times) for b, t in times[i + 1:]]
    median = statistics.median(slowness)
    return spacing / median if median > 0 else None


def local_speed(around, step_s, spacing):
    """1 over the gradient of the plane of least squares, through column, row and step of the arrivals."""
    if len(around) < 6:
        return None
    mean = [fractions.Fraction(sum(values), len(around)) for values in zip(*around)]
    around = [[value - mean[axis] for axis, value in enumerate(arrival)] for arrival in around]
    xx, xy, yy, xt, yt = (
        sum(arrival[a] * arrival[b] for arrival in around) for a, b in ((0, 0), (0, 1), (1, 1), (0, 2), (1, 2))
    )
    gradient = ((xt * yy - yt * xy) / (xx * yy - xy * xy), (yt * xx - xt * xy) / (xx * yy - xy * xy))
    steps = math.hypot(*map(float, gradient))
    return spacing / (steps * step_s) if steps > 0 else None


class Run:
    def __init__(self, tables):
        (manifest,) = tables.glob("*.export.json")
        run = json.loads(manifest.read_text())["run"]
        self.blocks, self.step_s, scales = run["blocks"], run["time_step_s"], run["scales"]
        self.is_area = run.get("rows", 1) > 1
        self.columns = self.blocks // run.get("rows", 1)
        self.spacing_m = scales["block_length_m"]
        self.modulus_n_per_m = scales["modulus_n_per_m"]
        self.interfacial_stiffness_n_per_m = scales["interfacial_stiffness_n_per_m"]
        self.link_s = scales["link_time_ratio"] * scales["block_time_s"]
        self.last_step = json.loads(manifest.read_text())["log"]["last_step"]
        self.steps = {int(row["step"]): row for row in rows(tables, "step")}
        self.slides = find_slides(rows(tables, "switch"))
        self.states = collections.defaultdict(dict)
        for row in rows(tables, "fields"):
            self.states[int(row["step"])][int(row["block"])] = row

    def time_s(self, step):
        """The double nearest to the step's time: exact where a second is a whole number of steps."""
        rate = round(1 / self.step_s)
        return step / rate if abs(1 / self.step_s / rate - 1) < 1e-14 else step * self.step_s

    def place(self, block):
        """Column and row."""
        return (block - 1) % self.columns + 1, (block - 1) // self.columns + 1

    def around(self, block):
        """Itself and its neighbours."""
        column, row = self.place(block)
        near = ((column + i, row + j) for i in (-1, 0, 1) for j in (-1, 0, 1))
        rows = self.blocks // self.columns
        return [(j - 1) * self.columns + i for i, j in near if 1 <= i <= self.columns and 1 <= j <= rows]

    def later_around(self, block):
        """Itself and the neighbours of higher numbers, so that each pair is met once."""
        return [near for near in self.around(block) if near >= block]

    def force_n(self, switch):
        """The tangential force; over an area its size."""
        along_n = float(switch["tangential_force_n"])
        if not self.is_area:
            return along_n
        # Not by powers, which may be rounded otherwise.
        across_n = float(switch["tangential_force_across_n"])
        return math.sqrt(along_n * along_n + across_n * across_n)

    def shear_force_n(self, detachment, state):
        """The tangential force in a state; over an area along that at the detachment."""
        if not self.is_area:
            return float(state["tangential_force_n"])
        parts = ("tangential_force_n", "tangential_force_across_n")
        return sum(float(detachment[part]) * float(state[part]) for part in parts) / self.force_n(detachment)

    def slip_m(self, first, last, part=""):
        name = f"displacement{part}_m"
        return float(last.attachment[name]) - float(first.detachment[name])

    def ft_fn(self, step):
        return float(self.steps[step]["ft_fn"])

    def ruptures(self):
        # The first distance in steps that is more than t_link.
        beyond = int(self.link_s / self.step_s)
        while beyond * self.step_s <= self.link_s:
            beyond += 1
        while beyond > 1 and (beyond - 1) * self.step_s > self.link_s:
            beyond -= 1
        ruptures = []
        for slides in components(self.slides, self.step_s, self.link_s, self.later_around):
            nucleation = min((slide.step, slide.block) for slide in slides)
            stops = [slide.stop_step() for slide in slides]
            end_step = None if None in stops else max(stops)
            certain = max(max(slide.step for slide in slides) + beyond, max(end_step or 0, 1) - 1)
            is_open = end_step is None or certain > self.last_step
            ruptures.append((is_open, 0 if is_open else certain, nucleation, end_step, slides))
        ruptures.sort(key=lambda rupture: rupture[:3])
        spans = [(nucleation[0] + 1, math.inf if end is None else end) for _, _, nucleation, end, _ in ruptures]
        for number, (is_open, _, nucleation, end_step, slides) in enumerate(ruptures):
            overlapping = any(
                other != number and begin < spans[number][1] and spans[number][0] < end
                for other, (begin, end) in enumerate(spans)
            )
            yield self.rupture(number, is_open, nucleation, end_step, slides, overlapping)

    def anchor_change_j(self, slides):
        """What friction springs hold as they take hold, less what they lose as they let go."""
        def stretch_m2(switch):
            parts = ("", "_across") if self.is_area else ("",)
            return sum(
                (float(switch[f"displacement{part}_m"]) - float(switch[f"stick_position{part}_m"])) ** 2 for part in parts
            )

        held_m2 = sum(stretch_m2(slide.attachment) for slide in slides if slide.attachment is not None)
        lost_m2 = sum(stretch_m2(slide.detachment) for slide in slides)
        return 0.5 * self.interfacial_stiffness_n_per_m * (held_m2 - lost_m2)

    def rupture(self, number, is_open, nucleation, end_step, slides, overlapping):
        of_block = collections.defaultdict(list)
        for slide in slides:
            of_block[slide.block].append(slide)
        blocks = sorted(of_block)
        assert self.is_area or blocks == list(range(blocks[0], blocks[-1] + 1)), "a rupture has no holes"
        columns, across = ([self.place(block)[axis] for block in blocks] for axis in (0, 1))
        first = {block: min(of_block[block], key=lambda slide: slide.step) for block in blocks}
        last = {block: max(of_block[block], key=lambda slide: slide.step) for block in blocks}
        arrival_s = {block: self.time_s(first[block].step + 1) for block in blocks}
        has_stopped = end_step is not None
        # At the step in which the first block slides, and that in which none does any more.
        states = [self.states.get(step) for step in (nucleation[0] + 1, end_step)]
        has_states = None not in states and not overlapping and not is_open
        slips, drops, borne, force_drops = {}, {}, {}, {}
        for block in blocks:
            if (stop := last[block].attachment) is not None:
                slips[block] = self.slip_m(first[block], last[block])
                if self.is_area:
                    across_m = self.slip_m(first[block], last[block], "_across")
                    slips[block] = math.sqrt(slips[block] * slips[block] + across_m * across_m)
                slips[block] = abs(slips[block])
                direction = math.copysign(1.0, self.force_n(first[block].detachment))
                drops[block] = direction * (self.force_n(first[block].detachment) - self.force_n(stop))
            borne[block] = [None, None]
            if has_states:
                borne[block] = [self.shear_force_n(first[block].detachment, state[block]) for state in states]
                force_drops[block] = direction * (borne[block][0] - borne[block][1])
        before = [self.place(slide.block)[0] for slide in self.slides if slide.step < nucleation[0]]
        arrived = max(slide.step for slide in first.values())
        origin = nucleation[1]
        start = self.place(origin)[0]

        def passed(is_there):
            of_side = (block for block in blocks if is_there(self.place(block)[0]))
            return [(self.place(b)[1], abs(self.place(b)[0] - start), arrival_s[b]) for b in of_side]

        potency_m2 = sum(slips.values()) * self.spacing_m if has_stopped else None
        rupture = {
            "rupture": number,
            "onset_s": self.time_s(nucleation[0] + 1),
            "end_s": self.time_s(end_step) if has_stopped else None,
            "first_block": min(columns),
            "last_block": max(columns),
            "nucleation_block": origin,
            "reached_every_block": len(blocks) == self.blocks,
            "ft_fn_onset": self.ft_fn(nucleation[0]),
            "ft_fn_arrival": self.ft_fn(arrived),
            "ft_fn_end": self.ft_fn(end_step - 1) if has_stopped else None,
            "onset_step": nucleation[0] + 1,
            "arrival_s": self.time_s(arrived + 1),
            "end_step": end_step,
            "detachments": len(slides),
            "front_speed_up_m_per_s": front_speed(passed(lambda column: column >= start), self.spacing_m),
            "front_speed_down_m_per_s": front_speed(passed(lambda column: column <= start), self.spacing_m),
            "mean_slip_m": sum(slips.values()) / len(blocks) if has_stopped else None,
            "largest_slip_m": max(slips.values()) if has_stopped else None,
            "potency_m2": None if self.is_area else potency_m2,
            "moment_n_m": potency_m2 * self.modulus_n_per_m if has_stopped else None,
            "mean_strength_drop_n": sum(drops.values()) / len(blocks) if has_stopped else None,
            "farthest_block_before": max(before, default=None),
            "overlapping": overlapping,
            "open": is_open,
        }
        energies = dict(ENERGIES)
        # Of runs with radiation, or with an end that absorbs.
        if "radiated_j" in self.steps[nucleation[0]]:
            energies["radiated_j"] = "radiated_j"
        for name in energies:
            rupture[name] = None
        if self.steps[nucleation[0]].get("drive_work_j"):
            rupture["anchor_change_j"] = self.anchor_change_j(slides)
            if not overlapping and not is_open:
                before, after = ({name: float(value) for name, value in self.steps[step].items() if name.endswith("_j")}
                                 for step in (nucleation[0], end_step - 1))
                for name, total in energies.items():
                    if name != "anchor_change_j":
                        rupture[name] = after[total] - before[total]
                # What springs gain in the steps, and what the switches change of them.
                in_steps_j = (after["elastic_j"] - after["anchor_change_j"]) - (before["elastic_j"] - before["anchor_change_j"])
                rupture["elastic_change_j"] = in_steps_j + rupture["anchor_change_j"]
        size_m = sum(slips.values())
        weighted_n = sum(drop * slips[block] for block, drop in force_drops.items()) / size_m if has_states and size_m else None
        rupture |= {
            "mean_shear_force_drop_n": sum(force_drops.values()) / len(blocks) if has_states else None,
            "slip_weighted_shear_force_drop_n": weighted_n,
        }
        if "radiated_j" in rupture:
            rupture["radiated_j"] = rupture.pop("radiated_j")
        if self.is_area:
            rupture |= {
                "first_across": min(across),
                "last_across": max(across),
                "contacts": len(blocks),
                "potency_m3": potency_m2 * self.spacing_m if has_stopped else None,
            }
        arrivals = []
        for block in blocks:
            stop_step = last[block].stop_step()
            towards = block + (block < origin) - (block > origin)
            took_s = None if self.is_area else arrival_s[block] - arrival_s[towards]
            arrival = (
                {
                    "rupture": number,
                    "block": block,
                    "arrival_s": arrival_s[block],
                    "stop_s": None if stop_step is None else self.time_s(stop_step),
                    "arrival_step": first[block].step + 1,
                    "stop_step": stop_step,
                    "detachments": len(of_block[block]),
                    "slip_m": self.slip_m(first[block], last[block]) if stop_step else None,
                    "force_detach_n": self.force_n(first[block].detachment),
                    "force_attach_n": self.force_n(last[block].attachment) if stop_step else None,
                    "front_speed_m_per_s": self.spacing_m / took_s if took_s else None,
                    "force_before_n": borne[block][0],
                    "force_after_n": borne[block][1],
                }
            )
            if self.is_area:
                around = [near for near in self.around(block) if near in first]
                arrival |= {
                    "column": self.place(block)[0],
                    "across": self.place(block)[1],
                    "slip_across_m": self.slip_m(first[block], last[block], "_across") if stop_step else None,
                    "local_speed_m_per_s": local_speed(
                        [(*self.place(near), first[near].step) for near in around], self.step_s, self.spacing_m
                    ),
                }
            arrivals.append(arrival)
        return rupture, arrivals


# Sums and quotients, which are rounded in an order that the page leaves open.
ROUNDED = {
    "front_speed_up_m_per_s",
    "front_speed_down_m_per_s",
    "front_speed_m_per_s",
    "local_speed_m_per_s",
    "potency_m3",
    "mean_slip_m",
    "potency_m2",
    "moment_n_m",
    "mean_strength_drop_n",
    "force_before_n",
    "force_after_n",
}

SPRINGS = {"anchor_change_j", "elastic_change_j", "mean_shear_force_drop_n", "slip_weighted_shear_force_drop_n"}


def same(column, text, value):
    if value is None or text == "":
        return value is None and text == ""
    if isinstance(value, bool):
        return text == str(value).lower()
    if isinstance(value, int):
        return text == str(value)
    tolerance = TOLERANCE_OF_SPRINGS if column in SPRINGS else TOLERANCE if column in ROUNDED else 0.0
    return math.isclose(float(text), value, rel_tol=tolerance)


def compare(topic, logged, found):
    assert len(logged) == len(found), f"{topic}: {len(logged)} in the log, {len(found)} by the definition"
    for row, entry in zip(logged, found):
        assert list(row) == list(entry), f"{topic} has the columns {list(row)}"
        for column, value in entry.items():
            assert same(column, row[column], value), f"{topic}: {column} is {value}, in the log {row}"


def main(tables):
    found = list(Run(tables).ruptures())
    compare("/events/rupture", rows(tables, "events.rupture"), [rupture for rupture, _ in found])
    arrivals = [arrival for _, arrivals in found for arrival in arrivals]
    compare("/events/arrival", rows(tables, "events.arrival"), arrivals)
    ruptures = [rupture for rupture, _ in found]
    reached, growing = 0, 0
    for rupture in ruptures:
        if rupture["first_block"] == 1 and rupture["last_block"] > reached:
            reached = rupture["last_block"]
            growing += 1
    counts = {
        "ruptures": len(ruptures),
        "of_three_blocks": sum(r["last_block"] - r["first_block"] >= 2 for r in ruptures),
        "growing": growing,
        "global": sum(r["reached_every_block"] for r in ruptures),
        "overlapping": sum(r["overlapping"] for r in ruptures),
        "again": sum(r["detachments"] > r.get("contacts", r["last_block"] + 1 - r["first_block"]) for r in ruptures),
        "down": sum(r["nucleation_block"] > r["first_block"] for r in ruptures),
        "with_local_speeds": sum(a.get("local_speed_m_per_s") is not None for a in arrivals),
        "in_part_of_their_box": sum(
            r.get("contacts", 0)
            < (r["last_block"] + 1 - r["first_block"]) * (r.get("last_across", 0) + 1 - r.get("first_across", 1))
            for r in ruptures
        ),
        "open": sum(r["open"] for r in ruptures),
        "with_energies": sum(r["drive_work_j"] is not None for r in ruptures),
        "with_stress_drop": sum(r["mean_shear_force_drop_n"] is not None for r in ruptures),
    }
    print(json.dumps(counts))


if __name__ == "__main__":
    main(pathlib.Path(sys.argv[1]))
