"""One network and one browser for all that is looked at on the pages.

BRACHIUM_PICTURES names where pictures of each step are kept (default build/pictures).
"""

import math
import os
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from itertools import pairwise
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import pytest
from axe_playwright_python.sync_playwright import Axe
from playwright.sync_api import Error

from brachium.checks import free_port
from brachium.demo_network import site_text
from brachium.processes import Processes
from brachium_nodes.emulate import EmulateSettings
from brachium_nodes.wearer import WearerSettings
from brachium_wire import keys
from brachium_wire.bus import Bus

PICTURES = Path(os.environ.get("BRACHIUM_PICTURES", Path(__file__).parents[3] / "build" / "pictures"))
ROOM = "demo"
UP_S = 90.0
LOOK_S = 0.05
STAND_S = 20.0
"""Within it a screen must be told of the wearer and be used, however busy the machine is."""
TOKEN = "of-this-test"
DRESS = """async ([language, theme, percent]) => {
    const words = await import("/app/words.js");
    const button = document.getElementById("language");
    if (words.language !== language) button ? button.click() : await words.speak(language);
    const light = await import("/app/theme.js");
    if (light.dark() !== (theme === "dark")) light.switchTheme();
    if (percent) document.documentElement.style.fontSize = `${percent}%`;
}"""
LOOK = (Path(__file__).parent / "look.js").read_text("utf-8")
DRESSES = (("en", "light", 100), ("de", "dark", 200))
"""Both languages, light and dark, letters twice as large; not every combination: it costs time."""


class Network:
    """Router, gateway, fusion and pages as processes; a wearer who can be sent in and out."""

    def __init__(self, folder: Path, processes: Processes) -> None:
        self.processes, self.folder = processes, folder
        self.endpoint = f"tcp/127.0.0.1:{free_port()}"
        self.gateway, self.web = free_port(), free_port()
        self.address = f"http://127.0.0.1:{self.web}"
        self.room = ROOM
        self._network = ["--room", ROOM, "--endpoint", self.endpoint]

    def start(self) -> None:
        wearer = EmulateSettings(endpoint=self.endpoint, room=ROOM, token=TOKEN, wearer=WearerSettings())
        site, token = self.folder / "site.toml", self.folder / "token"
        site.write_text(site_text(wearer), "utf-8")
        token.write_text(TOKEN, "utf-8")
        port = self.endpoint.rpartition(":")[2]
        services = {
            "router": ["router", "--room", ROOM, "--port", port],
            "fuse": ["fuse", "--no-auto-pose", *self._network],  # what is asked for is seen to be done
            "gateway": ["gateway", *self._network, "--port", str(self.gateway), "--site", str(site)],
        }
        for name, words in services.items():
            self.processes.start(name, words, stderr=self.folder / f"{name}.err")
        self.start_web()
        with Bus.open(self.endpoint, timeout_s=UP_S) as bus:
            wanted = {"gateway", "fusion", "web"}
            until(
                lambda: (
                    wanted
                    <= {
                        keys.parse(k).detail.split("/")[0]
                        for k in bus.alive(keys.services(ROOM, "*/*/alive"))
                    }
                )
            )

    def start_web(self) -> None:
        folder = ["--sessions", str(self.folder / "sessions")]
        words = ["web", *self._network, "--port", str(self.web), "--no-password", *folder]
        self.processes.start("web", words, stderr=self.folder / "web.err")

    def kill_web(self) -> None:
        process = self.processes.children["web"].process
        assert process is not None
        process.kill()
        process.wait()

    @contextmanager
    def wearer(self, exercise: str = "elbow-flexion", routine: str = "") -> Iterator[None]:
        """Somebody who stands for STAND_S, does a routine if there is one, and then an exercise for ever."""
        gateway = f"ws://127.0.0.1:{self.gateway}/node"
        way = ["--gateway", gateway, "--token-file", str(self.folder / "token")]
        moves = ["--stand", f"{STAND_S:g}", "--routine", routine, "--exercise", exercise]
        words = ["emulate", *self._network, *way, *moves]
        self.processes.start("emulate", words, stderr=self.folder / "emulate.err")
        try:
            yield
        finally:
            self.processes.end("emulate")


def until(found: Callable[[], bool], timeout_s: float = UP_S) -> None:
    deadline = time.monotonic() + timeout_s
    while not found():
        assert time.monotonic() < deadline
        time.sleep(LOOK_S)


