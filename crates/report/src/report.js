// The pair of a run: its load curve above, the space-time map of its ruptures below, and their table. A rupture picked in
// one is shown in all. The data of a run are read when it is looked at.
"use strict";
(() => {
  const { root, colour, repaints, lettered: html } = asperity;
  const canvas = document.getElementById("map");
  if (!canvas) return;
  const runs = new Map([...document.querySelectorAll("script.run")].map((one) => [one.dataset.run, one]));
  const byId = (id) => document.getElementById(id);
  const choice = byId("run"), box = byId("load"), said = byId("chosen"), least = byId("least");
  const toFront = byId("to-front"), answers = byId("answers");
  const inView = byId("in-view"), withEvents = byId("events"), kinds = [...document.querySelectorAll("input[data-kind]")];

  // A rupture is [number, onset, end, first, last, nucleation, kind, open, load at onset, load at end, speed of the front,
  // slip, front]; times are steps. A front is [arrivals, stops] of its blocks, counted from the onset; none if it is left
  // out, and empty where no row of the map is so fine.
  const NUMBER = 0, ONSET = 1, END = 2, FIRST = 3, LAST = 4, NUCLEATION = 5, KIND = 6, OPEN = 7, FROM = 8, TO = 9, SPEED = 10, SLIP = 11, FRONT = 12;
  const WORDS = ["rupture", "precursor", "global slip"];
  // In the order in which they are painted: kinds of ruptures upon slip events.
  const LOOKS = [
    { name: "event", colour: "open", dash: true },
    { name: "rupture", colour: "plain" },
    { name: "global", colour: "rust", hatch: "falling" },
    { name: "precursor", colour: "blue", hatch: "rising" },
  ];
  const LOOK_OF_KIND = [1, 3, 2];
  let run = null, ruptures = [], times = [], loads = [], chosen = -1, plot = null;
  const accepted = { kinds: new Set([0, 1, 2]), blocks: 1 };

  const seconds = (step) => step * run.dt;
  const onset = (k) => seconds(ruptures[k][ONSET]);
  // What is open lasted at least until the last step that went by.
  const end = (k) => seconds(ruptures[k][END] ?? run.last);
  const unit = () => run.unit ?? "s";
  // Where blocks are: x, in mm, on a fault line depth, in km; else their numbers.
  const at = (block) => (run.place ? digits(run.place[0] + (block - 1) * run.place[1], 5) : String(block));
  const between = (first, last, word) => (first === last ? at(first) : `${at(first)}${word}${at(last)}`);
  const span = (first, last) => (run.down ? `depth ${between(first, last, " to ")} km` : run.place ? `x = ${between(first, last, " to ")} mm` : `${places()} ${between(first, last, " to ")}`);
  const until = (t) => (t !== null ? `${time(seconds(t))} ${unit()}` : run.lacks ? "the last step of the log" : "the run's end");
  const blocks = (k) => ruptures[k][LAST] - ruptures[k][FIRST] + 1;
  const drop = (k) => (ruptures[k][TO] === null ? null : ruptures[k][FROM] - ruptures[k][TO]);
  const front = (k) => (ruptures[k][SPEED] === null || !run.c ? null : ruptures[k][SPEED] / run.c);
  const isShown = (k) => accepted.kinds.has(ruptures[k][KIND]) && blocks(k) >= accepted.blocks;
  const digits = (value, n) => (value === null ? null : Number(value.toPrecision(n)).toString());
  // To the step: with as many decimals as the length of a step has, as long as doubles have them.
  const time = (t) => {
    if (run.unit) return t.toFixed(6);
    const [digits, power] = run.dt.toExponential().split("e");
    return t.toFixed(Math.min(15, Math.max(0, digits.replace(".", "").length - 1 - Number(power))));
  };

  // Over an area, fronts are shown by the columns of contacts along the slider.
  const places = () => (run.rows ? "columns" : run.sensors ? "sensors" : "blocks");

  function words(k) {
    const r = ruptures[k], what = r[OPEN] ? `${WORDS[r[KIND]]}, open at the end of the run` : WORDS[r[KIND]];
    const parts = [
      `Rupture ${r[NUMBER]}, ${what}`,
      `${time(onset(k))} ${unit()} to ${until(r[END])}`,
      `${span(r[FIRST], r[LAST])}, first sliding at ${at(r[NUCLEATION])}${run.area ? `; ${run.area.slipped[k]} contacts` : ""}`,
      `F_T/F_N ${digits(r[FROM], 5)}${r[TO] === null ? "" : `, drop ${digits(drop(k) * 1e3, 3)} · 10⁻³`}`,
    ];
    if (front(k) !== null) parts.push(`front at ${digits(front(k), 4)} c`);
    if (!r[FRONT]) parts.push("its front is not on this page");
    if (r[SLIP] !== null) parts.push(run.down ? `mean slip ${digits(r[SLIP], 4)} m` : `mean slip ${digits(r[SLIP] * 1e6, 3)} µm`);
    return parts;
  }

  // How a front passed the blocks: edges of the blocks, and seconds.
  function passed(k) {
    const r = ruptures[k];
    if (!r[FRONT] || !r[FRONT][0].length) return null;
    const [arrivals, stops] = r[FRONT], stride = run.stride, lowest = 1 + Math.ceil((r[FIRST] - 1) / stride) * stride;
    const edges = arrivals.map((_, n) => (n ? lowest - 1 + n * stride : r[FIRST] - 1));
    return [[...edges, r[LAST]], arrivals.map((t) => seconds(r[ONSET] + t)), stops.map((t) => seconds(t === null ? run.last : r[ONSET] + t))];
  }
  function hasFrontsInView() {
    const [from, to] = map.view(), least = (to - from) * map.FRONT / Math.max(1, canvas.clientWidth - map.LEFT - map.RIGHT);
    return ruptures.some((r, k) => end(k) - onset(k) >= least && r[FRONT]?.[0].length && onset(k) <= to && end(k) >= from && isShown(k));
  }

  const map = asperity.map(canvas, {
    looks: LOOKS,
    legend: () => [
      { look: 2, text: `global slips (${ruptures.filter((r) => r[KIND] === 2).length})` },
      { look: 3, text: `precursors (${ruptures.filter((r) => r[KIND] === 1).length})` },
      { look: 1, text: "other ruptures" },
      ...(withEvents.checked ? [{ look: 0, text: "slip events" }] : []),
      ...(hasFrontsInView() ? [{ dash: [], text: "front arrives" }, { dash: [3, 2], text: "block stops" }] : []),
    ],
    words(_, k) {
      if (k < ruptures.length) return words(k).join("\n");
      const [from, to, first, last] = run.events[k - ruptures.length];
      return `slip event\n${time(seconds(from))} ${unit()} to ${until(to)}\n${span(first, last)}`;
    },
    pick: (_, k) => { if (k < ruptures.length) pick(k); },
    key: steer,
    seen(from, to) {
      if (plot && !isFollowing) follow(() => plot.setScale("x", { min: from, max: to }));
      if (inView.checked) filter();
    },
    over(pen, place) {
      // Where the picked one is, however thin.
      if (chosen < 0) return;
      const x = place.x((onset(chosen) + end(chosen)) / 2);
      if (x < place.left || x > place.left + place.across) return;
      pen.fillStyle = colour("ink");
      pen.beginPath(); pen.moveTo(x, place.tops[0] - 1); pen.lineTo(x - 5, place.tops[0] - 9); pen.lineTo(x + 5, place.tops[0] - 9); pen.fill();
    },
  });

  // Keys of curve, map and table.
  function steer(key) {
    if (key === "ArrowLeft" || key === "ArrowRight") return step(key === "ArrowLeft" ? -1 : 1);
    if (key === "Enter" && chosen >= 0) return zoomed();
    if (key === "Escape" && chosen >= 0) { pick(-1); return true; }
    return false;
  }
  // The picked rupture fills most of the map, so that its front is seen.
  function zoomed() {
    const margin = Math.max((end(chosen) - onset(chosen)) * .15, run.dt * 5);
    map.look(onset(chosen) - margin, end(chosen) + margin);
    return true;
  }
  // The next one that is shown, by onset; the first time, of those in view.
  function step(by) {
    const [from, to] = map.view();
    let k = chosen >= 0 ? chosen + by : by > 0 ? ruptures.findIndex((_, k) => onset(k) >= from) : ruptures.findLastIndex((_, k) => onset(k) <= to);
    while (k >= 0 && k < ruptures.length && !isShown(k)) k += by;
    if (k >= 0 && k < ruptures.length) {
      pick(k);
      // It comes into view.
      const [a, b] = map.view(), at = (onset(k) + end(k)) / 2;
      if (at < a || at > b) map.look(at - (b - a) / 2, at + (b - a) / 2);
    }
    return true;
  }

  let isFollowing = false;
  function follow(act) {
    isFollowing = true;
    act();
    isFollowing = false;
  }
  // Text with subscripts, as F_T/F_N.
  function lettered(pen, text, x, y, scale) {
    pen.textAlign = "left";
    for (const [, index, plain] of text.matchAll(/_(\w)|([^_]+)/g)) {
      pen.font = `${(index ? 9 : 12) * scale}px ${map.FONT}`;
      pen.fillText(index ?? plain, x, y + (index ? 3 * scale : 0));
      x += pen.measureText(index ?? plain).width;
    }
  }
  function marks(u) {
    const pen = u.ctx, scale = devicePixelRatio, { left, top, width, height } = u.bbox;
    const x = (t) => u.valToPos(t, "x", true), y = (load) => u.valToPos(load, "y", true);
    pen.save();
    pen.font = `${12 * scale}px ${map.FONT}`;
    pen.fillStyle = colour("ink");
    pen.save();
    pen.translate(left - 46 * scale, top + height / 2);
    pen.rotate(-Math.PI / 2);
    lettered(pen, "F_T/F_N", -20 * scale, 0, scale);
    pen.restore();
    pen.strokeStyle = colour("ink");
    pen.lineWidth = scale;
    pen.strokeRect(left, top, width, height);
    pen.beginPath();
    pen.rect(left, top, width, height);
    pen.clip();
    pen.lineWidth = scale;
    for (const [n, [name, value]] of run.lines.entries()) {
      pen.strokeStyle = pen.fillStyle = colour(n ? "rust-line" : "blue-line");
      pen.setLineDash(n ? [8 * scale, 3 * scale, 2 * scale, 3 * scale] : [6 * scale, 4 * scale]);
      pen.beginPath(); pen.moveTo(left, y(value)); pen.lineTo(left + width, y(value)); pen.stroke();
      lettered(pen, name, left + 6 * scale, y(value) + (y(value) - top < 18 * scale ? 13 : -5) * scale, scale);
    }
    pen.setLineDash([]);
    const { min, max } = u.scales.x, marked = [];
    for (let k = 0; k < ruptures.length; k++) {
      const r = ruptures[k], t = onset(k);
      if (r[KIND] && t >= min && t <= max && isShown(k)) marked.push(k);
    }
    // Where they would hide the curve they come into view with the zoom.
    const isCrowded = marked.length > width / scale / 6;
    for (const k of isCrowded ? [] : marked) {
      const r = ruptures[k], t = onset(k), look = LOOKS[LOOK_OF_KIND[r[KIND]]], px = x(t), py = y(r[FROM]), size = 3 * scale;
      pen.fillStyle = colour(`${look.colour}-line`);
      pen.beginPath();
      if (r[KIND] === 2) pen.rect(px - size, py - size, 2 * size, 2 * size);
      else { pen.moveTo(px, py - size * 1.2); pen.lineTo(px + size, py + size * .8); pen.lineTo(px - size, py + size * .8); }
      pen.fill();
    }
    if (chosen >= 0) {
      const r = ruptures[chosen];
      pen.strokeStyle = colour("ink");
      pen.lineWidth = 2 * scale;
      pen.beginPath(); pen.arc(x(onset(chosen)), y(r[FROM]), 7 * scale, 0, 7); pen.stroke();
    }
    pen.restore();
  }
  function band(u) {
    if (chosen < 0) return;
    const x0 = u.valToPos(onset(chosen), "x", true), x1 = u.valToPos(end(chosen), "x", true), least = 3 * devicePixelRatio;
    u.ctx.save();
    u.ctx.fillStyle = colour("here");
    u.ctx.fillRect(x0 - least, u.bbox.top, Math.max(x1 - x0, 0) + 2 * least, u.bbox.height);
    u.ctx.restore();
  }

  // The thinned curve with what ruptures say of the load when they begin and end, so that no drop is lost on the way in.
  function curve() {
    const at = [...run.at], load = [...run.load];
    for (const r of ruptures) {
      at.push(r[ONSET] - 1);
      load.push(r[FROM]);
      if (r[END] !== null && r[TO] !== null) { at.push(r[END] - 1); load.push(r[TO]); }
    }
    const order = [...at.keys()].sort((a, b) => at[a] - at[b] || a - b);
    times = [];
    loads = [];
    let last = -Infinity;
    for (const k of order) {
      if (at[k] === last) continue;
      last = at[k];
      times.push(seconds(last));
      loads.push(load[k]);
    }
  }
  function plotted() {
    if (plot) plot.destroy();
    const grid = { stroke: () => colour("grid"), width: 1 };
    const none = { size: 8, ticks: { show: false }, grid, splits: () => { const { axis, at } = map.ticks(canvas.clientWidth - map.LEFT - map.RIGHT); return at.map((t) => t + axis.base); }, values: (_, all) => all.map(() => "") };
    plot = new uPlot({
      width: box.clientWidth, height: box.clientHeight - 2, padding: [12, map.RIGHT, 0, 0], legend: { show: false },
      cursor: { y: false, points: { show: false }, drag: { x: true, y: false, setScale: true }, bind: { dblclick: (u) => (event) => map.zoom(.25, u.posToVal(event.offsetX, "x")) } },
      scales: { x: { time: false }, y: { range: (_, low, high) => { const room = (high - low) * .08 || .01; return [low - room, high + room]; } } },
      series: [{}, { stroke: () => colour("ink"), width: 1.2, points: { show: false } }],
      axes: [none, { size: map.LEFT, stroke: () => colour("ink"), font: `12px ${map.FONT}`, grid, ticks: { stroke: () => colour("ink"), size: 5, width: 1 }, values: (_, all) => all.map((one) => digits(one, 6)) }],
      hooks: {
        drawClear: [band],
        draw: [marks],
        setScale: [(u, key) => { if (key === "x" && !isFollowing && u.status === 1) follow(() => map.look(u.scales.x.min, u.scales.x.max)); }],
      },
    }, [times, loads], box);
    plot.over.addEventListener("click", (event) => {
      // The nearest onset by what is seen of it.
      const t = plot.posToVal(event.offsetX, "x"), near = Math.abs(plot.posToVal(event.offsetX + 12, "x") - t);
      let found = -1, best = near;
      for (let k = 0; k < ruptures.length; k++) {
        const away = Math.abs(onset(k) - t) / (1 + ruptures[k][KIND]);
        if (away < best && isShown(k)) [found, best] = [k, away];
      }
      box.focus({ preventScroll: true });
      pick(found);
    });
    plot.over.addEventListener("wheel", (event) => {
      if (document.activeElement !== box && !event.ctrlKey) return;
      event.preventDefault();
      map.zoom(event.deltaY < 0 ? 1 / 1.25 : 1.25, plot.posToVal(event.offsetX, "x"));
    }, { passive: false });
  }
  box.addEventListener("keydown", map.key);

  const column = (name, title, value, text, number = true) => ({ name, title, value, text, number });
  // Of all runs of the page.
  const { places: placesTitle, unit: timeUnit = "s" } = byId("ruptures").dataset, isLong = timeUnit === "years", isByDepth = placesTitle.startsWith("depth");
  const lasted = (k) => (end(k) - onset(k)) * (isLong ? 31557600 : 1e3);
  const list = asperity.longTable(byId("ruptures"), {
    label: "Ruptures of the run",
    sorted: "onset",
    columns: [
      column("number", "rupture", (k) => ruptures[k][NUMBER], (k) => String(ruptures[k][NUMBER])),
      column("kind", "kind", (k) => ruptures[k][KIND], (k) => WORDS[ruptures[k][KIND]], false),
      column("onset", `onset (${timeUnit})`, onset, (k) => time(onset(k))),
      column("duration", isLong ? "duration (s)" : "duration (ms)", (k) => (ruptures[k][END] === null ? null : lasted(k)), (k) => (ruptures[k][END] === null ? null : digits(lasted(k), 4))),
      column("blocks", placesTitle, blocks, (k) => between(ruptures[k][FIRST], ruptures[k][LAST], "–")),
      column("nucleation", "first sliding", (k) => ruptures[k][NUCLEATION], (k) => at(ruptures[k][NUCLEATION])),
      column("load", "F_T/F_N", (k) => ruptures[k][FROM], (k) => ruptures[k][FROM].toFixed(4)),
      column("drop", "drop (10⁻³)", drop, (k) => (drop(k) === null ? null : digits(drop(k) * 1e3, 3))),
      column("front", "v/c", front, (k) => digits(front(k), 4)),
      column("slip", `mean slip (${isByDepth ? "m" : "µm"})`, (k) => ruptures[k][SLIP], (k) => (ruptures[k][SLIP] === null ? null : digits(ruptures[k][SLIP] * (isByDepth ? 1 : 1e6), 3))),
    ],
    pick,
    key: steer,
  });

  const overArea = asperity.overArea?.(byId("hover"));
  function pick(k) {
    chosen = k;
    overArea?.(run, k);
    map.mark(k < 0 ? [] : [[0, k]]);
    list.choose(k);
    if (plot) plot.redraw(false);
    said.innerHTML = k < 0 ? "No rupture is picked." : html(`${words(k).join("; ")}.`);
    toFront.hidden = k < 0;
    root.dataset.chosen = k < 0 ? "" : ruptures[k][NUMBER];
  }
  function filter() {
    const [from, to] = map.view();
    list.filter((k) => isShown(k) && (!inView.checked || (onset(k) <= to && end(k) >= from)));
    const count = list.shown().length;
    byId("listed").textContent = `${count} of ${run.total[0]} ruptures are listed.`;
  }
  function filtered() {
    accepted.kinds = new Set(kinds.filter((one) => one.checked).map((one) => Number(one.dataset.kind)));
    accepted.blocks = Number(least.value) || 1;
    // What is not shown is not picked either.
    if (chosen >= 0 && !isShown(chosen)) pick(-1);
    filter();
    map.redraw();
    plot.redraw(false);
  }
  for (const one of [...kinds, inView, withEvents]) one.addEventListener("change", filtered);
  least.addEventListener("input", filtered);

  function show(name) {
    run = JSON.parse(runs.get(name).textContent);
    ruptures = run.ruptures;
    chosen = -1;
    choice.value = name;
    const count = ruptures.length + run.events.length;
    const panel = {
      title: run.place ? placesTitle : places().slice(0, -1), count, onset: new Float64Array(count), end: new Float64Array(count), first: new Int32Array(count),
      last: new Int32Array(count), look: new Uint8Array(count),
    };
    for (const [n, one] of [...ruptures, ...run.events].entries()) {
      const isRupture = n < ruptures.length, [from, to, first, last] = isRupture ? one.slice(ONSET, LAST + 1) : one;
      panel.onset[n] = seconds(from);
      panel.end[n] = seconds(to ?? run.last);
      panel.first[n] = first;
      panel.last[n] = last;
      panel.look[n] = isRupture ? LOOK_OF_KIND[one[KIND]] : 0;
    }
    curve();
    if (plot) { plot.destroy(); plot = null; }
    map.show({
      front: (_, k) => (k < ruptures.length ? passed(k) : null),
      name, unit: run.unit, place: run.place, down: run.down, blocks: run.blocks, from_s: 0, to_s: seconds(run.last), panels: [panel],
      shown: (_, k) => (k < ruptures.length ? isShown(k) : withEvents.checked),
    });
    plotted();
    const [from, to] = map.view();
    follow(() => plot.setScale("x", { min: from, max: to }));
    list.show([...ruptures.keys()]);
    filter();
    pick(-1);
    const kept = ruptures.length < run.total[0] ? `The page holds the ${ruptures.length} widest of the run's ${run.total[0]} ruptures. ` : "";
    const slips = run.events.length < run.total[1] ? `Of ${run.total[1]} slip events it holds the ${run.events.length} widest.` : "";
    const left = ruptures.filter((r) => !r[FRONT]).length, all = ruptures.length;
    const fronts = left === 0 ? "" : left === all ? " The log does not say how fronts ran." : ` Of ${left} ruptures, which are narrower than others, the page does not hold how their fronts passed the blocks.`;
    byId("held").textContent = kept + slips + fronts;
    answers.innerHTML = byId(`run-${name}`).querySelector(".answers")?.outerHTML ?? "";
    byId("lacks").textContent = run.lacks ? `Not all of this run is there: ${run.lacks}` : "";
    byId("lacks").hidden = !run.lacks;
    root.dataset.run = name;
    root.dataset.ruptures = ruptures.length;
    map.drawNow();
  }

  choice.addEventListener("change", () => show(choice.value));
  toFront.addEventListener("click", zoomed);
  // Names of runs lead to their pair, wherever they stand, and ruptures to their front in it.
  function pickNumber(number) {
    const k = ruptures.findIndex((r) => r[NUMBER] === Number(number));
    if (k >= 0) pick(k);
    return k >= 0;
  }
  document.addEventListener("click", (event) => {
    const link = event.target.closest("a[data-run]");
    if (!link || !runs.has(link.dataset.run)) return;
    event.preventDefault();
    if (run.name !== link.dataset.run) show(link.dataset.run);
    if (link.dataset.rupture) {
      if (pickNumber(link.dataset.rupture)) zoomed();
      byId("pair").scrollIntoView({ block: "nearest" });
      return;
    }
    const details = byId(`run-${run.name}`);
    if (details) details.open = true;
    (choice.closest("section") ?? document.body).scrollIntoView({ block: "start" });
  });
  new ResizeObserver(() => { if (plot && box.clientWidth) plot.setSize({ width: box.clientWidth, height: box.clientHeight - 2 }); }).observe(box);
  repaints.push(() => { if (plot) plot.redraw(true); });

  const asked = new URLSearchParams(location.hash.slice(1));
  show(runs.has(asked.get("run")) ? asked.get("run") : runs.keys().next().value);
  if (asked.has("rupture")) pickNumber(asked.get("rupture"));
})();
