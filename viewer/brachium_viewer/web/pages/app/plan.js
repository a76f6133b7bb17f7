// What is to be done: exercise, arm, how it is moved, goal, sets, repetitions, limit.

import { $, make, renew } from "./page.js";
import { fill, has, say } from "./words.js";

const MODES = ["active", "assisted", "passive"];
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

class Stepper {
  constructor({ name, value, min, max, step, optional, on }, changed) {
    this.changed = changed;
    this.step = step;
    this.input = make("input", { id: `plan-${name}`, type: "number", inputmode: "numeric", min, max, step });
    this.input.value = value;
    this.less = make("button", { type: "button", "data-say-label": `${name}.less` }, "−");
    this.more = make("button", { type: "button", "data-say-label": `${name}.more` }, "+");
    this.less.addEventListener("click", () => this.move(-1));
    this.more.addEventListener("click", () => this.move(1));
    this.input.addEventListener("change", () => this.changed());
    const label = make("label", { for: `plan-${name}`, "data-say": name });
    const head = make("div", { class: "with-check" }, label);
    if (optional) {
      this.check = make("input", { id: `use-${name}`, type: "checkbox", "data-say-label": `${name}.use` });
      this.check.checked = on;
      this.check.addEventListener("change", () => this.used());
      head.prepend(this.check);
    }
    this.field = make("div", { class: "field" }, head, make("div", { class: "stepper" }, this.less, this.input, this.more));
    this.used();
  }

  used() {
    for (const one of [this.input, this.less, this.more]) one.disabled = this.off;
    this.changed();
  }

  get off() {
    return this.check ? !this.check.checked : false;
  }

  move(by) {
    const [low, high] = [Number(this.input.min), Number(this.input.max)];
    this.input.value = Math.min(high, Math.max(low, Number(this.input.value) + by * this.step));
    this.changed();
  }

  get value() {
    return this.off || this.input.value === "" || !this.input.checkValidity() ? null : Number(this.input.value);
  }

  set value(value) {
    if (value != null) this.input.value = value;
    if (this.check) this.check.checked = value != null;
    this.used();
  }
}

export class Plan {
  /** `changed` is called whenever something else is chosen. */
  constructor(changed) {
    this.changed = () => {
      if (!this.ready) return;
      this.within();
      changed();
    };
    this.steps = Object.fromEntries(STEPS.map((row) => [row.name, new Stepper(row, () => this.changed())]));
    $("numbers").replaceChildren(...STEPS.map((row) => this.steps[row.name].field));
    $("modes").replaceChildren(...MODES.map((mode) => choice("mode", mode, `mode.${mode}`, mode === "active")));
    $("which").addEventListener("change", () => this.chosen());
    for (const id of ["sides", "modes"]) $(id).addEventListener("change", () => this.changed());
    document.addEventListener("language", () => this.names());
  }

  offer(exercises) {
    this.exercises = new Map(exercises.map((row) => [row.name, row]));
    const before = $("which").value;
    $("which").replaceChildren(...exercises.map(({ name }) => make("option", { value: name })));
    if (this.exercises.has(before)) $("which").value = before;
    this.names();
    this.ready = true;
    if (!before) this.chosen();
  }

  names() {
    for (const option of $("which").options) option.textContent = say(`exercise.${option.value}`);
    $("which-what").textContent = has(`exercise.${$("which").value}.what`) ? say(`exercise.${$("which").value}.what`) : "";
    fill($("exercise"));
  }

  chosen() {
    const row = this.exercise;
    this.steps.goal.value = row.goal_deg;
    this.names();
    this.changed();
  }

  /** A goal never leads beyond the limit. */
  within() {
    const { goal, limit } = this.steps;
    if (goal.value === null || limit.value === null) return;
    const beyond = this.exercise.rises ? goal.value > limit.value : goal.value < limit.value;
    if (beyond) goal.input.value = limit.value;
  }

  get exercise() {
    return this.exercises.get($("which").value);
  }

  sides(sides, affected) {
    renew($("sides"), sides.join(), () => {
      const before = this.side;
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
      sets: this.steps.sets.value ?? 1,
      repetitions: this.steps.repetitions.value,
    };
  }
}
