// The door: a code or a password, once a screen.

import "./theme.js";
import { say, speak } from "./words.js";

const form = document.getElementById("door");
const word = document.getElementById("word");
const wrong = document.getElementById("wrong");

const PAGES = ["/", "/patient"];

function next() {
  const wanted = new URLSearchParams(location.search).get("to");
  return PAGES.includes(wanted) ? wanted : "/";
}

async function enter() {
  wrong.textContent = "";
  const answer = await fetch("/door", { method: "POST", body: word.value.trim() }).catch(() => null);
  if (answer?.ok) {
    location.replace(next());
    return;
  }
  if (!answer) wrong.textContent = say("door.silent");
  else if (answer.status === 429) wrong.textContent = say("door.wait", { seconds: await answer.text() });
  else wrong.textContent = say("door.wrong");
  word.select();
  word.focus();
}

form.addEventListener("submit", (event) => {
  event.preventDefault();
  enter();
});

await speak();
if (location.hash.length > 1) {
  word.value = decodeURIComponent(location.hash.slice(1));
  history.replaceState(null, "", location.pathname + location.search);
  enter();
}
