// Where the angle stands: against its AAOS reference, what daily activities need, the goal and the limit.

import { MEASURED } from "./quality.js";
import { number, say } from "./words.js";

const WIDE = 340;
const EDGE = 14;
const TOP = 26;
const HIGH = 18;
const ABOVE = 15; // where words stand
const BELOW = 60;
const WORDS = 150; // two words nearer than this would touch
const SVG = "http://www.w3.org/2000/svg";

function element(name, words, text) {
  const one = document.createElementNS(SVG, name);
  for (const [key, value] of Object.entries(words)) one.setAttribute(key, value);
  if (text !== undefined) one.textContent = text;
  return one;
}

export class Gauge {
  constructor(box) {
    this.svg = element("svg", { viewBox: `0 0 ${WIDE} 88`, role: "img" });
    box.append(this.svg);
  }

  /** Say what belongs to the angle: {band, need, goal, limit, rises}. */
  mean({ band, need, goal, limit, rises }) {
    const known = [...(band ?? [0, 180]), need, goal, limit].filter((value) => value != null);
    const low = Math.min(...known);
    const high = Math.max(...known);
    const spare = 0.08 * (high - low || 1);
    this.from = low - spare;
    this.to = high + spare;
    this.svg.replaceChildren();
    const add = (name, words, text) => this.svg.append(element(name, words, text));
    add("rect", { class: "track", x: EDGE, y: TOP, width: WIDE - 2 * EDGE, height: HIGH, rx: 9 });
    if (band) {
      add("rect", { class: "band", x: this.at(band[0]), y: TOP, width: this.at(band[1]) - this.at(band[0]), height: HIGH, rx: 4 });
      add("text", { x: WIDE / 2, y: 85, "text-anchor": "middle" }, say("reference.range", { low: number(band[0]), high: number(band[1]) }));
    } else {
      add("text", { x: WIDE / 2, y: 85, "text-anchor": "middle" }, say("reference.none"));
    }
    if (limit != null) {
      const [x, end] = rises ? [this.at(limit), WIDE - EDGE] : [EDGE, this.at(limit)];
      add("rect", { class: "forbidden", x, y: TOP, width: Math.max(end - x, 0), height: HIGH, rx: 4 });
      this.tick("limit", limit, say("limit"), BELOW);
    }
    if (goal != null) this.tick("goal", goal, say("goal"), ABOVE);
    const close = limit != null && need != null && Math.abs(this.at(limit) - this.at(need)) < WORDS;
    if (need != null) this.tick("need", need, say("need"), close ? BELOW + 13 : BELOW);
    this.now = element("path", { class: "now" });
    this.svg.append(this.now);
    this.svg.setAttribute("aria-label", band ? say("reference.range", { low: number(band[0]), high: number(band[1]) }) : say("reference.none"));
    this.show(null);
  }

  tick(kind, value, word, y) {
    const x = this.at(value);
    const side = x > 0.8 * WIDE ? "end" : x < 0.2 * WIDE ? "start" : "middle";
    this.svg.append(element("path", { class: kind, d: `M${x} ${TOP - 5}V${TOP + HIGH + 5}` }));
    this.svg.append(element("text", { class: `${kind}-word`, x, y, "text-anchor": side }, `${word} ${number(value)}°`));
  }

  at(value) {
    const share = (value - this.from) / (this.to - this.from);
    return EDGE + Math.min(Math.max(share, 0), 1) * (WIDE - 2 * EDGE);
  }

  show(value, quality) {
    this.now.setAttribute("visibility", value == null ? "hidden" : "visible");
    if (value == null) return;
    const x = this.at(value);
    this.now.setAttribute("class", MEASURED.has(quality) ? "now" : "now doubtful");
    this.now.setAttribute("d", `M${x} ${TOP + 3}l7 -11h-14zM${x - 1.5} ${TOP}h3v${HIGH}h-3z`);
  }
}
