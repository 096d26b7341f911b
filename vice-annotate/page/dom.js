// Small help with elements. Text is only ever set as text.

/**
 * @template {HTMLElement} T
 * @param {string} id
 * @param {new () => T} kind
 * @returns {T}
 */
export function byId(id, kind) {
  const found = document.getElementById(id);
  if (!(found instanceof kind)) throw new Error(`the page lacks ${id}`);
  return found;
}

/**
 * @template {keyof HTMLElementTagNameMap} K
 * @param {K} name
 * @param {{class?: string, text?: string, title?: string, label?: string}} [what]
 * @param {(Node | string)[]} [inside]
 * @returns {HTMLElementTagNameMap[K]}
 */
export function make(name, what = {}, inside = []) {
  const element = document.createElement(name);
  if (what.class) element.className = what.class;
  if (what.text !== undefined) element.textContent = what.text;
  if (what.title) element.title = what.title;
  if (what.label) element.setAttribute("aria-label", what.label);
  element.append(...inside);
  return element;
}

/**
 * @param {string} text
 * @param {() => void} act
 * @param {{class?: string, title?: string, label?: string}} [what]
 * @returns {HTMLButtonElement}
 */
export function button(text, act, what = {}) {
  const element = make("button", { ...what, text });
  element.type = "button";
  element.addEventListener("click", act);
  return element;
}

/**
 * Sets text only where it changed, so that readers of the screen are not told twice.
 * @param {HTMLElement} element
 * @param {string} text
 */
export function setText(element, text) {
  if (element.textContent !== text) element.textContent = text;
}
