"""Access to particle arrays on the host or on a device through one interface: reductions and subsets.

The conditions and limits of a step need only a few numbers, and decisions about bubbles need only the vapour. On a
device the numbers are reduced and the subset is compressed on the device, so a step never fetches a whole property. On
the host the same calls use NumPy. ``docs/backends.md`` lists what is fetched, and how much.

The host owns the constants and the device owns the properties: constants are pushed to the device when they are set,
and everything on the host is pushed once, when the solver is set up.
"""
import copy
import functools
import sys
from contextlib import contextmanager

import numpy as np
from compyle.array import get_backend
from compyle.types import dtype_to_ctype

__all__ = [
    "Copies", "Mirrored", "Subset", "counted", "detached", "largest", "largest_size", "neighbour_search", "on_host",
    "order", "positive", "real", "reduced", "send", "smallest", "summed", "values",
]


def values(pa, name):
    """A property of the real particles, (n,), as a NumPy array or a device array, wherever it is. Nothing is copied.

    Both kinds support arithmetic, comparisons and ``abs``; use the functions of this module to reduce them.
    """
    if pa.gpu is None:
        return pa.get(name, only_real_particles=True)
    array, n = pa.gpu.get_device_array(name).dev, real(pa)
    return array if len(array) == n else array[:n]


def real(pa):
    """Number of particles without ghosts; PySPH's own count excludes ghosts only on the host."""
    return pa.get_number_of_particles(True) if pa.gpu is None else pa.gpu.num_real_particles


def _library(array):
    """The module with ``max`` and ``sum`` for an array: numpy, pyopencl.array or pycuda.gpuarray."""
    return sys.modules[type(array).__module__]


def _number(value):
    return float(value.get() if hasattr(value, "get") else value)


def _chosen(array, where, other):
    """The entries for a reduction: those chosen, or on a device all of them, with ``other`` for those not chosen."""
    if where is None:
        return array
    if isinstance(array, np.ndarray):
        return array[where]
    return _library(array).if_positive(where, array, (0 * array + other).astype(array.dtype))


def largest(array, where=None, default=0.0):
    """Largest entry, or ``default`` if that is larger; only entries in the mask ``where`` (n,) count, if given."""
    array = _chosen(array, where, default)
    found = _number(_library(array).max(array)) if len(array) else default
    return default if found < default else found  # NaN is returned, if the device's reduction returns it


def smallest(array):
    """Smallest entry of a non-empty array; NaN is treated as in :func:`largest`."""
    return _number(_library(array).min(array))


def largest_size(array):
    """Largest absolute value, 0 for an empty array; NaN is treated as in :func:`largest`."""
    if not isinstance(array, np.ndarray):
        return largest(abs(array))
    return max(float(np.max(array)), -float(np.min(array))) if len(array) else 0.0


def summed(array, where=None):
    """Sum of the entries, only those in the mask ``where`` (n,) if given; NaN if one of them is NaN."""
    array = _chosen(array, where, 0)
    return _number(_library(array).sum(array)) if len(array) else 0.0


def positive(array):
    """The entries, with negative ones set to 0."""
    return 0.5 * (array + abs(array))


def reduced(kind, expression, pa, names):
    """Largest value, at least 0, or sum over the real particles of one array on its device, in one reduction.

    ``kind`` is "max" or "sum"; the C ``expression`` has the properties ``names``, of one type, as ``a[i]``, ``b[i]``
    and so on. The result is NaN if there is one, and 0 without particles.
    """
    arrays = [values(pa, name) for name in names]
    if not len(arrays[0]):
        return 0.0
    return _number(_reduction(kind, expression, len(names), arrays[0].dtype, pa.gpu.backend)(*arrays))


@functools.cache
def _reduction(kind, expression, n, dtype, backend):
    """A kernel of pyopencl or PyCUDA for :func:`reduced`."""
    both = {"max": "a > b || a != a ? a : b", "sum": "a + b"}[kind]
    number = dtype_to_ctype(dtype)
    arguments = ", ".join(f"const {number} *{chr(ord('a') + k)}" for k in range(n))
    options = dict(dtype_out=dtype, neutral="0", reduce_expr=both, map_expr=expression)
    if backend == "opencl":
        from compyle.opencl import get_context
        from pyopencl.reduction import ReductionKernel

        return ReductionKernel(get_context(), arguments=arguments.replace("const", "__global const"), **options)
    from pycuda.reduction import ReductionKernel

    return ReductionKernel(arguments=arguments, **options)


