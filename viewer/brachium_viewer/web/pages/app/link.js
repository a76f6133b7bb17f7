// The line to the server: a WebSocket that comes back by itself. docs/web-protocol.md says what travels.

import { language } from "./words.js";

const FIRST_PAUSE_MS = 300;
const LONGEST_PAUSE_MS = 5000;
const ANSWER_MS = 320000;
const LOOK_MS = 1000;
const SILENT_LOOKS = 8; // the server tells at once that an arm is silent: who hears nothing for so long has a dead line

/** What a frame still tells when the line is cut: who and how many, but of no arm where it is now. */
function silent(frame) {
  const none = (angles) => Object.fromEntries(Object.keys(angles).map((name) => [name, [null, "missing"]]));
  const arms = Object.entries(frame.arms).map(([side, arm]) => [side, { ...arm, stale: true, angles: none(arm.angles) }]);
  const set = frame.set && { ...frame.set, angle: null, over: false };
  return { ...frame, arms: Object.fromEntries(arms), set };
}

export class Link {
  /** `heard` has a function for each kind of message: hello, frame, state; and `line(up)` for the line itself. */
  constructor(heard) {
    this.heard = heard;
    this.waiting = new Map();
    this.newest = null;
    this.number = 0;
    this.pause = FIRST_PAUSE_MS;
    this.silent = 0;
    this.open();
    setInterval(() => this.look(), LOOK_MS);
  }

  open() {
    const scheme = location.protocol === "https:" ? "wss" : "ws";
    this.socket = new WebSocket(`${scheme}://${location.host}/ws`);
    this.socket.onopen = () => {
      this.pause = FIRST_PAUSE_MS;
      this.heard.line?.(true);
    };
    this.socket.onmessage = (event) => this.take(JSON.parse(event.data));
    this.socket.onclose = () => this.lost();
  }

  /** A network that is gone closes nothing: count looks, not time, for a page that was busy has not heard yet. */
  look() {
    const shown = Object.values(this.newest?.arms ?? {}).some((arm) => !arm.stale);
    if (this.socket.readyState !== WebSocket.OPEN || !shown || ++this.silent < SILENT_LOOKS) return;
    this.socket.onclose = this.socket.onmessage = null;
    this.socket.close();
    this.lost();
  }

  take(message) {
    this.silent = 0;
    if (message.kind === "answer") {
      this.waiting.get(message.id)?.(message);
      this.waiting.delete(message.id);
    } else {
      if (message.kind === "frame") this.newest = message;
      this.heard[message.kind]?.(message);
    }
  }

  async lost() {
    this.heard.line?.(false);
    this.newest &&= silent(this.newest);
    if (this.newest) this.heard.frame?.(this.newest);
    for (const answer of this.waiting.values()) answer({ ok: false, reason: "" });
    this.waiting.clear();
    await new Promise((done) => setTimeout(done, this.pause));
    this.pause = Math.min(LONGEST_PAUSE_MS, 2 * this.pause);
    // A key that has run out is told by no WebSocket: ask for something small, and go to the door if it is refused.
    const signal = AbortSignal.timeout(LONGEST_PAUSE_MS);
    const asked = await fetch("/app/link.js", { method: "HEAD", cache: "no-store", signal }).catch(() => null);
    if (asked?.status === 401) location.assign(`/door?to=${location.pathname}`);
    else this.open();
  }

  /** Ask for something; the promise gives {ok, reason, data}, and never fails. */
  ask(verb, words = {}) {
    if (this.socket.readyState !== WebSocket.OPEN) return Promise.resolve({ ok: false, reason: "" });
    const id = ++this.number;
    return new Promise((done) => {
      this.waiting.set(id, done);
      setTimeout(() => this.take({ kind: "answer", id, ok: false, reason: "" }), ANSWER_MS);
      this.socket.send(JSON.stringify({ kind: "do", id, verb, language, ...words }));
    });
  }
}
