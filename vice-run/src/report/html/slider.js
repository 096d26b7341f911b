for (const box of document.querySelectorAll(".frames")) {
  const strip = box.querySelector(".strip");
  const bar = box.querySelector(".slider");
  const input = bar.querySelector("input");
  const output = bar.querySelector("output");
  const shots = strip.children;
  let moved = false;
  const say = () => { output.textContent = shots[input.value].dataset.at; };
  const go = () => { moved = true; strip.scrollLeft = shots[input.value].offsetLeft - shots[0].offsetLeft; say(); };
  input.max = shots.length - 1;
  input.addEventListener("input", go);
  strip.addEventListener("scroll", () => {
    if (moved) { moved = false; return; }
    input.value = Math.round(strip.scrollLeft / (shots.length > 1 ? shots[1].offsetLeft - shots[0].offsetLeft : 1));
    say();
  }, { passive: true });
  input.value = strip.dataset.first;
  bar.hidden = false;
  go();
}
