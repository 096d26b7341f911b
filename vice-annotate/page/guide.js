// Leads from one thing that needs a person to the next, until each lane is full or said to be: what to do there is a banner with
// buttons, and where a point may go on is suggested.

/** @import {Actions} from "./actions.js" */
/** @import {App} from "./app.js" */
/** @import {Notices} from "./notices.js" */
/** @import {Player} from "./player.js" */
/** @import {Task} from "./tasks.js" */

const WHY = {
  doubtful: "is doubtful",
  lost: "is lost",
  left: "has left the image",
  untracked: "has not been tracked from here yet",
  gap: "is not labelled",
  start: "has not begun",
};

export class Guide {
  /**
   * @param {App} app
   * @param {Player} player
   * @param {Actions} actions
   * @param {Notices} notices
   */
  constructor(app, player, actions, notices) {
    this.app = app;
    this.player = player;
    this.actions = actions;
    this.notices = notices;
  }

  /**
   * @param {1 | -1} step
   * @param {"any" | "gap"} [what]
   */
  async go(step, what = "any") {
    const { app, actions } = this;
    // What was just placed counts once it is on the disk, and then its tracking has begun.
    await actions.settled();
    const task = app.tasks.next(app.target, app.selected, step, ({ kind }) => what === "any" || kind !== "doubtful");
    if (!task) return this.notices.tell("info", this.#nothing(what));
    this.player.pause();
    app.select(task.name);
    await this.player.go(task.place);
    if (app.selected !== task.name || app.place !== task.place) return;
    const at = app.pixel ?? app.labels.lastUpTo(task.name, app.frame);
    if (at) app.viewer.view.reveal(at);
    if (task.kind !== "doubtful" && task.kind !== "untracked" && app.writable) {
      // The same point may be found again where it was lost; elsewhere a click gives it a new place.
      app.respawning = task.kind === "left" || task.kind === "start";
      await actions.suggestFor(task.name);
    }
    app.changed();
  }

  /** @param {"any" | "gap"} what @returns {string} */
  #nothing(what) {
    const { labels, keys } = this.app;
    const busy = labels.running.filter(({ kind }) => kind === "track").flatMap(({ points }) => points);
    if (busy.length > 0) return `Tracking of ${busy.join(", ")} is under way; nothing else needs you.`;
    if (labels.names.length === 0) return `There are no points yet: ${keys.hint("suggest")} suggests some.`;
    return what === "gap" ? "There is no gap: every lane is full." : "Done: every lane is full, none doubtful.";
  }

  draw() {
    const { app } = this;
    const task = app.tasks.at(app.place, app.selected);
    if (!task || this.player.playing || !app.writable) return this.notices.clear("task");
    this.notices.banner("task", "info", this.#text(task), this.#doings(task));
  }

  /** @param {Task} task @returns {string} */
  #text({ name, kind, first, last }) {
    const { frames } = this.app;
    const many = last - first + 1;
    const range = many === 1 ? `frame ${frames[first].frame}` : `frames ${frames[first].frame} to ${frames[last].frame}`;
    if (kind === "untracked") return `Point ${name} ${WHY[kind]}.`;
    const found = kind === "lost" || kind === "gap" ? " Click on it where you see it, or give it a new place." : "";
    const moved = kind === "doubtful" ? " Right as it is? Else drag it, or give it a new place." : "";
    return `Point ${name} ${WHY[kind]}: ${range}.${found}${moved}`;
  }

  /** @param {Task} task @returns {[string, () => void][]} */
  #doings({ name, kind }) {
    const { app, actions } = this;
    /** @param {string} text @param {string} action */
    const withKey = (text, action) => {
      const key = app.keys.hint(action);
      return key ? `${text} (${key})` : text;
    };
    if (kind === "untracked") return [[withKey("Track", "track-forward"), () => actions.track([name], "forward")]];
    if (kind === "doubtful") return [
      [withKey("It is right", "accept"), () => actions.accept()],
      [withKey("New place", "respawn"), () => actions.respawn()],
    ];
    const suggested = app.suggestedFor === name && app.suggestions.length > 0;
    return [
      suggested ? [withKey("Use S1", "use-suggestions"), () => actions.useSuggestions()] : [withKey("New place", "respawn"), () => actions.respawn()],
      [withKey("Nothing here", "nothing-here"), () => actions.nothingHere()],
    ];
  }
}
