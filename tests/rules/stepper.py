"""Computes the slip events of a scenario, step by step, from docs/rules.md alone.

usage: stepper.py SCENARIO.toml

The scenario is a resolved one, as `asperity scenario show RUN.mcap` prints it. The events are
printed as CSV; steps and blocks are exact, loads are what this machine's rounding makes of them.
"""

import math
import sys
import tomllib

import numpy as np

NEVER = 2**64


def sums(terms):
    """The sum from block 1 upwards."""
    return float(np.cumsum(terms)[-1])


def tilted(total, tilt, count):
    n = np.arange(1, count + 1, dtype=float)
    return total / count * (1.0 - (2.0 * n - count - 1.0) / max(count - 1.0, 1.0) * tilt)


def drawn(seed, stream, count, behind=0):
    """Numbers from -1 to 1: the output function of SplitMix64."""
    values = []
    for block in range(count):
        place = stream % 2 * 2**31 + behind + stream // 2 * 2**29 + block
        z = (seed * 2**32 + place + 1) * 0x9E3779B97F4A7C15 % 2**64
        z = (z ^ z >> 30) * 0xBF58476D1CE4E5B9 % 2**64
        z = (z ^ z >> 27) * 0x94D049BB133111EB % 2**64
        z ^= z >> 31
        values.append((z >> 11) / 2**52 - 1.0)
    return np.array(values)


def offsets(disorder, spacing, seed, stream, mean, spread, count):
    """What is drawn for a quantity."""
    word, length = disorder["distribution"], disorder["correlation_length_m"]
    even = drawn(seed, stream, count)
    size = (even + 1.0) / 2.0 + 2.0**-54
    normal = np.sqrt(-2.0 * np.log(size)) * np.cos(np.pi * drawn(seed, stream, count, 2**30))
    above = (1.0 - even) / 2.0
    if length:
        r = math.exp(-spacing / length)
        for n in range(1, count):
            normal[n] = r * normal[n - 1] + math.sqrt(1.0 - r * r) * normal[n]
        even = np.array([math.erf(g / math.sqrt(2.0)) for g in normal])
        above = np.array([math.erfc(g / math.sqrt(2.0)) / 2.0 for g in normal])
    if word == "uniform":
        return spread * even
    if word == "normal":
        return spread * normal
    if word == "lognormal":
        variance = math.log1p((spread / mean) ** 2)
        return mean * np.expm1(math.sqrt(variance) * normal - variance / 2.0)
    if word == "weibull":
        modulus = disorder["weibull_modulus"]
        g1, g2 = math.gamma(1.0 + 1.0 / modulus), math.gamma(1.0 + 2.0 / modulus)
        return spread * ((-np.log(above)) ** (1.0 / modulus) - g1) / math.sqrt(g2 - g1 * g1)
    return np.where(above < disorder["asperity_share"], spread, -spread)


def second_difference(y):
    """What is right of a block and what is left of it, each less the block's own."""
    right = np.zeros_like(y)
    left = np.zeros_like(y)
    right[:-1] = y[1:] - y[:-1]
    left[1:] = y[:-1] - y[1:]
    return left + right


