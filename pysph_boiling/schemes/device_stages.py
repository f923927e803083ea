"""How the kernels of a stage are compiled and started on a device.

PySPH waits for the device before and after each kernel, and leaves the size of a work-group to the driver, which takes
a divisor of the number of particles: 1 if that is a prime. Here only a stage waits, at its end, and all work-groups
have the same size; PySPH's kernels leave out the work-items beyond the last particle.

A driver for processors (pocl) can only vectorise a sum over neighbours if the terms may be added in any order, if no
function is called and nothing branches, and if what is written cannot be what is read. So :class:`DeviceSource` edits
the source that PySPH generates. A sum then takes a fifth to a third of the time.
"""
import re
from contextlib import contextmanager

from compyle.translator import literal_to_float
from pysph.sph import acceleration_eval_gpu_helper as generator

from pysph_boiling.equations.helpers import boiling_kernel, boiling_kernel_slope, kernel_coefficients

__all__ = ["DeviceSource", "DeviceStages", "on_devices", "vectorisable"]

GROUP = 64  # work-items
HEAD = """\
#if defined(__clang__) && (defined(__x86_64__) || defined(__aarch64__))
#pragma clang fp reassociate(on)
#define sqrt(x) __builtin_sqrt{f}(x)
#endif
#define min(x, y) ((x) < (y) ? (x) : (y))
"""
KERNEL = """
WITHIN_KERNEL double {name}_kernel(GLOBAL_MEM {name}* self, double* xij, double rij, double h)
{{
    double h1 = {one} / h;
    return boiling_kernel(rij * h1, {c}) * {volume};
}}

WITHIN_KERNEL void {name}_gradient(GLOBAL_MEM {name}* self, double* xij, double rij, double h, double* grad)
{{
    double h1 = {one} / h;
    double slope = boiling_kernel_slope(rij * h1, {c}) * {volume} * h1 * h1;
    grad[0] = slope * xij[0];
    grad[1] = slope * xij[1];
    grad[2] = slope * xij[2];
}}
"""


def vectorisable(source, double):
    """The OpenCL source of a stage in PySPH's words, as it is compiled here, in ``double`` precision or single.

    A kernel writes no property that it also reads from neighbours (``tests/unit/test_order.py``), so that its pointers
    may be restricted.
    """
    source = re.sub(r"#define WITHIN_KERNEL .*", "#define WITHIN_KERNEL static inline", source)
    source = re.sub(r"#define max\(x, y\).*", "#define max(x, y) ((x) > (y) ? (x) : (y))", source)
    source = re.sub(r"^KERNEL void[^{]*", lambda found: re.sub(r"\*(\s*)(?=\w)", r"* restrict\1 ", found[0]), source,
                    flags=re.MULTILINE)
    return HEAD.format(f="" if double else "f") + source


class DeviceSource(generator.AccelerationEvalGPUHelper):
    """PySPH's generator of the source for a device, with smoothing kernels that do not branch.

    For OpenCL the source is made :func:`vectorisable`.
    """

    def get_header(self):
        header, kernel = super().get_header(), self.object.kernel
        try:
            coefficients = kernel_coefficients(kernel)
        except ValueError:  # one that the density constraint does not know
            return header
        name, number = type(kernel).__name__, lambda value: literal_to_float(value, self._use_double)
        for method in ("kernel", "gradient"):
            header, found = re.subn(rf"WITHIN_KERNEL\s+\w+\s+{name}_{method}\(.*?\n}}\n", "", header, flags=re.DOTALL)
            if found != 1:
                raise RuntimeError(f"the source of {name} that PySPH generates is not the one that this version of "
                                   "pysph_boiling supports")
        struct, end, rest = header.partition(f"}} {name};\n")
        transpiler = generator.get_converter(self.backend)(known_types=self.known_types)
        helpers = [transpiler.parse_function(helper) for helper in (boiling_kernel, boiling_kernel_slope)
                   if f" {helper.__name__}(" not in struct]
        ours = KERNEL.format(name=name, one=number(1.0), c=", ".join(map(number, coefficients)),
                             volume=" * ".join(["h1"] * kernel.dim))
        return "\n".join([struct + end, *helpers, ours, rest])

    def compile(self, code):
        code = generator.convert_to_float_if_needed(code)
        return super().compile(vectorisable(code, self._use_double) if self.backend == "opencl" else code)


class DeviceStages(generator.GPUAccelerationEval):
    """PySPH's evaluator for OpenCL, whose kernels follow one another without waiting for each."""

    def _call_kernel(self, info, extra_args):
        dest = info["dest"]
        first = self._get_index(dest, info["start_idx"])
        stop = dest.get_number_of_particles(info.get("real", True)) if info["stop_idx"] is None else self._get_index(
            dest, info["stop_idx"])
        n = int(stop - first)
        if n <= 0:
            return
        *_, NP_MAX, OFFSET_IDX = extra_args
        NP_MAX[...], OFFSET_IDX[...] = stop - 1, first
        queue, _, _, *arrays = info["args"]
        lists = []
        if info["loop"]:
            self.nnps.set_context(info["src_idx"], info["dst_idx"])
            found = self.nnps.current_cache
            found.get_neighbors_gpu()
            lists = [found._nbr_lengths_gpu.dev.data, found._start_idx_gpu.dev.data, found._neighbors_gpu.dev.data]
        info["method"](queue, (-(-n // GROUP) * GROUP,), (GROUP,), *[array() for array in arrays], *lists, *extra_args)

    def compute(self, t, dt):
        super().compute(t, dt)
        self._queue.finish()


@contextmanager
def on_devices():
    """Inside this block PySPH compiles and evaluates for OpenCL in these ways."""
    names = "AccelerationEvalGPUHelper", "GPUAccelerationEval"
    plain = [getattr(generator, name) for name in names]
    for name, ours in zip(names, (DeviceSource, DeviceStages)):
        setattr(generator, name, ours)
    try:
        yield
    finally:
        for name, one in zip(names, plain):
            setattr(generator, name, one)