class Screen:
    """One page of a browser, and everything that is noted about it."""

    def __init__(
        self,
        browser: Any,
        network: Network,
        size: tuple[int, int],
        label: str,
        *,
        own_letters: bool = False,
        **device: Any,
    ) -> None:
        """`own_letters`: the page itself sets the size of letters; else the browser does."""
        self.network, self.label = network, label
        self.context = browser.new_context(
            viewport={"width": size[0], "height": size[1]},
            locale="en-GB",
            reduced_motion="reduce",
            color_scheme="light",
            **device,
        )
        self.asked: list[str] = []
        self.complaints: list[str] = []
        self.found: list[str] = []
        self.policies: set[str] = set()
        self.context.on("request", lambda request: self.asked.append(request.url))
        self.context.on("response", self._answered)
        self.page = self.context.new_page()
        self._listen(self.page)
        self.browser_says = self.context.new_cdp_session(self.page)
        self.own_letters = own_letters
        self.steps = 0

    def _listen(self, page: Any) -> None:
        page.on("console", self._console)
        page.on("pageerror", lambda error: self.complaints.append(str(error)))

    def _console(self, message: Any) -> None:
        """Keep what is said of the page, not that drawing without a graphics card is slow."""
        if message.type in ("error", "warning") and "GL Driver Message" not in message.text:
            self.complaints.append(message.text)

    def _answered(self, response: Any) -> None:
        if response.headers.get("content-type", "").startswith("text/html"):
            self.policies.add(response.headers.get("content-security-policy", "none"))

    def open(self, path: str) -> None:
        self.page.goto(self.network.address + path)

    def picture(self, step: str) -> None:
        """Keep a picture of the step reached."""
        self.steps += 1
        PICTURES.mkdir(parents=True, exist_ok=True)
        self.keep(self.page, f"{self.steps:02d}-{step}")

    def keep(self, page: Any, name: str, **how: Any) -> None:
        """Take a picture; a browser that draws without a graphics card may fail to give one at once."""
        for left in (2, 1, 0):
            try:
                page.screenshot(path=str(PICTURES / f"{self.label}-{name}.png"), **how)
                return
            except Error:
                if not left:
                    raise
                page.wait_for_timeout(500)

    def until(self, found: Callable[[], bool]) -> None:
        """Wait for something on the page: its policy forbids what a browser's driver would wait with."""
        deadline = time.monotonic() + UP_S
        while not found():
            if time.monotonic() > deadline:
                self.picture("failed")
                raise AssertionError(f"not within {UP_S:.0f} s; complaints: {self.complaints}")
            self.page.wait_for_timeout(50)

    def dress(self, language: str, theme: str, percent: int) -> None:
        """Another language, light or dark, larger letters: as the person, and as the browser may set them."""
        self.page.evaluate(DRESS, [language, theme, percent if self.own_letters else None])
        if not self.own_letters:
            self.browser_says.send("Page.setFontSizes", {"fontSizes": {"standard": 16 * percent // 100}})
        self.until(lambda: self.page.evaluate("document.documentElement.lang") == language)
        self.page.evaluate("new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))")

    def faults(self, target_px: int | None = None) -> list[str]:
        """What an eye would find wrong."""
        return [str(fault) for fault in self.page.evaluate(LOOK, target_px)]

    def barriers(self) -> list[str]:
        """What axe finds that is serious or critical."""
        found = Axe().run(self.page).response["violations"]
        return [
            f"{one['id']}: {node['html'][:120]} {node['failureSummary'][:200]}"
            for one in found
            if one["impact"] in ("serious", "critical")
            for node in one["nodes"][:3]
        ]

    def inspect(
        self,
        step: str,
        *,
        target_px: int | None = None,
        axe: bool = True,
        dresses: tuple[tuple[str, str, int], ...] = DRESSES,
    ) -> None:
        """Look at the page in both languages, light and dark, at the size of letters and at twice that."""
        found = []
        for language, theme, percent in dresses:
            self.dress(language, theme, percent)
            dressed = f"{step} {language} {theme} {percent} %"
            found += [f"{dressed}: {fault}" for fault in self.faults(target_px)]
            if axe:
                found += [f"{dressed}: {barrier}" for barrier in self.barriers()]
            if percent == 200:
                self.keep(self.page, f"{step}-{language}-{percent}")
        self.dress("en", "light", 100)
        self.found += found

    def arm(self, place: str, side: str = "right") -> None:
        """The arm that is drawn is in one piece: each part begins where the one before ends."""
        limbs = self.page.evaluate(f"document.getElementById('{place}').drawn()")[side]
        assert list(limbs) == ["upper_arm", "forearm", "hand"]
        for one, next_one in pairwise(limbs.values()):
            assert math.dist(one[1], next_one[0]) < 1e-6
        lengths = [math.dist(*ends) for ends in limbs.values()]
        assert min(lengths) > 0.1
        assert max(lengths) < 0.5

    def close(self) -> None:
        """End, and judge what was noted."""
        self.context.close()
        hosts = {urlsplit(url).hostname for url in self.asked if not url.startswith(("data:", "blob:"))}
        assert len(self.asked) > 10
        assert hosts == {"127.0.0.1"}, "nobody else may be asked for anything"
        assert self.policies
        assert all(
            policy.startswith(("default-src 'self'", "default-src 'none'")) for policy in self.policies
        )
        assert self.complaints == []
        assert self.found == [], "\n".join(self.found)


@pytest.fixture(scope="session")
def network(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Network]:
    with Processes() as processes:
        one = Network(tmp_path_factory.mktemp("pages"), processes)
        one.start()
        yield one


@pytest.fixture
def screen(browser: Any, network: Network) -> Callable[..., Any]:
    """A screen as a context manager; what was noted of it is judged at its end."""

    @contextmanager
    def opened(size: tuple[int, int], label: str, **device: Any) -> Iterator[Screen]:
        one = Screen(browser, network, size, label, **device)
        yield one
        one.close()

    return opened
