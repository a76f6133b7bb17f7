// What each step shows. It reads what is known and what was done, and changes nothing but the page.

import { has, number, say } from "../app/words.js";
import { far, missing, nextSet } from "./steps.js";
import { beads, face, named, worn } from "./pictures.js";
import { Mirror } from "./mirror.js";
import { move } from "./moves.js";
import { counted, sounds, warn } from "../app/tone.js";
import { speakOut } from "./voice.js";

const id = (name) => document.getElementById(name);
const WITHOUT_STOP = ["stopped"];

function part(segment) {
  return segment.replace(/_[rl]$/, "");
}

function texted(element, text) {
  if (element.textContent !== text) element.textContent = text;
}

export class Screens {
  constructor(room, mine) {
    this.room = room;
    this.mine = mine;
    this.rested = "other";
    this.counted = 0;
    this.shownBeads = "";
    this.mirror = null;
    this.lowest = null;
    for (let value = 0; value <= 10; value += 1) {
      const button = document.createElement("button");
      button.type = "button";
      button.dataset.value = value;
      const digits = document.createElement("span");
      digits.textContent = value;
      button.append(face(value), digits);
      id("faces").append(button);
    }
  }

  /** The section that is to be seen. */
  get section() {
    return this.mine.aside ? "settings" : this.mine.step;
  }

  /** Show a step anew: its section alone, its name under the reader's eye. */
  enter(side, choices) {
    const step = this.section;
    document.body.dataset.step = step;
    for (const section of document.querySelectorAll("[data-step]")) {
      if (section !== document.body) section.hidden = section.dataset.step !== step;
    }
    if (step === "exercise") this.exercise(choices, side);
    if (step === "do") this.doing();
    this.show(side, choices);
    document.querySelector("main").scrollTo(0, 0);
    document.querySelector(`section[data-step="${step}"] h1`).focus({ preventScroll: true });
  }

  /** What is said aloud of the step shown. */
  spoken() {
    const section = document.querySelector(`section[data-step="${this.section}"]`);
    return [...section.querySelectorAll("h1, .what")].map((element) => element.textContent).filter(Boolean).join(" ");
  }

  calibrated() {
    return this.room.state?.calibration?.state === "done";
  }

  show(side, choices) {
    const { refused, busy } = this.mine;
    const step = this.section;
    const { state, up } = this.room;
    const origin = state?.origin ?? "worn";
    id("origin").hidden = origin === "worn";
    texted(id("origin"), origin === "worn" ? "" : say(`patient.origin.${origin}`));
    this.trouble(up, step);
    id("sound").replaceChildren(named("sound"));
    id("sound").setAttribute("aria-pressed", sounds());
    id("choose").replaceChildren(named("settings"));
    if (step === "sensors") this.sensors(state, side);
    if (step === "still") this.still(state);
    if (step === "pain") this.pain();
    if (step === "rest") texted(id("rest-what"), say(`patient.rest.${this.rested}`));
    id("stop").hidden = WITHOUT_STOP.includes(step);
    this.buttons(choices, busy, refused);
  }

  trouble(up, step) {
    const { refused, stopping } = this.mine;
    const words = [];
    if (!up) words.push(say("patient.trouble.line"));
    else if (stopping !== null && step !== "stopped") words.push(say("patient.trouble.stop"));
    if (refused && up) words.push(say(step === "still" ? "patient.trouble.still" : "patient.trouble.refused"));
    texted(id("trouble"), words.join(" "));
  }

  buttons(choices, busy, refused) {
    const { pain, last } = this.mine;
    const step = this.section;
    const name = (key) => (has(key) ? say(key) : "");
    let go = name(`patient.go.${step}`);
    let other = name(`patient.other.${step}`);
    if (step === "still") {
      const again = this.calibrated() && !refused;
      go = say(again ? "patient.next" : "patient.go.still");
      if (!again) other = "";
    }
    if (step === "exercise" && choices.length < 2) other = "";
    if (step === "done" && nextSet(last)) {
      go = say("patient.go.set", { set: last.set + 1, sets: last.sets });
      other = say("patient.go.done");
    }
    texted(id("go"), go);
    texted(id("other"), other);
    id("go").hidden = !go;
    id("other").hidden = !other;
    const waits = { sensors: missing(this.room.state) !== null, pain: pain === null };
    id("go").disabled = busy || !this.room.up || (waits[step] ?? false);
    id("other").disabled = busy || !this.room.up;
  }

