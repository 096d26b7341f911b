// What the page says of work in the background. Frames are counted as everywhere: by their index in the data set.

/** @import {Job, LaneEnd} from "./types.js" */
/** @import {Keys} from "./keys.js" */
/** @import {Labels} from "./labels.js" */

/** Between images further apart than this much has changed. */
const LONG_GAP_S = 0.3;

/** @param {Job} job @returns {string} while it runs */
export function underway({ kind, points, done, total }) {
  return `${kind === "detect" ? "Looking for targets" : `Tracking ${points.join(", ")}`}: ${done} of ${total}`;
}

/**
 * @param {Job} job that has ended
 * @param {Labels} labels
 * @param {Keys} keys
 * @returns {{kind: "info" | "warning" | "error", text: string}} no text where there is nothing to say
 */
export function outcome(job, labels, keys) {
  const detect = job.kind === "detect";
  if (job.state === "failed") return { kind: "error", text: `${detect ? "The search" : "Tracking"} failed: ${job.message ?? "no reason given"}` };
  if (job.state !== "done") return { kind: "info", text: "" };
  if (detect) return { kind: "info", text: job.message ?? "" };
  const parts = [`Tracked ${job.points.join(", ")}`, ...endings(job.ends ?? [], labels)];
  if (job.remarks) parts.push(job.remarks);
  const open = job.ends?.some(({ why }) => why !== "changed");
  if (open) parts.push(`${keys.hint("next-task")} goes to the next of these frames`);
  return { kind: "info", text: `${parts.join(". ")}.` };
}

/**
 * @param {LaneEnd[]} ends
 * @param {Labels} labels
 * @returns {string[]} one for each frame and reason
 */
function endings(ends, labels) {
  /** @type {Map<string, LaneEnd[]>} */
  const alike = new Map();
  for (const end of ends) {
    const key = `${end.why} ${end.frame}`;
    alike.set(key, [...(alike.get(key) ?? []), end]);
  }
  return [...alike.values()].map((group) => {
    const { why, frame, gap_s } = group[0];
    const names = group.map(({ point }) => point).join(", ");
    const at = labels.state.frames[labels.placeNear(frame)].frame;
    if (why === "left-image") return `${names} left the image at frame ${at}`;
    if (why === "changed") return `${names} was changed where tracking started`;
    const far = gap_s > LONG_GAP_S ? `, ${gap_s.toFixed(2)} s from the image before it` : "";
    return `${names} lost at frame ${at}${far}`;
  });
}
