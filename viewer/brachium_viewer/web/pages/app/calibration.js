// Calibration as a person is led through it: what to do now, how far it is, how it went.

import { $, busy, make, renew, tell } from "./page.js";
import { has, say, told } from "./words.js";

const RUNNING = new Set(["waiting", "running"]);
const MOVES_ON = new Set(["running", "done"]);

const WEAR_STEPS = ["listen", "ready", "hang", "raise", "bend"];

function seat({ segment, seat: place, turn, fine }) {
  const name = say(`segment.${segment}`);
  if (fine) return say("wear.right", { segment: name });
  if (place === null) return say("wear.unknown", { segment: name });
  if (place !== segment) return say("wear.elsewhere", { segment: name, seat: say(`segment.${place}`) });
  return say("wear.turned", { segment: name, turn: say(`turn.${turn || "both"}`) });
}

/** Whom a pose waits for; empty when nobody moves. */
function restless({ moving }) {
  return moving.length ? ` ${say("moving", { segments: moving.map((name) => say(`segment.${name}`)).join(", ") })}` : "";
}

export class Calibration {
  constructor(link) {
    this.link = link;
    $("calibrate-guided").addEventListener("click", () => this.ask("calibrate", { routine: "guided" }));
    $("calibrate-pose").addEventListener("click", () => this.ask("calibrate", { routine: "pose" }));
    $("zero").addEventListener("click", () => this.ask("zero"));
    $("wear-check").addEventListener("click", () => this.checkWear());
    $("donning").addEventListener("click", async () => {
      tell($("wear-said"), await busy($("donning"), () => link.ask("donning")), say("donning.done"));
    });
  }

  async ask(verb, words) {
    this.refused = "";
    this.asked = true;
    this.buttons(true);
    const answer = await this.link.ask(verb, words);
    this.asked = false;
    if (!answer.ok) this.refused = answer.reason || say("no-answer");
    if (this.news !== undefined) this.show(this.news);
  }

  async checkWear() {
    this.asked = true;
    this.buttons(true);
    const answer = await this.link.ask("wear-check");
    this.asked = false;
    tell($("wear-said"), answer, this.news?.wear?.fine ? say("wear.fine") : say("wear.done"));
    if (this.news !== undefined) this.show(this.news);
  }

  buttons(disabled) {
    for (const id of ["calibrate-guided", "calibrate-pose", "zero", "wear-check"]) $(id).disabled = disabled;
  }

  /** What is to be done now, and how far it is; null when nothing runs. */
  step(news) {
    const wear = news?.wear;
    if (wear?.state === "running") {
      const side = say(`side.${wear.side || "right"}`);
      const left = wear.left_s ? ` ${say("seconds", { seconds: wear.left_s })}` : "";
      return { words: say(`wear.${wear.step}`, { side }) + left, progress: WEAR_STEPS.indexOf(wear.step) / WEAR_STEPS.length };
    }
    if (news === null || !RUNNING.has(news.state) || !(this.asked || news.state === "running")) return null;
    const key = `motion.${news.motion || news.pose}`;
    return { words: (has(key) ? say(key) : told(news.reason)) + restless(news), progress: news.progress };
  }

  show(news) {
    if (MOVES_ON.has(news?.state) && news.state !== this.news?.state) this.refused = ""; // asked for anew, maybe elsewhere
    this.news = news;
    const step = this.step(news);
    const runs = step !== null;
    this.buttons(runs || Boolean(this.asked));
    $("prompt").hidden = !runs;
    if (runs) {
      if ($("prompt-words").textContent !== step.words) $("prompt-words").textContent = step.words;
      $("prompt-progress").value = step.progress;
    }
    this.seats(news?.wear);
    $("calibration-state").classList.toggle("wrong", Boolean(this.refused));
    $("calibration-state").textContent = told(this.refused) || this.words(news);
    const notes = news === null || runs ? [] : [...Object.values(news.refused), ...news.warnings].map(told);
    renew($("calibration-notes"), JSON.stringify(notes), () => notes.map((note) => make("li", {}, note)));
  }

  /** Where each sensor was found to sit. */
  seats(wear) {
    const found = wear?.state === "done" ? wear.findings.map(seat) : [];
    const silent = wear?.state === "done" ? Object.keys(wear.left_out).map((name) => say("wear.left-out", { segment: say(`segment.${name}`) })) : [];
    renew($("wear-notes"), JSON.stringify([found, silent]), () => [...found, ...silent].map((line) => make("li", {}, line)));
  }

  words(news) {
    if (news === null || news.state === "none") return say("calibration.none");
    if (news.state === "done") return `${say("calibration.done")} ${say(`forward.${news.forward}`)}`;
    if (news.state === "refused") return told(news.reason);
    return say("calibration.running");
  }
}
