"""Each file of tests starts on the backend and in the precision that are asked for, whatever the last one set."""
import pytest
from harness import use_backend


@pytest.fixture(autouse=True, scope="module")
def backend():
    use_backend()
