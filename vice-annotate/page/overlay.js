// Crosses, dots and cursors above the image, in screen pixels.

/** @import {App} from "./app.js" */
/** @import {View} from "./view.js" */

import { DARK, DOUBT, LABEL_BLUE, pointColour, streamColour } from "./palette.js";

const TRAIL_FRAMES = 20;
const TEXT = "600 12px system-ui, sans-serif";
const TAG_HEIGHT = 17;
/** With more points than this in a frame their crosses are small. */
const MANY_POINTS = 12;

/**
 * Strokes a path twice: dark and wide below, coloured above, so that it is seen on any image.
 * @param {CanvasRenderingContext2D} context
 * @param {Path2D} path
 * @param {string} colour
 * @param {number} width
 */
function outlined(context, path, colour, width) {
  context.strokeStyle = DARK;
  context.lineWidth = width + 2.5;
  context.stroke(path);
  context.strokeStyle = colour;
  context.lineWidth = width;
  context.stroke(path);
}

/**
 * @param {number} x
 * @param {number} y
 * @param {number} inner the gap in the middle, so that the pixel itself stays in sight
 * @param {number} outer
 */
export function crossPath(x, y, inner, outer) {
  const path = new Path2D();
  for (const [dx, dy] of [[1, 0], [-1, 0], [0, 1], [0, -1]]) {
    path.moveTo(x + dx * inner, y + dy * inner);
    path.lineTo(x + dx * outer, y + dy * outer);
  }
  return path;
}

/**
 * @param {CanvasRenderingContext2D} context
 * @param {Tag} what
 */
function tag(context, { text, x, y, colour }) {
  context.font = TEXT;
  const { left, top, width } = tagBox(context, text, x, y);
  context.fillStyle = DARK;
  context.beginPath();
  context.roundRect(left, top, width, TAG_HEIGHT, 4);
  context.fill();
  context.fillStyle = colour;
  context.textBaseline = "middle";
  context.fillText(text, left + 4, top + 9);
}

/**
 * @param {CanvasRenderingContext2D} context
 * @param {string} text
 * @param {number} x
 * @param {number} y
 */
function tagBox(context, text, x, y) {
  context.font = TEXT;
  return { left: x + 9, top: y - 25, width: context.measureText(text).width + 8 };
}

/**
 * Of names that would hide each other, as on a board's corners, the first ones are shown.
 * @param {CanvasRenderingContext2D} context
 * @param {Tag[]} tags the most important one first
 */
function drawTags(context, tags) {
  /** @type {{left: number, top: number, width: number}[]} */
  const drawn = [];
  for (const each of tags) {
    const box = tagBox(context, each.text, each.x, each.y);
    const hidden = drawn.some((other) => box.left < other.left + other.width && other.left < box.left + box.width && Math.abs(box.top - other.top) < TAG_HEIGHT);
    if (hidden) continue;
    drawn.push(box);
    tag(context, each);
  }
}

/** @typedef {{text: string, x: number, y: number, colour: string}} Tag a name beside a place on the screen */

/**
 * @param {CanvasRenderingContext2D} context
 * @param {App} app
 * @param {View} view
 */
export function drawOverlay(context, app, view) {
  context.lineCap = "round";
  if (app.switches.dots) drawDots(context, app, view);
  drawTrail(context, app, view);
  drawSuggestions(context, app, view);
  const others = app.labels.names.filter((name) => name !== app.selected);
  const small = others.filter((name) => app.labels.pixel(name, app.frame)).length > MANY_POINTS;
  const tags = [...others, app.selected].map((name) => drawPoint(context, app, view, name, small));
  drawTags(context, tags.reverse().filter((each) => each !== null));
  if (app.cursor) drawCursor(context, view.toScreen(app.cursor));
}

/**
 * @param {CanvasRenderingContext2D} context
 * @param {App} app
 * @param {View} view
 * @param {string} name
 * @param {boolean} small
 * @returns {Tag | null} its name, where it is in this frame
 */
function drawPoint(context, app, view, name, small) {
  const pixel = app.labels.pixel(name, app.frame);
  const index = app.labels.indexOf(name);
  const colour = pointColour(index);
  if (!pixel) {
    drawGhost(context, app, view, name, colour);
    return null;
  }
  const observation = app.labels.at(name, app.frame);
  const chosen = name === app.selected;
  const { x, y } = view.toScreen(pixel);
  context.setLineDash(observation?.occluded ? [3, 4] : []);
  outlined(context, small && !chosen ? crossPath(x, y, 2, 5) : crossPath(x, y, 3, chosen ? 15 : 11), colour, chosen ? 2.5 : 1.75);
  context.setLineDash([]);
  if (chosen) {
    const ring = new Path2D();
    ring.arc(x, y, 19, 0, 2 * Math.PI);
    outlined(context, ring, colour, 1.25);
  }
  const doubtful = observation !== null && app.labels.doubtful(observation);
  if (doubtful) {
    const ring = new Path2D();
    ring.rect(x - 23, y - 23, 46, 46);
    context.setLineDash([5, 4]);
    outlined(context, ring, DOUBT, 1.5);
    context.setLineDash([]);
  }
  return { text: name + (observation?.keyframe ? " ◆" : "") + (doubtful ? " ?" : ""), x, y, colour };
}

