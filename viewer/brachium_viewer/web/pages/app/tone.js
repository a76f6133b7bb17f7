// What is heard: a warning while an angle is past its limit, a soft note for each repetition.

const KEPT = "brachium-sound";

let context = null;

export function sounds() {
  return localStorage.getItem(KEPT) !== "off";
}

export function switchSound() {
  localStorage.setItem(KEPT, sounds() ? "off" : "on");
  return sounds();
}

// Browsers give sound only to who has touched the page.
addEventListener("pointerdown", wake);
addEventListener("keydown", wake);

function wake() {
  context ??= new AudioContext();
  if (context.state === "suspended") context.resume();
}

function note(hertz, from, seconds, loudness) {
  const source = context.createOscillator();
  const volume = context.createGain();
  const start = context.currentTime + from;
  source.frequency.value = hertz;
  volume.gain.setValueAtTime(0, start);
  volume.gain.linearRampToValueAtTime(loudness, start + 0.012);
  volume.gain.setValueAtTime(loudness, start + seconds - 0.05);
  volume.gain.linearRampToValueAtTime(0, start + seconds);
  source.connect(volume).connect(context.destination);
  source.start(start);
  source.stop(start + seconds);
}

export function warn() {
  if (!context || !sounds()) return;
  note(880, 0, 0.16, 0.3);
  note(660, 0.2, 0.22, 0.3);
}

export function counted() {
  if (context && sounds()) note(523, 0, 0.12, 0.12);
}
