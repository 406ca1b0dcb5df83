"""The notebooks run from first to last cell on the wheel, and end where they say."""

import os
from pathlib import Path

import pytest

nbformat = pytest.importorskip("nbformat")
nbclient = pytest.importorskip("nbclient")
pytest.importorskip("ipykernel")

PYTHON = Path(__file__).resolve().parents[1]
DATA = PYTHON.parents[1] / "shared" / "data"
#: What must hold when a notebook is through; a cell after its last.
HOLDS = {
    "first_diagnosis": """
        kinds = {effect.kind for effect in diagnosis.effects}
        assert {"viscous_friction", "coulomb_friction"} <= kinds, kinds
        (viscous,) = (e for e in diagnosis.effects if e.kind == "viscous_friction")
        (found,) = viscous.parameters["viscous"].values()
        assert abs(found["value"] - 203.5) < 10, found
        assert evaluation.shrink["torque"]["shrink"] > 0.85
    """,
    "servo_arm": """
        kinds = {effect.kind for effect in diagnosis.effects}
        assert kinds if real else "coulomb_friction" in kinds, kinds
        assert diagnosis.shrink["position"]["shrink"] > 0.1
    """,
    "mujoco": """
        assert after < 0.2 * before, (before, after)
    """,
    "residual_or_pure": """
        assert errors["hybrid"] < errors["pure"], errors
        held = on_top.training["held_out"]
        assert held["physics"] < 0.2 * residual.training["held_out"]["physics"], held
    """,
}


def test_each_notebook_is_known():
    assert {file.stem for file in (PYTHON / "notebooks").glob("*.ipynb")} == set(HOLDS)


def run(name, folder, data, monkeypatch):
    if name == "mujoco":
        pytest.importorskip("mujoco")
    monkeypatch.setenv("GAPSCOPE_DATA", str(data))
    notebook = nbformat.read(PYTHON / "notebooks" / f"{name}.ipynb", as_version=4)
    nbformat.validate(notebook)
    assert not any(cell.get("outputs") for cell in notebook.cells), "notebooks are stored without outputs"
    checks = "\n".join(line[8:] for line in HOLDS[name].split("\n"))
    notebook.cells.append(nbformat.v4.new_code_cell(checks))
    client = nbclient.NotebookClient(notebook, timeout=600, kernel_name="python3", resources={"metadata": {"path": folder}})
    client.execute()


@pytest.mark.parametrize("name", sorted(HOLDS))
def test_a_notebook_runs_on_simulated_logs(name, tmp_path, monkeypatch):
    run(name, tmp_path, tmp_path / "none", monkeypatch)


@pytest.mark.parametrize("name", ["first_diagnosis", "servo_arm"])
def test_a_notebook_runs_on_the_real_log(name, tmp_path, monkeypatch):
    data = Path(os.environ.get("GAPSCOPE_DATA", DATA))
    if not data.is_dir():
        pytest.skip(f"no real logs in {data}; name their folder by GAPSCOPE_DATA")
    run(name, tmp_path, data, monkeypatch)
