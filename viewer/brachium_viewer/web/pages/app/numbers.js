// The numbers that move: the exercise's angle, the count, and what is past its limit.

import { Chart } from "./chart.js";
import { Gauge } from "./gauge.js";
import { $, make, put, renew } from "./page.js";
import { MEASURED } from "./quality.js";
import { counted, warn } from "./tone.js";
import { number, say, sayCount } from "./words.js";

const WARN_MS = 900;

const degrees = (value) => (value == null ? "–" : `${number(value)}°`);

export class Numbers {
  constructor() {
    this.gauge = new Gauge($("gauge"));
    this.chart = new Chart($("chart"));
    this.count = null;
    this.warned = 0;
    this.ended = null;
  }

  /** Say which angle of which arm is shown, and what belongs to it. */
  mean({ row, side, goal, limit }) {
    const marks = { band: row.band, need: row.need, goal, limit, rises: row.rises };
    const key = JSON.stringify([row.angle, side, marks, say("goal")]);
    if (key === this.key) return;
    this.key = key;
    this.angle = row.angle;
    this.side = side;
    this.limit = limit;
    $("angle-name").textContent = `${say(`angle.${row.angle}`)} · ${say(`side.${side}`)}`;
    this.gauge.mean(marks);
    this.chart.mean(row.angle + side, marks);
  }

  frame(frame) {
    const arm = frame.arms[this.side];
    const [value, quality] = arm?.angles[this.angle] ?? [null, "missing"];
    const measured = MEASURED.has(quality) && value != null;
    this.quality = quality;
    put($("angle-value"), degrees(value));
    $("angle-value").parentElement.classList.toggle("doubtful", !measured);
    $("angle-quality").hidden = measured;
    if (!measured) put($("angle-quality"), say(`quality.${value == null ? "missing" : quality}`));
    this.gauge.show(value, quality);
    if (arm && !arm.stale) this.chart.add(arm.t, value, quality);
    this.others(frame.arms);
    this.progress(frame.set);
  }

  /** The same angle of the other arm, small: for comparing. */
  others(arms) {
    const rows = Object.entries(arms).filter(([side]) => side !== this.side);
    const said = rows.map(([side, arm]) => {
      const [value, quality] = arm.angles[this.angle];
      const doubt = MEASURED.has(quality) || value == null ? "" : ` (${say(`quality.${quality}`)})`;
      return [say(`side.${side}.arm`), degrees(value) + doubt];
    });
    renew($("others"), JSON.stringify(said), () =>
      said.map(([name, value]) => make("div", {}, make("dt", {}, name), make("dd", {}, value))),
    );
  }

  progress(set) {
    const shown = set ?? this.ended;
    put($("count-value"), shown ? number(shown.count) : "–");
    $("count-value").parentElement.classList.toggle("done", Boolean(shown?.done));
    $("count-value").parentElement.classList.toggle("empty", !shown);
    put($("count-last"), degrees(shown?.last));
    put($("count-best"), degrees(shown?.best));
    put($("count-tries"), shown ? number(shown.tries) : "–");
    if (set && this.count !== null && set.count > this.count) {
      counted();
      $("count-said").textContent = sayCount("counted", set.count);
    }
    this.count = set ? set.count : null;
    this.beyond(Boolean(set?.over));
  }

  beyond(over) {
    $("stage").classList.toggle("beyond", over);
    if ($("over").hidden === over) $("over").hidden = !over;
    if (!over) return;
    put($("over-words"), say("over", { limit: number(this.limit ?? 0) }));
    if (performance.now() - this.warned > WARN_MS) {
      this.warned = performance.now();
      warn();
    }
  }
}
