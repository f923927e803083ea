"""Each file of tests starts on the backend and in the precision that are asked for, whatever the last one set."""
import forces
import motion
import pytest
from harness import use_backend


@pytest.fixture(autouse=True, scope="module")
def backend():
    use_backend()


@pytest.fixture(scope="module", params=[2, 3], ids=["2-D", "3-D"])
def cloud(request):
    """A random cloud of bubbles and sites, with every kernel that acts on them."""
    made = forces.random_bubbles(request.param)
    made.dim = request.param
    return made


@pytest.fixture(scope="module", params=[2, 3], ids=["2-D", "3-D"])
def compiled(request):
    """A random cloud of fluid and walls, with every kernel that moves it."""
    fluid, wall, spacing = motion.cloud(request.param)
    return motion.compile_kernels(fluid, wall, dim=request.param, spacing=spacing)


@pytest.fixture
def kernels(compiled):
    """The cloud of :func:`compiled` in its initial state."""
    return motion.reset(compiled)
