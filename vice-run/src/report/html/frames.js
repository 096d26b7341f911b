"use strict";
// Frames one at a time, with a slider and a film; a run tells its plots the time by the event "vice-time", and they tell it.
const lets = (target) => !(target instanceof Element && target.closest("input, select, textarea, summary, a"));
for (const run of document.querySelectorAll(".run")) {
  const strip = run.querySelector(".strip");
  const bar = run.querySelector(".slider");
  if (!strip || !bar) continue;
  const figures = [...strip.children];
  const times = figures.map((figure) => Number(figure.dataset.t));
  const input = bar.querySelector("input");
  const output = bar.querySelector("output");
  const play = bar.querySelector(".play");
  let shown = Number(strip.dataset.first);
  let timer = 0;
  let range = [-Infinity, Infinity];
  const show = (at, tell) => {
    shown = Math.max(0, Math.min(figures.length - 1, at));
    figures.forEach((figure, place) => figure.classList.toggle("on", place === shown));
    input.value = shown;
    output.textContent = `${times[shown].toFixed(2)} s`;
    if (tell) run.dispatchEvent(new CustomEvent("vice-time", { detail: { t: times[shown], from: "frames" } }));
  };
  const stop = () => { clearInterval(timer); timer = 0; play.textContent = "Play"; };
  const step = () => {
    const within = times.map((t, place) => [t, place]).filter(([t]) => t >= range[0] && t <= range[1]).map(([, place]) => place);
    if (within.length === 0) return stop();
    show(within.find((place) => place > shown) ?? within[0], true);
  };
  const toggle = () => {
    if (timer) return stop();
    timer = setInterval(step, 160);
    play.textContent = "Stop";
  };
  const go = (at) => { stop(); show(at, true); };
  input.max = figures.length - 1;
  input.addEventListener("input", () => go(Number(input.value)));
  play.addEventListener("click", toggle);
  run.addEventListener("vice-time", ({ detail }) => {
    if (detail.from === "frames" || !detail.jump) return;
    const off = times.map((t) => Math.abs(t - detail.t));
    stop();
    show(off.indexOf(Math.min(...off)), true);
  });
  run.addEventListener("vice-range", ({ detail }) => { range = detail; });
  strip.addEventListener("keydown", (event) => {
    const by = { ArrowLeft: -1, ArrowRight: 1 }[event.key];
    if (by) go(shown + by);
    else if (event.key === " ") toggle();
    else return;
    event.preventDefault();
    event.stopPropagation();
  });
  let from = null;
  strip.addEventListener("pointerdown", (event) => { from = event.clientX; });
  strip.addEventListener("pointerup", (event) => {
    if (from === null) return;
    const moved = event.clientX - from;
    from = null;
    if (Math.abs(moved) > 40) go(shown - Math.sign(moved));
  });
  strip.classList.add("one");
  bar.hidden = false;
  show(shown, false);
}
for (const whole of document.querySelectorAll(".whole")) {
  const press = () => whole.closest("figure").classList.toggle("large");
  whole.addEventListener("click", press);
  whole.addEventListener("keydown", (event) => {
    if (event.key !== "Enter" && event.key !== " ") return;
    event.preventDefault();
    press();
  });
}
