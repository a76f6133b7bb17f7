// Where the angle stands: against its AAOS reference, what daily activities need, the goal and the limit.

import { MEASURED } from "./quality.js";
import { number, say } from "./words.js";

// All in units of the letters' size / 16: what is written grows with the letters of the page.
const EDGE = 1;
const TOP = 26;
const HIGH = 18;
const ABOVE = 15; // where words stand
const BELOW = 62;
const ROW = 17;
const LETTER = 7.4; // of width
const SVG = "http://www.w3.org/2000/svg";

function element(name, words, text) {
  const one = document.createElementNS(SVG, name);
  for (const [key, value] of Object.entries(words)) one.setAttribute(key, value);
  if (text !== undefined) one.textContent = text;
  return one;
}

const written = (word, value) => `${word} ${number(value)}°`;

const touch = ([from, to], [start, end]) => from < end + LETTER && start < to + LETTER;

/** A text in lines of so many letters. */
function broken(text, letters) {
  return text.split(" ").reduce((lines, word) => {
    const last = lines.at(-1);
    if (last !== undefined && last.length + 1 + word.length <= letters) lines[lines.length - 1] = `${last} ${word}`;
    else lines.push(word);
    return lines;
  }, []);
}

export class Gauge {
  constructor(box) {
    this.box = box;
    this.wide = 0;
    this.svg = element("svg", { role: "img" });
    box.append(this.svg);
    new ResizeObserver(() => this.fit()).observe(box);
  }

  /** As wide as there is room. */
  fit() {
    const unit = parseFloat(getComputedStyle(document.documentElement).fontSize) / 16;
    const wide = Math.round(this.box.clientWidth / unit);
    if (!wide || wide === this.wide) return;
    this.wide = wide;
    if (this.marks) this.mean(this.marks);
  }

  /** Say what belongs to the angle: {band, need, goal, limit, rises}. */
  mean(marks) {
    this.marks = marks;
    const { band, need, goal, limit, rises } = marks;
    const known = [...(band ?? [0, 180]), need, goal, limit].filter((value) => value != null);
    const low = Math.min(...known);
    const high = Math.max(...known);
    const spare = 0.08 * (high - low || 1);
    this.from = low - spare;
    this.to = high + spare;
    this.svg.replaceChildren();
    const add = (name, words, text) => this.svg.append(element(name, words, text));
    add("rect", { class: "track", x: EDGE, y: TOP, width: Math.max(this.wide - 2 * EDGE, 0), height: HIGH, rx: 9 });
    if (band) {
      add("rect", { class: "band", x: this.at(band[0]), y: TOP, width: this.at(band[1]) - this.at(band[0]), height: HIGH, rx: 4 });
    }
    if (limit != null) {
      const [x, end] = rises ? [this.at(limit), this.wide - EDGE] : [EDGE, this.at(limit)];
      add("rect", { class: "forbidden", x, y: TOP, width: Math.max(end - x, 0), height: HIGH, rx: 4 });
      this.tick("limit", limit, say("limit"), BELOW);
    }
    if (goal != null) this.tick("goal", goal, say("goal"), ABOVE);
    const close = limit != null && need != null && touch(this.span(limit, say("limit")), this.span(need, say("need")));
    if (need != null) this.tick("need", need, say("need"), close ? BELOW + ROW : BELOW);
    const rows = close ? 2 : limit != null || need != null ? 1 : 0;
    const legend = band ? say("reference.range", { low: number(band[0]), high: number(band[1]) }) : say("reference.none");
    const lines = broken(legend, this.wide / LETTER);
    const first = BELOW + rows * ROW;
    lines.forEach((line, i) => add("text", { x: 0, y: first + i * ROW }, line));
    this.svg.setAttribute("viewBox", `0 0 ${Math.max(this.wide, 1)} ${first + (lines.length - 1) * ROW + 6}`);
    this.now = element("path", { class: "now" });
    this.svg.append(this.now);
    this.svg.setAttribute("aria-label", legend);
    this.show(...(this.shown ?? [null]));
  }

  tick(kind, value, word, y) {
    const x = this.at(value);
    this.svg.append(element("path", { class: kind, d: `M${x} ${TOP - 5}V${TOP + HIGH + 5}` }));
    this.svg.append(element("text", { class: `${kind}-word`, x, y, "text-anchor": this.anchor(x) }, written(word, value)));
  }

  /** How a word stands at its tick: towards the middle from either end. */
  anchor(x) {
    return x > 0.75 * this.wide ? "end" : x < 0.25 * this.wide ? "start" : "middle";
  }

  /** From where to where a tick's word goes. */
  span(value, word) {
    const x = this.at(value);
    const long = LETTER * written(word, value).length;
    const from = { end: x - long, start: x, middle: x - long / 2 }[this.anchor(x)];
    return [from, from + long];
  }

  at(value) {
    const share = (value - this.from) / (this.to - this.from);
    return EDGE + Math.min(Math.max(share, 0), 1) * Math.max(this.wide - 2 * EDGE, 0);
  }

  show(value, quality) {
    this.shown = [value, quality];
    this.now.setAttribute("visibility", value == null ? "hidden" : "visible");
    if (value == null) return;
    const x = this.at(value);
    this.now.setAttribute("class", MEASURED.has(quality) ? "now" : "now doubtful");
    this.now.setAttribute("d", `M${x} ${TOP + 3}l7 -11h-14zM${x - 1.5} ${TOP}h3v${HIGH}h-3z`);
  }
}
