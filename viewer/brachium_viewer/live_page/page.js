"use strict";

// Starts the bundled viewer on this page's canvas. Nothing is kept in the browser, so each visit shows our layout.
async function start() {
  const message = document.getElementById("message");
  try {
    await wasm_bindgen({ module_or_path: "re_viewer_bg.wasm" });
    const handle = new wasm_bindgen.WebHandle({
      url: [document.body.dataset.stream],
      render_backend: new URLSearchParams(location.search).get("renderer"),
      hide_welcome_screen: true,
      enable_history: false,
      notebook: false,
      persist: false,
      theme: "dark",
    });
    await handle.start(document.getElementById("view"));
    message.hidden = true;
    const watch = setInterval(() => {
      if (!handle.has_panicked()) return;
      clearInterval(watch);
      message.textContent = "The viewer stopped: " + handle.panic_message() + " Reload the page.";
      message.hidden = false;
    }, 1000);
  } catch (error) {
    message.textContent = "The viewer could not start: " + error;
  }
}

start();
