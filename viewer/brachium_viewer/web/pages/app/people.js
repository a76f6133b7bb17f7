// Who is measured: chosen or created, by a pseudonym.

import { $, make, renew, tell } from "./page.js";
import { say } from "./words.js";

export class People {
  constructor(link) {
    this.link = link;
    $("subject").addEventListener("click", () => $("subjects").showModal());
    $("subjects-close").addEventListener("click", () => $("subjects").close());
    $("create").addEventListener("submit", (event) => {
      event.preventDefault();
      this.create();
    });
  }

  show(state) {
    $("subject-name").textContent = state.subject ?? say("nobody");
    renew($("subject-list"), JSON.stringify([state.subjects, state.subject]) + say("sensors"), () =>
      state.subjects.map((one) => {
        const sides = one.sides.map((side) => say(`side.${side}`)).join(", ") || say("no-arm");
        const button = make("button", { type: "button" }, make("span", {}, one.name), make("span", { class: "small" }, sides));
        if (one.name === state.subject) button.setAttribute("aria-current", "true");
        button.addEventListener("click", () => this.ask({ subject: one.name }, "subjects-said"));
        return make("li", {}, button);
      }),
    );
  }

  create() {
    const height = $("create-height").valueAsNumber;
    const words = { subject: $("create-name").value, create: true, side: $("create-side").value };
    this.ask(Number.isFinite(height) ? { ...words, height_m: height / 100 } : words, "create-said");
  }

  /** Ask, and say what was answered beside what was pressed. */
  async ask(words, where) {
    const answer = await this.link.ask("subject", words);
    for (const place of ["subjects-said", "create-said"]) tell($(place), place === where ? answer : { ok: true });
    if (answer.ok) $("subjects").close();
  }
}
