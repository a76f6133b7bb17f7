// The angle over the last seconds: measured as a line, what is not measured as a broken one, nothing where nothing is.

import uPlot from "../vendor/uplot/uPlot.esm.js";
import { MEASURED } from "./quality.js";
import { number, say } from "./words.js";

const WINDOW_S = 24;
const PAUSE_MS = 90; // between two drawings: fast enough for an eye, and cheap
const STEP_S = 0.03;
const GAP_S = 0.3;

const COLOURS = ["--muted", "--line", "--trace", "--band", "--bad", "--good", "--ink", "--goal", "--surface"];

/** Where a word stands under an edge so that none of the lines goes through it. */
function under(edge, lines, ratio) {
  const high = 15 * ratio;
  const crosses = (y, line) => line > y - high && line < y + 3 * ratio;
  return lines.sort((a, b) => a - b).reduce((y, line) => (crosses(y, line) ? line + high : y), edge + high);
}

export class Chart {
  constructor(box) {
    this.box = box;
    this.marks = {};
    this.clear();
    this.make();
    new ResizeObserver(() => this.fit()).observe(box);
    document.addEventListener("theme", () => this.make());
    document.addEventListener("language", () => this.make());
  }

  clear() {
    this.times = [];
    this.measured = [];
    this.doubtful = [];
    this.drawn = 0;
  }

  size() {
    return { width: Math.max(this.box.clientWidth, 80), height: Math.max(this.box.clientHeight, 80) };
  }

  fit() {
    const unit = parseFloat(getComputedStyle(document.documentElement).fontSize) / 16;
    if (unit === this.unit) this.plot.setSize(this.size());
    else this.make();
  }

  make() {
    this.plot?.destroy();
    const style = getComputedStyle(document.documentElement); // asked once: the answer costs a look at the whole page
    const colours = Object.fromEntries(COLOURS.map((name) => [name, style.getPropertyValue(name).trim()]));
    this.colour = (name) => colours[name];
    this.unit = parseFloat(style.fontSize) / 16; // what is written grows with the letters of the page
    const axis = {
      stroke: this.colour("--muted"),
      grid: { stroke: this.colour("--line"), width: 1 },
      ticks: { show: false },
      font: `${12 * this.unit}px system-ui, sans-serif`,
    };
    this.plot = new uPlot(
      {
        ...this.size(),
        padding: [10, 12, 0, 0],
        legend: { show: false },
        cursor: { show: false },
        scales: { x: { time: false }, y: { range: () => this.range() } },
        axes: [
          { ...axis, size: 26 * this.unit, space: 50 * this.unit, values: (plot, ticks) => ticks.map((at) => `${number(at).replace("-", "−")} s`) },
          { ...axis, size: 46 * this.unit, space: 24 * this.unit, values: (plot, ticks) => ticks.map((at) => `${number(at).replace("-", "−")}°`) },
        ],
        series: [
          {},
          { stroke: this.colour("--trace"), width: 2.5, spanGaps: false, points: { show: false } },
          { stroke: this.colour("--muted"), width: 2, dash: [4, 4], spanGaps: false, points: { show: false } },
        ],
        hooks: { drawAxes: [(plot) => this.under(plot)] },
      },
      [[-WINDOW_S, 0], [null, null], [null, null]],
      this.box,
    );
    this.draw();
  }

  /** Say what belongs to the angle: {band, need, goal, limit, rises}. A change of angle empties the course. */
  mean(angle, marks) {
    if (angle !== this.angle) this.clear();
    this.angle = angle;
    this.marks = marks;
    this.draw();
  }

  range() {
    const { band, goal, limit, need } = this.marks;
    const known = [...this.measured, ...this.doubtful, ...(band ?? []), goal, limit, need].filter((value) => value != null);
    if (known.length === 0) return [0, 180];
    return [Math.min(...known) - 10, Math.max(...known) + 12];
  }

