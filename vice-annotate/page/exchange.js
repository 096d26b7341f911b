// Labels from a file.

/** @import {App} from "./app.js" */

import { byId } from "./dom.js";

/** @type {Record<string, string>} by ending */
const FORMATS = { json: "json", csv: "csv", xml: "cvat", pkl: "pickle", pickle: "pickle" };

/**
 * @param {ArrayBuffer} bytes
 * @returns {string} base64
 */
function base64(bytes) {
  let text = "";
  for (const byte of new Uint8Array(bytes)) text += String.fromCharCode(byte);
  return btoa(text);
}

/**
 * Joins the file input of the menu.
 * @param {App} app
 * @param {(kind: "info" | "warning" | "error", text: string) => void} tell
 */
export function importLabels(app, tell) {
  const input = byId("import", HTMLInputElement);
  input.addEventListener("change", async () => {
    const file = input.files?.[0];
    input.value = "";
    byId("file-menu", HTMLDetailsElement).open = false;
    if (!file) return;
    const format = FORMATS[file.name.split(".").pop()?.toLowerCase() ?? ""];
    if (!format) return tell("error", `${file.name}: labels come as .json, .csv, .xml (CVAT) or .pkl.`);
    const replace = byId("import-replace", HTMLInputElement).checked;
    const body = format === "pickle"
      ? /** @type {const} */ ({ content: base64(await file.arrayBuffer()), encoding: "base64", replace })
      : /** @type {const} */ ({ content: await file.text(), encoding: "text", replace });
    if (await app.session.importLabels(format, body, file.name)) {
      tell("info", `${file.name} is imported; undo takes it out again.`);
      app.select(app.labels.names[0] ?? "1");
    }
  });
}
