// What is to be done: exercise, arm, how it is moved, goal, sets, repetitions, limit. The same on every screen: the
// server keeps what was chosen, and a page that is loaded anew or joins takes it from there.

import { $, make, renew } from "./page.js";
import { Stepper } from "./stepper.js";
import { fill, has, number, say } from "./words.js";

const MODES = ["active", "assisted", "passive"];
const SPARE_DEG = 5; // between goal and limit: the alarm is not where the goal is
const STEPS = [
  { name: "sets", value: 3, min: 1, max: 20, step: 1 },
  { name: "repetitions", value: 10, min: 1, max: 100, step: 1 },
  { name: "goal", value: 90, min: -180, max: 180, step: 5, optional: true, on: true },
  { name: "limit", value: 90, min: -180, max: 180, step: 5, optional: true, on: false },
];

function choice(name, value, key, checked) {
  const input = make("input", { type: "radio", name, value });
  input.checked = checked;
  return make("label", {}, input, make("span", { "data-say": key }));
}

export class Plan {
  /** `changed` is called whenever something else is chosen; `link` tells it to the other screens. */
  constructor(changed, link) {
    this.link = link;
    this.plans = []; // that the server keeps, the one meant last at the end
    this.mine = new Map(); // by subject, what was meant last: a server that starts anew has forgotten it
    this.changed = () => {
      if (!this.ready || this.filling) return;
      this.within();
      if ($("plan-said").textContent) $("plan-said").scrollIntoView({ block: "nearest" });
      changed();
      this.tell();
    };
    this.filled = changed;
    this.steps = Object.fromEntries(STEPS.map((row) => [row.name, new Stepper(row, () => this.changed())]));
    $("numbers").replaceChildren(...STEPS.map((row) => this.steps[row.name].field));
    $("modes").replaceChildren(...MODES.map((mode) => choice("mode", mode, `mode.${mode}`, mode === "active")));
    $("which").addEventListener("change", () => this.chosen());
    $("sides").addEventListener("change", () => this.otherSide());
    $("modes").addEventListener("change", () => this.changed());
    document.addEventListener("language", () => this.names());
  }

  offer(exercises) {
    this.exercises = new Map(exercises.map((row) => [row.name, row]));
    const before = $("which").value;
    $("which").replaceChildren(...exercises.map(({ name }) => make("option", { value: name })));
    if (this.exercises.has(before)) $("which").value = before;
    this.names();
    this.ready = true;
    if (!before) this.fill(this.fresh);
  }

  names() {
    for (const option of $("which").options) option.textContent = say(`exercise.${option.value}`);
    $("which-what").textContent = has(`exercise.${$("which").value}.what`) ? say(`exercise.${$("which").value}.what`) : "";
    fill($("exercise"));
  }

  /** What is proposed to somebody of whom nothing is known. */
  get fresh() {
    const values = Object.fromEntries(STEPS.map(({ name, value, on }) => [name, on === false ? null : value]));
    const { name, goal_deg } = this.exercises.values().next().value;
    const { sets, repetitions } = values;
    return { exercise: name, side: null, mode: "active", goal_deg, limit_deg: values.limit, sets, repetitions };
  }

  /** Another exercise: as it was meant before, else with its own goal; a limit stays until somebody takes it away. */
  chosen() {
    const known = this.known;
    if (known) this.fill(known);
    else this.fill({ ...this.words, goal_deg: this.exercise.goal_deg });
    this.changed();
  }

  otherSide() {
    this.wanted = this.side;
    if (this.known) this.fill(this.known);
    this.changed();
  }

  /** Put a plan into the form. */
  fill(row) {
    this.filling = true;
    if (this.exercises.has(row.exercise)) $("which").value = row.exercise;
    if (row.side) this.wanted = row.side;
    for (const [name, value] of [["side", row.side], ["mode", row.mode]]) {
      for (const input of document.querySelectorAll(`input[name="${name}"]`)) input.checked ||= input.value === value;
    }
    const { goal, limit, sets, repetitions } = this.steps;
    goal.value = row.goal_deg;
    limit.value = row.limit_deg;
    sets.value = row.sets;
    if (row.repetitions != null) repetitions.value = row.repetitions;
    this.filling = false;
    this.names();
    this.within();
    this.filled();
  }

  /** Take the plans that all screens share; what was chosen here and could not be told yet comes first. */
  adopt({ subject, plans }) {
    if (!this.ready || subject === null) return;
    const other = this.subject && this.subject !== subject;
    if (other) this.untold = false;
    const unknown = this.mine.get(subject) ?? (this.subject ? null : this.mine.get(undefined));
    this.subject = subject;
    this.plans = plans;
    if (this.untold) this.tell();
    if (this.telling) return;
    const newest = plans.at(-1);
    const key = JSON.stringify([subject, newest]);
    if (key === this.adopted) return;
    this.adopted = key;
    if (newest) {
      this.mine.set(subject, newest);
      if (this.says(newest)) this.filled();
      else this.fill(newest);
    } else if (unknown) {
      this.fill(unknown);
      this.tell();
    } else if (other) {
      this.fill(this.fresh);
    }
  }

  /** Tell what is chosen to every screen; while the line is cut, as soon as it is back. */
  async tell() {
    this.untold = true;
    this.mine.set(this.subject, { ...this.words, set: this.number });
    if (this.telling) return;
    this.telling = true;
    while (this.untold) {
      this.untold = false;
      const { ok, reason } = await this.link.ask("plan", { ...this.words, set: this.number });
      if (ok || reason) continue;
      this.untold = true;
      break;
    }
    this.telling = false;
  }

  /** What was meant before with this exercise and arm. */
  get known() {
    const rows = [...this.plans, this.mine.get(this.subject)];
    return rows.find((row) => row?.exercise === $("which").value && row.side === this.side);
  }

  /** Whether the form says this plan already. */
  says(row) {
    return Object.entries(this.words).every(([name, value]) => row[name] === value);
  }

  /** Which set is next. */
  get number() {
    const number = this.known?.set ?? 1;
    return number <= this.steps.sets.value ? number : 1;
  }

  /** A goal is some degrees before the limit: who follows it does not hear the alarm. */
  within() {
    const { goal, limit } = this.steps;
    $("plan-said").textContent = "";
    if (goal.value === null || limit.value === null) return;
    const nearest = limit.value - (this.exercise.rises ? SPARE_DEG : -SPARE_DEG);
    if (this.exercise.rises ? goal.value <= nearest : goal.value >= nearest) return;
    goal.number = nearest;
    $("plan-said").textContent = say("goal.moved", { goal: number(goal.value), spare: number(SPARE_DEG) });
  }

  get exercise() {
    return this.exercises.get($("which").value);
  }

  sides(sides, affected) {
    renew($("sides"), sides.join(), () => {
      const before = this.wanted ?? this.side;
      const wanted = sides.includes(before) ? before : sides.includes(affected) ? affected : sides[0];
      return sides.map((side) => choice("side", side, `side.${side}`, side === wanted));
    });
    fill($("sides"));
  }

  get side() {
    return document.querySelector('input[name="side"]:checked')?.value ?? "right";
  }

  /** What is asked for, as the server takes it. */
  get words() {
    return {
      exercise: this.exercise.name,
      side: this.side,
      mode: document.querySelector('input[name="mode"]:checked').value,
      goal_deg: this.steps.goal.value,
      limit_deg: this.steps.limit.value,
      sets: this.steps.sets.value,
      repetitions: this.steps.repetitions.value,
    };
  }
}
