// What every part of a page needs: its elements, and answers said where they were asked for.

import { say, told } from "./words.js";

export const $ = (id) => document.getElementById(id);

/** An element with text; `words` are its attributes. */
export function make(name, words = {}, ...inside) {
  const one = document.createElement(name);
  for (const [key, value] of Object.entries(words)) one.setAttribute(key, value);
  one.append(...inside);
  return one;
}

/** Put a text into an element, when it is another one: what does not change is not painted again. */
export function put(element, text) {
  if (element.textContent !== text) element.textContent = text;
}

/** Put children into an element only when they say something new: what has the focus keeps it. */
export function renew(element, key, children) {
  if (element.dataset.key === key) return;
  element.dataset.key = key;
  element.replaceChildren(...children());
}

/** Say an answer in an element: what was done, or why not. */
export function tell(element, answer, done = "") {
  element.classList.toggle("wrong", !answer.ok);
  element.textContent = answer.ok ? done : told(answer.reason) || say("no-answer");
}

/** Run a question while its button is busy; returns the answer. */
export async function busy(button, question) {
  button.disabled = true;
  try {
    return await question();
  } finally {
    button.disabled = false;
  }
}
