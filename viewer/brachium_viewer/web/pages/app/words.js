// Every word that is shown, out of one catalogue a language: /words/en.json, /words/de.json.
//
// Services say in English why something cannot be. Such a sentence is its own key in the other languages'
// catalogues, with {names} where it has figures.

export const LANGUAGES = ["en", "de"];
const KEPT = "brachium-language";

let words = {};
let sentences = [];
let known = new Map();
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
  sentences = Object.keys(words).filter((key) => key.includes(" ")).map(sentence).sort((a, b) => b.weight - a.weight);
  known = new Map();
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

/** The words of a key for so many repetitions: one has words of its own. */
export function sayCount(key, count) {
  return say(count === 1 ? `${key}.one` : key, { count: number(count) });
}

/** A sentence that a service said in English, in this language; one that no catalogue knows stays as it came. */
export function told(text) {
  if (!text) return "";
  if (!known.has(text)) known.set(text, whole(text) ?? joined(text, "; ", told) ?? named(text));
  return known.get(text);
}

const BLANK = /\{(\w+)\}/g;

function sentence(key) {
  const literal = key.split(/\{\w+\}/).map((part) => part.replace(/[.*+?^${}()|[\]\\]/g, "\\$&"));
  return {
    key,
    pattern: new RegExp(`^${literal.join("([^;]+?)")}$`),
    names: [...key.matchAll(BLANK)].map((found) => found[1]),
    weight: literal.join("").length, // what says most of itself fits best
  };
}

function whole(text) {
  for (const { key, pattern, names } of sentences) {
    const found = pattern.exec(text);
    if (found) return say(key, Object.fromEntries(names.map((name, i) => [name, filled(found[i + 1]) ?? found[i + 1]])));
  }
  return null;
}

/** What stands in a blank: a segment, a side, a figure, another sentence, or some of them; null if none. */
function filled(value) {
  return joined(value, ", ", filled) ?? joined(value, " and ", filled) ?? one(value);
}

function one(value) {
  for (const kind of ["segment", "side"]) if (has(`${kind}.${value}`)) return say(`${kind}.${value}`);
  if (/^-?\d+\.\d+$/.test(value)) return number(Number(value), value.split(".")[1].length);
  return whole(value);
}

/** Text that is known up to a mark, as far as can be, and whatever follows; null where none is. */
function joined(text, mark, rest) {
  for (let at = text.lastIndexOf(mark); at > 0; at = text.lastIndexOf(mark, at - 1)) {
    const left = one(text.slice(0, at));
    const right = left === null ? null : rest(text.slice(at + mark.length));
    if (right !== null) return left + (mark === "; " ? mark : ", ") + right;
  }
  return null;
}

/** The text with its segments called as people call them. */
function named(text) {
  return text.replace(/\b(sternum|(upper_arm|forearm|hand)_[rl])\b/g, (id) => say(`segment.${id}`));
}

/** True when the catalogue has this key. */
export function has(key) {
  return key in words;
}

/** A number as people of this language write it. */
export function number(value, digits = 0) {
  return value.toLocaleString(language, { minimumFractionDigits: digits, maximumFractionDigits: digits });
}

/** Fill in every element below `root` that names its words: data-say, data-say-label. */
export function fill(root) {
  for (const element of root.querySelectorAll("[data-say]")) element.textContent = say(element.dataset.say);
  for (const element of root.querySelectorAll("[data-say-label]")) {
    element.setAttribute("aria-label", say(element.dataset.sayLabel));
  }
}
