// The space-time map: time across, blocks up, a rectangle for whatever lasted from one time to another on blocks next to
// each other. One map or several above each other, with one time axis. On a canvas and not as SVG, so that tens of
// thousands of rectangles stay quick.
"use strict";
asperity.map = (canvas, options) => {
  const { colour, root } = asperity;
  const LEFT = 62, RIGHT = 14, FOOT = 44;
  const FONT = "system-ui, 'Segoe UI', 'Noto Sans', 'DejaVu Sans', sans-serif";
  const hover = document.getElementById("hover");
  // What is shown: {panels: [{title, count, onset, end, first, last, look}], blocks, from_s, to_s}, each column an array,
  // with times in years if `unit` says so; `place` has that of the first block and from one to the next, else blocks are
  // numbered, and they go downwards if `down`;
  // shown(panel, k) says of each whether it is, and front(panel, k), where there is one, how it passed the blocks:
  // [edges, arrivals, stops], of one block after the other, with one edge more. Marked are [panel, k].
  let what = null, from = 0, to = 1, boxes = [], marked = [];

  // A rectangle's look: colour, hatching and, where it has one, dashes, so that any of them is enough.
  function hatching(look, scale) {
    const fill = colour(`${look.colour}-fill`);
    if (!look.hatch) return fill;
    const side = 8;
    const tile = document.createElement("canvas");
    tile.width = tile.height = side * scale;
    const pen = tile.getContext("2d");
    pen.scale(scale, scale);
    pen.fillStyle = fill;
    pen.fillRect(0, 0, side, side);
    pen.strokeStyle = pen.fillStyle = colour(`${look.colour}-line`);
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
    hatches[look.hatch]();
    const pattern = pen.createPattern(tile, "repeat");
    pattern.setTransform(new DOMMatrix().scale(1 / scale));
    return pattern;
  }
  function swatch(pen, look, x, y, width, height, scale) {
    pen.fillStyle = hatching(look, scale);
    pen.fillRect(x, y, width, height);
    pen.setLineDash(look.dash ? [3, 2] : []);
    pen.strokeStyle = colour(`${look.colour}-line`);
    pen.lineWidth = 1;
    pen.strokeRect(x + .5, y + .5, width - 1, height - 1);
    pen.setLineDash([]);
  }
  // The same on the page: <canvas class="key" data-look="...">.
  function keys() {
    for (const key of document.querySelectorAll("canvas.key")) {
      const scale = 2, look = options.looks.find((one) => one.name === key.dataset.look);
      key.width = 22 * scale;
      key.height = 14 * scale;
      const pen = key.getContext("2d");
      pen.scale(scale, scale);
      if (look) swatch(pen, look, 0, 0, 22, 14, scale);
    }
  }

  // Ticks at 1, 2 or 5 times a power of ten.
  function stepOf(span, count) {
    const raw = span / count, power = 10 ** Math.floor(Math.log10(raw)), lead = raw / power;
    return power * (lead < 1.5 ? 1 : lead < 3.5 ? 2 : lead < 7.5 ? 5 : 10);
  }
  // With so many decimals; far below the least unit with a power of ten, since `toFixed` takes a hundred at most.
  const fixed = (value, digits) => (digits > 20 ? value.toExponential(3) : value.toFixed(digits));
  // Far into a run, seconds alone would repeat ten digits at every tick: a part common to all goes into the axis' title,
  // the rest into a unit that fits.
  function timeAxis(a, b, count) {
    const span = b - a, far = Math.max(Math.abs(a), Math.abs(b));
    const year = 31557600, units = what.unit === "years" ? [["years", 1], ["d", 86400 / year], ["s", 1 / year], ["ms", 1e-3 / year]] : [["s", 1], ["ms", 1e-3], ["µs", 1e-6], ["ns", 1e-9]];
    const step = stepOf(span, count);
    if (span > far * 2e-3) {
      const [unit, size] = far >= .1 ? units[0] : units.find(([, size]) => far >= size) || units[3];
      const digits = Math.max(0, -Math.floor(Math.log10(step / size) + 1e-9));
      return { base: 0, step, label: (t) => fixed(t / size, digits), title: `t (${unit})` };
    }
    const [unit, size] = units.find(([, size]) => span >= size) || units[3];
    const coarse = 10 ** Math.ceil(Math.log10(span));
    const digits = Math.max(0, -Math.floor(Math.log10(coarse) + 1e-9));
    const fine = Math.max(0, -Math.floor(Math.log10(step / size) + 1e-9));
    const origin = Number((Math.floor(a / coarse) * coarse).toFixed(Math.min(digits, 20)));
    return {
      base: origin, step,
      label: (t) => fixed(t / size, fine),
      title: `t − ${origin.toFixed(Math.min(digits, 20))} ${units[0][0]} (${unit})`,
    };
  }
  function ticks(across) {
    const axis = timeAxis(from, to, across / 95), at = [];
    for (let k = Math.ceil((from - axis.base) / axis.step); k * axis.step + axis.base <= to; k++) at.push(k * axis.step);
    return { axis, at };
  }

  // The legend in as many lines as it takes, each entry with its place.
  const ruler = document.createElement("canvas").getContext("2d");
  function legendLines(across) {
    const lines = [[]];
    let at = 0;
    ruler.font = `12px ${FONT}`;
    for (const entry of options.legend(what)) {
      const wide = (entry.mark ? 44 : 28) + ruler.measureText(entry.text).width;
      if (at && at + wide > across) { lines.push([]); at = 0; }
      lines[lines.length - 1].push({ ...entry, at });
      at += wide + 18;
    }
    return lines;
  }

  // Where things are in a picture of this size.
  function layout(width, height) {
    const heading = options.heading ? options.heading(what) : [], count = what.panels.length;
    const top = 12 + 17 * heading.length, across = width - LEFT - RIGHT;
    const lines = options.legend ? legendLines(across) : [], legend = lines.length ? 12 + 18 * lines.length : 0, gap = options.gap ?? 12;
    const panel = (height - top - FOOT - legend - gap * (count - 1)) / count;
    const tops = what.panels.map((_, n) => top + n * (panel + gap)), rowHeight = panel / what.blocks;
    return {
      width, height, heading, lines, left: LEFT, right: RIGHT, across, panel, tops, foot: tops[count - 1] + panel, from, to,
      x: (t) => LEFT + (t - from) / (to - from) * across,
      y: (n, block) => tops[n] + (what.down ? block * rowHeight : panel - block * rowHeight),
    };
  }
  // Top and height of what is on blocks next to each other, no lower than it can be seen.
  function spanOf(y, n, first, last) {
    const [a, b] = [y(n, first - 1), y(n, last)];
    return [Math.min(a, b), Math.max(Math.abs(a - b), 1.5)];
  }
  // A text that is cut where there is no room for it.
  function fitted(pen, text, room) {
    if (pen.measureText(text).width <= room) return text;
    let cut = text;
    while (cut.length > 1 && pen.measureText(`${cut}…`).width > room) cut = cut.slice(0, -1);
    return `${cut}…`;
  }

  // From this width on, in dots, the front of a rupture is drawn instead of its rectangle.
  const FRONT = 40;
  // A time at each block, as stairs from the first edge to the last or back.
  function stairs(pen, edges, x, backwards) {
    const order = [...x.keys()];
    for (const n of backwards ? order.reverse() : order) {
      pen.lineTo(x[n], edges[n + (backwards ? 1 : 0)]);
      pen.lineTo(x[n], edges[n + (backwards ? 0 : 1)]);
    }
  }
  function front(pen, place, n, [edges, arrivals, stops], fill, line) {
    const within = (t) => Math.min(Math.max(place.x(t), place.left - 4), place.left + place.across + 4);
    const y = edges.map((edge) => place.y(n, edge)), came = arrivals.map(within), stopped = stops.map(within);
    pen.beginPath();
    stairs(pen, y, came, false);
    stairs(pen, y, stopped, true);
    pen.fillStyle = fill;
    pen.fill();
    pen.lineWidth = 1;
    pen.strokeStyle = line;
    pen.setLineDash([3, 2]);
    pen.beginPath(); stairs(pen, y, stopped, false); pen.stroke();
    pen.setLineDash([]);
    pen.lineWidth = 2;
    pen.strokeStyle = colour("ink");
    pen.beginPath(); stairs(pen, y, came, false); pen.stroke();
    pen.lineWidth = 1;
  }

  function frame(pen, place) {
    const { left, across, panel, tops, foot, x, y } = place, { axis, at } = ticks(across);
    pen.font = `12px ${FONT}`;
    pen.lineWidth = 1;
    pen.textAlign = "center";
    for (const tick of at) {
      const across = Math.round(x(tick + axis.base)) + .5;
      pen.strokeStyle = colour("grid");
      for (const top of tops) { pen.beginPath(); pen.moveTo(across, top); pen.lineTo(across, top + panel); pen.stroke(); }
      pen.strokeStyle = pen.fillStyle = colour("ink");
      pen.beginPath(); pen.moveTo(across, foot); pen.lineTo(across, foot + 5); pen.stroke();
      pen.fillText(axis.label(tick), across, foot + 18);
    }
    pen.fillStyle = colour("ink");
    pen.fillText(axis.title, left + across / 2, foot + 36);
    const step = Math.max(1, stepOf(what.blocks, 5));
    pen.textAlign = "right";
    for (const top of tops.keys()) {
      const labels = [1];
      for (let block = step; block < what.blocks; block += step) if (block > step / 2) labels.push(block);
      if (what.blocks - labels[labels.length - 1] > step / 2) labels.push(what.blocks);
      if (what.place) {
        const [first, spacing] = what.place, last = first + spacing * (what.blocks - 1), by = stepOf(last || spacing, 5);
        for (let k = Math.ceil(first / by); k * by <= last; k++) pen.fillText(String(Number((k * by).toPrecision(6))), left - 8, y(top, (k * by - first) / spacing + .5) + 4);
      } else for (const block of labels) pen.fillText(String(block), left - 8, y(top, block - .5) + 4);
      pen.save();
      pen.translate(16, tops[top] + panel / 2);
      pen.rotate(-Math.PI / 2);
      pen.textAlign = "center";
      pen.fillText(what.panels[top].title || "block", 0, 0);
      pen.restore();
    }
  }

  // Draws the picture into any canvas; gives how many rectangles fall into view.
  function draw(pen, width, height, scale, hits) {
    const place = layout(width, height), { left, across, panel, tops, x, y } = place;
    pen.setTransform(scale, 0, 0, scale, 0, 0);
    pen.fillStyle = colour("paper");
    pen.fillRect(0, 0, width, height);
    frame(pen, place);
    const fills = options.looks.map((look) => hatching(look, scale));
    const lines = options.looks.map((look) => colour(`${look.colour}-line`));
    const inView = [], fronts = new Set();
    let drawn = 0;
    for (const [n, all] of what.panels.entries()) {
      const passes = options.looks.map(() => []);
      for (let k = 0; k < all.count; k++) {
        if (all.end[k] < from || all.onset[k] > to || !what.shown(n, k)) continue;
        passes[all.look[k]].push(k);
        drawn++;
      }
      inView.push(passes);
    }
    const isDense = drawn > across;
    let seen = 0;
    for (const [n, all] of what.panels.entries()) {
      fronts.clear();
      pen.save();
      pen.beginPath();
      pen.rect(left, tops[n], across, panel);
      pen.clip();
      for (const [pass, members] of inView[n].entries()) {
        const look = options.looks[pass];
        pen.strokeStyle = lines[pass];
        pen.setLineDash(look.dash ? [3, 2] : []);
        for (const k of members) {
          // Most slips last less than a dot of the picture: none is thinner than that.
          const x0 = Math.max(x(all.onset[k]), left - 4), x1 = Math.min(x(all.end[k]), left + across + 4);
          const wide = Math.max(x1 - x0, 1.5), [y0, high] = spanOf(y, n, all.first[k], all.last[k]);
          if (wide < 3) {
            // Where they lie on each other, many look darker than one.
            pen.globalAlpha = isDense ? .65 : 1;
            pen.fillStyle = lines[pass];
            pen.fillRect(x0, y0, wide, high);
            pen.globalAlpha = 1;
          } else if (wide >= FRONT && what.front?.(n, k)) {
            front(pen, place, n, what.front(n, k), fills[pass], lines[pass]);
            fronts.add(k);
          } else {
            pen.fillStyle = fills[pass];
            pen.fillRect(x0, y0, wide, high);
            if (high >= 3) pen.strokeRect(x0 + .5, y0 + .5, wide - 1, high - 1);
          }
          if (hits) hits.push([x0, y0, wide, high, n, k]);
        }
      }
      pen.setLineDash([]);
      pen.strokeStyle = colour("ink");
      pen.lineWidth = 2;
      for (const [panel, k] of marked) {
        // What is drawn as a front is told apart by that.
        if (panel !== n || all.end[k] < from || all.onset[k] > to || fronts.has(k)) continue;
        const x0 = x(all.onset[k]), wide = Math.max(x(all.end[k]) - x0, 1.5);
        const [y0, high] = spanOf(y, n, all.first[k], all.last[k]);
        pen.strokeRect(x0 - 2.5, y0 - 2.5, wide + 5, high + 5);
      }
      seen += fronts.size;
      pen.lineWidth = 1;
      pen.restore();
      pen.strokeStyle = colour("ink");
      pen.strokeRect(left + .5, tops[n] + .5, across - 1, panel);
    }
    if (hits) root.dataset.fronts = seen;
    if (options.over) options.over(pen, place);

    // What a picture must say when it is seen without its page.
    pen.fillStyle = colour("ink");
    pen.textAlign = "left";
    pen.font = `600 13px ${FONT}`;
    for (const [line, words] of place.heading.entries()) pen.fillText(fitted(pen, words, across), left, 18 + 17 * line);
    pen.font = `12px ${FONT}`;
    for (const [n, line] of place.lines.entries()) {
      const top = height - 22 - 18 * (place.lines.length - 1 - n);
      for (const { look, dash, text, mark, at } of line) {
        if (dash) {
          // A line: of ink or, if it is dashed, a thin one.
          pen.strokeStyle = colour("ink");
          pen.lineWidth = dash.length ? 1 : 2;
          pen.setLineDash(dash);
          pen.beginPath(); pen.moveTo(left + at, top + 6.5); pen.lineTo(left + at + 22, top + 6.5); pen.stroke();
          pen.setLineDash([]);
        } else swatch(pen, options.looks[look], left + at, top, 22, 13, scale);
        if (mark) mark(pen, left + at + 34, top + 6.5);
        pen.fillStyle = colour("ink");
        pen.fillText(text, left + at + (mark ? 44 : 28), top + 11);
      }
    }
    return drawn;
  }

  let waiting = false;
  function redraw() {
    if (waiting) return;
    waiting = true;
    requestAnimationFrame(() => { waiting = false; drawNow(); });
  }
  function drawNow() {
    if (!what) return;
    const scale = Math.max(1, window.devicePixelRatio || 1);
    const width = canvas.clientWidth, height = canvas.clientHeight;
    if (!width || !height) return;
    canvas.width = width * scale;
    canvas.height = height * scale;
    boxes = [];
    const drawn = draw(canvas.getContext("2d"), width, height, scale, boxes);
    root.dataset.drawn = drawn;
    if (options.drawn) options.drawn(drawn);
  }
  // Shows this part of the time axis; whoever has it already is not told.
  function look(a, b, isTold = true) {
    if (!(b > a)) return;
    [from, to] = [a, b];
    if (isTold && options.seen) options.seen(from, to);
    redraw();
  }
  function whole() {
    const margin = (what.to_s - what.from_s) * .01 || 1e-9;
    look(what.from_s - margin, what.to_s + margin);
  }
  function zoom(factor, centre = (from + to) / 2) {
    // No closer than doubles can tell times apart.
    const least = Math.max(Math.abs(from), Math.abs(to)) * 1e-13;
    if ((to - from) * factor < least || (to - from) * factor > (what.to_s - what.from_s) * 4 + 1e-9) return;
    look(centre + (from - centre) * factor, centre + (to - centre) * factor);
  }
  const pan = (share) => look(from + (to - from) * share, to + (to - from) * share);
  function save() {
    // Finer than it is seen, for print.
    const picture = document.createElement("canvas"), scale = 3;
    picture.width = canvas.clientWidth * scale;
    picture.height = canvas.clientHeight * scale;
    draw(picture.getContext("2d"), canvas.clientWidth, canvas.clientHeight, scale, null);
    const link = document.createElement("a");
    link.download = `${what.name}.png`;
    link.href = picture.toDataURL("image/png");
    link.click();
  }
  const actions = { in: () => zoom(.5), out: () => zoom(2), whole, left: () => pan(-.25), right: () => pan(.25), save };
  for (const button of document.querySelectorAll("button[data-action]")) {
    button.addEventListener("click", () => actions[button.dataset.action]());
  }

  const timeAt = (px) => from + (px - LEFT) / (canvas.clientWidth - LEFT - RIGHT) * (to - from);
  function boxAt(px, py) {
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
      const by = (event.offsetX - drag.x) / (canvas.clientWidth - LEFT - RIGHT) * (drag.to - drag.from);
      drag.moved = drag.moved || Math.abs(event.offsetX - drag.x) > 3;
      if (drag.moved) {
        canvas.classList.add("dragged");
        look(drag.from - by, drag.to - by);
      }
      return;
    }
    const box = boxAt(event.offsetX, event.offsetY);
    hover.style.display = box ? "block" : "none";
    if (box) {
      hover.innerHTML = asperity.lettered(options.words(box[4], box[5]));
      hover.style.left = `${Math.min(event.clientX + 14, window.innerWidth - 260)}px`;
      hover.style.top = `${event.clientY + 14}px`;
    }
  });
  canvas.addEventListener("pointerup", (event) => {
    const clicked = drag && !drag.moved;
    drag = null;
    canvas.classList.remove("dragged");
    if (!clicked) return;
    const box = boxAt(event.offsetX, event.offsetY);
    options.pick(box ? box[4] : -1, box ? box[5] : -1);
  });
  canvas.addEventListener("pointercancel", () => { drag = null; canvas.classList.remove("dragged"); });
  canvas.addEventListener("pointerleave", () => { hover.style.display = "none"; });
  // The wheel belongs to the page until the picture has been clicked into.
  canvas.addEventListener("wheel", (event) => {
    if (document.activeElement !== canvas && !event.ctrlKey) return;
    event.preventDefault();
    zoom(event.deltaY < 0 ? 1 / 1.25 : 1.25, timeAt(event.offsetX));
  }, { passive: false });
  canvas.addEventListener("dblclick", (event) => zoom(.25, timeAt(event.offsetX)));
  // Whatever else shows the same times may hand its keys on.
  function key(event) {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const names = { ArrowLeft: "left", ArrowRight: "right", "+": "in", "=": "in", "-": "out", "0": "whole" };
    if (!event.shiftKey && options.key && options.key(event.key)) {
      event.preventDefault();
    } else if (names[event.key]) {
      event.preventDefault();
      actions[names[event.key]]();
    }
  }
  canvas.addEventListener("keydown", key);
  new ResizeObserver(redraw).observe(canvas);
  window.addEventListener("beforeprint", drawNow);
  asperity.repaints.push(() => { keys(); drawNow(); });
  keys();

  return {
    // Shows other data, whole.
    show(data) { what = data; marked = []; whole(); },
    mark(items) { marked = items; redraw(); },
    view: () => [from, to],
    // What others draw beside it has the same font and the same margins.
    FONT, LEFT, RIGHT, FRONT,
    ticks, look, zoom, whole, redraw, drawNow, key,
  };
};
