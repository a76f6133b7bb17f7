// What a patient may set: language, size of text, the hand that touches, light or dark. Kept on this device.

import { dark, switchTheme } from "../app/theme.js";
import { LANGUAGES, language, say, speak } from "../app/words.js";

const SIZE = "brachium-size";
const HAND = "brachium-hand";
const SIZES = [100, 150, 200];
const root = document.documentElement;
const place = document.getElementById("settings");
let hand = localStorage.getItem(HAND);

function size() {
  const kept = Number(localStorage.getItem(SIZE));
  return SIZES.includes(kept) ? kept : SIZES[0];
}

function next(list, one) {
  return list[(list.indexOf(one) + 1) % list.length];
}

/** Buttons lie at the hand that is free: the other one than the arm that moves, until somebody chooses. */
export function armMoves(side) {
  root.dataset.hand = hand ?? (side === "left" ? "right" : "left");
}

export function showSettings() {
  root.dataset.size = size();
  const now = {
    language: say(`patient.set.${language}`),
    size: say("patient.set.size", { percent: size() }),
    hand: say(root.dataset.hand === "left" ? "patient.set.hand.left" : "patient.set.hand.right"),
    theme: say(dark() ? "patient.set.dark" : "patient.set.light"),
  };
  for (const button of place.querySelectorAll("[data-setting]")) {
    if (button.dataset.setting in now) button.textContent = now[button.dataset.setting];
  }
}

const CHANGE = {
  language: () => speak(next(LANGUAGES, language)),
  size: () => localStorage.setItem(SIZE, next(SIZES, size())),
  hand: () => {
    hand = root.dataset.hand === "left" ? "right" : "left";
    localStorage.setItem(HAND, hand);
    root.dataset.hand = hand;
  },
  theme: switchTheme,
};

place.addEventListener("click", async (event) => {
  const button = event.target.closest("[data-setting]");
  if (!button) return;
  await CHANGE[button.dataset.setting]();
  showSettings();
});
document.addEventListener("language", showSettings);
armMoves("right");
root.dataset.size = size();
