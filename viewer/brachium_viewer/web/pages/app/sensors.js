// How each sensor fares: in words, and by a shape as well as a colour.

import { $, make, renew } from "./page.js";
import { has, number, say } from "./words.js";

const SHAPES = {
  live: "M8 1a7 7 0 1 0 0 14A7 7 0 0 0 8 1z",
  stale: "M8 1l7 13H1z",
  missing: "M3.5 1L8 5.5 12.5 1 15 3.5 10.5 8 15 12.5 12.5 15 8 10.5 3.5 15 1 12.5 5.5 8 1 3.5z",
};
const LOSS_PERCENT = 5; // told from here on: less is bridged
const WEAK_DBM = -80;
const WAY = ["sternum", "upper_arm_r", "forearm_r", "hand_r", "upper_arm_l", "forearm_l", "hand_l"];

export function shape(kind) {
  const svg = document.createElementNS("http://www.w3.org/2000/svg", "svg");
  svg.setAttribute("viewBox", "0 0 16 16");
  svg.setAttribute("class", "shape");
  svg.setAttribute("aria-hidden", "true");
  const path = document.createElementNS("http://www.w3.org/2000/svg", "path");
  path.setAttribute("d", SHAPES[kind]);
  svg.append(path);
  return svg;
}

function worst(state) {
  if (state.sensors.length === 0 || state.live === 0) return "missing";
  return state.live < state.sensors.length ? "stale" : "live";
}

export function showHeadline(state, up) {
  const kind = up ? worst(state) : "missing";
  const words = up ? say("headline", { live: state.live, all: state.sensors.length }) : say("line.down");
  $("headline").className = `pill ${kind}`;
  renew($("headline"), kind + words, () => [shape(kind), words]);
}

function more(sensor) {
  const notes = [];
  if (sensor.battery_low) notes.push(say("battery.low", { hours: number(sensor.battery_hours, 1) }));
  if (sensor.slow && sensor.state === "live") notes.push(say("sensor.slow"));
  if (sensor.loss_percent >= LOSS_PERCENT) notes.push(say("sensor.loss", { percent: number(sensor.loss_percent, 0) }));
  if (sensor.rssi_dbm != null && sensor.rssi_dbm < WEAK_DBM) notes.push(say("sensor.far"));
  return notes.join(" · ");
}

function stateOf(sensor) {
  return [say(`sensor.${sensor.state}`), ...charge(sensor)].join(" · ");
}

/** How long the battery lasts; of a sensor that does not tell, how full it is. */
function charge({ battery_low, battery_hours, battery_percent }) {
  if (battery_low) return []; // said below, with everything else that needs somebody
  if (battery_hours != null) return [say("battery", { hours: number(battery_hours, 0) })];
  return battery_percent == null ? [] : [say("battery.percent", { percent: number(battery_percent) })];
}

function row(sensor) {
  const what = make("span", { class: "what" }, say(`segment.${sensor.segment}`));
  const how = make("span", { class: "how" }, stateOf(sensor));
  const one = make("li", { class: sensor.state }, shape(sensor.state), what, how);
  const notes = more(sensor);
  if (notes) one.append(make("span", { class: "more" }, notes));
  return one;
}

export function showSensors(state) {
  const sensors = [...state.sensors].sort((a, b) => WAY.indexOf(a.segment) - WAY.indexOf(b.segment));
  renew($("sensors"), JSON.stringify(sensors.map((s) => [s.segment, stateOf(s), more(s)])) + say("sensor.live"), () =>
    sensors.length ? sensors.map(row) : [make("li", { class: "missing" }, shape("missing"), say("sensors.none"))],
  );
  $("waiting").hidden = state.waiting.length === 0;
  $("waiting").textContent = say("waiting", { nodes: state.waiting.join(", ") });
}

/** The arm's parts: a colour for each that is plainly measured, and what is wrong with all the others. */
export function showParts(arms) {
  const rows = Object.entries(arms).flatMap(([side, arm]) =>
    Object.entries(arm.parts).map(([part, quality]) => [side, part, arm.stale ? "missing" : quality]),
  );
  const both = Object.keys(arms).length > 1;
  renew($("parts"), JSON.stringify(rows) + say("quality.held"), () => {
    const doubtful = new Map();
    for (const [side, part, quality] of rows) {
      if (quality === "good") continue;
      const name = say(`part.${part}`) + (both ? ` ${say(`side.${side}.short`)}` : "");
      doubtful.set(quality, [...(doubtful.get(quality) ?? []), name]);
    }
    const good = rows.filter(([side, , quality]) => quality === "good" && (!both || side === "right"));
    return [
      ...good.map(([, part]) => entry(part, say(`part.${part}`))),
      ...[...doubtful].map(([quality, names]) => {
        const known = has(`quality.${quality}`) ? `: ${say(`quality.${quality}`)}` : "";
        return entry("not", (names.length > 1 && names.length === rows.length ? say("part.all") : names.join(", ")) + known);
      }),
    ];
  });
}

function entry(swatch, words) {
  return make("li", {}, make("span", { class: `swatch ${swatch}` }), words);
}
