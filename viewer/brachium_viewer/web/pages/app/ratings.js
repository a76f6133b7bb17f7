// Pain and effort, 0 to 10, before and after.

import { make } from "./page.js";
import { fill, say, told } from "./words.js";

const WHAT = ["pain", "effort"];

function scale(link, what, when) {
  const name = `${what}-${when}`;
  const said = make("p", { class: "said", role: "status" });
  const choices = Array.from({ length: 11 }, (_, value) => {
    const input = make("input", { type: "radio", name, value: String(value) });
    input.addEventListener("change", async () => {
      const answer = await link.ask(what, { value, when });
      said.classList.toggle("wrong", !answer.ok);
      said.textContent = answer.ok ? say("kept") : told(answer.reason) || say("no-answer");
      if (!answer.ok) input.checked = false;
    });
    return make("label", {}, input, make("span", {}, String(value)));
  });
  const ends = make(
    "p",
    { class: "ends", "aria-hidden": "true" },
    make("span", { "data-say": `${what}.low` }),
    make("span", { "data-say": `${what}.high` }),
  );
  const legend = make("legend", { "data-say": what });
  return make("fieldset", { class: "rating" }, legend, make("div", { class: "scale choice" }, ...choices), ends, said);
}

export function showRatings(link) {
  for (const box of document.querySelectorAll(".ratings")) {
    box.replaceChildren(...WHAT.map((what) => scale(link, what, box.dataset.when)));
    fill(box);
  }
}

/** Take every rating back: another person, or another session. */
export function clearRatings() {
  for (const input of document.querySelectorAll(".rating input")) input.checked = false;
  for (const said of document.querySelectorAll(".rating .said")) said.textContent = "";
}
