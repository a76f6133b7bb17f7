// The therapist's page: puts its parts together, and hands each what concerns it.

import { Calibration } from "./calibration.js";
import { Link } from "./link.js";
import { Numbers } from "./numbers.js";
import { $, busy, make, put, renew, tell } from "./page.js";
import { People } from "./people.js";
import { Picture } from "./picture.js";
import { Plan } from "./plan.js";
import { clearRatings, showRatings } from "./ratings.js";
import { showHeadline, showParts, showSensors } from "./sensors.js";
import { Tabs } from "./tabs.js";
import { switchTheme } from "./theme.js";
import { sounds, switchSound } from "./tone.js";
import { language, say, sayCount, speak, told } from "./words.js";

const UNCOUNTED = new Set(["uncalibrated", "heading_assumed", "assumed"]);

let state = null;
let arms = {};
let up = false;
let again = false; // the next state is the first that this line tells
let next = null; // the button that gets the focus as soon as it is there

await speak();
const picture = new Picture($("picture"));
const numbers = new Numbers();
const tabs = new Tabs($("tabs"));
const link = new Link({ hello, frame, state: news, line });
const plan = new Plan(() => meant(), link);
const calibration = new Calibration(link);
const people = new People(link);
showRatings(link);

function hello(message) {
  again = true;
  plan.offer(message.exercises);
  meant();
}

function line(now) {
  up = now;
  document.body.classList.toggle("cut", !up);
  if (!state) return;
  showHeadline(state, up);
  recording();
}

function frame(message) {
  arms = message.arms;
  showParts(arms);
  numbers.frame(message);
  picture.show(message.arms, message.set?.over ? numbers.side : null);
  hint();
}

/** What the numbers are about: the set that runs, else what is chosen. */
function meant() {
  if (!plan.exercises) return;
  const running = state?.set;
  const row = plan.exercises.get(running?.exercise) ?? plan.exercise;
  const words = running ?? plan.words;
  numbers.mean({ row, side: words.side, goal: words.goal_deg, limit: words.limit_deg });
  const wanted = running ? running.repetitions : words.repetitions;
  $("count-wanted").textContent = wanted == null ? "" : say("of", { wanted });
  $("count-set").textContent = say("set", { set: running?.set ?? numbers.ended?.number ?? plan.number, sets: words.sets });
  const { sets } = plan.words;
  $("start").textContent = sets > 1 ? say("start.set", { set: plan.number, sets }) : say("start");
}

/** Beside the button, before anybody waits for a count: that this angle is not measured, so nothing is counted. */
function hint() {
  const { quality } = numbers;
  const words = UNCOUNTED.has(quality) ? say(`uncounted.${quality}`) : "";
  $("action-hint").hidden = !words;
  put($("action-hint"), words);
}

function news(message) {
  if (state && state.subject !== message.subject) {
    numbers.ended = null;
    clearRatings();
  }
  if (!state && message.set) tabs.show($("tab-exercise"));
  if (again && state?.set && !message.set) tell($("action-said"), { ok: false, reason: say("line.anew") });
  again = false;
  state = message;
  showHeadline(state, up);
  showSensors(state);
  people.show(state);
  calibration.show(state.calibration);
  plan.sides(state.sides.length ? state.sides : ["right"], state.session?.side);
  plan.adopt(state);
  $("origin").hidden = state.origin === "worn";
  $("origin").textContent = say(`origin.${state.origin}`);
  $("start").hidden = state.set !== null;
  $("stop").hidden = state.set === null;
  lead(next);
  $("start").disabled = state.sides.length === 0;
  recording();
  history();
  meant();
}

/** Give a button the focus, now or when the state shows it: who has no pointer goes on from there. */
function lead(button) {
  next = button?.hidden ? button : null;
  if (button && !next) button.focus({ preventScroll: true });
}

/** Whether anything comes that can be recorded. */
function heard() {
  return state.live > 0 || Object.values(arms).some((arm) => !arm.stale);
}

