// The two space-time timelines of a run: OLD above, NEW below, one time axis, and between them which event belongs to
// which. The data stand in the page as JSON.
"use strict";
(() => {
  const { root, colour } = asperity;
  const data = asperity.data("#data");
  const canvas = document.getElementById("timeline");
  const SIDES = ["old", "new"];
  // An event is [number, onset_s, end_s or null, first, last, class, match].
  const ONSET = 1, END = 2, FIRST = 3, LAST = 4, CLASS = 5, MATCH = 6;

  // Each class has a colour, a hatching and a mark, so that any one of them is enough.
  const LOOKS = {
    "identical": { colour: "plain" },
    "within-tolerance": { colour: "faint", hatch: "dots", mark: "tick" },
    "shifted": { colour: "blue", hatch: "rising", mark: "arrow" },
    "changed": { colour: "ochre", hatch: "falling", mark: "diamond" },
    "split": { colour: "rose", hatch: "upright", mark: "split" },
    "merged": { colour: "green", hatch: "level", mark: "merged" },
    "missing": { colour: "rust", hatch: "cross", mark: "times" },
    "extra": { colour: "sky", hatch: "grid", mark: "plus" },
    "open": { colour: "open", mark: "ring", dash: true },
  };
  // First what is the same, so that what differs lies above it.
  const looks = data.classes.map(({ word }) => ({ name: word, ...(LOOKS[word] || LOOKS.changed) }));
  const line = (index) => colour(`${looks[index].colour}-line`);

  function mark(pen, index, x, y) {
    pen.save();
    pen.translate(x, y);
    pen.strokeStyle = pen.fillStyle = line(index);
    pen.lineWidth = 1.6;
    const shapes = {
      tick: [[0, -3, 0, 3]],
      arrow: [[-4, 0, 4, 0], [1, -3, 4, 0], [1, 3, 4, 0]],
      split: [[0, -5, 0, 0], [0, 0, -4, 5], [0, 0, 4, 5]],
      merged: [[0, 5, 0, 0], [0, 0, -4, -5], [0, 0, 4, -5]],
      times: [[-4, -4, 4, 4], [-4, 4, 4, -4]],
      plus: [[-5, 0, 5, 0], [0, -5, 0, 5]],
    };
    const shape = looks[index].mark;
    pen.beginPath();
    if (shape === "diamond") {
      pen.moveTo(0, -5); pen.lineTo(4, 0); pen.lineTo(0, 5); pen.lineTo(-4, 0); pen.closePath(); pen.fill();
    } else if (shape === "ring") {
      pen.arc(0, 0, 3.5, 0, 7); pen.stroke();
    } else if (shape) {
      for (const [x0, y0, x1, y1] of shapes[shape]) { pen.moveTo(x0, y0); pen.lineTo(x1, y1); }
      pen.stroke();
    }
    pen.restore();
  }

  const status = document.getElementById("drawn"), runChoice = document.getElementById("run");
  const rows = [...document.querySelectorAll("tr[data-finding]")];
  const shown = new Set(data.classes.map((_, index) => index));
  let run = data.runs[0], chosen = -1;
  if (!canvas || !run) return;
  // Nine digits: a step of the shortest runs.
  const time = (time_s) => `${Number(time_s.toPrecision(9))} s`;
  const end = (event) => (event[END] === null ? run.to_s : event[END]);

  const map = asperity.map(canvas, {
    looks,
    gap: 40,
    heading: () => SIDES.map((side) => `${side.toUpperCase()}  ${data[side]}${data.runs.length > 1 ? `, run ${run.name}` : ""}: ${run.total[side]} ${run.what}`),
    legend: () => data.classes.flatMap(({ title }, index) => (run.counts[index] && shown.has(index)
      ? [{ look: index, text: `${title} (${run.counts[index]})`, mark: (pen, x, y) => mark(pen, index, x, y) }] : [])),
    words(panel, k) {
      const event = run[SIDES[panel]][k];
      return `${SIDES[panel].toUpperCase()} event ${event[0]}: ${data.classes[event[CLASS]].title}\n`
        + `${time(event[ONSET])} to ${event[END] === null ? "the run's end" : time(event[END])}\n`
        + `blocks ${event[FIRST]} to ${event[LAST]}`;
    },
    pick(panel, k) {
      const match = k < 0 ? -1 : run[SIDES[panel]][k][MATCH];
      const index = match < 0 ? -1 : data.findings.findIndex((finding) => finding.match === match && data.runs[finding.run] === run);
      if (index >= 0) {
        choose(index, false);
        const row = rows.find((candidate) => Number(candidate.dataset.finding) === index);
        if (row) row.parentElement.closest(".list").scrollTop = row.offsetTop - 60;
      } else {
        pickMatch(match);
      }
    },
    over: between,
    drawn(drawn) {
      const held = run.old.length + run.new.length, total = run.total.old + run.total.new;
      root.dataset.run = run.name;
      root.dataset.events = total;
      const least = held < total ? ` The page holds ${held} of the run's ${total} ${run.what}.` : "";
      status.textContent = `${drawn} of ${total} ${run.what} of both sides in view.${least}`;
    },
  });

  // Between the two: which belongs to which, and a mark for each that differs; where there are too many for that, how many
  // of which class there are. And from where on the runs no longer agree.
  function between(pen, place) {
    const { left, across, panel, tops, x, from, to, width } = place;
    const centres = new Map();
    for (const side of SIDES) {
      for (const event of run[side]) {
        const stop = end(event), index = event[CLASS];
        if (event[MATCH] < 0 || looks[index].name === "identical" || !shown.has(index) || stop < from || event[ONSET] > to) continue;
        const centre = Math.min(Math.max((x(event[ONSET]) + x(stop)) / 2, left), left + across);
        const entry = centres.get(event[MATCH]) || { old: [], new: [], class: index };
        entry[side].push(centre);
        centres.set(event[MATCH], entry);
      }
    }
    const upper = tops[0] + panel, lower = tops[1], middle = (upper + lower) / 2;
    if (centres.size > across / 3) {
      const barWidth = 4, bars = Array.from({ length: Math.ceil(across / barWidth) }, () => new Map());
      for (const { old, new: now, class: index } of centres.values()) {
        const bar = bars[Math.min(bars.length - 1, Math.floor(((old[0] ?? now[0]) - left) / barWidth))];
        bar.set(index, (bar.get(index) || 0) + 1);
      }
      const sum = (bar) => [...bar.values()].reduce((total, count) => total + count, 0);
      const most = Math.max(...bars.map(sum));
      for (const [place, bar] of bars.entries()) {
        let foot = lower - 4;
        for (const index of [...bar.keys()].sort((a, b) => a - b)) {
          const high = bar.get(index) / most * (lower - upper - 10);
          pen.fillStyle = line(index);
          pen.fillRect(left + place * barWidth, foot - high, barWidth - .5, high);
          foot -= high;
        }
      }
      pen.fillStyle = colour("soft");
      pen.font = `12px ${map.FONT}`;
      pen.textAlign = "right";
      pen.fillText(`up to ${most}`, left - 8, middle + 4);
    } else {
      for (const [match, { old, new: now, class: index }] of centres) {
        const all = [...old, ...now], centre = all.reduce((total, at) => total + at, 0) / all.length;
        pen.strokeStyle = match === chosen ? colour("ink") : line(index);
        pen.lineWidth = match === chosen ? 2 : 1;
        pen.beginPath();
        for (const at of old) { pen.moveTo(at, upper + 1); pen.lineTo(centre, middle - 7); }
        for (const at of now) { pen.moveTo(centre, middle + 7); pen.lineTo(at, lower - 1); }
        pen.stroke();
        mark(pen, index, centre, middle);
      }
    }
    pen.lineWidth = 1;
    if (run.horizon_s === null || run.horizon_s < from || run.horizon_s > to) return;
    const at = x(run.horizon_s), isRight = at > width * .7;
    pen.strokeStyle = pen.fillStyle = colour("ink");
    pen.setLineDash([5, 4]);
    pen.beginPath(); pen.moveTo(at, tops[0]); pen.lineTo(at, tops[1] + panel); pen.stroke();
    pen.setLineDash([]);
    pen.font = `12px ${map.FONT}`;
    pen.textAlign = isRight ? "right" : "left";
    pen.strokeStyle = colour("paper");
    pen.lineWidth = 4;
    pen.strokeText("first difference", at + (isRight ? -5 : 5), tops[0] + 14);
    pen.lineWidth = 1;
    pen.fillText("first difference", at + (isRight ? -5 : 5), tops[0] + 14);
  }

  function pickMatch(match) {
    chosen = match;
    const marked = [];
    for (const [panel, side] of SIDES.entries()) {
      for (const [k, event] of run[side].entries()) if (match >= 0 && event[MATCH] === match) marked.push([panel, k]);
    }
    map.mark(marked);
  }
  function show(place) {
    run = data.runs[place] || data.runs[0];
    runChoice.value = data.runs.indexOf(run);
    chosen = -1;
    const panel = (side) => ({
      title: `${side.toUpperCase()}, block`, count: run[side].length,
      onset: run[side].map((event) => event[ONSET]), end: run[side].map(end),
      first: run[side].map((event) => event[FIRST]), last: run[side].map((event) => event[LAST]),
      look: run[side].map((event) => event[CLASS]),
    });
    map.show({
      name: run.name, blocks: run.blocks, from_s: run.from_s, to_s: run.to_s, panels: SIDES.map(panel),
      shown: (side, k) => shown.has(run[SIDES[side]][k][CLASS]),
    });
    filterRows();
  }
  function filterRows() {
    for (const row of rows) {
      const finding = data.findings[row.dataset.finding];
      row.hidden = !shown.has(finding.class) || finding.run !== run.pair;
    }
  }
  function choose(index, scrolls) {
    const finding = data.findings[index];
    if (data.runs[finding.run] !== run) show(finding.run);
    pickMatch(finding.match === null ? -1 : finding.match);
    if (scrolls) {
      const margin = Math.max((finding.to_s - finding.from_s) * 1.5, (run.to_s - run.from_s) * 1e-7);
      map.look(finding.from_s - margin, finding.to_s + margin);
      canvas.scrollIntoView({ block: "center" });
    }
    for (const row of rows) row.classList.toggle("here", Number(row.dataset.finding) === index);
    root.dataset.chosen = index;
  }

  for (const [place, candidate] of data.runs.entries()) {
    const option = document.createElement("option");
    const differing = candidate.counts.reduce((sum, count, index) => sum + (index > 0 ? count : 0), 0);
    option.value = place;
    option.textContent = `${candidate.name}, ${candidate.what}: ${differing ? `${differing} not identical` : "identical"}`;
    runChoice.append(option);
  }
  runChoice.addEventListener("change", () => show(Number(runChoice.value)));
  for (const box of document.querySelectorAll("input[data-class]")) {
    box.addEventListener("change", () => {
      const index = data.classes.findIndex((entry) => entry.word === box.dataset.class);
      if (box.checked) shown.add(index); else shown.delete(index);
      filterRows();
      map.redraw();
    });
  }
  for (const link of document.querySelectorAll("a[data-run]")) {
    link.addEventListener("click", (event) => { event.preventDefault(); show(Number(link.dataset.run)); canvas.scrollIntoView({ block: "center" }); });
  }
  for (const row of rows) {
    row.addEventListener("click", () => choose(Number(row.dataset.finding), true));
    row.addEventListener("keydown", (event) => { if (event.key === "Enter") choose(Number(row.dataset.finding), true); });
  }

  // The first run whose ruptures differ, else its slip events, seen whole; #finding=N and #run=N lead on.
  const differs = (candidate) => candidate.counts.some((count, index) => index > 0 && count > 0);
  const first = data.runs.find((candidate) => candidate.what === "ruptures" && differs(candidate))
    || data.runs.find((candidate) => candidate.what === "events" && differs(candidate)) || data.runs[0];
  show(data.runs.indexOf(first));
  const asked = new URLSearchParams(location.hash.slice(1));
  if (asked.has("run")) show(Number(asked.get("run")));
  if (asked.has("finding")) choose(Number(asked.get("finding")), true);
  map.drawNow();
})();