def counted(mask):
    """Number of true entries."""
    if isinstance(mask, np.ndarray):
        return int(np.count_nonzero(mask))
    return int(_number(_library(mask).sum(mask.astype(np.int32)))) if len(mask) else 0


class Subset:
    """Some of the real particles of one array; only the values that are asked for are fetched to the host.

    ``chosen`` is a mask (n,) computed from :func:`values`; on the host their indices ``who`` may be given instead. The
    order is that of the array. A subset is valid until particles are added, removed or reordered.
    """

    def __init__(self, pa, chosen=None, who=None):
        self.pa = pa
        if who is None:
            who = np.flatnonzero(chosen) if pa.gpu is None else _compressed(chosen, pa.gpu.backend)
        self.who, self.n = who, len(who)

    def __len__(self):
        return self.n

    def get(self, name):
        """A copy of a property on the host, (n,); in double precision unless it is an integer."""
        if self.pa.gpu is None:
            return self.pa.get(name, only_real_particles=True)[self.who]
        whole = self.pa.gpu.get_device_array(name)
        if self.n == 0:
            return np.zeros(0, whole.dtype)
        part = _array_module().empty(self.n, whole.dtype, backend=whole.backend)
        _kernel("take", whole.backend, whole.dtype)(self.who, whole, part)
        part = part.get()
        return part.astype(float) if part.dtype.kind == "f" else part

    def put(self, name, new):
        """Set a property to a number, or to an array (n,)."""
        if self.pa.gpu is None:
            self.pa.get(name, only_real_particles=False)[self.who] = new
        elif self.n:
            whole = self.pa.gpu.get_device_array(name)
            new = np.ascontiguousarray(np.broadcast_to(new, self.n).astype(whole.dtype))
            part = _array_module().to_device(new, backend=whole.backend)
            _kernel("put", whole.backend, whole.dtype)(self.who, part, whole)

    def only(self, chosen):
        """The subset of these particles that a mask (n,) on the host selects."""
        part = copy.copy(self)
        part.who, part.n = np.flatnonzero(chosen), int(np.count_nonzero(chosen))
        if self.pa.gpu is None:
            part.who = self.who[part.who]
        elif part.n:
            part.who = _array_module().to_device(self.who.get()[part.who], backend=self.pa.gpu.backend)
        return part

    def remove(self):
        """Remove these particles from the array."""
        if self.n:
            self.pa.remove_particles(self.who if self.pa.gpu is None else self.who.get())


def _array_module():
    import compyle.array

    return compyle.array


def _compressed(mask, backend):
    """Indices of the true entries of a device mask, in order; the result stays on the device."""
    array = _array_module()
    mask = array.wrap_array(mask.astype(np.int32), backend)
    n = len(mask)
    found, count = (array.empty(size, np.int32, backend=backend) for size in (n, 1))
    _scan(backend)(mask=mask, found=found, count=count, last=n - 1)
    return array.wrap_array(found.dev[:int(count.get()[0])], backend)


@functools.cache
def _scan(backend):
    """Prefix sum that writes the index of each true entry, and the number of true entries."""
    from compyle.api import annotate
    from compyle.parallel import Scan

    @annotate(i="int", mask="gintp", return_="int")
    def subset_input(i, mask):
        return mask[i]

    @annotate(int="i, item, prev_item, last_item, last", gintp="mask, found, count")
    def subset_output(i, item, prev_item, last_item, mask, found, count, last):
        if mask[i]:
            found[prev_item] = i
        if i == last:
            count[0] = last_item

    return Scan(subset_input, subset_output, "a+b", dtype=np.int32, backend=backend)


@functools.cache
def _kernel(name, backend, dtype):
    """``take`` or ``put`` for one type of number."""
    from compyle.api import annotate
    from compyle.parallel import Elementwise

    @annotate
    def take(i, who, whole, part):
        part[i] = whole[who[i]]

    @annotate
    def put(i, who, part, whole):
        whole[who[i]] = part[i]

    return Elementwise({"take": take, "put": put}[name], backend=backend)