function recording() {
  const { state: how, seconds } = state.recording;
  $("recording").hidden = how !== "on" || !up; // cut off, nobody knows whether it still does
  const time = `${Math.floor((seconds ?? 0) / 60)}:${String((seconds ?? 0) % 60).padStart(2, "0")}`;
  $("recording").textContent = say(heard() ? "recording" : "recording.silent", { time });
  const alarms = state.alarms.map(({ what, reason }) => say(`alarm.${what}`, { reason: told(reason) }));
  if (state.stopped) alarms.unshift(stopSaid(state.stopped));
  renew($("alarm"), alarms.join(), () => alarms.map((text) => make("p", {}, text)));
}

/** That the patient has stopped, and why once they have said it: until then it is "other". */
function stopSaid(reason) {
  if (reason === "other") return say("alarm.stopped.untold");
  return say("alarm.stopped", { reason: say(`patient.reason.${reason}`) });
}

function history() {
  $("history-none").hidden = state.history.length > 0;
  renew($("history"), JSON.stringify(state.history) + language, () =>
    state.history.map((one) => {
      const when = new Date(one.started).toLocaleDateString(language, { dateStyle: "medium" });
      const what = one.sets.map((row) => say("history.set", { exercise: say(`exercise.${row.exercise}`), count: row.count ?? "–" }));
      const origin = one.origin === "worn" ? [] : [make("span", { class: "small" }, ` ${say(`origin.${one.origin}.short`)}`)];
      const name = make("span", {}, make("strong", {}, when), ` ${what.join(", ")}`, ...origin);
      const open = one.report ? [make("a", { href: one.report, target: "_blank", rel: "noopener" }, say("report.open"))] : [];
      return make("li", {}, name, ...open);
    }),
  );
}

$("start").addEventListener("click", async () => {
  tabs.show($("tab-exercise"));
  plan.tell(); // what was never changed is planned by starting it
  const answer = await busy($("start"), () => link.ask("exercise", { ...plan.words, set: plan.number }));
  numbers.ended = null;
  tell($("action-said"), answer);
  if (!answer.ok) return;
  lead($("stop"));
  scrollTo({ top: 0 }); // the picture and the numbers are what is looked at now
});

$("stop").addEventListener("click", async () => {
  const { set, sets } = state.set ?? { set: plan.number, sets: plan.words.sets };
  const answer = await busy($("stop"), () => link.ask("stop"));
  if (answer.ok) numbers.ended = { ...answer.data.set, number: set };
  const last = set >= sets;
  tell($("action-said"), answer, sayCount("set.done", answer.data?.set?.count ?? 0));
  if (answer.ok) lead($("start"));
  if (answer.ok && last) tabs.show($("tab-finish"));
  meant();
});

$("mark").addEventListener("click", async () => {
  tell($("action-said"), await busy($("mark"), () => link.ask("mark")), say("mark.done"));
});

$("report").addEventListener("click", async () => {
  $("report-open").hidden = true;
  tell($("report-said"), { ok: true }, say("report.making"));
  const answer = await busy($("report"), () => link.ask("report"));
  const notes = [answer.data?.ended, answer.data?.why].filter(Boolean).map(told).join(" ");
  tell($("report-said"), answer, `${say("report.done", { file: answer.data?.recording ?? "" })} ${notes}`);
  if (!answer.ok) return;
  clearRatings();
  $("report-open").hidden = !answer.data.report;
  if (answer.data.report) {
    $("report-open").href = answer.data.report;
    $("report-open").focus();
  }
});

for (const button of document.querySelectorAll("#views button")) {
  button.addEventListener("click", () => {
    for (const one of document.querySelectorAll("#views button")) one.setAttribute("aria-pressed", String(one === button));
    picture.view(button.dataset.view, [numbers.side]);
  });
}
picture.turned = () => {
  for (const one of document.querySelectorAll("#views button")) one.setAttribute("aria-pressed", "false");
};

$("theme").addEventListener("click", switchTheme);
$("sound").addEventListener("click", () => {
  switchSound();
  soundSaid();
});

function soundSaid() {
  $("sound").textContent = say(sounds() ? "sound.on" : "sound.off");
}
soundSaid();

function otherLanguage() {
  const other = language === "en" ? "de" : "en";
  $("language").lang = other;
  $("language").textContent = { en: "English", de: "Deutsch" }[other];
  return other;
}
otherLanguage();
$("language").addEventListener("click", async () => {
  await speak(otherLanguage());
  otherLanguage();
  soundSaid();
  if (state) news(state);
});
