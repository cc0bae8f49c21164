// The two space-time timelines of a run: OLD above, NEW below, one time axis.
// Canvas and not SVG, so that tens of thousands of events stay quick. The data
// stand in the page as JSON; nothing is fetched.
"use strict";
(() => {
  const root = document.documentElement;
  window.addEventListener("error", (event) => { root.dataset.failure = String(event.message); });
  const data = JSON.parse(document.getElementById("data").textContent);
  root.classList.add("scripted");

  const canvas = document.getElementById("timeline");
  const hover = document.getElementById("hover");
  const status = document.getElementById("drawn");
  const runChoice = document.getElementById("run");
  const rows = [...document.querySelectorAll("tr[data-finding]")];
  const SIDES = ["old", "new"];

  // An event is [number, onset_s, end_s or null, first, last, class, match].
  const ONSET = 1, END = 2, FIRST = 3, LAST = 4, CLASS = 5, MATCH = 6;

  // Each class has a colour, a hatching and a mark, so that any one of them is enough.
  const LOOKS = {
    "identical": { fill: "#c9c9c9", line: "#9a9a9a", hatch: "" },
    "within-tolerance": { fill: "#e4e4e4", line: "#4d4d4d", hatch: "dots", mark: "tick" },
    "shifted": { fill: "#bcdcf2", line: "#0072b2", hatch: "rising", mark: "arrow" },
    "changed": { fill: "#fbe3b4", line: "#a86f00", hatch: "falling", mark: "diamond" },
    "split": { fill: "#f1d5e5", line: "#9b3f74", hatch: "upright", mark: "split" },
    "merged": { fill: "#c9ecdf", line: "#00775a", hatch: "level", mark: "merged" },
    "missing": { fill: "#f9d3bf", line: "#b84a00", hatch: "cross", mark: "times" },
    "extra": { fill: "#d3ebfa", line: "#1d6fa5", hatch: "grid", mark: "plus" },
    "open": { fill: "#ffffff", line: "#1a1a1a", hatch: "", mark: "ring", dash: true },
  };
  const look = (index) => LOOKS[data.classes[index].word] || LOOKS.changed;

  function hatching(style, scale) {
    if (!style.hatch) return style.fill;
    const side = 8;
    const tile = document.createElement("canvas");
    tile.width = tile.height = side * scale;
    const pen = tile.getContext("2d");
    pen.scale(scale, scale);
    pen.fillStyle = style.fill;
    pen.fillRect(0, 0, side, side);
    pen.strokeStyle = pen.fillStyle = style.line;
    pen.lineWidth = 1;
    const line = (x0, y0, x1, y1) => { pen.beginPath(); pen.moveTo(x0, y0); pen.lineTo(x1, y1); pen.stroke(); };
    const rising = () => { line(-1, side + 1, side + 1, -1); line(-1, 1, 1, -1); line(side - 1, side + 1, side + 1, side - 1); };
    const falling = () => { line(-1, -1, side + 1, side + 1); line(side - 1, -1, side + 1, 1); line(-1, side - 1, 1, side + 1); };
    const upright = () => line(side / 2, 0, side / 2, side);
    const level = () => line(0, side / 2, side, side / 2);
    const hatches = {
      rising, falling, upright, level,
      cross: () => { rising(); falling(); },
      grid: () => { upright(); level(); },
      dots: () => pen.fillRect(side / 2 - 1, side / 2 - 1, 2, 2),
    };
    hatches[style.hatch]();
    return tile;
  }

  function mark(pen, style, x, y) {
    pen.save();
    pen.translate(x, y);
    pen.strokeStyle = pen.fillStyle = style.line;
    pen.lineWidth = 1.6;
    const shapes = {
      tick: [[0, -3, 0, 3]],
      arrow: [[-4, 0, 4, 0], [1, -3, 4, 0], [1, 3, 4, 0]],
      split: [[0, -5, 0, 0], [0, 0, -4, 5], [0, 0, 4, 5]],
      merged: [[0, 5, 0, 0], [0, 0, -4, -5], [0, 0, 4, -5]],
      times: [[-4, -4, 4, 4], [-4, 4, 4, -4]],
      plus: [[-5, 0, 5, 0], [0, -5, 0, 5]],
    };
    pen.beginPath();
    if (style.mark === "diamond") {
      pen.moveTo(0, -5); pen.lineTo(4, 0); pen.lineTo(0, 5); pen.lineTo(-4, 0); pen.closePath(); pen.fill();
    } else if (style.mark === "ring") {
      pen.arc(0, 0, 3.5, 0, 7); pen.stroke();
    } else if (style.mark) {
      for (const [x0, y0, x1, y1] of shapes[style.mark]) { pen.moveTo(x0, y0); pen.lineTo(x1, y1); }
      pen.stroke();
    }
    pen.restore();
  }

  // One look for the rectangle in the picture, in its legend and in the page's tables.
  function swatch(pen, style, x, y, width, height, scale) {
    const fill = hatching(style, scale);
    if (typeof fill === "string") {
      pen.fillStyle = fill;
    } else {
      const pattern = pen.createPattern(fill, "repeat");
      pattern.setTransform(new DOMMatrix().scale(1 / scale));
      pen.fillStyle = pattern;
    }
    pen.fillRect(x, y, width, height);
    pen.setLineDash(style.dash ? [3, 2] : []);
    pen.strokeStyle = style.line;
    pen.lineWidth = 1;
    pen.strokeRect(x + .5, y + .5, width - 1, height - 1);
    pen.setLineDash([]);
  }
  for (const key of document.querySelectorAll("canvas.key")) {
    const scale = 2;
    key.width = 22 * scale;
    key.height = 14 * scale;
    const pen = key.getContext("2d");
    pen.scale(scale, scale);
    swatch(pen, LOOKS[key.dataset.class] || LOOKS.changed, 0, 0, 22, 14, scale);
  }

  if (!canvas || data.runs.length === 0) return;

  // What is looked at.
  let run = data.runs[0];
  let from = 0, to = 1;
  let chosen = -1;
  let boxes = [];
  const shown = new Set(data.classes.map((_, index) => index));

  const end = (event) => event[END] === null ? run.to_s : event[END];
  function whole() {
    const margin = (run.to_s - run.from_s) * .01 || 1e-9;
    from = run.from_s - margin;
    to = run.to_s + margin;
  }

  // Ticks at 1, 2 or 5 times a power of ten.
  function stepOf(span, count) {
    const raw = span / count, power = 10 ** Math.floor(Math.log10(raw)), lead = raw / power;
    return power * (lead < 1.5 ? 1 : lead < 3.5 ? 2 : lead < 7.5 ? 5 : 10);
  }
  // Far into a run, seconds alone would repeat ten digits at every tick: a part
  // common to all goes into the axis' title, the rest into a unit that fits.
  function timeAxis(a, b, count) {
    const span = b - a, far = Math.max(Math.abs(a), Math.abs(b));
    const units = [["s", 1], ["ms", 1e-3], ["µs", 1e-6], ["ns", 1e-9]];
    if (span > far * 2e-3) {
      const step = stepOf(span, count);
      const digits = Math.max(0, -Math.floor(Math.log10(step) + 1e-9));
      return { base: 0, step, label: (t) => t.toFixed(digits), title: "time, s" };
    }
    const [unit, size] = units.find(([, size]) => span >= size) || units[3];
    const coarse = 10 ** Math.ceil(Math.log10(span));
    const base = Math.floor(a / coarse) * coarse;
    const digits = Math.max(0, -Math.floor(Math.log10(coarse) + 1e-9));
    const step = stepOf(span, count);
    const fine = Math.max(0, -Math.floor(Math.log10(step / size) + 1e-9));
    const origin = Number(base.toFixed(Math.min(digits, 20)));
    return {
      base: origin, step,
      label: (t) => (t / size).toFixed(fine),
      title: `time − ${origin.toFixed(Math.min(digits, 20))} s, ${unit}`,
    };
  }

  const INK = "#1a1a1a", SOFT = "#5a5a5a";
  const FONT = "system-ui, 'Segoe UI', 'Noto Sans', 'DejaVu Sans', sans-serif";

  // Draws the picture into any canvas; gives how many events of the run fall into view.
  function draw(pen, width, height, scale, hits) {
    const left = 62, right = 14, top = 46, between = 40, bottom = 74;
    const panel = (height - top - between - bottom) / 2;
    const tops = { old: top, new: top + panel + between };
    const across = width - left - right;
    const x = (t) => left + (t - from) / (to - from) * across;
    const rowHeight = panel / run.blocks;
    const y = (side, block) => tops[side] + panel - block * rowHeight;
    pen.setTransform(scale, 0, 0, scale, 0, 0);
    pen.fillStyle = "#ffffff";
    pen.fillRect(0, 0, width, height);

    // Axes.
    const axis = timeAxis(from, to, across / 95);
    const ticks = [];
    for (let k = Math.ceil((from - axis.base) / axis.step); k * axis.step + axis.base <= to; k++) ticks.push(k * axis.step);
    pen.font = `12px ${FONT}`;
    pen.lineWidth = 1;
    pen.textAlign = "center";
    for (const tick of ticks) {
      const at = Math.round(x(tick + axis.base)) + .5;
      pen.strokeStyle = "#eeeeee";
      for (const side of SIDES) { pen.beginPath(); pen.moveTo(at, tops[side]); pen.lineTo(at, tops[side] + panel); pen.stroke(); }
      pen.strokeStyle = INK;
      pen.beginPath(); pen.moveTo(at, tops.new + panel); pen.lineTo(at, tops.new + panel + 5); pen.stroke();
      pen.fillStyle = INK;
      pen.fillText(axis.label(tick), at, tops.new + panel + 18);
    }
    pen.fillText(axis.title, left + across / 2, tops.new + panel + 36);
    const blockStep = Math.max(1, stepOf(run.blocks, 5));
    for (const side of SIDES) {
      pen.textAlign = "right";
      pen.fillStyle = INK;
      pen.strokeStyle = INK;
      for (let block = 0; block <= run.blocks; block += blockStep) {
        const shownBlock = Math.max(1, block);
        const at = y(side, shownBlock - .5);
        pen.beginPath(); pen.moveTo(left - 5, at); pen.lineTo(left, at); pen.stroke();
        pen.fillText(String(shownBlock), left - 8, at + 4);
      }
      pen.save();
      pen.translate(16, tops[side] + panel / 2);
      pen.rotate(-Math.PI / 2);
      pen.textAlign = "center";
      pen.fillText(`${side.toUpperCase()}, block`, 0, 0);
      pen.restore();
    }

    // Events: first what is the same, so that what differs lies above it.
    const fills = data.classes.map((_, index) => {
      const fill = hatching(look(index), scale);
      if (typeof fill === "string") return fill;
      const pattern = pen.createPattern(fill, "repeat");
      pattern.setTransform(new DOMMatrix().scale(1 / scale));
      return pattern;
    });
    let drawn = 0;
    const centres = new Map();
    const inView = SIDES.reduce((sum, side) => sum + run[side].reduce((n, event) => n + (event[ONSET] <= to && end(event) >= from), 0), 0);
    const isDense = inView > across;
    for (const side of SIDES) {
      pen.save();
      pen.beginPath();
      pen.rect(left, tops[side], across, panel);
      pen.clip();
      for (let pass = 0; pass < data.classes.length; pass++) {
        const style = look(pass);
        if (!shown.has(pass)) continue;
        pen.fillStyle = fills[pass];
        pen.strokeStyle = style.line;
        pen.setLineDash(style.dash ? [3, 2] : []);
        for (const event of run[side]) {
          if (event[CLASS] !== pass) continue;
          const stop = end(event);
          if (stop < from || event[ONSET] > to) continue;
          drawn++;
          // Most slips last less than a dot of the picture: none is thinner than that.
          const x0 = Math.max(x(event[ONSET]), left - 4), x1 = Math.min(x(stop), left + across + 4);
          const wide = Math.max(x1 - x0, 1.5), y0 = y(side, event[LAST]), high = Math.max(y(side, event[FIRST] - 1) - y0, 1.5);
          if (wide < 3) {
            // Where they lie on each other, many look darker than one.
            pen.globalAlpha = isDense ? .65 : 1;
            pen.fillStyle = style.line;
            pen.fillRect(x0, y0, wide, high);
            pen.fillStyle = fills[pass];
            pen.globalAlpha = 1;
          } else {
            pen.fillRect(x0, y0, wide, high);
            if (high >= 3) pen.strokeRect(x0 + .5, y0 + .5, wide - 1, high - 1);
          }
          if (hits) hits.push([x0, y0, wide, high, side, event]);
          if (event[MATCH] >= 0 && data.classes[pass].word !== "identical") {
            const centre = Math.min(Math.max((x(event[ONSET]) + x(stop)) / 2, left), left + across);
            const entry = centres.get(event[MATCH]) || { old: [], new: [], class: pass };
            entry[side].push(centre);
            centres.set(event[MATCH], entry);
          }
        }
      }
      pen.setLineDash([]);
      pen.restore();
      pen.strokeStyle = INK;
      pen.strokeRect(left + .5, tops[side] + .5, across - 1, panel);
    }

    // Between the two: which belongs to which, and a mark for each that differs;
    // where there are too many for that, how many of which class there are.
    const upper = tops.old + panel, lower = tops.new, middle = (upper + lower) / 2;
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
          const high = bar.get(index) / most * (between - 10);
          pen.fillStyle = look(index).line;
          pen.fillRect(left + place * barWidth, foot - high, barWidth - .5, high);
          foot -= high;
        }
      }
      pen.fillStyle = SOFT;
      pen.textAlign = "right";
      pen.fillText(`up to ${most}`, left - 8, middle + 4);
    } else {
      for (const [match, { old, new: now, class: index }] of centres) {
        const style = look(index);
        const all = [...old, ...now];
        const centre = all.reduce((total, at) => total + at, 0) / all.length;
        pen.strokeStyle = match === chosen ? INK : style.line;
        pen.lineWidth = match === chosen ? 2 : 1;
        pen.beginPath();
        for (const at of old) { pen.moveTo(at, upper + 1); pen.lineTo(centre, middle - 7); }
        for (const at of now) { pen.moveTo(centre, middle + 7); pen.lineTo(at, lower - 1); }
        pen.stroke();
        mark(pen, style, centre, middle);
      }
    }
    pen.lineWidth = 1;

    // From where on the runs no longer agree.
    if (run.horizon_s !== null && run.horizon_s >= from && run.horizon_s <= to) {
      const at = x(run.horizon_s);
      pen.strokeStyle = INK;
      pen.setLineDash([5, 4]);
      pen.beginPath(); pen.moveTo(at, tops.old); pen.lineTo(at, tops.new + panel); pen.stroke();
      pen.setLineDash([]);
      pen.fillStyle = INK;
      pen.textAlign = at > width * .7 ? "right" : "left";
      pen.strokeStyle = "#ffffff";
      pen.lineWidth = 4;
      pen.strokeText("first difference", at + (pen.textAlign === "left" ? 5 : -5), tops.old + 14);
      pen.lineWidth = 1;
      pen.fillText("first difference", at + (pen.textAlign === "left" ? 5 : -5), tops.old + 14);
    }
    if (hits) {
      for (const [x0, y0, wide, high, , event] of hits) {
        if (event[MATCH] === chosen && chosen >= 0) {
          pen.strokeStyle = INK;
          pen.lineWidth = 2;
          pen.strokeRect(x0 - 2, y0 - 2, wide + 4, high + 4);
        }
      }
      pen.lineWidth = 1;
    }

    // What a picture must say when it is seen without its page.
    pen.fillStyle = INK;
    pen.textAlign = "left";
    pen.font = `600 13px ${FONT}`;
    for (const [line, side] of SIDES.entries()) {
      const words = `${side.toUpperCase()}  ${data[side]}${data.runs.length > 1 ? `, run ${run.name}` : ""}: ${run.total[side]} ${run.what}`;
      pen.fillText(fitted(pen, words, across), left, 18 + 17 * line);
    }
    pen.font = `12px ${FONT}`;
    let at = left;
    const legendTop = height - 22;
    for (const [index, entry] of data.classes.entries()) {
      const count = run.counts[index];
      if (!count || !shown.has(index)) continue;
      const text = `${entry.title} (${count})`;
      swatch(pen, look(index), at, legendTop, 22, 13, scale);
      mark(pen, look(index), at + 32, legendTop + 6.5);
      pen.fillStyle = INK;
      pen.fillText(text, at + 42, legendTop + 11);
      at += 42 + pen.measureText(text).width + 18;
    }
    return drawn;
  }

  // A text that is cut where there is no room for it.
  function fitted(pen, text, room) {
    if (pen.measureText(text).width <= room) return text;
    let cut = text;
    while (cut.length > 1 && pen.measureText(`${cut}…`).width > room) cut = cut.slice(0, -1);
    return `${cut}…`;
  }

  let waiting = false;
  function redraw() {
    if (waiting) return;
    waiting = true;
    requestAnimationFrame(() => { waiting = false; drawNow(); });
  }
  function drawNow() {
    const scale = Math.max(1, window.devicePixelRatio || 1);
    const width = canvas.clientWidth, height = canvas.clientHeight;
    canvas.width = width * scale;
    canvas.height = height * scale;
    boxes = [];
    const drawn = draw(canvas.getContext("2d"), width, height, scale, boxes);
    const held = run.old.length + run.new.length, total = run.total.old + run.total.new;
    root.dataset.run = run.name;
    root.dataset.drawn = drawn;
    root.dataset.events = total;
    const least = held < total ? ` The page holds ${held} of the run's ${total} ${run.what}.` : "";
    status.textContent = `${drawn} of ${total} ${run.what} of both sides in view.${least}`;
  }

  function show(place) {
    run = data.runs[place] || data.runs[0];
    runChoice.value = data.runs.indexOf(run);
    whole();
    filterRows();
    redraw();
  }
  function filterRows() {
    for (const row of rows) {
      const finding = data.findings[row.dataset.finding];
      row.hidden = !shown.has(finding.class) || finding.run !== run.pair;
    }
  }
  function zoom(factor, centre) {
    const middle = centre === undefined ? (from + to) / 2 : centre;
    // No closer than doubles can tell times apart.
    const least = Math.max(Math.abs(from), Math.abs(to)) * 1e-13;
    if ((to - from) * factor < least || (to - from) * factor > (run.to_s - run.from_s) * 4 + 1e-9) return;
    from = middle + (from - middle) * factor;
    to = middle + (to - middle) * factor;
    redraw();
  }
  function pan(share) {
    const by = (to - from) * share;
    from += by;
    to += by;
    redraw();
  }
  function choose(index, scrolls) {
    const finding = data.findings[index];
    chosen = finding.match === null ? -1 : finding.match;
    if (data.runs[finding.run] !== run) show(finding.run);
    if (scrolls) {
      const margin = Math.max((finding.to_s - finding.from_s) * 1.5, (run.to_s - run.from_s) * 1e-7);
      from = finding.from_s - margin;
      to = finding.to_s + margin;
      canvas.scrollIntoView({ block: "center" });
    }
    for (const row of rows) row.classList.toggle("here", Number(row.dataset.finding) === index);
    root.dataset.chosen = index;
    redraw();
  }

  for (const [place, candidate] of data.runs.entries()) {
    const option = document.createElement("option");
    const differing = candidate.counts.reduce((sum, count, index) => sum + (index > 0 ? count : 0), 0);
    option.value = place;
    option.textContent = `${candidate.name}, ${candidate.what}: ${differing ? `${differing} not identical` : "identical"}`;
    runChoice.append(option);
  }
  runChoice.addEventListener("change", () => { chosen = -1; show(Number(runChoice.value)); });
  for (const box of document.querySelectorAll("input[data-class]")) {
    box.addEventListener("change", () => {
      const index = data.classes.findIndex((entry) => entry.word === box.dataset.class);
      if (box.checked) shown.add(index); else shown.delete(index);
      filterRows();
      redraw();
    });
  }
  for (const link of document.querySelectorAll("a[data-run]")) {
    link.addEventListener("click", (event) => { event.preventDefault(); chosen = -1; show(Number(link.dataset.run)); canvas.scrollIntoView({ block: "center" }); });
  }
  for (const row of rows) {
    row.addEventListener("click", () => choose(Number(row.dataset.finding), true));
    row.addEventListener("keydown", (event) => { if (event.key === "Enter") choose(Number(row.dataset.finding), true); });
  }
  const actions = {
    in: () => zoom(.5), out: () => zoom(2), whole: () => { whole(); redraw(); },
    left: () => pan(-.25), right: () => pan(.25),
    save: () => {
      // Twice as fine as it is seen, for print.
      const picture = document.createElement("canvas"), scale = 3;
      picture.width = canvas.clientWidth * scale;
      picture.height = canvas.clientHeight * scale;
      draw(picture.getContext("2d"), canvas.clientWidth, canvas.clientHeight, scale, []);
      const link = document.createElement("a");
      link.download = `${run.name}.png`;
      link.href = picture.toDataURL("image/png");
      link.click();
    },
  };
  for (const button of document.querySelectorAll("button[data-action]")) {
    button.addEventListener("click", () => actions[button.dataset.action]());
  }

  const timeAt = (px) => from + (px - 62) / (canvas.clientWidth - 76) * (to - from);
  function eventAt(px, py) {
    // The last drawn lies on top; one that is thinner than a finger is met a little beside it.
    for (const slack of [0, 4]) {
      for (let k = boxes.length - 1; k >= 0; k--) {
        const [x0, y0, wide, high] = boxes[k];
        if (px >= x0 - slack && px <= x0 + wide + slack && py >= y0 - slack && py <= y0 + high + slack) return boxes[k];
      }
    }
    return null;
  }
  let drag = null;
  canvas.addEventListener("pointerdown", (event) => {
    drag = { x: event.offsetX, from, to, moved: false };
    canvas.setPointerCapture(event.pointerId);
    canvas.focus({ preventScroll: true });
  });
  canvas.addEventListener("pointermove", (event) => {
    if (drag) {
      const by = (event.offsetX - drag.x) / (canvas.clientWidth - 76) * (drag.to - drag.from);
      drag.moved = drag.moved || Math.abs(event.offsetX - drag.x) > 3;
      if (drag.moved) {
        from = drag.from - by;
        to = drag.to - by;
        canvas.classList.add("dragged");
        redraw();
      }
      return;
    }
    const box = eventAt(event.offsetX, event.offsetY);
    hover.style.display = box ? "block" : "none";
    if (box) {
      const [, , , , side, slip] = box;
      hover.textContent = `${side.toUpperCase()} event ${slip[0]}: ${data.classes[slip[CLASS]].title}\n`
        + `${slip[ONSET]} s to ${slip[END] === null ? "the run's end" : `${slip[END]} s`}\n`
        + `blocks ${slip[FIRST]} to ${slip[LAST]}`;
      hover.style.left = `${Math.min(event.clientX + 14, window.innerWidth - 260)}px`;
      hover.style.top = `${event.clientY + 14}px`;
    }
  });
  canvas.addEventListener("pointerup", (event) => {
    const clicked = drag && !drag.moved;
    drag = null;
    canvas.classList.remove("dragged");
    if (!clicked) return;
    const box = eventAt(event.offsetX, event.offsetY);
    const match = box ? box[5][MATCH] : -1;
    const index = match < 0 ? -1 : data.findings.findIndex((finding) => finding.match === match && data.runs[finding.run] === run);
    if (index >= 0) {
      choose(index, false);
      const row = rows.find((candidate) => Number(candidate.dataset.finding) === index);
      if (row) row.parentElement.closest(".list").scrollTop = row.offsetTop - 60;
    } else {
      chosen = match;
      redraw();
    }
  });
  canvas.addEventListener("pointerleave", () => { hover.style.display = "none"; });
  // The wheel belongs to the page until the picture has been clicked into.
  canvas.addEventListener("wheel", (event) => {
    if (document.activeElement !== canvas && !event.ctrlKey) return;
    event.preventDefault();
    zoom(event.deltaY < 0 ? 1 / 1.25 : 1.25, timeAt(event.offsetX));
  }, { passive: false });
  canvas.addEventListener("dblclick", (event) => zoom(.25, timeAt(event.offsetX)));
  canvas.addEventListener("keydown", (event) => {
    const keys = { ArrowLeft: "left", ArrowRight: "right", "+": "in", "=": "in", "-": "out", "0": "whole" };
    if (keys[event.key]) { event.preventDefault(); actions[keys[event.key]](); }
  });
  window.addEventListener("resize", redraw);
  window.addEventListener("beforeprint", drawNow);

  // The first run whose ruptures differ, else its slip events, seen whole; #finding=N and #run=N lead on.
  const differs = (candidate) => candidate.counts.some((count, index) => index > 0 && count > 0);
  const first = data.runs.find((candidate) => candidate.what === "ruptures" && differs(candidate))
    || data.runs.find((candidate) => candidate.what === "events" && differs(candidate)) || data.runs[0];
  show(data.runs.indexOf(first));
  const asked = new URLSearchParams(location.hash.slice(1));
  if (asked.has("run")) show(Number(asked.get("run")));
  if (asked.has("finding")) choose(Number(asked.get("finding")), true);
  drawNow();
})();
