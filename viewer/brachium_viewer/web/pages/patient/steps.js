// The patient's way, one thing at a time. Values only: what is shown next follows from what is known.

/** The steps in the order in which they are gone through by who does everything alone. */
export const WAY = ["begin", "sensors", "still", "arm", "exercise", "do", "pain", "done"];

/** Where the room leads, whatever the patient was at: a set that runs is done, one that ended is asked about. */
export function led(step, set, over) {
  if (set && set.from !== over) return step === "stopped" ? null : step === "do" ? null : "do";
  return step === "do" ? "pain" : null;
}

/** The step after this one: an arm is asked for only when there are two. */
export function after(step, sides) {
  const next = WAY[WAY.indexOf(step) + 1] ?? "done";
  return next === "arm" && sides.length < 2 ? "exercise" : next;
}

/** What is missing before a person can begin: the key of a plain sentence, or null. */
export function missing(state) {
  if (!state) return "patient.missing.server";
  if (!state.sensors.length) return "patient.missing.sensors";
  if (state.live < state.sensors.length) return "patient.missing.some";
  if (!state.services.fusion) return "patient.missing.fusion";
  return null;
}

const MEASURED = ["good", "disturbed"];

/** The exercises that these sensors can count, as an arm's newest angles tell; all of them before any has come. */
export function offered(exercises, arm) {
  const found = exercises.filter((one) => MEASURED.includes(arm?.angles[one.angle]?.[1]));
  return found.length ? found : exercises;
}

/** How far along its way to the goal an angle is, 0 to 1; null when there is no goal. */
export function far(angle, from, goal) {
  if (angle === null || goal === null || from === null || Math.abs(goal - from) < 1) return null;
  return Math.min(1, Math.max(0, (angle - from) / (goal - from)));
}

/** An exercise as it was planned for this arm, with its limit; else just the exercise. */
export function planned(plans, { name, goal_deg }, side) {
  const alone = { exercise: name, side, mode: "active", goal_deg, limit_deg: null, repetitions: null, set: 1, sets: 1 };
  return plans?.find((one) => one.exercise === name && one.side === side) ?? alone;
}

/** The set after this one, or null when as many were done as were wanted. */
export function nextSet(set) {
  return set && set.set < set.sets ? { ...set, set: set.set + 1 } : null;
}
