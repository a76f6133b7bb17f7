// Light or dark: as the device is set, until somebody chooses.

const KEPT = "brachium-theme";
const device = matchMedia("(prefers-color-scheme: dark)");

export function dark() {
  const kept = localStorage.getItem(KEPT);
  return kept ? kept === "dark" : device.matches;
}

function show() {
  document.documentElement.dataset.theme = dark() ? "dark" : "light";
  document.dispatchEvent(new CustomEvent("theme"));
}

export function switchTheme() {
  localStorage.setItem(KEPT, dark() ? "light" : "dark");
  show();
}

device.addEventListener("change", show);
show();
