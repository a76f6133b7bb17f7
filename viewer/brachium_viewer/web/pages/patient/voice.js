// Spoken prompts. Only voices of this device: one that is spoken elsewhere would send words away.
// A device without one shows the same words and gives its tone.

import { sounds } from "../app/tone.js";
import { language } from "../app/words.js";

const speech = window.speechSynthesis ?? null;

function localVoice() {
  const voices = speech?.getVoices() ?? [];
  return voices.find((voice) => voice.localService && voice.lang.startsWith(language)) ?? null;
}

/** Speak a sentence instead of what is being spoken. */
export function speakOut(text) {
  const voice = localVoice();
  if (!text || !voice || !sounds()) return;
  speech.cancel();
  const spoken = new SpeechSynthesisUtterance(text);
  spoken.voice = voice;
  spoken.lang = voice.lang;
  spoken.rate = 0.9;
  speech.speak(spoken);
}

export function hush() {
  speech?.cancel();
}
