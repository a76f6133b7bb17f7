"""Colours that stand for different things on one page differ for people who lack one kind of cone."""

import io
from itertools import combinations

import numpy as np
import pytest
from matplotlib.image import imread

pytestmark = [pytest.mark.network, pytest.mark.browser]

TOGETHER = {
    "parts of the arm": (".upper_arm", ".forearm", ".hand", ".sternum"),
    "sensors": ("--good", "--warn", "--bad"),
    "lines over time": ("--trace", "--goal", "--bad", "--ink"),
}
EYES = ("none", "protanopia", "deuteranopia", "tritanopia")
"""As Chromium simulates them, which is none of our own reckoning."""
LEAST = 10.0
"""CIE76 difference: four times what is just noticed side by side (2.3, Mahy 1994)."""
SIDE_PX = 40
SHOW = """([theme, colours, side]) => {
    document.documentElement.dataset.theme = theme;
    colours.forEach((colour, i) => {
        const one = document.createElement("i");
        const place = {position: "fixed", zIndex: 99, left: `${i * side}px`, top: 0};
        Object.assign(one.style, place, {width: `${side}px`, height: `${side}px`, borderRadius: 0});
        if (colour.startsWith(".")) one.className = `swatch ${colour.slice(1)}`;
        else one.style.background = `var(${colour})`;
        document.body.append(one);
    });
}"""


def lab(srgb: np.ndarray) -> np.ndarray:
    """CIE L*a*b* under D65 (IEC 61966-2-1, CIE 15)."""
    linear = np.where(srgb <= 0.04045, srgb / 12.92, ((srgb + 0.055) / 1.055) ** 2.4)
    xyz = linear @ np.array([[0.4124, 0.2126, 0.0193], [0.3576, 0.7152, 0.1192], [0.1805, 0.0722, 0.9505]])
    part = xyz / [0.9505, 1.0, 1.089]
    f = np.where(part > 216 / 24389, np.cbrt(part), (24389 / 27 * part + 16) / 116)
    return np.stack([116 * f[..., 1] - 16, 500 * (f[..., 0] - f[..., 1]), 200 * (f[..., 1] - f[..., 2])], -1)


@pytest.mark.parametrize("theme", ["light", "dark"])
def test_colours_that_mean_different_things_differ_whatever_cone_is_missing(screen, theme):
    near = []
    with screen((600, 200), f"colours-{theme}") as one:
        one.open("/")
        for what, colours in TOGETHER.items():
            one.page.evaluate(SHOW, [theme, list(colours), SIDE_PX])
            for eyes in EYES:
                one.browser_says.send("Emulation.setEmulatedVisionDeficiency", {"type": eyes})
                seen = imread(io.BytesIO(one.page.screenshot()))[SIDE_PX // 2, SIDE_PX // 2 :: SIDE_PX, :3]
                for (a, first), (b, second) in combinations(
                    zip(colours, lab(seen[: len(colours)]), strict=True), 2
                ):
                    apart = float(np.linalg.norm(first - second))
                    if apart < LEAST:
                        near.append(f"{what}, {eyes}: {a} and {b} differ by {apart:.1f}")
    assert near == []
