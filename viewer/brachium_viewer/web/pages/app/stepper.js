// A number that a finger sets: two buttons and a field between them.

import { make } from "./page.js";

export class Stepper {
  /** `changed` is called whenever somebody chose another number; an `optional` one may be left out. */
  constructor({ name, value, min, max, step, optional, on }, changed) {
    this.changed = changed;
    this.step = step;
    this.input = make("input", { id: `plan-${name}`, type: "number", inputmode: "numeric", min, max, step: optional ? "any" : step });
    this.less = make("button", { type: "button", "data-say-label": `${name}.less` }, "−");
    this.more = make("button", { type: "button", "data-say-label": `${name}.more` }, "+");
    this.less.addEventListener("click", () => this.move(-1));
    this.more.addEventListener("click", () => this.move(1));
    this.input.addEventListener("change", () => {
      this.number = this.input.value === "" ? this.kept : Number(this.input.value);
      this.changed();
    });
    const label = make("label", { for: `plan-${name}`, "data-say": name });
    const head = make("div", { class: "with-check" }, label);
    if (optional) {
      this.check = make("input", { id: `use-${name}`, type: "checkbox", "data-say-label": `${name}.use` });
      this.check.checked = on;
      this.check.addEventListener("change", () => this.used());
      head.prepend(this.check);
    }
    this.number = value;
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
    this.number = this.kept + by * this.step;
    this.changed();
  }

  /** What can be meant: a number out of range becomes the nearest in it, and never none, so that no limit is lost. */
  set number(value) {
    const [low, high] = [Number(this.input.min), Number(this.input.max)];
    this.kept = Math.min(high, Math.max(low, this.check ? value : Math.round(value)));
    this.input.value = this.kept;
  }

  get value() {
    return this.off ? null : this.kept;
  }

  set value(value) {
    if (value != null) this.number = value;
    if (this.check) this.check.checked = value != null;
    this.used();
  }
}
