"""The examples of the documents run, and docs/engines.md shows lines of an example file."""

import pathlib
import re
import runpy

import zynq_pgs
from conftest import pile

PACKAGE = pathlib.Path(__file__).parents[1]


def blocks(page):
    return re.findall(r"^```python\n(.*?)^```", page.read_text(), re.MULTILINE | re.DOTALL)


def test_the_example_of_the_packages_readme_runs():
    (example,) = blocks(PACKAGE / "README.md")
    names = {}
    exec(example, names)
    assert abs(names["bodies"]["position"][1, 1] - 0.99) < 0.01


def test_the_lines_of_the_projects_readme_run():
    (lines,) = blocks(PACKAGE.parents[1] / "README.md")
    bodies, collisions = pile(5)
    before = bodies.tobytes()
    exec(lines.replace("auto", "emulated"), {"zynq_pgs": zynq_pgs, "bodies": bodies, "found": collisions})
    assert bodies.tobytes() != before


def test_the_page_about_engines_shows_lines_of_the_example():
    (shown,) = blocks(PACKAGE.parents[1] / "docs/engines.md")
    lines = (PACKAGE / "examples/pile.py").read_text().splitlines()
    assert all(line in lines for line in shown.splitlines())


def test_the_heap_comes_to_rest_in_its_box(capsys, monkeypatch):
    monkeypatch.setattr("sys.argv", ["pile.py"])
    names = runpy.run_path(str(PACKAGE / "examples/pile.py"))
    assert abs(names["balls"][:, ::2]).max() < 2 and 0.3 < names["balls"][:, 1].min()
    speeds = abs(names["bodies"]["linear_velocity"]).max()
    assert speeds < 0.5 and "cycles" in capsys.readouterr().out


def test_the_stubs_name_what_the_module_has():
    stubs = (PACKAGE / "python/zynq_pgs/_driver.pyi").read_text()
    names = set(re.findall(r"^(?:class|def) (\w+)|^(\w+): ", stubs, re.MULTILINE))
    assert set(zynq_pgs.__all__) <= {name for pair in names for name in pair}
    for of in (zynq_pgs.Accelerator, zynq_pgs.Report):
        (body,) = re.findall(rf"^class {of.__name__}.*?(?=^\S)", stubs + "end", re.MULTILINE | re.DOTALL)
        stubbed = set(re.findall(r"^    (?:def )?(\w+)[(:]", body, re.MULTILINE))
        assert stubbed - {"__init__"} == {name for name in vars(of) if not name.startswith("__") or "ter" in name or "exit" in name}
