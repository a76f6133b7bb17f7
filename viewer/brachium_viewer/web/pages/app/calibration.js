// Calibration as a person is led through it: what to do now, how far it is, how it went.

import { $, busy, make, renew, tell } from "./page.js";
import { has, say } from "./words.js";

const RUNNING = new Set(["waiting", "running"]);

export class Calibration {
  constructor(link) {
    this.link = link;
    $("calibrate-guided").addEventListener("click", () => this.ask("calibrate", { routine: "guided" }));
    $("calibrate-pose").addEventListener("click", () => this.ask("calibrate", { routine: "pose" }));
    $("zero").addEventListener("click", () => this.ask("zero"));
    $("wear-check").addEventListener("click", async () => {
      const answer = await busy($("wear-check"), () => link.ask("wear-check"));
      tell($("wear-said"), answer, (answer.data?.words ?? []).join(" "));
    });
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

  buttons(disabled) {
    for (const id of ["calibrate-guided", "calibrate-pose", "zero"]) $(id).disabled = disabled;
  }

  show(news) {
    this.news = news;
    const runs = news !== null && RUNNING.has(news.state) && (this.asked || news.state === "running");
    this.buttons(runs || Boolean(this.asked));
    $("prompt").hidden = !runs;
    if (runs) {
      const step = `motion.${news.motion || news.pose}`;
      $("prompt-words").textContent = has(step) ? say(step) : news.reason;
      $("prompt-progress").value = news.progress;
    }
    $("calibration-state").classList.toggle("wrong", Boolean(this.refused));
    $("calibration-state").textContent = this.refused || this.words(news);
    const notes = news === null || runs ? [] : [...Object.values(news.refused), ...news.warnings];
    renew($("calibration-notes"), JSON.stringify(notes), () => notes.map((note) => make("li", {}, note)));
  }

  words(news) {
    if (news === null || news.state === "none") return say("calibration.none");
    if (news.state === "done") return `${say("calibration.done")} ${say(`forward.${news.forward}`)}`;
    if (news.state === "refused") return news.reason;
    return say("calibration.running");
  }
}