/**
 * Where a point that is not labelled here was in the frame before.
 * @param {CanvasRenderingContext2D} context
 * @param {App} app
 * @param {View} view
 * @param {string} name
 * @param {string} colour
 */
function drawGhost(context, app, view, name, colour) {
  const before = app.place > 0 && app.labels.at(name, app.frames[app.place - 1].frame);
  if (!before) return;
  const { x, y } = view.toScreen(before);
  const ring = new Path2D();
  ring.arc(x, y, 7, 0, 2 * Math.PI);
  context.globalAlpha = 0.6;
  context.setLineDash([2, 4]);
  outlined(context, ring, colour, 1.5);
  context.setLineDash([]);
  context.globalAlpha = 1;
}

/**
 * @param {CanvasRenderingContext2D} context
 * @param {App} app
 * @param {View} view
 */
function drawTrail(context, app, view) {
  const path = new Path2D();
  let drawn = 0;
  for (let place = app.place; place >= 0 && place >= app.place - TRAIL_FRAMES; place -= 1) {
    const observation = app.labels.at(app.selected, app.frames[place].frame);
    if (!observation) break;
    const { x, y } = view.toScreen(observation);
    if (drawn === 0) path.moveTo(x, y);
    else path.lineTo(x, y);
    drawn += 1;
    if (observation.keyframe) break;
  }
  if (drawn < 2) return;
  context.globalAlpha = 0.5;
  context.strokeStyle = pointColour(app.labels.indexOf(app.selected));
  context.lineWidth = 1.5;
  context.stroke(path);
  context.globalAlpha = 1;
}

/**
 * As in the paper's figure: a line from the label to where each estimate puts the point.
 * @param {CanvasRenderingContext2D} context
 * @param {App} app
 * @param {View} view
 */
function drawDots(context, app, view) {
  const { projections } = app.labels;
  if (!projections) return;
  let onBoard = -1;
  const looks = projections.streams.map(({ kind }) => {
    if (kind === "on-board") onBoard += 1;
    return { kind, colour: streamColour(kind, onBoard) };
  });
  for (const dot of app.labels.dotsAt(app.frame)) {
    const label = app.labels.pixel(dot.point, dot.frame);
    const to = view.toScreen(dot);
    const { kind, colour } = looks[dot.stream];
    if (label) {
      const from = view.toScreen(label);
      const line = new Path2D();
      line.moveTo(from.x, from.y);
      line.lineTo(to.x, to.y);
      context.strokeStyle = colour;
      context.lineWidth = 1.25;
      context.stroke(line);
      disc(context, from, LABEL_BLUE, 3);
    }
    // The reference is a square, what is judged a disc: shape says what colour says.
    if (kind === "reference") square(context, to, colour, 4);
    else disc(context, to, colour, 4.5);
  }
}

/**
 * @param {CanvasRenderingContext2D} context
 * @param {{x: number, y: number}} at
 * @param {string} colour
 * @param {number} radius
 */
function disc(context, { x, y }, colour, radius) {
  context.beginPath();
  context.arc(x, y, radius, 0, 2 * Math.PI);
  fill(context, colour);
}

/**
 * @param {CanvasRenderingContext2D} context
 * @param {{x: number, y: number}} at
 * @param {string} colour
 * @param {number} radius
 */
function square(context, { x, y }, colour, radius) {
  context.beginPath();
  context.rect(x - radius, y - radius, 2 * radius, 2 * radius);
  fill(context, colour);
}

/**
 * @param {CanvasRenderingContext2D} context
 * @param {string} colour
 */
function fill(context, colour) {
  context.fillStyle = colour;
  context.strokeStyle = DARK;
  context.lineWidth = 1.5;
  context.fill();
  context.stroke();
}

/**
 * @param {CanvasRenderingContext2D} context
 * @param {App} app
 * @param {View} view
 */
function drawSuggestions(context, app, view) {
  app.suggestions.forEach((each, index) => {
    const { x, y } = view.toScreen(each);
    const ring = new Path2D();
    ring.arc(x, y, 10, 0, 2 * Math.PI);
    context.setLineDash([4, 3]);
    outlined(context, ring, "#ffffff", 1.75);
    context.setLineDash([]);
    outlined(context, crossPath(x, y, 2, 5), "#ffffff", 1.25);
    const depth = each.depth_m === null ? "" : ` · ${each.depth_m.toFixed(2)} m`;
    tag(context, { text: `S${index + 1}${depth}`, x, y, colour: "#ffffff" });
  });
}

/**
 * @param {CanvasRenderingContext2D} context
 * @param {{x: number, y: number}} at
 */
function drawCursor(context, { x, y }) {
  outlined(context, crossPath(x, y, 5, 26), "#ffffff", 1.5);
  const box = new Path2D();
  box.rect(x - 9, y - 9, 18, 18);
  outlined(context, box, "#ffffff", 1.25);
}
