"""The notebook of the book, run anew: film, rope, throw."""

import importlib.util
import json
import os
import shutil
from pathlib import Path

import numpy as np
import pytest

SCRIPT = Path(__file__).resolve().parents[2] / "docs" / "notebook" / "notebook.py"


@pytest.fixture(scope="module")
def script():
    spec = importlib.util.spec_from_file_location("notebook", SCRIPT)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def ran(script, tmp_path_factory):
    pytest.importorskip("matplotlib")
    assert os.environ.get("WAG_PROGRAM") or shutil.which("wag"), (
        "the program `wag` is missing: build it, and name it in WAG_PROGRAM"
    )
    notebook = json.loads(script.NOTEBOOK.read_text(encoding="utf-8"))
    return notebook, *script.run_cells(notebook, tmp_path_factory.mktemp("notebook"))


def test_the_fit_explains_the_film_of_the_hidden_rope(ran):
    _, names, _ = ran
    assert not names["track"].unconfirmed and not names["track"].lost.any()
    assert names["rms_px"] == pytest.approx(names["estimate"].residual_px, abs=0.03)
    assert names["rms_px"] < 1.0
    assert abs(names["estimate"].rope.length_m - names["HIDDEN"].length_m) < 3e-3


def test_the_throw_is_as_forecast(ran):
    _, names, _ = ran
    plan, limits = names["plan"], names["limits"]
    assert plan.success and plan.predicted_error_m < 0.003
    qd_rad_s = np.abs(names["qd_rad_s"]).max(axis=0)
    assert all(qd_rad_s[joint - 1] <= limit * 1.001 for joint, limit in limits.items())
    assert np.median(names["misses_mm"]) < 10.0 and np.ptp(names["misses_mm"]) > 0.1
    assert names["miss_mm"] < 20.0


def test_every_cell_shows_as_much_as_the_book(ran, script):
    notebook, _, outputs = ran
    for cell, (printed, drawn) in zip(script.code_cells(notebook), outputs, strict=True):
        kept = [output["output_type"] for output in cell["outputs"]]
        assert kept.count("stream") == bool(printed) and kept.count("display_data") == len(drawn)


def test_the_page_is_the_notebooks(script, tmp_path, monkeypatch):
    script.check()
    monkeypatch.setattr(script, "PAGE", tmp_path / "notebook.md")
    with pytest.raises(SystemExit, match="notebook.md"):
        script.check()
