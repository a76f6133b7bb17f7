"""Bland-Altman figures are pictures of the right size with every number's panel."""

import struct
from pathlib import Path

import numpy as np
import pytest

from brachium_viewer import agreement_chart
from brachium_wire.table import TableError

B = 60.0 * np.sin(np.arange(300) / 20.0)
NUMBERS = {"elbow_flexion": (B + 2.0, B), "wrist_x": (0.001 * B, 0.001 * B + 0.003)}
UNITS = {"elbow_flexion": "deg", "wrist_x": "m"}
ALL = np.ones(300, dtype=np.bool_)


@pytest.mark.parametrize(("ending", "begins"), [("png", b"\x89PNG"), ("svg", b"<?xml"), ("pdf", b"%PDF")])
def test_each_ending_gives_its_format(tmp_path: Path, ending: str, begins: bytes) -> None:
    path = tmp_path / f"agreement.{ending}"
    agreement_chart.draw(path, NUMBERS, ALL, UNITS)
    assert path.read_bytes().startswith(begins)
    again = tmp_path / f"again.{ending}"
    agreement_chart.draw(again, NUMBERS, ALL, UNITS)
    if ending != "pdf":
        assert again.read_bytes() == path.read_bytes()


def test_a_picture_is_one_page_clinical_angles_first_and_names_what_found_no_room(tmp_path: Path) -> None:
    many = {f"theta{i}": NUMBERS["elbow_flexion"] for i in range(20)} | NUMBERS
    left_out = agreement_chart.draw(tmp_path / "a.png", many, ALL, UNITS)
    assert len(left_out) == len(many) - agreement_chart.A_PAGE
    assert "elbow_flexion" not in left_out
    width, height = struct.unpack(">II", (tmp_path / "a.png").read_bytes()[16:24])
    assert max(width, height) < 2000
    assert agreement_chart.draw(tmp_path / "a.pdf", many, ALL, UNITS) == []
    assert (tmp_path / "a.pdf").read_bytes().count(b"/Type /Page ") == 2


def test_what_cannot_be_drawn_is_named(tmp_path: Path) -> None:
    with pytest.raises(TableError, match=r"ends in \.svg, \.png, \.pdf"):
        agreement_chart.draw(tmp_path / "a.jpg", NUMBERS, ALL, UNITS)
    with pytest.raises(TableError, match="share no number"):
        agreement_chart.draw(tmp_path / "a.png", {}, ALL, UNITS)
