// The patient's page: one thing at a time. What is known, what was done, and which step follows.

import "../app/theme.js";
import { Link } from "../app/link.js";
import { counted, sounds, switchSound, warn } from "../app/tone.js";
import { say, speak } from "../app/words.js";
import { missing, led, after, nextSet, offered, planned } from "./steps.js";
import { armMoves, showSettings } from "./settings.js";
import { Screens } from "./screens.js";
import { named } from "./pictures.js";
import { hush, speakOut } from "./voice.js";

const STOP_AGAIN_MS = 1000;

const room = { exercises: [], state: null, frame: null, up: false };
const mine = {
  step: "begin",
  aside: false, // at the settings; the step waits
  side: null,
  exercise: 0,
  last: null, // the set that ran last
  over: null, // when it began: it is done, even if the server still tells of it
  pain: null,
  stopping: null, // why the patient stopped, until the server has heard it
  busy: false,
  refused: "",
};
const screens = new Screens(room, mine);

function side() {
  return mine.side ?? room.state?.sides[0] ?? room.state?.session?.side ?? "right";
}

function choices() {
  return offered(room.exercises, room.frame?.arms[side()]);
}

function show() {
  screens.show(side(), choices());
}

function enter(step) {
  mine.step = step;
  mine.aside = false;
  mine.refused = "";
  if (step === "pain") mine.pain = null;
  screens.enter(side(), choices());
  if (step !== "begin") counted();
  speakOut(screens.spoken());
}

async function asked(verb, words) {
  mine.busy = true;
  mine.refused = "";
  show();
  const answer = await link.ask(verb, words);
  mine.busy = false;
  if (!answer.ok) mine.refused = answer.reason || say("patient.trouble.line");
  show();
  return answer.ok;
}

async function stand() {
  speakOut(say("patient.still.now"));
  if (await asked("calibrate", { routine: "pose", pose: "n-pose", seconds: 3 })) {
    enter(after("still", room.state.sides));
  } else {
    speakOut(screens.spoken());
  }
}

async function begin(set) {
  const { exercise, mode, goal_deg, limit_deg, repetitions } = set;
  await asked("exercise", { exercise, side: set.side, mode, goal_deg, limit_deg, repetitions, set: set.set, sets: set.sets });
}

async function finish() {
  await asked("stop");
  mine.refused = "";
}

async function rate() {
  if (mine.pain !== null && !(await asked("pain", { value: mine.pain, when: "after" }))) return;
  enter("done");
}

const GO = {
  begin: () => enter("sensors"),
  sensors: () => enter(after("sensors", room.state.sides)),
  still: () => (screens.calibrated() && !mine.refused ? enter(after("still", room.state.sides)) : stand()),
  exercise: () => {
    const one = choices()[mine.exercise % choices().length];
    begin(planned(room.state?.plans, one, side()));
  },
  do: finish,
  pain: rate,
  done: () => {
    const next = nextSet(mine.last);
    if (next) begin(next);
    else enter("exercise");
  },
  rest: () => enter(missing(room.state) ? "sensors" : "exercise"),
};

const OTHER = {
  still: stand,
  exercise: () => {
    mine.exercise += 1;
    screens.enter(side(), choices());
    speakOut(screens.spoken());
  },
  pain: () => enter("done"),
  done: () => enter("exercise"),
};

function setAside(aside) {
  mine.aside = aside;
  showSettings();
  screens.enter(side(), choices());
}

/** The set ends at once; why is asked afterwards, and told as well. */
function stop() {
  mine.over = room.state?.set?.from ?? mine.over;
  enter("stopped");
  warn();
  tellStop("other");
}

async function tellStop(reason) {
  const trying = mine.stopping !== null;
  mine.stopping = reason;
  if (trying) return;
  while (mine.stopping !== null) {
    const telling = mine.stopping;
    const { ok } = await link.ask("patient-stop", { reason: telling });
    if (ok && mine.stopping === telling) mine.stopping = null;
    if (!ok) await new Promise((done) => setTimeout(done, STOP_AGAIN_MS));
    show();
  }
}

await speak(); // before the line opens: nobody is shown a word's key
const link = new Link({
  line: (up) => {
    room.up = up;
    show();
  },
  hello: (hello) => {
    room.exercises = hello.exercises;
    show();
  },
  state: (state) => {
    room.state = state;
    if (state.set && state.set.from !== mine.over) mine.last = state.set;
    if (!state.sides.includes(mine.side)) mine.side = null;
    armMoves(state.set?.side ?? side());
    const to = led(mine.step, state.set, mine.over);
    if (to === "pain") mine.over = mine.last?.from ?? null;
    if (to) enter(to);
    else show();
  },
  frame: (frame) => {
    room.frame = frame;
    screens.drawFrame(mine.last?.side ?? side());
  },
});

for (const element of document.querySelectorAll("[data-picture]")) element.append(named(element.dataset.picture));
document.getElementById("go").addEventListener("click", () => (mine.aside ? setAside(false) : GO[mine.step]?.()));
document.getElementById("other").addEventListener("click", () => OTHER[mine.step]?.());
document.getElementById("stop").addEventListener("click", stop);
document.getElementById("choose").addEventListener("click", () => setAside(!mine.aside));
document.getElementById("sound").addEventListener("click", () => {
  switchSound();
  if (!sounds()) hush();
  show();
});
document.getElementById("reasons").addEventListener("click", (event) => {
  const button = event.target.closest("[data-reason]");
  if (!button) return;
  const { reason } = button.dataset;
  screens.rested = reason;
  if (reason !== "other") tellStop(reason);
  enter("rest");
});
for (const button of document.querySelectorAll("[data-side]")) {
  button.addEventListener("click", () => {
    mine.side = button.dataset.side;
    armMoves(mine.side);
    enter("exercise");
  });
}
document.getElementById("faces").addEventListener("click", (event) => {
  const button = event.target.closest("[data-value]");
  if (!button) return;
  mine.pain = Number(button.dataset.value);
  show();
});
document.addEventListener("keydown", (event) => {
  if (event.key === "Escape" && mine.step === "do") stop();
});
document.addEventListener("language", () => screens.enter(side(), choices()));

screens.enter(side(), choices());
