"""The site: Sphinx reads the documents where they are, so its source is the root of the repository (``make docs``)."""
import importlib
import re
import sys
from pathlib import Path

ROOT = Path(__file__).parents[1]
sys.path[:0] = [str(ROOT), str(Path(__file__).parent)]

from pysph_boiling import __version__ as release  # noqa: E402
from pysph_boiling.examples import scenes  # noqa: E402

project, author = "pysph_boiling", "The pysph_boiling developers"
copyright = author
extensions = ["myst_nb", "sphinx.ext.autodoc", "sphinx.ext.autosummary", "sphinx.ext.napoleon", "sphinx.ext.mathjax",
              "sphinx_gallery.gen_gallery", "docstrings"]
root_doc = "docs/index"
include_patterns = ["*.md", "docs/**.md", "docs/**.rst", "docs/**.ipynb", "example_plugin/README.md",
                    "pysph_boiling/evaluation/validation/*/README.md"]
exclude_patterns = [".*", "build", "docs/gallery", "docs/templates", "docs/generated/**.ipynb", "**.ipynb_checkpoints"]
templates_path = [str(ROOT / "docs/templates")]

myst_enable_extensions = ["dollarmath", "amsmath"]
myst_heading_anchors = 6  # as GitHub makes them
nb_execution_mode = "auto"  # notebooks are kept without what they print
nb_execution_in_temp = True
nb_execution_timeout = 600
nb_execution_raise_on_error = True

autodoc_member_order = "bysource"
autodoc_typehints = "description"
autosummary_generate = True
autosummary_ignore_module_all = False

sphinx_gallery_conf = {
    "examples_dirs": ["docs/gallery"], "gallery_dirs": ["docs/generated/gallery"],
    "image_scrapers": ("matplotlib", "gallery_pictures"),
    "abort_on_example_error": True,
    "download_all_examples": False,
    "show_memory": False,
    "write_computation_times": False,
}

html_theme = "furo"
html_title = f"pysph_boiling {release}"
html_extra_path = ["root"]  # leads from the root of the site to its first page


def write_scenes():
    """The page of the scenes: picture and docstring of each, whose entries become a list."""
    parts = ["# Scenes", "What each scene solves, how long it takes, and its command. `pysph-boiling run SCENE --help` "
                         "lists its variants, such as `--demo` and `--flat`, and all parameters."]
    for name in scenes():
        parts.append(f"## {name}")
        if (ROOT / "docs/pictures" / f"{name}.webp").exists():
            parts.append(f"![{name}](../pictures/{name}.webp)")
        text = importlib.import_module(f"pysph_boiling.examples.{name}").__doc__.strip()
        parts.append(re.sub(r"^([A-Z][\w ]*?) {2,}(?=\S)", r"- **\1**: ", text, flags=re.M))
    page = ROOT / "docs/generated/scenes.md"
    page.parent.mkdir(exist_ok=True)
    text = "\n\n".join(parts) + "\n"
    if not page.exists() or page.read_text(encoding="utf-8") != text:  # an unchanged page is not built again
        page.write_text(text, encoding="utf-8")


write_scenes()
