"""Pages from templates: HTML that needs nothing else, one look for all of them."""

from pathlib import Path

from brachium_wire.messages import Origin
from brachium_wire.table import MissingExtra

STYLE = Path(__file__).with_name("page.css")

_ORIGIN: dict[Origin, tuple[str, str]] = {
    "worn": ("Worn.", "A person wore these sensors."),
    "emulated": ("Emulated.", "No person wore these sensors: every sample comes from a computed wearer."),
    "playback": (
        "Playback.",
        "These samples were played from a file; nobody wore the sensors while this was recorded.",
    ),
}


def render(template: Path, **values: object) -> str:
    """Return a template's HTML; `style` is in it. Foreign words cannot become markup.

    Raises MissingExtra without `brachium[report]`.
    """
    try:
        import jinja2
    except ImportError:
        raise MissingExtra("a page needs Jinja2: pip install 'brachium[report]'") from None
    environment = jinja2.Environment(
        autoescape=True, undefined=jinja2.StrictUndefined, trim_blocks=True, lstrip_blocks=True
    )
    text = template.read_text(encoding="utf-8")
    return environment.from_string(text).render(style=STYLE.read_text(encoding="utf-8"), **values)


def origin_words(origins: list[str]) -> tuple[str, str]:
    """Return where data come from, as a title and a sentence."""
    if not origins:
        return "Origin unknown.", "The recording does not say where its data come from."
    if len(origins) == 1:
        return _ORIGIN[origins[0]]  # type: ignore[index]
    return f"Mixed: {', '.join(origins)}.", "Not all of these data come from sensors that a person wore."