  /** Take one angle: at `t` ms, degrees or null, and its quality. */
  add(t, value, quality) {
    const now = t / 1000;
    const last = this.times.at(-1);
    if (last !== undefined && now < last + STEP_S) return;
    if (last !== undefined && now > last + GAP_S) this.push(last + STEP_S, null, null); // what was not measured is no line
    this.push(now, MEASURED.has(quality) ? value : null, MEASURED.has(quality) ? null : value);
    while (this.times[0] < now - WINDOW_S) {
      this.times.shift();
      this.measured.shift();
      this.doubtful.shift();
    }
    if (performance.now() - this.drawn > PAUSE_MS) this.later();
  }

  /** Draw behind the picture: the arm is not kept waiting. */
  later() {
    if (this.due) return;
    this.due = true;
    requestAnimationFrame(() => setTimeout(() => {
      this.due = false;
      this.draw();
    }));
  }

  push(time, measured, doubtful) {
    this.times.push(time);
    this.measured.push(measured);
    this.doubtful.push(doubtful);
  }

  draw() {
    this.drawn = performance.now();
    const end = this.times.at(-1) ?? 0;
    const times = this.times.map((time) => time - end);
    const data = times.length ? [times, this.measured, this.doubtful] : [[-WINDOW_S, 0], [null, null], [null, null]];
    this.plot.batch(() => {
      this.plot.setData(data, false);
      this.plot.setScale("x", { min: -WINDOW_S, max: 0 });
    });
  }

  /** The band, the lines and their words, below the course. */
  under(plot) {
    const { band, goal, limit, need, rises } = this.marks;
    const { ctx, bbox } = plot;
    const ratio = devicePixelRatio * this.unit;
    const at = (value) => plot.valToPos(value, "y", true);
    ctx.save();
    ctx.beginPath();
    ctx.rect(bbox.left, bbox.top, bbox.width, bbox.height);
    ctx.clip();
    ctx.font = `600 ${12 * ratio}px system-ui, sans-serif`;
    if (band) {
      ctx.fillStyle = this.colour("--band");
      ctx.fillRect(bbox.left, at(band[1]), bbox.width, at(band[0]) - at(band[1]));
    }
    if (limit != null) {
      ctx.fillStyle = this.colour("--bad");
      ctx.globalAlpha = 0.14; // the reference is still seen behind it
      const edge = at(limit);
      if (rises) ctx.fillRect(bbox.left, bbox.top, bbox.width, edge - bbox.top);
      else ctx.fillRect(bbox.left, edge, bbox.width, bbox.top + bbox.height - edge);
      ctx.globalAlpha = 1;
    }
    if (band) {
      const lines = [need, goal, limit].filter((value) => value != null).map(at);
      this.word(ctx, say("reference"), bbox.left + 6 * ratio, under(at(band[1]), lines, ratio), "--good", "left");
    }
    const right = bbox.left + bbox.width - 6 * ratio;
    this.line(ctx, bbox, need, at, "--ink", [2, 4], say("need"), bbox.left + 0.45 * bbox.width, -6);
    this.line(ctx, bbox, goal, at, "--goal", [8, 5], say("goal"), right, rises ? 15 : -6);
    this.line(ctx, bbox, limit, at, "--bad", [], say("limit"), bbox.left + 0.7 * bbox.width, rises ? -6 : 15);
    ctx.restore();
  }

  line(ctx, bbox, value, at, name, dash, word, x, below) {
    if (value == null) return;
    const ratio = devicePixelRatio * this.unit;
    ctx.strokeStyle = this.colour(name);
    ctx.lineWidth = 2 * ratio;
    ctx.setLineDash(dash.map((part) => part * ratio));
    ctx.beginPath();
    ctx.moveTo(bbox.left, at(value));
    ctx.lineTo(bbox.left + bbox.width, at(value));
    ctx.stroke();
    const text = `${word} ${number(value)}°`;
    const least = bbox.left + ctx.measureText(text).width + 4 * ratio; // on a narrow screen it begins at the edge
    this.word(ctx, text, Math.max(x, least), at(value) + below * ratio, name, "right");
  }

  word(ctx, text, x, y, name, side) {
    ctx.textAlign = side;
    ctx.setLineDash([]);
    ctx.lineWidth = 4 * devicePixelRatio;
    ctx.lineJoin = "round";
    ctx.strokeStyle = this.colour("--surface");
    ctx.strokeText(text, x, y);
    ctx.fillStyle = this.colour(name);
    ctx.fillText(text, x, y);
  }
}
