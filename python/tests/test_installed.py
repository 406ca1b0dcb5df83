"""What is tested is the wheel."""

import importlib.metadata
import subprocess
import sys
from pathlib import Path

import gapscope


def test_the_package_is_the_installed_one():
    place = Path(gapscope.__file__)
    assert "site-packages" in place.parts
    assert gapscope.__version__ == importlib.metadata.version("gapscope")
    assert (place.parent / "py.typed").exists() and (place.parent / "_native.pyi").exists()


def test_numpy_is_its_only_need():
    needs = [need for need in importlib.metadata.requires("gapscope") if "extra ==" not in need]
    assert [need.split(">")[0] for need in needs] == ["numpy"]
    text = "import sys, gapscope; print([m for m in ('pandas', 'polars', 'matplotlib', 'mujoco') if m in sys.modules])"
    assert subprocess.check_output([sys.executable, "-c", text], text=True).strip() == "[]"


def test_what_is_public_has_a_docstring():
    for name in gapscope.__all__:
        public = getattr(gapscope, name)
        assert name == "__version__" or public.__doc__, name
    for name in ("inverse_dynamics", "forward_dynamics", "mass_matrix", "gravity", "bias", "regressor"):
        assert "(..., n" in getattr(gapscope.Model, name).__doc__, name
