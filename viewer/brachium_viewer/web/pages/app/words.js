// Every word that is shown, out of one catalogue a language: /words/en.json, /words/de.json.

export const LANGUAGES = ["en", "de"];
const KEPT = "brachium-language";

let words = {};
export let language = "en";

function chosen() {
  const kept = localStorage.getItem(KEPT);
  if (LANGUAGES.includes(kept)) return kept;
  const own = navigator.language.slice(0, 2);
  return LANGUAGES.includes(own) ? own : "en";
}

/** Load the words of a language, and put them into every element that names one. */
export async function speak(wanted = chosen()) {
  const answer = await fetch(`/words/${wanted}.json`);
  words = await answer.json();
  language = wanted;
  localStorage.setItem(KEPT, wanted);
  document.documentElement.lang = wanted;
  fill(document);
  document.dispatchEvent(new CustomEvent("language", { detail: wanted }));
}

/** The words of a key, with {names} filled in. A key that is in no catalogue is shown as it is. */
export function say(key, values = {}) {
  const text = words[key] ?? key;
  return text.replace(/\{(\w+)\}/g, (whole, name) => values[name] ?? whole);
}

/** True when the catalogue has this key. */
export function has(key) {
  return key in words;
}

/** A number as people of this language write it. */
export function number(value, digits = 0) {
  return value.toLocaleString(language, { minimumFractionDigits: digits, maximumFractionDigits: digits });
}

/** Fill in every element below `root` that names its words: data-say, data-say-label, data-say-title. */
export function fill(root) {
  for (const element of root.querySelectorAll("[data-say]")) element.textContent = say(element.dataset.say);
  for (const element of root.querySelectorAll("[data-say-label]")) {
    element.setAttribute("aria-label", say(element.dataset.sayLabel));
  }
  for (const element of root.querySelectorAll("[data-say-hint]")) {
    element.setAttribute("placeholder", say(element.dataset.sayHint));
  }
}
