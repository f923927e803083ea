"""Position Based Fluids in Taichi, written in the usual way: single precision, cells, neighbour lists, Jacobi sweeps.

Particles are sorted by counting into cells as wide as the support. Each step builds neighbour lists once, and all its
sweeps use them. Constraint, clamp and relaxation are those of Macklin & Müller 2013, and boundary particles those of
Akinci et al. 2012, as in the other codes of the comparison.
"""
import numpy as np
import taichi as ti
from job import arguments

LONGEST = 96  # neighbours that a list can hold


@ti.data_oriented
class PBF:
    """``settings``: ``min_sweeps``, ``max_sweeps``, ``tolerance``, ``omega``, ``eps`` (of the rest lattice's) [-]."""

    def __init__(self, job, min_sweeps, max_sweeps, tolerance, omega=0.7, eps=0.1):
        self.min_sweeps, self.max_sweeps, self.tolerance = min_sweeps, max_sweeps, tolerance
        self.omega, self.dt, self.g, self.h = omega, job.dt, job.gravity, job.h
        self.n, self.n_wall, self.volume = len(job.fluid), len(job.wall), job.spacing**3
        self.fac = 1.0 / (np.pi * job.h**3)
        self.longest = 0.25 * job.spacing
        self.low = job.wall.min(axis=0) - 2.0 * job.h
        reach = job.wall.max(axis=0) - self.low + np.array([2.0, 2.0, 40.0]) * job.h
        self.cells = tuple(int(n) for n in np.ceil(reach / (2.0 * job.h)))
        self.count = int(np.prod(self.cells))

        vector = ti.types.vector(3, ti.f32)
        self.origin = vector(*self.low)
        self.x, self.v, self.old, self.dx = (ti.field(vector, self.n) for _ in range(4))
        self.lmbda = ti.field(ti.f32, self.n)
        self.near, self.near_count = ti.field(ti.i32, (self.n, LONGEST)), ti.field(ti.i32, self.n)
        self.near_wall, self.near_wall_count = ti.field(ti.i32, (self.n, LONGEST)), ti.field(ti.i32, self.n)
        self.wall, self.psi = ti.field(vector, self.n_wall), ti.field(ti.f32, self.n_wall)
        self.start, self.start_wall = ti.field(ti.i32, self.count + 1), ti.field(ti.i32, self.count + 1)
        self.filled = ti.field(ti.i32, self.count)
        self.order, self.order_wall = ti.field(ti.i32, self.n), ti.field(ti.i32, self.n_wall)
        self.lost = ti.field(ti.i32, ())
        self.wall.from_numpy(job.wall.astype(np.float32))
        self.psi.from_numpy(job.volume.astype(np.float32))
        self.sort(self.wall, self.start_wall, self.order_wall)
        self.rest, squares = self.lattice(job)
        self.eps = eps * squares
        self.reset(job)

    def reset(self, job):
        self.x.from_numpy(job.fluid.astype(np.float32))
        self.v.fill(0.0)

    def lattice(self, job):
        """Sums of V W and of V^2 |grad W|^2 over the rest lattice."""
        r = np.linalg.norm(np.mgrid[-2:3, -2:3, -2:3].reshape(3, -1), axis=0) * job.spacing
        q = r / job.h
        w = self.fac * (0.25 * np.maximum(2 - q, 0) ** 3 - np.maximum(1 - q, 0) ** 3)
        slope = self.fac / job.h * (-0.75 * np.maximum(2 - q, 0) ** 2 + 3 * np.maximum(1 - q, 0) ** 2)
        return float(self.volume * w.sum()), float((self.volume * slope[q > 0]) @ (self.volume * slope[q > 0]))

    # --- neighbours ---------------------------------------------------------------------------------------------------

    @ti.func
    def cell(self, p):
        c = ti.cast((p - self.origin) / (2.0 * self.h), ti.i32)
        for k in ti.static(range(3)):
            c[k] = ti.min(ti.max(c[k], 0), self.cells[k] - 1)
        return c

    @ti.func
    def flat(self, c):
        return (c[0] * self.cells[1] + c[1]) * self.cells[2] + c[2]

    @ti.kernel
    def sort(self, x: ti.template(), start: ti.template(), order: ti.template()):
        for c in self.filled:
            self.filled[c] = 0
        for i in x:
            ti.atomic_add(self.filled[self.flat(self.cell(x[i]))], 1)
        ti.loop_config(serialize=True)
        for c in range(self.count):
            start[c + 1] = start[c] + self.filled[c]
        for c in self.filled:
            self.filled[c] = start[c]
        for i in x:
            order[ti.atomic_add(self.filled[self.flat(self.cell(x[i]))], 1)] = i

    @ti.kernel
    def find_neighbours(self):
        for i in self.x:
            p, n, b = self.x[i], 0, 0
            c = self.cell(p)
            low, high = ti.max(c[2] - 1, 0), ti.min(c[2] + 1, self.cells[2] - 1)
            for dx in range(-1, 2):
                for dy in range(-1, 2):
                    if 0 <= c[0] + dx < self.cells[0] and 0 <= c[1] + dy < self.cells[1]:
                        row = ((c[0] + dx) * self.cells[1] + c[1] + dy) * self.cells[2]
                        for k in range(self.start[row + low], self.start[row + high + 1]):
                            j = self.order[k]
                            if j != i and (p - self.x[j]).norm_sqr() < 4.0 * self.h * self.h and n < LONGEST:
                                self.near[i, n] = j
                                n += 1
                        for k in range(self.start_wall[row + low], self.start_wall[row + high + 1]):
                            j = self.order_wall[k]
                            if (p - self.wall[j]).norm_sqr() < 4.0 * self.h * self.h and b < LONGEST:
                                self.near_wall[i, b] = j
                                b += 1
            self.near_count[i] = n
            self.near_wall_count[i] = b
            if n == LONGEST or b == LONGEST:
                self.lost[None] += 1

    # --- density constraint -------------------------------------------------------------------------------------------

    @ti.func
    def kernel(self, r):
        q = r / self.h
        t, u = ti.max(2.0 - q, 0.0), ti.max(1.0 - q, 0.0)
        return self.fac * (0.25 * t * t * t - u * u * u)

    @ti.func
    def gradient(self, d):
        """grad W at the offset d."""
        r = ti.max(d.norm(), 1e-9)
        q = r / self.h
        t, u = ti.max(2.0 - q, 0.0), ti.max(1.0 - q, 0.0)
        return d * (self.fac * (3.0 * u * u - 0.75 * t * t) / (self.h * r))

    @ti.kernel
    def predict(self):
        for i in self.x:
            self.old[i] = self.x[i]
            self.v[i][2] -= self.dt * self.g
            self.x[i] += self.dt * self.v[i]

    @ti.kernel
    def multipliers(self) -> ti.f32:
        total = 0.0
        for i in self.x:
            p = self.x[i]
            density = self.volume * self.kernel(0.0)
            own = ti.Vector([0.0, 0.0, 0.0])
            squares = 0.0
            for k in range(self.near_count[i]):
                d = p - self.x[self.near[i, k]]
                density += self.volume * self.kernel(d.norm())
                gradient = self.volume * self.gradient(d)
                own += gradient
                squares += gradient.norm_sqr()
            for k in range(self.near_wall_count[i]):
                j = self.near_wall[i, k]
                d = p - self.wall[j]
                density += self.psi[j] * self.kernel(d.norm())
                own += self.psi[j] * self.gradient(d)
            C = ti.max(density / self.rest - 1.0, 0.0)
            self.lmbda[i] = -C / (squares + own.norm_sqr() + self.eps)
            total += C
        return total

    @ti.kernel
    def corrections(self):
        for i in self.x:
            p, own = self.x[i], self.lmbda[i]
            move = ti.Vector([0.0, 0.0, 0.0])
            for k in range(self.near_count[i]):
                j = self.near[i, k]
                move += (own + self.lmbda[j]) * self.volume * self.gradient(p - self.x[j])
            for k in range(self.near_wall_count[i]):
                j = self.near_wall[i, k]
                move += own * self.psi[j] * self.gradient(p - self.wall[j])
            move *= self.omega
            size = move.norm()
            if size > self.longest:
                move *= self.longest / size
            self.dx[i] = move
        for i in self.x:
            self.x[i] += self.dx[i]

    @ti.kernel
    def velocities(self):
        for i in self.x:
            self.v[i] = (self.x[i] - self.old[i]) / self.dt

    def step(self):
        """One step; returns its sweeps."""
        self.predict()
        self.sort(self.x, self.start, self.order)
        self.find_neighbours()
        sweeps, error = 0, np.inf
        while sweeps < self.min_sweeps or (sweeps < self.max_sweeps and error > self.tolerance):
            error = self.multipliers() / self.n
            self.corrections()
            sweeps += 1
        self.velocities()
        return sweeps


def main():
    job, out = arguments()
    ti.init(arch=ti.cpu, cpu_max_num_threads=job.threads, default_fp=ti.f32, offline_cache=True, log_level=ti.ERROR)
    pbf = PBF(job, **job.settings)
    pbf.step()  # compiles
    pbf.reset(job)
    job.begin_now()
    for _ in range(job.steps):
        job.step_done(pbf.step(), pbf.x.to_numpy,
                      lambda: (pbf.near_count.to_numpy() + pbf.near_wall_count.to_numpy()).mean())
    job.write(out, fluid=pbf.n, wall=pbf.n_wall, volume=pbf.volume, support=2.0 * pbf.h,
              wall_volume=float(job.volume.mean()), lost=int(pbf.lost[None]))


if __name__ == "__main__":
    main()