def detached(particles):
    """Detach arrays from the device, so that the host owns them: pairs (array, device) for :class:`Mirrored`."""
    pairs = [(pa, pa.gpu) for pa in particles]
    for pa, _ in pairs:
        pa.set_device_helper(None)
    return pairs


class Copies:
    """Particles at the end of an array, from ``first`` on, that are copies of the particles ``original`` (n,)."""

    def __init__(self, pa, first, original):
        self.pa, self.first, self.original = pa, first, original
        if pa.gpu is not None:
            self.original = _array_module().to_device(original.astype(np.int32), backend=pa.gpu.backend)

    def refresh(self, name, shift=0.0):
        """Copy a property from the originals and add ``shift``, a number or (n,)."""
        if self.pa.gpu is None:
            whole = self.pa.get_carray(name).get_npy_array()
            whole[self.first:] = whole[self.original] + shift if np.any(shift) else whole[self.original]
            return
        array, whole = _array_module(), self.pa.gpu.get_device_array(name)
        part = array.empty(len(self.original), whole.dtype, backend=whole.backend)
        _kernel("take", whole.backend, whole.dtype)(self.original, whole, part)
        if np.any(shift):
            part = array.wrap_array(part.dev + array.to_device(shift.astype(whole.dtype), whole.backend).dev,
                                    whole.backend)
        whole.dev[self.first:] = part.dev


class Mirrored:
    """An object that computes on a device with arrays that the host owns.

    Each method call first sends everything to the device and fetches the properties afterwards. This is for stepping
    by hand; a run does not need it.
    """

    def __init__(self, target, pairs):
        self._target, self._pairs = target, pairs

    def __getattr__(self, name):
        found = getattr(self._target, name)
        if not callable(found):
            return found

        @functools.wraps(found)
        def call(*args, **kwargs):
            for pa, device in self._pairs:
                device.num_real_particles = pa.get_number_of_particles(True)
                pa.set_device_helper(device)
                device.push()
            try:
                return found(*args, **kwargs)
            finally:
                for pa, device in self._pairs:
                    device.pull(*pa.properties)
                    pa.set_device_helper(None)

        return call


# --- what PySPH's device support lacks --------------------------------------------------------------------------------

def send(particles):
    """Send everything on the host to the device; call it once, after the last edit on the host.

    PySPH copies an array to the device when the array is made; later edits on the host do not reach that copy.
    """
    for pa in particles:
        if pa.gpu is not None:
            pa.gpu.push()


@contextmanager
def on_host(particles):
    """Inside this block the host owns the arrays, with the present values of the device.

    PySPH's writer would fetch the constants too. The device never changes them, and its copies are older or rounded.
    """
    for pa in particles:
        if pa.gpu is not None:
            pa.gpu.pull(*pa.properties)
    pairs = detached(particles)
    try:
        yield
    finally:
        for pa, device in pairs:
            pa.set_device_helper(device)


def neighbour_search(particles, **options):
    """The neighbour search for the present backend, with cached lists."""
    from pysph_boiling import search

    found = search.sorted_cell_nnps() if get_backend() == "cython" else search.device_cell_nnps()
    return found(particles=particles, **options)


def order(nnps, arrays, scratch=None):
    """Sort the particles of ``arrays`` in memory by the cells of the neighbour search, which must search again next.

    ``scratch`` maps names of arrays to properties that need not be sorted, since each step writes them before it reads
    them. PySPH sorts by the indices of its last search, which no longer fit after particles were removed. Its searches
    also mix ghosts with the other particles; ours keeps ghosts behind them.
    """
    if nnps.domain.manager.is_periodic and not getattr(nnps, "ghosts_stay_behind", False):
        return
    nnps.update()
    for index, pa in enumerate(nnps.particles):
        if any(pa is one for one in arrays):
            if hasattr(nnps, "order_particles"):
                nnps.order_particles(index, (scratch or {}).get(pa.name, ()))
            else:
                nnps.spatially_order_particles(index)
