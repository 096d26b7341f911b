// How much of the time is labelled, for each point and in all.

/** @import {Labels} from "./labels.js" */

/** @typedef {{labelled_s: number, all_s: number, share: number}} Coverage */

/**
 * @param {Labels} labels
 * @param {string} [name] of one point; of all without it
 * @returns {Coverage} each frame stands for the time to the next one
 */
export function coverage(labels, name) {
  const { frames } = labels.state;
  const names = name === undefined ? labels.names : [name];
  const spanned_s = frames.length > 1 ? frames[frames.length - 1].time_s - frames[0].time_s : 0;
  const lane_s = frames.length > 1 ? (spanned_s * frames.length) / (frames.length - 1) : 0;
  let seen = 0;
  for (const each of names) {
    for (const frame of labels.lanes.get(each)?.keys() ?? []) if (labels.places.has(frame)) seen += 1;
  }
  const share = names.length > 0 ? seen / (frames.length * names.length) : 0;
  return { labelled_s: share * lane_s * names.length, all_s: lane_s * names.length, share };
}

/** @param {Coverage} coverage @returns {string} such as `11.2 of 30 s, 37 %` */
export function coverageText({ labelled_s, all_s, share }) {
  const percent = `${share >= 1 ? 100 : Math.min(99, Math.round(100 * share))} %`;
  if (all_s === 0) return percent;
  return `${Number(labelled_s.toFixed(1))} of ${Number(all_s.toFixed(1))} s, ${percent}`;
}