class Slider:
    def __init__(self, scenario):
        self.scenario = scenario
        mass, damping = {"as-coded": (12.0, 10.0**0.5), "as-stated": (0.012, 0.1)}[
            scenario["parameter_set"]
        ]
        scenario["slider"].setdefault("mass_kg", mass)
        scenario["slider"].setdefault("relative_damping", damping)
        slider, friction = scenario["slider"], scenario["friction"]
        load, drive, time = scenario["normal_load"], scenario["drive"], scenario["time"]
        self.blocks = count = slider["blocks"]
        self.gaps = max(count - 1, 1)
        self.spacing = slider["length_m"] / self.gaps
        self.mass = slider["mass_kg"] / count
        self.k = (
            slider["youngs_modulus_pa"]
            * self.gaps
            * slider["width_m"]
            * slider["height_m"]
            / slider["length_m"]
        )
        self.eta = slider["relative_damping"] * np.sqrt(self.k * self.mass)
        self.springs = friction["law"] == "interfacial-springs"
        disorder = scenario["disorder"]
        kt = friction["interfacial_stiffness_ratio"] * self.k if self.springs else 0.0
        self.kt = kt * self.values(disorder, "stiffness", 2, 1.0)
        self.p = tilted(load["total_n"], load["tilt"], count)
        if disorder["load_spread"] or disorder["load_offsets"]:
            self.p = self.p * self.values(disorder, "load", 3, 1.0)
            self.p = self.p * (load["total_n"] / sums(self.p))
        self.static = self.values(friction, "static", 0, friction["static_coefficient"]) * self.p
        self.dynamic = self.values(friction, "dynamic", 1, friction["dynamic_coefficient"]) * self.p
        self.growth = friction["ageing_coefficient"] * self.p
        self.make_weakening(friction)
        self.dt = time["step_s"]
        self.steps = self.whole_steps(time["duration_s"])
        self.make_drive(drive)
        self.make_bonds(slider)
        prestress = scenario["prestress"]
        listed = np.zeros(count)
        listed[: len(prestress["profile"])] = prestress["profile"]
        first = np.zeros(count)
        first[0] = prestress["first_block_ratio"]
        rise = prestress["rise_ratio"] * (np.arange(count) / self.gaps)
        steps = np.zeros(count)
        for block, ratio in zip(prestress["from_blocks"], prestress["from_blocks_ratio"]):
            steps[int(block) - 1 :] = ratio
        self.prestress = (prestress["ratio"] + first + rise + steps + listed) * self.p
        self.ratios = self.by_block(prestress["course_s"], prestress["course_ratio"])
        self.borne = self.by_block(load["course_s"], load["course_factor"])
        # The course of the normal load.
        self.knots = [self.whole_steps(t) for t in load["schedule_s"]]
        self.factors = [total / load["total_n"] for total in load["schedule_n"]]
        self.from_hold = load["schedule_from"] == "hold"
        self.start()

    def make_weakening(self, friction):
        """The slip over which each block weakens, the corners of the fall, and what blocks remember."""
        self.weakening = np.full(self.blocks, friction.get("weakening_slip_m", 0.0))
        given = friction.get("weakening_slip_offsets_m", [])
        self.weakening[: len(given)] += given
        self.weakens = np.any(self.weakening > 0.0)
        points = zip(friction.get("weakening_fractions", []), friction.get("weakening_shares", []))
        self.corners = [(0.0, 1.0), *points, (1.0, 0.0)]
        self.memory = friction.get("slip_memory_s", 0.0)
        self.slid_from, self.slid_before, self.rested = np.zeros((3, self.blocks))

    def weakened(self, slip):
        """Friction after a slip, at the load of the start."""
        fall = self.static - self.dynamic
        friction = self.dynamic.copy()
        with np.errstate(divide="ignore", invalid="ignore"):
            x = slip / self.weakening
        if len(self.corners) == 2:
            return np.where(slip < self.weakening, self.static - fall * x, friction)
        for (x0, s0), (x1, s1) in zip(self.corners, self.corners[1:]):
            share = s0 + (s1 - s0) * ((x - x0) / (x1 - x0))
            friction = np.where((x0 <= x) & (x < x1), self.dynamic + fall * share, friction)
        return np.where(slip < self.weakening, friction, self.dynamic)

    def by_block(self, times, values):
        """The knots of a course of all blocks."""
        if not times:
            return []
        rows = np.array(values, dtype=float).reshape(len(times), -1)
        return [(self.whole_steps(t), np.ones(self.blocks) * row) for t, row in zip(times, rows)]

    @staticmethod
    def between(knots, step):
        """The value of a course in a step."""
        before = [knot for knot in knots if knot[0] <= step]
        after = [knot for knot in knots if knot[0] > step]
        if not before or not after:
            return before[-1][1] if before else knots[0][1]
        (t0, a), (t1, b) = before[-1], after[0]
        return a + (b - a) * ((step - t0) / (t1 - t0))

    def make_bonds(self, slider):
        """The bonds of the ends: block, other block or none for a wall, stiffness, damping, rest."""
        self.bonds = []
        ends = slider.get("left_end", "free"), slider.get("right_end", "free")
        if ends[0] == "periodic":
            self.bonds.append((self.blocks - 1, 0, self.k, self.eta))
            return
        for block, end in zip((0, self.blocks - 1), ends):
            if end == "clamped":
                self.bonds.append((block, None, self.k, self.eta))
            elif end == "absorbing":
                self.bonds.append((block, None, 0.0, np.sqrt(self.k * self.mass)))

    def more(self, bond, values):
        return values[bond[0]] - (0.0 if bond[1] is None else values[bond[1]])

    def pull_of_ends(self):
        pull = np.zeros(self.blocks)
        for bond, rest in zip(self.bonds, self.rests):
            b = -(bond[2] * (self.more(bond, self.u) - rest) + bond[3] * self.more(bond, self.v))
            pull[bond[0]] += b
            if bond[1] is not None:
                pull[bond[1]] -= b
        return pull

    def outside(self, step):
        """The forces on all blocks besides friction and springs."""
        force = self.prestress
        if self.ratios:
            force = force + self.between(self.ratios, step) * self.p
        return force

    def whole_steps(self, seconds):
        return round(seconds / self.dt)

    def time(self, step):
        # The double nearest to the product: 1/dt is a whole number for the steps of the tests.
        per_second = round(1.0 / self.dt)
        return step / per_second if 1.0 / per_second == self.dt else step * self.dt

    def values(self, table, kind, stream, mean):
        friction, count = self.scenario["friction"], self.blocks
        listed = np.zeros(count)
        given = table[f"{kind}_offsets"]
        listed[: len(given)] = given
        spread = table[f"{kind}_spread"]
        random = np.zeros(count)
        if spread:
            disorder, seed = self.scenario["disorder"], friction["spread_seed"]
            random = offsets(disorder, self.spacing, seed, stream, mean, spread, count)
            # Who does not want to draw reads them, to the last digit, in which two libraries of functions may differ.
            listed_draws = np.array(self.scenario["drawn"][f"{kind}_offsets"])
            is_exact = disorder["distribution"] == "uniform" and not disorder["correlation_length_m"]
            assert np.all(np.abs(random - listed_draws) <= (0.0 if is_exact else 1e-13))
            random = listed_draws
        values = mean + listed + random
        if kind == "static":
            values[[int(block) - 1 for block in friction["stuck_blocks"]]] = 1e6
        return values

    def make_drive(self, drive):
        count, whole = self.blocks, drive["stiffness_n_per_m"]
        self.direction = np.ones(count)
        self.stiffness = np.zeros(count)
        self.force = []
        if drive["kind"] == "force":
            self.force = list(zip([self.whole_steps(t) for t in drive["course_s"]], drive["course_n"]))
            self.direction[0] = 0.0
        elif drive["kind"] == "side":
            self.stiffness[0] = whole
        elif drive["kind"] == "left-right":
            self.stiffness[0] = self.stiffness[-1] = whole
            self.direction[0] = -1.0
        elif drive["decay_length_m"]:
            shares = np.exp(-(np.arange(count) * self.spacing) / drive["decay_length_m"])
            self.stiffness = whole * (shares / sums(shares))
        else:
            self.stiffness = tilted(whole, drive["tilt"], count)
        self.velocity = drive["velocity_m_per_s"]
        steps = [self.whole_steps(t) for t in drive["course_s"]]
        self.course = list(zip(steps, drive["course_m_per_s"])) if not self.force else []
        self.hold = self.whole_steps(drive["hold_from_s"]) or NEVER
        self.until = drive["until_load_ratio"]

    def point(self, step):
        step = min(step, self.hold)
        if not self.course and self.weakens:
            return self.velocity * (step * self.dt)
        if not self.course:
            return self.velocity * self.time(step)
        moved, since, velocity = 0.0, 0, self.velocity
        for knot, next_velocity in self.course:
            if knot > step:
                share = (step - since) / (knot - since)
                next_velocity, knot = velocity + (next_velocity - velocity) * share, step
            moved += (velocity + next_velocity) / 2.0 * (knot - since)
            since, velocity = knot, next_velocity
            if since == step:
                break
        return (moved + velocity * (step - since)) * self.dt

    def pull_of_drive(self, step, u):
        if self.force:
            pull = np.zeros(self.blocks)
            pull[0] = self.between(self.force, min(step, self.hold))
            return pull
        return self.stiffness * (self.direction * self.point(step) - u)

    def load_factor(self, step):
        if not self.knots:
            return 1.0
        if self.from_hold and self.hold == NEVER:
            return self.factors[0]
        at = max(step - (self.hold if self.from_hold else 0), 0)
        if at >= self.knots[-1]:
            return self.factors[-1]
        if at < self.knots[0]:
            return self.factors[0]
        i = max(j for j, knot in enumerate(self.knots) if knot <= at)
        (t0, t1), (f0, f1) = self.knots[i : i + 2], self.factors[i : i + 2]
        return f0 + (f1 - f0) * ((at - t0) / (t1 - t0))

    def start(self):
        count, shear = self.blocks, self.scenario["initial_shear"]
        slider = self.scenario["slider"]
        beta = shear["beta"] + 4.0 * shear["poisson_ratio"] * slider["height_m"] / slider["length_m"]
        length = self.spacing * self.gaps
        x = np.arange(count) * self.spacing
        tau0 = beta * self.p * (2.0 * x / length - 1.0)
        profile = np.zeros(count)
        profile[: len(shear["profile"])] = shear["profile"]
        tau0 = tau0 + profile * self.p
        u = np.zeros(count)
        for n in range(1, count):
            u[n] = (2.0 * u[n - 1] - u[n - 2] if n > 1 else 0.0) + tau0[n - 1] / self.k
        pull = second_difference(u) * self.k + self.pull_of_drive(0, u) + self.outside(0)
        self.u, self.anchor = u, u - pull / self.kt if self.springs else u.copy()
        self.rests = [self.more(bond, u) for bond in self.bonds]
        first = self.scenario["initial_velocity"]
        phase = np.pi * first["mode"] * (np.arange(count) + 0.5) / count
        self.v = first["amplitude_m_per_s"] * np.cos(phase)
        self.slides = np.zeros(count, dtype=bool)
        self.stuck_since = np.zeros(count)
        self.step = 0
        if self.scenario["time"]["start"] == "loaded":
            self.start_loaded()

    def start_loaded(self):
        count = self.blocks
        difference = np.array([second_difference(row) for row in np.eye(count)]).T
        matrix = -self.k * difference + np.diag(self.kt + self.stiffness)
        driven = self.stiffness * self.direction
        b = np.linalg.solve(matrix, driven * self.velocity * self.dt)
        lag = self.eta * second_difference(b / self.dt)
        c = np.linalg.solve(matrix, lag + self.kt * self.anchor + driven * self.point(1) + self.prestress)
        g, r = self.kt * (c - self.anchor), self.kt * b
        room = 0.999 * self.static
        if np.any(np.abs(g) >= room):
            return
        moving = r != 0.0
        least = np.min(((room - g * np.sign(r)) / np.abs(r))[moving])
        step = int(min(least, self.steps - 1, self.hold))
        if step > 0:
            self.step, self.u, self.v = step, c + step * b, b / self.dt

    def take_step(self):
        friction = self.scenario["friction"]
        self.step += 1
        factor = self.load_factor(self.step)
        pulls = self.pull_of_drive(self.step, self.u)
        total_factor, borne = factor, 1.0
        if self.borne:
            borne = self.between(self.borne, self.step)
            total_factor = factor * (sums(borne * self.p) / sums(self.p))
        u, v, slides = self.u, self.v, self.slides
        tau = second_difference(u) * self.k + second_difference(v) * self.eta
        tau = tau + ((self.outside(self.step) + pulls) + self.pull_of_ends())
        rubs, resists = factor * borne * self.dynamic, bool(friction.get("drag_at_rest"))
        if self.weakens:
            rubs = factor * self.weakened(self.slid_before + np.abs(u - self.slid_from))
            resists = resists | (self.weakening > 0.0)
        drag = rubs * np.sign(v)
        drag = np.where(resists & (v == 0.0), np.minimum(rubs, np.abs(tau)) * np.sign(tau), drag)
        if friction["law"] == "velocity-weakening":
            drag = drag / (1.0 + np.abs(v) * (1.0 / friction["weakening_velocity_m_per_s"]))
        drag = drag + friction["radiation_kg_per_s"] * v
        if self.springs:
            resistance = np.where(slides, drag, self.kt * (u - self.anchor))
        else:
            resistance = np.where(slides, drag, tau)
        new_v = v + (tau - resistance) * (self.dt / self.mass)
        new_u = u + new_v * self.dt
        threshold = self.static
        if friction["ageing_coefficient"]:
            waited = (self.step - self.stuck_since) * self.dt
            threshold = threshold + self.growth * np.log1p(waited / friction["ageing_time_s"])
        force = self.kt * (u - self.anchor) if friction.get("detach_by") == "spring" else tau
        if self.weakens:
            self.slid_before = np.where(~slides & (self.step >= self.rested), 0.0, self.slid_before)
            threshold = np.where(self.slid_before > 0.0, self.weakened(self.slid_before), self.static)
        detach = ~slides & (np.abs(force) >= factor * borne * threshold)
        if not self.springs:
            attach = slides & ((new_v * v < 0.0) | (resists & (new_v == 0.0)))
            new_v, new_u = np.where(attach, 0.0, new_v), np.where(attach, u, new_u)
        else:
            two_way = friction["reattach"] == "two-way"
            attach = slides & ((new_v * v <= 0.0) if two_way else (new_v <= 0.0))
            if attach.any():
                self.anchor = np.where(attach, new_u - tau / self.kt, self.anchor)
        self.stuck_since = np.where(attach, self.step, self.stuck_since)
        if self.weakens:
            slip = self.slid_before + np.abs(new_u - self.slid_from)
            self.slid_before = np.where(attach, slip if self.memory else 0.0, self.slid_before)
            self.rested = np.where(attach, self.step + round(self.memory / self.dt), self.rested)
            self.slid_from = np.where(detach, new_u, self.slid_from)
        self.slides = (slides | detach) & ~attach
        self.u, self.v = new_u, new_v
        total = sums(pulls)
        if self.until and self.hold == NEVER:
            if total >= self.until * (total_factor * self.scenario["normal_load"]["total_n"]):
                self.hold = self.step
        return total / (total_factor * self.scenario["normal_load"]["total_n"])

    def events(self):
        """One row per slip event: onset_step, end_step, first, last, slipped, most, load at onset."""
        current = None
        while self.step < self.steps:
            slid = self.slides
            ratio = self.take_step()
            if slid.any():
                if current is None:
                    current = {"onset": self.step, "slid": slid.copy(), "most": 0, "load": ratio}
                current["slid"] |= slid
                current["most"] = max(current["most"], int(slid.sum()))
            elif current is not None:
                yield current, self.step
                current = None
        if current is not None:
            yield current, None


def main():
    with open(sys.argv[1], encoding="utf-8") as file:
        text, mark, drawn_there = file.read().partition("# [drawn]")
    # Comments, since a scenario does not take them.
    listed = [line[2:] for line in drawn_there.splitlines() if "_offsets = [" in line]
    slider = Slider(tomllib.loads("\n".join([text, mark[2:], *listed])))
    print("onset_step,end_step,first_block,last_block,blocks_slipped,max_sliding,ft_fn_onset")
    for event, end in slider.events():
        blocks = np.flatnonzero(event["slid"]) + 1
        row = [event["onset"], "" if end is None else end, blocks[0], blocks[-1], len(blocks)]
        print(*row, event["most"], repr(float(event["load"])), sep=",")


main()
