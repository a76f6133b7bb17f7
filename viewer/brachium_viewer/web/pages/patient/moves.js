// Pictures of the exercises: where the arm starts (pale), how it goes (an arrow), and the arm on its way.

import { BODY, SHOULDER, draw, line, disc, path, picture } from "./drawing.js";

const WIDE = 260; // an arm stretched out to the side, and the arrow around it
const UPPER = [46, 16];
const FORE = [40, 14];
const HAND = [14, 12];
const STRAIGHT = [0, 0];

// Per link: length, width, and the angle against the one before at the start and at the end, in degrees of the
// picture: 0 hangs down, 90 points away from the body.
const arm = (upper, elbow = STRAIGHT, hand = STRAIGHT) => [[...UPPER, ...upper], [...FORE, ...elbow], [...HAND, ...hand]];
const MOVES = {
  "elbow-flexion": { body: "side", links: arm([0, 0], [5, 130]) },
  "elbow-extension": { body: "side", links: arm([0, 0], [115, 5]) },
  "shoulder-flexion": { body: "side", links: arm([0, 125]) },
  "shoulder-abduction": { body: "front", links: arm([6, 95]) },
  "scapular-elevation": { body: "front", links: arm([6, 115]), plan: 45 },
  "shoulder-extension": { body: "side", links: arm([0, -42], [8, 8]) },
  "external-rotation": { body: "above", links: [[44, 14, 180, 112], [...HAND, 0, 0]] },
  "forearm-rotation": { body: "side", links: arm([0, 0], [90, 90]), twist: true },
  "wrist-flexion": { body: "none", links: [[86, 34, 90, 90], [46, 28, 0, -62]] },
  reaching: { body: "side", links: arm([8, 72], [70, 12]), thing: [178, 84] },
  drinking: { body: "side", links: arm([8, 38], [62, 118], [0, 10]), cup: true },
  free: { body: "front", links: arm([15, 95], [10, 55]) },
};

/** The tip of a chain of links at `part` of its way, 0 to 1. */
function tip([x, y], links, part, beyond) {
  let sum = 0;
  links.forEach(([length, , from, to], i) => {
    sum += from + part * (to - from);
    const reach = length + (i === links.length - 1 ? beyond : 0);
    x += reach * Math.sin((sum * Math.PI) / 180);
    y += reach * Math.cos((sum * Math.PI) / 180);
  });
  return [x, y];
}

function arrow(at, links, name) {
  const points = Array.from({ length: 25 }, (_, i) => tip(at, links, i / 24, 16));
  const [x, y] = points[24];
  const [bx, by] = points[21];
  const length = Math.hypot(x - bx, y - by) || 1;
  const [ux, uy] = [(x - bx) / length, (y - by) / length];
  const text = points.map(([px, py]) => `${px.toFixed(1)} ${py.toFixed(1)}`).join(" L");
  const side = (sign) => `${(x - 11 * ux - sign * 8 * uy).toFixed(1)} ${(y - 11 * uy + sign * 8 * ux).toFixed(1)}`;
  const head = `M${side(1)} L${x.toFixed(1)} ${y.toFixed(1)} L${side(-1)}`;
  return draw("g", { class: name }, path(`M${text}`, "way"), path(head, "way"));
}

/** Links hung one into the other; each turns about its own beginning. `held`: what the last one holds. */
function chain([[length, width, from, to], ...rest], held) {
  const onwards = draw("g", { transform: `translate(0 ${length})` }, ...(rest.length ? [chain(rest, held)] : held));
  const turn = draw("g", { class: "turn" }, line(0, 0, 0, length, width, "bone"), onwards);
  turn.style.setProperty("--from", `${-from}deg`);
  turn.style.setProperty("--to", `${-to}deg`);
  return turn;
}

function limb([x, y], links, name, held = []) {
  return draw("g", { class: name, transform: `translate(${x} ${y})` }, chain(links, held));
}

/** A small view from above: into which direction the arm is raised, degrees from the side towards the front. */
function plan(degrees) {
  const [x, y] = [44 + 34 * Math.cos((degrees * Math.PI) / 180), 200 - 34 * Math.sin((degrees * Math.PI) / 180)];
  return draw(
    "g",
    { class: "plan" },
    draw("ellipse", { cx: 26, cy: 204, rx: 20, ry: 9, class: "flesh" }),
    disc(26, 202, 9, "flesh edge"),
    line(43, 203, x, y, 8, "bone moving-bone"),
  );
}

/** The picture of an exercise with this arm; like a mirror, the right arm is at the right. */
export function move(name, side) {
  const { body, links, plan: degrees, twist, thing, cup } = MOVES[name] ?? MOVES.free;
  const at = SHOULDER[body];
  const parts = [...BODY[body]()];
  if (body === "front" && !degrees) parts.push(...BODY.farArm());
  if (thing) parts.push(disc(...thing, 9, "thing"));
  if (twist) parts.push(path("M122 98 A12 32 0 1 1 113 150", "way"), path("M104 139 L112 151 L123 142", "way"));
  else parts.push(limb(at, links, "ghost"), arrow(at, links, "arrow"));
  const held = cup ? [path("M-8 10 L8 10 L6 26 L-6 26 Z", "thing")] : [];
  parts.push(limb(at, links, "moving", held));
  if (degrees) parts.push(plan(degrees));
  const flip = side === "left" ? { transform: `translate(${WIDE} 0) scale(-1 1)` } : {};
  return picture(WIDE, 240, draw("g", flip, ...parts));
}
