// A table of any length, sorted and filtered: of its rows there are as many on the page as are seen.
"use strict";
asperity.longTable = (box, options) => {
  // columns: [{name, title, number, value(row), text(row)}]; rows are numbers, whatever they stand for.
  const HEIGHT = 26;
  let rows = [], shown = [], chosen = -1, sort = null;
  const table = document.createElement("table"), head = table.createTHead().insertRow(), body = table.createTBody();
  table.setAttribute("role", "grid");
  table.setAttribute("aria-label", options.label);
  table.setAttribute("aria-multiselectable", "false");
  table.tabIndex = 0;
  for (const column of options.columns) {
    const heading = document.createElement("th");
    heading.scope = "col";
    heading.innerHTML = asperity.lettered(column.title);
    if (column.number) heading.className = "number";
    if (column.name === options.sorted) heading.setAttribute("aria-sort", "ascending");
    asperity.sortable(heading, () => [...head.cells], (descending) => { sort = [column, descending]; order(); });
    head.append(heading);
  }
  box.append(table);

  function order() {
    if (sort) {
      const [column, descending] = sort;
      const keyed = shown.map((row) => [column.value(row), row]);
      const some = keyed.filter(([value]) => value !== null), none = keyed.filter(([value]) => value === null);
      some.sort(typeof some[0]?.[0] === "number" ? (a, b) => a[0] - b[0] : (a, b) => asperity.compare(a[0], b[0]));
      if (descending) some.reverse();
      shown = [...some, ...none].map(([, row]) => row);
    }
    place = new Map(shown.map((row, n) => [row, n]));
    fill();
  }
  let place = new Map();

  const gap = (height) => {
    const row = document.createElement("tr"), cell = row.insertCell();
    row.setAttribute("aria-hidden", "true");
    cell.colSpan = options.columns.length;
    cell.className = "gap";
    cell.style.height = `${height}px`;
    return row;
  };
  function fill() {
    const first = Math.max(0, Math.floor(box.scrollTop / HEIGHT) - 8);
    const last = Math.min(shown.length, first + Math.ceil((box.clientHeight || 400) / HEIGHT) + 16);
    const made = shown.slice(first, last).map((row, n) => {
      const line = document.createElement("tr");
      line.id = `${box.id}-${row}`;
      line.dataset.row = row;
      line.setAttribute("aria-rowindex", first + n + 2);
      line.setAttribute("aria-selected", row === chosen);
      for (const column of options.columns) {
        const cell = line.insertCell(), text = column.text(row);
        cell.textContent = text === null ? "–" : text.replace("-", "−");
        cell.className = `${column.number ? "number" : ""}${text === null ? " none" : ""}`;
      }
      return line;
    });
    body.replaceChildren(...(first ? [gap(first * HEIGHT)] : []), ...made, ...(last < shown.length ? [gap((shown.length - last) * HEIGHT)] : []));
    table.setAttribute("aria-rowcount", shown.length + 1);
    if (made.some((line) => Number(line.dataset.row) === chosen)) {
      table.setAttribute("aria-activedescendant", `${box.id}-${chosen}`);
    } else {
      table.removeAttribute("aria-activedescendant");
    }
    asperity.root.dataset.listed = shown.length;
  }
  function reveal() {
    const n = place.get(chosen);
    if (n === undefined) return;
    const top = n * HEIGHT, room = box.clientHeight - HEIGHT;
    if (top < box.scrollTop || top + HEIGHT > box.scrollTop + room) box.scrollTop = Math.max(0, top - room / 2);
  }
  box.addEventListener("scroll", () => requestAnimationFrame(fill), { passive: true });
  body.addEventListener("click", (event) => {
    const line = event.target.closest("tr[data-row]");
    if (!line) return;
    table.focus({ preventScroll: true });
    options.pick(Number(line.dataset.row));
  });
  table.addEventListener("keydown", (event) => {
    if (event.target !== table) return;
    const steps = { ArrowDown: 1, ArrowUp: -1, PageDown: 12, PageUp: -12, Home: -Infinity, End: Infinity };
    if (event.key in steps && shown.length) {
      const now = place.get(chosen) ?? (steps[event.key] > 0 ? -1 : shown.length);
      event.preventDefault();
      options.pick(shown[Math.min(Math.max(now + steps[event.key], 0), shown.length - 1)]);
    } else if (options.key && options.key(event.key)) {
      event.preventDefault();
    }
  });
  new ResizeObserver(() => fill()).observe(box);
  return {
    show(all) { rows = all; shown = rows; chosen = -1; box.scrollTop = 0; order(); },
    filter(accepts) { shown = rows.filter(accepts); box.scrollTop = 0; order(); reveal(); },
    choose(row) { chosen = row; reveal(); fill(); },
    shown: () => shown,
  };
};
