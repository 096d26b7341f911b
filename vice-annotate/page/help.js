// The overlay of keys, where they can be changed too.

/** @import {Keys} from "./keys.js" */

import { button, byId, make, setText } from "./dom.js";
import { nameOf, readable } from "./keys.js";

const ASK = "To change a key, press its button and then the new key.";

export class Help {
  /**
   * @param {Keys} keys
   * @param {() => void} changed
   */
  constructor(keys, changed) {
    this.keys = keys;
    this.changed = changed;
    this.dialog = byId("help", HTMLDialogElement);
    this.list = byId("help-keys", HTMLElement);
    this.status = byId("help-status", HTMLElement);
    /** @type {string | null} the action that waits for its new key */
    this.waiting = null;
    byId("help-close", HTMLButtonElement).addEventListener("click", () => this.dialog.close());
    byId("keys-reset", HTMLButtonElement).addEventListener("click", () => {
      keys.reset();
      this.#drawn("The default keys hold again.");
    });
    this.dialog.addEventListener("close", () => (this.waiting = null));
    this.dialog.addEventListener("keydown", (event) => this.#pressed(event));
  }

  toggle() {
    if (this.dialog.open) return this.dialog.close();
    this.#draw();
    setText(this.status, ASK);
    this.dialog.showModal();
  }

  /** @param {KeyboardEvent} event */
  #pressed(event) {
    const key = nameOf(event);
    if (this.waiting === null) {
      if (this.keys.actionOf(key) === "help") {
        event.preventDefault();
        this.dialog.close();
      }
      return;
    }
    if (["shift", "control", "alt", "meta", "ctrl+control", "shift+shift", "alt+alt"].includes(key)) return;
    event.preventDefault();
    event.stopPropagation();
    const action = this.waiting;
    this.waiting = null;
    // Tab and Escape stay with the browser, so that nobody is locked in.
    if (key === "escape" || key === "tab" || key === "shift+tab") return this.#drawn("Nothing changed.");
    const before = this.keys.bindings.find((each) => each.keys.includes(key) && each.action !== action);
    this.keys.set(action, key);
    this.#drawn(before ? `${readable(key)} was "${before.text}", which has lost it.` : `${readable(key)} is set.`);
    const again = this.list.querySelector(`button[data-for="${action}"]`);
    if (again instanceof HTMLElement) again.focus();
  }

  /** @param {string} text */
  #drawn(text) {
    this.#draw();
    setText(this.status, text);
    this.changed();
  }

  #draw() {
    /** @type {Map<string, HTMLElement>} */
    const groups = new Map();
    for (const { action, group, text, keys } of this.keys.bindings) {
      let list = groups.get(group);
      if (!list) {
        list = make("dl");
        groups.set(group, list);
      }
      const change = button(keys.map(readable).join(", ") || "none", () => this.#wait(action, change), {
        label: `Change the key of "${text}", now ${keys.map(readable).join(" or ") || "none"}`,
      });
      change.dataset.for = action;
      // The nine points share a line.
      const line = list.querySelector(".many");
      if (/^point-[2-9]$/.test(action) && line) line.append(change);
      else if (action === "point-1") list.append(make("dt", { text: "Choose point 1 to 9" }), make("dd", { class: "many" }, [change]));
      else list.append(make("dt", { text }), make("dd", {}, [change]));
    }
    this.list.replaceChildren(...[...groups].map(([group, list]) => make("div", {}, [make("h3", { text: group }), list])));
  }

  /**
   * @param {string} action
   * @param {HTMLButtonElement} change
   */
  #wait(action, change) {
    for (const each of this.list.querySelectorAll(".waiting")) each.classList.remove("waiting");
    this.waiting = action;
    change.classList.add("waiting");
    setText(this.status, "Press the new key; Esc leaves it as it is.");
  }
}
