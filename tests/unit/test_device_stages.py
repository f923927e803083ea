"""The edits of a stage's OpenCL source, on text."""
from pysph_boiling.schemes.device_stages import vectorisable

SOURCE = """
#define WITHIN_KERNEL /* empty */
#define max(x, y) fmax((double)(x), (double)(y))
WITHIN_KERNEL void Sum_loop(GLOBAL_MEM double* d_au) {}
KERNEL void g0_fluid_on_fluid_loop (GLOBAL_MEM double* d_au, GLOBAL_MEM
    double* s_x, GLOBAL_MEM unsigned int
    *neighbors, double t)
{
    GLOBAL_MEM unsigned int* NBRS = &(neighbors[0]);
}
"""


def test_what_a_driver_needs_to_vectorise_a_sum():
    text = vectorisable(SOURCE, double=True)
    assert "WITHIN_KERNEL static inline" in text and "fmax" not in text
    assert "__builtin_sqrt(x)" in text and "__builtin_sqrtf(x)" in vectorisable(SOURCE, double=False)
    signature = text[text.index("\nKERNEL void"):text.index("NBRS")]
    assert signature.count("restrict") == 3
    assert "* restrict d_au" in " ".join(signature.split()) and "* restrict neighbors" in signature


def test_functions_and_their_bodies_keep_their_pointers():
    text = vectorisable(SOURCE, double=True)
    assert "Sum_loop(GLOBAL_MEM double* d_au)" in text and "GLOBAL_MEM unsigned int* NBRS" in text
