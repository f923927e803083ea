"""The examples in the docstrings of what a user calls give what they say."""
import doctest
import importlib
from unittest.mock import patch

import pytest

from pysph_boiling.schemes.effects import EFFECTS

MODULES = ("pysph_boiling.particles", "pysph_boiling.results", "pysph_boiling.schemes.boiling",
           "pysph_boiling.schemes.effects.base")


@pytest.mark.parametrize("name", MODULES)
def test_examples_give_what_they_say(name):
    with patch.dict(EFFECTS):  # an example defines an effect, which registers itself
        failed, tried = doctest.testmod(importlib.import_module(name))
    assert tried > 0 and failed == 0
