// What the page tells: passing notes in a corner, and banners that stay until dealt with.

import { button, make } from "./dom.js";

const PASSING_MS = { info: 4500, warning: 9000, error: 12000 };
const MOST = 3;

export class Notices {
  /**
   * @param {HTMLElement} notes a polite live region
   * @param {HTMLElement} banners
   */
  constructor(notes, banners) {
    this.notes = notes;
    this.banners = banners;
  }

  /**
   * @param {"info" | "warning" | "error"} kind
   * @param {string} text
   */
  tell(kind, text) {
    // Of plain notes only the newest is worth its room; what went wrong stays a while.
    for (const old of this.notes.querySelectorAll(".note")) {
      if (old.classList.contains("info") || old.querySelector("span")?.textContent === text) old.remove();
    }
    const note = make("div", { class: `note ${kind}` }, [make("span", { text })]);
    note.append(button("×", () => note.remove(), { class: "plain", label: "Close this note" }));
    this.notes.append(note);
    while (this.notes.childElementCount > MOST) this.notes.firstElementChild?.remove();
    window.setTimeout(() => note.remove(), PASSING_MS[kind]);
  }

  /**
   * @param {string} id one banner each; a second one replaces the first
   * @param {"info" | "warning" | "error"} kind
   * @param {string} text
   * @param {[string, () => void][]} [doings] buttons
   */
  banner(id, kind, text, doings = []) {
    const key = `${kind} ${text} ${doings.map(([each]) => each).join()}`;
    const there = this.#find(id);
    if (there?.dataset.key === key) return;
    const banner = make("div", { class: `banner ${kind}` }, [make("span", { text })]);
    banner.dataset.id = id;
    banner.dataset.key = key;
    banner.setAttribute("role", kind === "info" ? "status" : "alert");
    for (const [name, act] of doings) banner.append(button(name, act));
    if (there) there.replaceWith(banner);
    else this.banners.append(banner);
  }

  /** @param {string} id */
  clear(id) {
    this.#find(id)?.remove();
  }

  /**
   * @param {string} id
   * @returns {HTMLElement | null}
   */
  #find(id) {
    for (const each of this.banners.children) if (each instanceof HTMLElement && each.dataset.id === id) return each;
    return null;
  }
}
