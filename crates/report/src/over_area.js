// The map over the area of contact of whichever rupture is picked: a copy of the map that the page has of each run, in
// other colours. Without a picked rupture it is that of the page.
"use strict";
asperity.overArea = (hover) => {
  const box = document.getElementById("over-area");
  if (!box) return () => {};
  const [place, caption] = [box.querySelector("div"), box.querySelector("figcaption")], shows = document.getElementById("over-area-shows");
  const BANDS = 12, digits = (value) => Number(value.toPrecision(4)).toString();
  let run = null, k = -1, told = [];

  function draw() {
    const original = run.area && document.getElementById(`run-${run.name}`)?.querySelector(".over-area");
    box.hidden = !original;
    if (!original) return;
    place.replaceChildren(...[...original.children].slice(0, 2).map((one) => one.cloneNode(true)));
    caption.innerHTML = original.querySelector("figcaption").innerHTML;
    const about = caption.querySelector(".about"), cells = [...place.querySelectorAll(".cells path")];
    const { slipped, maps, columns, stride } = run.area;
    // The widest one with a map, as on the page.
    const has = (n) => maps[run.ruptures[n][0]];
    const of = k >= 0 ? k : run.ruptures.reduce((best, _, n) => (has(n) && (best < 0 || slipped[n] > slipped[best]) ? n : best), -1);
    const [steps, arrivals, slips] = has(of) ?? [[], [], []], isSlip = shows.value === "slip";
    const values = isSlip ? slips : arrivals.map((t) => t * run.dt * 1e6), most = values.reduce((a, b) => Math.max(a, b ?? 0), 0);
    for (const cell of cells) { cell.setAttribute("class", "n"); }
    place.querySelector(".first").replaceChildren();
    told = [];
    let at = 0;
    for (const [n, step] of steps.entries()) {
      at += step;
      const [x, y] = cells[at].getAttribute("d").slice(1).split("h")[0].split(" ").map(Number);
      if (values[n] !== null) cells[at].setAttribute("class", `b${Math.min(Math.floor(values[n] / (most || 1) * BANDS), BANDS - 1)}`);
      if (arrivals[n] === 0) {
        const mark = document.createElementNS("http://www.w3.org/2000/svg", "circle");
        for (const [name, value] of [["cx", x + .5], ["cy", y + .5], ["r", .22]]) mark.setAttribute(name, value);
        place.querySelector(".first").append(mark);
      }
      told[at] = `column ${at % columns * stride + 1}, row ${Math.floor(at / columns) * stride + 1}\n${digits(arrivals[n] * run.dt * 1e6)} µs after the onset${slips[n] === null ? "" : `\nslip ${digits(slips[n])} µm`}`;
    }
    place.querySelector(".to").textContent = `${digits(most)} ${isSlip ? "µm" : "µs"}`;
    const what = isSlip ? "how far each contact slid" : "when its front came to each contact, after its onset";
    about.textContent = !steps.length ? `The page does not hold the map of rupture ${run.ruptures[of]?.[0]}.`
      : `Rupture ${run.ruptures[of][0]}${k < 0 ? ", the widest" : ""}, ${slipped[of]} contacts: ${what}.`;
    document.documentElement.dataset.overArea = `${run.ruptures[of]?.[0]} ${shows.value} ${steps.length}`;
  }
  place.addEventListener("pointermove", (event) => {
    const words = told[[...place.querySelectorAll(".cells path")].indexOf(event.target)];
    hover.style.display = words ? "block" : "none";
    if (!words) return;
    hover.innerText = words;
    hover.style.left = `${Math.min(event.clientX + 14, window.innerWidth - 260)}px`;
    hover.style.top = `${event.clientY + 14}px`;
  });
  place.addEventListener("pointerleave", () => { hover.style.display = "none"; });
  shows.addEventListener("change", draw);
  return (shown, picked) => { [run, k] = [shown, picked]; draw(); };
};
