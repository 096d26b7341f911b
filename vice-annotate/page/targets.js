// The panel that has calibration targets found. What was asked for last is remembered by this browser.

/** @import {App} from "./app.js" */

import { byId, setText } from "./dom.js";

const STORE = "vice.annotate.targets";
const BOARD = /^\s*(\d{1,3})\s*[x×*, ]\s*(\d{1,3})\s*$/i;

export class Targets {
  /** @param {App} app */
  constructor(app) {
    this.app = app;
    this.dialog = byId("targets", HTMLDialogElement);
    this.family = byId("targets-family", HTMLSelectElement);
    this.border = byId("targets-border", HTMLSelectElement);
    this.board = byId("targets-board", HTMLInputElement);
    this.keep = byId("targets-select", HTMLInputElement);
    this.status = byId("targets-status", HTMLElement);
    this.find = byId("targets-find", HTMLButtonElement);
    byId("targets-close", HTMLButtonElement).addEventListener("click", () => this.dialog.close());
    byId("targets-form", HTMLFormElement).addEventListener("submit", (event) => {
      event.preventDefault();
      this.#find();
    });
    this.dialog.addEventListener("keydown", (event) => {
      // A browser itself sends a form with Enter from a text field only.
      if (event.key !== "Enter" || !(event.target instanceof HTMLSelectElement)) return;
      event.preventDefault();
      this.#find();
    });
    this.dialog.addEventListener("close", () => app.viewer.marks.focus());
    this.family.addEventListener("change", () => this.#draw());
    this.#restore();
  }

  show() {
    const { length } = this.app.frames;
    setText(this.find, length === 1 ? "Find in 1 frame" : `Find in ${length} frames`);
    setText(this.status, "");
    this.#draw();
    this.dialog.showModal();
  }

  #draw() {
    this.border.disabled = this.family.value === "";
  }

  async #find() {
    const board = this.board.value.match(BOARD);
    if (this.board.value.trim() !== "" && !board) {
      return this.#refuse(this.board, "A chessboard is named by its inner corners: one of 7 by 8 squares is 6x7.");
    }
    const apriltag = this.family.value || null;
    if (!apriltag && !board) return this.#refuse(this.family, "Choose a family of tags, or give the size of a chessboard.");
    if (!this.keep.validity.valid) return this.#refuse(this.keep, "Keep a whole number of points, or leave it empty for all.");
    this.#store();
    this.dialog.close();
    await this.app.session.detect({
      apriltag,
      border_bits: apriltag && this.border.value ? Number(this.border.value) : null,
      chessboard: board ? `${board[1]}x${board[2]}` : null,
      select: this.keep.value ? this.keep.valueAsNumber : null,
    });
  }

  /** @param {HTMLElement} field @param {string} why */
  #refuse(field, why) {
    setText(this.status, why);
    field.focus();
  }

  get #fields() {
    return { family: this.family, border: this.border, board: this.board, keep: this.keep };
  }

  #store() {
    const values = Object.entries(this.#fields).map(([name, field]) => [name, field.value]);
    try {
      localStorage.setItem(STORE, JSON.stringify(Object.fromEntries(values)));
    } catch {
      // Then it is asked for again.
    }
  }

  #restore() {
    try {
      const stored = JSON.parse(localStorage.getItem(STORE) ?? "{}");
      for (const [name, field] of Object.entries(this.#fields)) if (typeof stored?.[name] === "string") field.value = stored[name];
    } catch {
      // Then the fields are empty.
    }
  }
}
