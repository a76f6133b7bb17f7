// The other pictures: sensors worn, standing still, resting, and the signs on buttons.

import { BODY, SHOULDER, disc, draw, line, path, picture } from "./drawing.js";
import { sounds } from "../app/tone.js";

const BOXES = { upper_arm: [139, 104], forearm: [146, 143], hand: [149, 172], sternum: [100, 92] };

function armDown(name = "bone moving-bone") {
  const [x, y] = SHOULDER.front;
  return [line(x, y, x + 10, y + 46, 16, name), line(x + 10, y + 46, x + 15, y + 84, 14, name), line(x + 15, y + 84, x + 16, y + 97, 12, name)];
}

/** A person with sensors; `parts` says which, and `live` those that are ready. */
export function worn(parts, live, side) {
  const box = (part) => {
    const [x, y] = BOXES[part];
    const name = live.includes(part) ? "box live" : "box";
    return draw("g", {}, draw("rect", { x: x - 10, y: y - 8, width: 20, height: 16, rx: 4, class: name }), path(`M${x - 5} ${y} L${x - 1} ${y + 4} L${x + 6} ${y - 4}`, name === "box" ? "absent" : "tick"));
  };
  const boxes = parts.filter((part) => part in BOXES).map(box);
  const flip = side === "left" ? { transform: "translate(200 0) scale(-1 1)" } : {};
  return picture(200, 240, draw("g", flip, ...BODY.front(), ...BODY.farArm(), ...armDown(), ...boxes));
}

function one(side) {
  const flip = side === "left" ? { transform: "translate(200 0) scale(-1 1)" } : {};
  return picture(200, 240, draw("g", flip, ...BODY.front(), ...BODY.farArm(), ...armDown()));
}

const sign = (...parts) => picture(48, 48, ...parts);

const PICTURES = {
  hello: () =>
    picture(200, 240, ...BODY.front(), ...BODY.farArm(), line(133, 80, 160, 50, 16, "bone moving-bone"), line(160, 50, 154, 14, 14, "bone moving-bone")),
  still: () => {
    const far = armDown("bone moving-bone").map((limb) => limb.cloneNode());
    const left = draw("g", { transform: "translate(200 0) scale(-1 1)" }, ...far);
    return picture(200, 240, ...BODY.front(), left, ...armDown(), line(40, 234, 160, 234, 5, "ground"));
  },
  rest: () =>
    picture(
      200,
      240,
      path("M58 84 L58 228 M58 168 L128 168 L128 228", "chair"),
      disc(88, 40, 20, "flesh"),
      line(86, 60, 86, 76, 15, "bone"),
      line(82, 156, 136, 158, 22, "bone"),
      line(136, 160, 136, 226, 19, "bone"),
      path("M68 88 Q68 72 86 72 Q104 72 105 90 L102 160 Q86 166 70 160 Z", "flesh"),
      line(87, 88, 92, 128, 15, "bone moving-bone"),
      line(92, 128, 126, 142, 13, "bone moving-bone"),
    ),
  left: () => one("left"),
  right: () => one("right"),
  stop: () => sign(path("M15 3 H33 L45 15 V33 L33 45 H15 L3 33 V15 Z", "halt"), path("M16 16 H32 V32 H16 Z", "halt-mark")),
  pain: () => sign(path("M27 3 L10 27 H22 L18 45 L38 19 H26 Z", "mark")),
  tired: () => sign(draw("rect", { x: 4, y: 14, width: 36, height: 22, rx: 4, class: "stroke" }), path("M44 21 V29", "stroke"), draw("rect", { x: 9, y: 19, width: 7, height: 12, class: "mark" })),
  dizzy: () => sign(path("M25 25 C25 21 31 22 31 27 C31 34 18 35 17 26 C16 16 30 13 36 21 C43 32 33 43 22 41 C8 38 5 24 13 14", "stroke")),
  other: () => sign(disc(10, 24, 4.5, "mark"), disc(24, 24, 4.5, "mark"), disc(38, 24, 4.5, "mark")),
  sound: () => {
    const waves = sounds() ? [path("M31 17 Q36 24 31 31", "stroke"), path("M36 11 Q46 24 36 37", "stroke")] : [path("M32 18 L43 30 M43 18 L32 30", "stroke")];
    return sign(path("M5 18 H13 L24 8 V40 L13 30 H5 Z", "mark"), ...waves);
  },
  settings: () => sign(path("M6 14 H42 M6 24 H42 M6 34 H42", "stroke"), disc(16, 14, 5, "knob"), disc(32, 24, 5, "knob"), disc(20, 34, 5, "knob")),
  tick: () => sign(path("M8 26 L19 37 L41 12", "stroke")),
  wait: () => sign(draw("circle", { cx: 24, cy: 24, r: 16, class: "stroke dashed" })),
};

export function named(name) {
  return PICTURES[name]();
}

/** A face for a pain of 0 to 10. Its colour says nothing: shape and number do. */
export function face(value) {
  const bend = 9 - 1.9 * value;
  const brow = 0.55 * value;
  return sign(
    disc(24, 24, 20, "face"),
    disc(17, 20, 2.4, "mark"),
    disc(31, 20, 2.4, "mark"),
    path(`M15 ${33 - 0.35 * bend} Q24 ${33 + 0.8 * bend} 33 ${33 - 0.35 * bend}`, "stroke thin"),
    path(`M13 ${14 + 0.25 * brow} L20 ${15 - brow + 2} M35 ${14 + 0.25 * brow} L28 ${15 - brow + 2}`, value > 3 ? "stroke thin" : "absent"),
  );
}

/** The repetitions as beads; of a set without a number only those that were done. */
export function beads(done, wanted) {
  const count = Math.min(20, Math.max(wanted ?? 0, done));
  const perRow = 10;
  const rows = Math.max(1, Math.ceil(count / perRow));
  const one = (i) => disc(14 + 26 * (i % perRow), 14 + 26 * Math.floor(i / perRow), 9, i < done ? "bead done" : "bead");
  return picture(26 * Math.min(perRow, Math.max(1, count)) + 2, 26 * rows + 2, ...Array.from({ length: count }, (_, i) => one(i)));
}