  sensors(state, side) {
    const sensors = state?.sensors ?? [];
    const live = sensors.filter((one) => one.state === "live").map((one) => part(one.segment));
    const picture = document.querySelector('section[data-step="sensors"] .picture');
    const text = JSON.stringify([sensors.map((one) => [one.segment, one.state]), side, document.documentElement.lang]);
    const what = missing(state);
    texted(id("worn-what"), say(what ?? "patient.sensors.ready"));
    if (text === this.shownSensors) return;
    this.shownSensors = text;
    picture.replaceChildren(worn(sensors.map((one) => part(one.segment)), live, side));
    id("worn").replaceChildren(...sensors.map((one) => this.sensorRow(one)));
  }

  sensorRow(one) {
    const row = document.createElement("li");
    const ready = one.state === "live";
    row.className = ready ? "ready" : "";
    const name = document.createElement("span");
    name.textContent = say(`patient.part.${part(one.segment)}`);
    const how = document.createElement("span");
    how.textContent = say(ready ? "patient.ready" : "patient.silent");
    row.append(named(ready ? "tick" : "wait"), name, how);
    return row;
  }

  still(state) {
    const { busy, refused } = this.mine;
    const far = state?.calibration?.progress ?? 0;
    const done = this.calibrated() && !busy && !refused;
    const moving = state?.calibration?.moving ?? [];
    const parts = [...new Set(moving.map((name) => say(`patient.part.${part(name)}`)))].join(", ");
    const now = parts ? say("patient.still.moving", { parts }) : say("patient.still.now");
    texted(id("still-what"), busy ? now : say(done ? "patient.still.done" : "patient.still.what"));
    id("still-far").hidden = !busy;
    id("still-far").value = this.calibrated() ? 0 : far;
  }

  exercise(choices, side) {
    const { name } = choices[this.mine.exercise % Math.max(1, choices.length)] ?? { name: "free" };
    texted(id("exercise-name"), say(`patient.exercise.${name}`));
    texted(id("exercise-what"), say(`exercise.${name}.what`));
    id("exercise-picture").replaceChildren(move(name, side));
  }

  doing() {
    const { exercise, side } = this.mine.last ?? { exercise: "free", side: "right" };
    texted(id("do-name"), say(`patient.exercise.${exercise}`));
    this.counted = 0;
    this.lowest = null;
    this.shownBeads = "";
    this.mirror ??= new Mirror(id("mirror"));
    this.drawFrame(side);
  }

  pain() {
    for (const button of id("faces").children) {
      const value = Number(button.dataset.value);
      button.setAttribute("aria-pressed", value === this.mine.pain);
      button.setAttribute("aria-label", say(`patient.pain.${value === 0 ? "none" : value === 10 ? "worst" : "of"}`, { value }));
    }
  }

  /** The newest picture of the arm, and how far the set is: a count and beads, never degrees. */
  drawFrame(side) {
    if (this.section !== "do") return;
    const arm = this.room.frame?.arms[side];
    const set = this.room.frame?.set;
    const plan = this.mine.last;
    const wanted = plan?.repetitions ?? null;
    if (arm) this.mirror?.show(side, arm, set?.over ?? false);
    this.level(this.reached(set, plan));
    const count = set?.count ?? 0;
    if (count > this.counted) {
      counted();
      speakOut(number(count));
    }
    this.counted = count;
    texted(id("count"), number(count));
    texted(id("count-of"), wanted ? say("patient.count.of", { wanted }) : "");
    const drawn = `${count}/${wanted}`;
    if (drawn !== this.shownBeads) id("beads").replaceChildren(beads(count, wanted));
    this.shownBeads = drawn;
    this.hint(arm, set);
  }

  level(part) {
    id("level").hidden = part === null;
    if (part !== null) id("level").firstElementChild.style.height = `${Math.round(100 * part)}%`;
  }

  hint(arm, set) {
    const key = !arm || arm.stale ? "silent" : set?.over ? "over" : set?.done ? "enough" : "go";
    document.body.dataset.hint = key;
    const words = say(`patient.do.${key}`);
    if (words === id("do-what").textContent) return;
    id("do-what").textContent = words;
    if (key === "over") warn();
    if (key !== "go") speakOut(words);
  }

  /** How far the arm is on its way from where it hung lowest to the goal. */
  reached(set, plan) {
    const angle = set?.angle ?? null;
    if (angle === null || !plan) return null;
    const lower = plan.rises ? Math.min : Math.max;
    this.lowest = this.lowest === null ? angle : lower(this.lowest, angle);
    return far(angle, this.lowest, plan.goal_deg);
  }
}
