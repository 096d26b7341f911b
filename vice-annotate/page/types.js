// Shapes of what the server says. Types only: nothing here runs.
// Stamps are strings of nanoseconds, for they exceed what a double holds. Pixels have their centres at integers.

/** @typedef {"manual" | "auto" | "detected" | "interpolated"} Source */

/**
 * One point seen in one frame.
 * @typedef {object} Observation
 * @property {number} frame the data set's own frame index
 * @property {string} stamp_ns
 * @property {number} u pixels, to the right
 * @property {number} v pixels, down
 * @property {Source} source
 * @property {boolean} keyframe starts a segment
 * @property {boolean} occluded
 * @property {boolean} uncertain
 * @property {number | null} confidence 0 to 1, of an automatic observation
 * @property {boolean} seeded the search began where an estimate pointed
 */

/** @typedef {{name: string, observations: Observation[]}} Point */

/** @typedef {{frame: number, stamp_ns: string, time_s: number}} Frame */

/** @typedef {{point: string, from: number, to: number}} Empty frames in which there is nothing to label, both ends among them */

/**
 * @typedef {object} Job
 * @property {number | string} id
 * @property {string} kind
 * @property {string[]} points
 * @property {string} [direction]
 * @property {number} done
 * @property {number} total
 * @property {"running" | "done" | "stopped" | "failed"} state
 * @property {string | null} [message]
 * @property {LaneEnd[]} [ends] where points were followed no further
 * @property {string | null} [remarks] what the message says beyond that
 */

/**
 * @typedef {object} LaneEnd
 * @property {string} point
 * @property {number} frame the first one without it
 * @property {"lost" | "left-image" | "changed"} why
 * @property {number} gap_s to that frame from the one before on the way
 */

/**
 * @typedef {object} State
 * @property {number} revision
 * @property {string} dataset
 * @property {string} format
 * @property {string} camera
 * @property {number} width
 * @property {number} height
 * @property {string} labels_file
 * @property {boolean} writable
 * @property {string | null} read_only_reason
 * @property {string | null} [save_problem] why the file beside the journal is behind it
 * @property {Frame[]} frames
 * @property {Point[]} points
 * @property {boolean} can_undo
 * @property {boolean} can_redo
 * @property {boolean} floor_suggestions
 * @property {boolean} [depth_known] there is a depth source
 * @property {string[]} streams
 * @property {Job[]} jobs
 * @property {string} version
 * @property {Empty[]} [empty]
 * @property {Record<string, string[]>} [keys]
 * @property {number} [doubt_below]
 */

/**
 * @typedef {object} Change
 * @property {number} revision
 * @property {Point[]} points whole lanes of the points that changed
 * @property {string[]} removed
 * @property {boolean} can_undo
 * @property {boolean} can_redo
 * @property {string} by
 * @property {string} label what the step was
 */

/**
 * @typedef {{op: "place", point: string, frame: number, u: number, v: number}
 *   | {op: "spawn", point: string, frame: number, u: number, v: number, suggested?: boolean}
 *   | {op: "mark", point: string, frame: number, occluded?: boolean, uncertain?: boolean, keyframe?: boolean}
 *   | {op: "delete", point: string, frame: number}
 *   | {op: "delete-after", point: string, frame: number}
 *   | {op: "delete-range", point: string, frame: number, to: number}
 *   | {op: "remove-point", point: string}
 *   | {op: "rename", point: string, to: string}} Edit
 */

/** @typedef {"forward" | "backward" | "both"} Direction */

/** @typedef {{u: number, v: number, score: number, depth_m: number | null, stays_s: number | null}} Suggestion stays in view as far as can be told */

/**
 * Where suggestions lie: on the floor as a scan or depth camera sees it; below the horizon, where that may be a wall;
 * where there is depth; anywhere.
 * @typedef {{suggestions: Suggestion[], surface: "floor" | "below-horizon" | "depth" | "any"}} Suggestions
 */

/**
 * Targets to look for; null where not asked for.
 * @typedef {object} Targets
 * @property {string | null} apriltag the family
 * @property {number | null} border_bits
 * @property {string | null} chessboard inner corners, such as `6x7`
 * @property {number | null} select how many points to keep
 */

/** @typedef {{name: string, kind: "reference" | "on-board", rmse_px: Record<string, number> | null}} Stream */

/** @typedef {{stream: number, point: string, frame: number, u: number, v: number, error_px: number | null}} Dot */

/** @typedef {{streams: Stream[], dots: Dot[], skips: {reason: string, count: number}[]}} Projections */

/** @typedef {{u: number, v: number}} Pixel */

/**
 * What a reviewer said of an observation, and what the labels say.
 * @typedef {{stored: Pixel, reviewed: Pixel | null, distance_px: number | null, source: Source}} Verdict
 */

/** @typedef {{point: string, frame: number, keyframe: {frame: number, u: number, v: number}, verdict: Verdict | null}} Sample */

/** @typedef {{samples: number, placed: number, untold: number, median_px: number | null, p95_px: number | null, largest_px: number | null}} Summary */

/**
 * @typedef {object} ReviewState
 * @property {string} dataset
 * @property {string} camera
 * @property {number} width
 * @property {number} height
 * @property {string} labels_file
 * @property {string} review_file
 * @property {number} outdated verdicts of labels that have changed since
 * @property {Sample[]} samples
 * @property {Summary} summary
 */

export {};
