// What all pages share: light and dark, colours for canvases, tables that can be sorted and filtered.
"use strict";
const asperity = (() => {
  const root = document.documentElement;
  const failed = (what) => { root.dataset.failure = String(what); };
  window.addEventListener("error", (event) => failed(event.message));
  window.addEventListener("unhandledrejection", (event) => failed(event.reason));
  root.classList.add("scripted");

  // Colours stand in the style sheet alone; a probe says what they are now.
  const probe = document.createElement("i");
  probe.hidden = true;
  document.body.append(probe);
  let known = new Map();
  function colour(name) {
    if (!known.has(name)) {
      probe.style.color = `var(--${name})`;
      known.set(name, getComputedStyle(probe).color);
    }
    return known.get(name);
  }
  const repaints = [];
  function repaint() {
    known = new Map();
    repaints.forEach((draw) => draw());
  }

  // Light or dark as the system has it, until the reader says otherwise.
  const theme = document.getElementById("theme");
  const system = matchMedia("(prefers-color-scheme: dark)");
  const isDark = () => (root.dataset.theme || (system.matches ? "dark" : "light")) === "dark";
  const other = () => (isDark() ? "light" : "dark");
  function name() {
    theme.textContent = other();
    theme.setAttribute("aria-label", `show the page ${other()}`);
  }
  theme.addEventListener("click", () => { root.dataset.theme = other(); name(); repaint(); });
  system.addEventListener("change", () => { name(); repaint(); });
  name();
  // Paper is white, and nobody unfolds anything on it; what is folded within that stays so.
  const unfolded = [];
  window.addEventListener("beforeprint", () => {
    root.dataset.printing = "";
    for (const one of document.querySelectorAll("details:not([open])")) {
      if (!one.parentElement.closest("details")) { one.open = true; unfolded.push(one); }
    }
    repaint();
  });
  window.addEventListener("afterprint", () => {
    delete root.dataset.printing;
    for (const one of unfolded.splice(0)) one.open = false;
    repaint();
  });

  // Numbers by size, texts by letter, nothing last.
  function compare(a, b) {
    const empty = (value) => value === null || value === "" || value === "–";
    if (empty(a) || empty(b)) return empty(a) - empty(b);
    const [x, y] = [Number(a), Number(b)];
    return Number.isNaN(x) || Number.isNaN(y) ? String(a).localeCompare(String(b), "en", { numeric: true }) : x - y;
  }
  // A heading that sorts; `sort(descending)` is called, and `others` are no longer sorted by.
  function sortable(heading, others, sort) {
    const button = document.createElement("button");
    button.type = "button";
    button.append(...heading.childNodes);
    heading.append(button);
    button.addEventListener("click", () => {
      const descending = heading.getAttribute("aria-sort") === "ascending";
      for (const one of others()) one.removeAttribute("aria-sort");
      heading.setAttribute("aria-sort", descending ? "descending" : "ascending");
      sort(descending);
    });
  }

  // Tables of the page: sorted by their headings, and filtered by what is typed above them.
  for (const table of document.querySelectorAll("table.sortable")) {
    const headings = [...table.tHead.rows[0].cells], body = table.tBodies[0], rows = [...body.rows];
    const key = (row, column) => row.cells[column].dataset.value ?? row.cells[column].textContent;
    for (const [column, heading] of headings.entries()) {
      sortable(heading, () => headings, (descending) => {
        const inOrder = [...rows].sort((a, b) => compare(key(a, column), key(b, column)));
        // Nothing stays last, whichever way.
        const none = inOrder.filter((row) => ["", "–"].includes(key(row, column)));
        const some = inOrder.filter((row) => !none.includes(row));
        body.append(...(descending ? some.reverse() : some), ...none);
      });
    }
    if (rows.length < 8) continue;
    const label = document.createElement("label"), input = document.createElement("input"), count = document.createElement("span");
    label.className = "controls";
    input.type = "search";
    input.dataset.filters = table.id;
    count.className = "soft";
    count.setAttribute("role", "status");
    label.append("only rows with", input, count);
    table.parentElement.before(label);
    const texts = rows.map((row) => row.textContent.toLowerCase());
    input.addEventListener("input", () => {
      const words = input.value.toLowerCase().split(/\s+/).filter(Boolean);
      let shown = 0;
      for (const [n, row] of rows.entries()) {
        row.hidden = !words.every((word) => texts[n].includes(word));
        shown += !row.hidden;
      }
      count.textContent = words.length ? `${shown} of ${rows.length}` : "";
    });
  }

  // Symbols of the field with their subscripts, as HTML: F_T/F_N.
  const escaped = (text) => text.replace(/[&<>"]/g, (c) => `&#${c.charCodeAt(0)};`);
  const lettered = (text) => escaped(text).replace(/(?<![A-Za-z])([A-Zμτ])_(\w)/g, "$1<sub>$2</sub>");

  const data = (selector) => JSON.parse(document.querySelector(selector).textContent);
  return { root, colour, repaints, compare, sortable, lettered, data };
})();
