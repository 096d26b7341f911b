// Values under the pointer, zoom in time, streams on and off. All values are read back from the curves that are drawn.
const make = (name, values) => {
  const element = document.createElementNS(document.querySelector("svg").namespaceURI, name);
  for (const [key, value] of Object.entries(values)) element.setAttribute(key, value);
  return element;
};
const short = (value) => {
  const size = Math.abs(value);
  return size >= 1e5 || (size > 0 && size < 1e-4) ? value.toExponential(2) : value.toFixed(size >= 100 ? 1 : size >= 1 ? 2 : 4);
};
for (const run of document.querySelectorAll(".run")) {
  const views = [...run.querySelectorAll("svg.view")].map((view) => {
    const [x, y, width, height] = view.getAttribute("viewBox").split(" ").map(Number);
    let marks = view.previousElementSibling;
    while (marks && !marks.classList.contains("xmarks")) marks = marks.previousElementSibling;
    const { x0, x1, y0, y1, unit } = view.dataset;
    const plot = view.parentElement;
    return { view, plot, marks, x, y, width, height, unit, y0: Number(y0), y1: Number(y1), x0: Number(x0), x1: Number(x1), labels: Boolean(marks?.querySelector("text")), cursor: null };
  });
  const keys = run.querySelector(".switches");
  const hint = keys?.querySelector(".hint");
  if (hint) hint.hidden = views.length === 0;
  const switches = [...run.querySelectorAll("[data-switch]")];
  const flip = (each) => {
    const out = each.classList.toggle("out");
    each.setAttribute("aria-pressed", String(!out));
    for (const part of run.querySelectorAll("[data-s]")) if (part.dataset.s === each.dataset.switch) part.classList.toggle("off", out);
  };
  for (const each of switches) {
    each.setAttribute("role", "button");
    each.setAttribute("tabindex", "0");
    each.setAttribute("aria-pressed", "true");
    each.addEventListener("click", () => flip(each));
    each.addEventListener("keydown", (event) => {
      if (event.key !== "Enter" && event.key !== " ") return;
      event.preventDefault();
      flip(each);
    });
  }
  if (views.length === 0) continue;
  const whole = [views[0].x0, views[0].x1];
  let now = [...whole];
  let time = null;
  const toX = (panel, t) => panel.x + ((t - now[0]) / (now[1] - now[0])) * panel.width;
  const ticks = () => {
    const least = (now[1] - now[0]) / 6;
    const power = 10 ** Math.floor(Math.log10(least));
    const step = [1, 2, 5, 10].map((f) => f * power).find((s) => s >= least * (1 - 1e-9));
    const digits = Math.max(0, -Math.floor(Math.log10(step)));
    const first = Math.ceil(now[0] / step - 1e-6);
    const list = [];
    for (let i = first; i * step <= now[1] + 1e-6 * step; i += 1) list.push([i * step, (i * step).toFixed(digits)]);
    return list;
  };
  const cursor = () => {
    for (const panel of views) {
      panel.cursor?.remove();
      panel.cursor = null;
      if (time === null || time < now[0] || time > now[1]) continue;
      const x = toX(panel, time);
      panel.cursor = make("path", { class: "line cursor", d: `M${x} ${panel.y}V${panel.y + panel.height}` });
      panel.plot.append(panel.cursor);
    }
  };
  const zoom = (from, to) => {
    const least = 1e-3 * (whole[1] - whole[0]);
    from = Math.max(whole[0], from);
    to = Math.min(whole[1], to);
    if (!(to - from > least)) return;
    now = [from, to];
    const isWhole = from === whole[0] && to === whole[1];
    for (const panel of views) {
      const scale = panel.width / (whole[1] - whole[0]);
      panel.view.setAttribute("viewBox", `${panel.x + (from - whole[0]) * scale} ${panel.y} ${(to - from) * scale} ${panel.height}`);
      panel.view.classList.toggle("zoomed", !isWhole);
      if (!panel.marks) continue;
      panel.marks.replaceChildren();
      for (const [t, label] of ticks()) {
        const x = toX(panel, t);
        panel.marks.append(make("path", { class: "line grid", d: `M${x} ${panel.y}V${panel.y + panel.height}` }));
        if (!panel.labels) continue;
        const text = make("text", { x, y: panel.y + panel.height + 15, "text-anchor": "middle" });
        text.textContent = label;
        panel.marks.append(text);
      }
    }
    cursor();
    run.dispatchEvent(new CustomEvent("vice-range", { detail: now }));
  };
  const curves = new WeakMap();
  const places = (path) => {
    if (!curves.has(path)) {
      const numbers = (path.getAttribute("d").match(/-?[\d.]+/g) ?? []).map(Number);
      curves.set(path, numbers.flatMap((x, at) => (at % 2 ? [] : [[x, numbers[at + 1]]])));
    }
    return curves.get(path);
  };
  const valuesAt = (panel, t) => {
    const x = panel.x + ((t - panel.x0) / (panel.x1 - panel.x0)) * panel.width;
    const found = [];
    for (const group of panel.view.querySelectorAll("[data-name]:not(.off)")) {
      let best = null;
      for (const path of group.querySelectorAll("path.line")) {
        for (const place of places(path)) if (!best || Math.abs(place[0] - x) < Math.abs(best[0] - x)) best = place;
      }
      if (!best || Math.abs(best[0] - x) > 0.03 * panel.width) continue;
      const value = panel.y0 + ((panel.y + panel.height - best[1]) / panel.height) * (panel.y1 - panel.y0);
      found.push(`${group.dataset.name} ${short(value)} ${panel.unit}`);
    }
    return found;
  };
  run.addEventListener("vice-time", ({ detail }) => { time = detail.t; cursor(); });
  for (const plot of new Set(views.map((panel) => panel.plot))) {
    const own = views.filter((panel) => panel.plot === plot);
    const figure = plot.closest("figure");
    const tip = document.createElement("div");
    tip.className = "tip";
    tip.hidden = true;
    tip.setAttribute("role", "status");
    figure.append(tip);
    plot.setAttribute("tabindex", "0");
    const at = (event) => {
      const place = new DOMPoint(event.clientX, event.clientY).matrixTransform(plot.getScreenCTM().inverse());
      const near = own.find((panel) => place.y <= panel.y + panel.height + 10) ?? own[own.length - 1];
      const share = Math.max(0, Math.min(1, (place.x - near.x) / near.width));
      return { near, t: now[0] + share * (now[1] - now[0]) };
    };
    const tell = (near, t, clientX) => {
      run.dispatchEvent(new CustomEvent("vice-time", { detail: { t } }));
      tip.textContent = [`${t.toFixed(2)} s`, ...valuesAt(near, t)].join("\n");
      tip.hidden = false;
      const box = figure.getBoundingClientRect();
      const scale = plot.getBoundingClientRect();
      tip.style.top = `${scale.top - box.top + (near.y / plot.viewBox.baseVal.height) * scale.height + 4}px`;
      const right = clientX - box.left > box.width / 2;
      tip.style.left = right ? "auto" : `${clientX - box.left + 14}px`;
      tip.style.right = right ? `${box.right - clientX + 14}px` : "auto";
    };
    let from = null;
    let band = null;
    plot.addEventListener("pointerdown", (event) => {
      if (event.button !== 0) return;
      from = at(event).t;
      plot.setPointerCapture(event.pointerId);
    });
    plot.addEventListener("pointermove", (event) => {
      const { near, t } = at(event);
      tell(near, t, event.clientX);
      band?.remove();
      band = null;
      if (from === null) return;
      const [left, right] = [from, t].sort((a, b) => a - b).map((each) => toX(near, each));
      band = make("rect", { class: "band", x: left, y: near.y, width: right - left, height: near.height });
      plot.append(band);
    });
    const leave = () => { tip.hidden = true; band?.remove(); band = null; };
    plot.addEventListener("pointerup", (event) => {
      if (from === null) return;
      const { t } = at(event);
      const [left, right] = [from, t].sort((a, b) => a - b);
      from = null;
      leave();
      if (right - left > 0.02 * (now[1] - now[0])) zoom(left, right);
      else run.dispatchEvent(new CustomEvent("vice-time", { detail: { t, jump: true } }));
    });
    plot.addEventListener("pointercancel", () => { from = null; leave(); });
    plot.addEventListener("pointerleave", leave);
    plot.addEventListener("dblclick", () => zoom(...whole));
    plot.addEventListener("keydown", (event) => {
      const by = { ArrowLeft: -0.01, ArrowRight: 0.01 }[event.key];
      if (!by) return;
      event.preventDefault();
      event.stopPropagation();
      const t = Math.max(now[0], Math.min(now[1], (time ?? (now[0] + now[1]) / 2) + by * (now[1] - now[0])));
      const box = plot.getBoundingClientRect();
      tell(own[0], t, box.left + (toX(own[0], t) / plot.viewBox.baseVal.width) * box.width);
    });
    plot.addEventListener("blur", leave);
  }
  document.addEventListener("keydown", (event) => {
    if (!lets(event.target) || event.ctrlKey || event.metaKey || event.altKey) return;
    const middle = time !== null && time >= now[0] && time <= now[1] ? time : (now[0] + now[1]) / 2;
    const around = (factor) => zoom(middle - factor * (middle - now[0]), middle + factor * (now[1] - middle));
    if (/^[1-9]$/.test(event.key)) {
      const each = switches.find((s) => s.dataset.switch === String(Number(event.key) - 1));
      if (each) flip(each);
    } else if (event.key === "+" || event.key === "=") around(0.5);
    else if (event.key === "-") around(2);
    else if (event.key === "0") zoom(...whole);
    else if (event.key === "ArrowLeft" || event.key === "ArrowRight" || event.key === " ") {
      const strip = run.querySelector(".strip");
      if (!strip || event.target !== document.body) return;
      strip.dispatchEvent(new KeyboardEvent("keydown", { key: event.key }));
    } else return;
    event.preventDefault();
  });
}
