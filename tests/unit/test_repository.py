"""What surrounds the package: the workflow and the container run what they say."""
import os
import re
from pathlib import Path

import pytest
import yaml

from pysph_boiling.examples import scene_class

ROOT = Path(__file__).parents[2]


def test_the_workflow_runs_what_ci_runs():
    workflow = yaml.safe_load((ROOT / ".github/workflows/ci.yml").read_text(encoding="utf-8"))
    commands = [step["run"] for step in workflow["jobs"]["test"]["steps"] if "run" in step]
    assert commands[-1] == ".ci/run" and os.access(ROOT / ".ci/run", os.X_OK)


@pytest.mark.parametrize("path", sorted(ROOT.glob(".github/ISSUE_TEMPLATE/*.md")), ids=lambda path: path.stem)
def test_issue_templates_have_what_github_asks_for(path):
    _, head, body = path.read_text(encoding="utf-8").split("---\n")
    assert {"name", "about", "labels"} <= set(yaml.safe_load(head)) and body.strip()


def test_the_container_has_all_that_an_installation_reads():
    text = (ROOT / "Containerfile").read_text(encoding="utf-8")
    copied = {name for line in re.findall(r"^COPY (.*) \S+$", text, re.M) for name in line.split()}
    assert all((ROOT / name).exists() for name in copied)
    read = set(re.findall(r'HERE / "(\w[\w.]*)"', (ROOT / "setup.py").read_text(encoding="utf-8")))
    assert read and read | {"setup.py", "pyproject.toml"} <= copied


def test_the_container_runs_a_scene():
    text = (ROOT / "Containerfile").read_text(encoding="utf-8")
    command, scene, *options = yaml.safe_load(re.search(r"^CMD (.*)$", text, re.M)[1])
    assert command == "run" and scene_class(scene)().resolve(options)
