"""Heat: conduction between particles, heaters, loss at the free surface, and a volumetric source.

These equations work in any PySPH scheme. An array needs the properties ``e`` [J/kg], ``T`` [K], ``k`` [W/(m K)] and
``ae`` [J/(kg s)], and the constant ``heat_dt`` [s], by which :class:`HeatUpdate` advances at each evaluation. Every
equation adds to ``ae``. Exchanges with the outside are also added up in joules per particle by the kernel that causes
them, so that the energy balance needs no differences.
"""
from math import exp, sqrt

from pysph.base.reduce_array import dummy_reduce_array as parallel_reduce_array  # compiled modules have their own
from pysph.sph.equation import Equation

__all__ = [
    "HeatAmbientLoss", "HeatAmbientWall", "HeatConductionClearyMonaghan", "HeatConductionPaper", "HeatFixedTemperature",
    "HeatFlux", "HeatFluxWeight", "HeatTemperature", "HeatTemperatureAfter", "HeatUniformSource", "HeatUpdate",
]


def _positive(**values):
    for name, (value, unit) in values.items():
        if not value > 0.0:
            raise ValueError(f"{name} must be > 0 {unit}, got {value}")


class HeatTemperature(Equation):
    r"""Temperature of a single phase, :math:`T = T_0 + e/c`, and its conductivity; resets ``ae``.

    Source: the inverse of the paper's eq. 3. With phases, ``PhaseTemperature`` replaces it.

    Parameters
    ----------
    T0 : float   Temperature at e = 0 [K].
    c : float    Specific heat capacity [J/(kg K)], > 0.
    k : float    Thermal conductivity [W/(m K)], > 0.

    Reads    d_e [J/kg].   Writes   d_T [K], d_k [W/(m K)], d_ae [J/(kg s)], own index only.
    Errors   ValueError if c <= 0 or k <= 0.
    """

    def __init__(self, dest, sources, T0, c, k):
        _positive(c=(c, "J/(kg K)"), k=(k, "W/(m K)"))
        self.T0 = float(T0)
        self.c = float(c)
        self.cond = float(k)
        super().__init__(dest, sources)

    def initialize(self, d_idx, d_e, d_T, d_k, d_ae):
        d_T[d_idx] = self.T0 + d_e[d_idx] / self.c
        d_k[d_idx] = self.cond
        d_ae[d_idx] = 0.0


class HeatTemperatureAfter(Equation):
    """Temperature of a single phase again, after :class:`HeatUpdate` in the same group, so that T always fits e.

    Source: ours.

    Parameters
    ----------
    T0, c : float   As :class:`HeatTemperature`.

    Reads    d_e [J/kg].   Writes   d_T [K], own index only.   Needs   HeatUpdate before it in the same group.
    Errors   ValueError if c <= 0.
    """

    def __init__(self, dest, sources, T0, c):
        _positive(c=(c, "J/(kg K)"))
        self.T0 = float(T0)
        self.c = float(c)
        super().__init__(dest, sources)

    def post_loop(self, d_idx, d_e, d_T):
        d_T[d_idx] = self.T0 + d_e[d_idx] / self.c


class HeatConductionClearyMonaghan(Equation):
    r"""Conduction between fluid particles, antisymmetric pair by pair.

    .. math::  m_i \frac{de_i}{dt} = \sum_j V_i V_j \frac{4 k_i k_j}{k_i + k_j} (T_i - T_j)
               \frac{x_{ij} \cdot \nabla W_{ij}}{r_{ij}^2 + 0.01 h_{ij}^2}, \qquad V = m/\rho_0

    Source: Cleary & Monaghan 1999, eq. 24; the paper, eqs. 8-16. The rest volume replaces the summed volume, which is
    too large at a free surface.

    Parameters
    ----------
    rho0 : float   Rest density [kg/m^3], > 0.

    Reads    d_T, s_T [K], d_k, s_k [W/(m K)], s_m [kg].   Writes   d_ae [J/(kg s)], own index only.
    Needs    HeatTemperature (or PhaseTemperature) in an earlier group.   Errors   ValueError if rho0 <= 0.
    Limits   Explicit, which limits ``heat_dt``. Use a bell-shaped kernel (cubic spline, Wendland). On disordered
    particles heat is slower: with displacements of 0, .1 and .3 spacings a Fourier mode decays 2.1, 2.5 and 7.1 % too
    slowly (2-D, h/dx 1.2).
    """

    def __init__(self, dest, sources, rho0):
        _positive(rho0=(rho0, "kg/m^3"))
        self.rho0 = float(rho0)
        super().__init__(dest, sources)

    def loop(self, d_idx, s_idx, d_ae, d_T, s_T, d_k, s_k, s_m, XIJ, DWIJ, R2IJ, HIJ):
        k = 4.0 * d_k[d_idx] * s_k[s_idx] / (d_k[d_idx] + s_k[s_idx])
        f = (XIJ[0]*DWIJ[0] + XIJ[1]*DWIJ[1] + XIJ[2]*DWIJ[2]) / (R2IJ + 0.01*HIJ*HIJ)
        d_ae[d_idx] += s_m[s_idx] / (self.rho0*self.rho0) * k * (d_T[d_idx] - s_T[s_idx]) * f


class HeatConductionPaper(Equation):
    r"""Conduction as in the paper, with one conductivity; it is only antisymmetric if densities are equal.

    .. math::  m_i \frac{de_i}{dt} = \frac{m_i}{\rho_i} k \sum_j \frac{m_j}{\rho_j}
               \frac{4\rho_i}{\rho_i + \rho_j} (T_i - T_j) \frac{x_{ij} \cdot \nabla W_{ij}}{r_{ij}^2 + 0.01 h_{ij}^2}

    Source: the paper, eqs. 16 and 17 (after Gu et al.). Its k stands outside the divergence, so it is the same
    everywhere, and vapour conducts as liquid does. Energy created or lost by a pair is recorded, half for each
    particle.

    Parameters
    ----------
    k : float   Thermal conductivity of eq. 16 [W/(m K)], > 0.

    Reads    d_T, s_T [K], d_m, s_m [kg], d_rho, s_rho [kg/m^3], constant heat_dt [s].
    Writes   d_ae [J/(kg s)], d_q_leak [J], own index only.   Needs   HeatTemperature in an earlier group.
    Errors   ValueError if k <= 0.
    Limits   It loses or creates energy wherever densities differ, as at every surface, which is reported, not
    corrected.
    """

    def __init__(self, dest, sources, k):
        _positive(k=(k, "W/(m K)"))
        self.cond = float(k)
        super().__init__(dest, sources)

    def loop(self, d_idx, s_idx, d_ae, d_q_leak, d_heat_dt, d_T, s_T, d_m, s_m, d_rho, s_rho, XIJ, DWIJ, R2IJ, HIJ):
        f = (XIJ[0]*DWIJ[0] + XIJ[1]*DWIJ[1] + XIJ[2]*DWIJ[2]) / (R2IJ + 0.01*HIJ*HIJ)
        pair = d_m[d_idx]*s_m[s_idx] / (d_rho[d_idx]*s_rho[s_idx]) * 4.0 / (d_rho[d_idx] + s_rho[s_idx])
        pair = pair * self.cond * (d_T[d_idx] - s_T[s_idx]) * f
        here = pair * d_rho[d_idx]
        there = -pair * s_rho[s_idx]
        d_ae[d_idx] += here / d_m[d_idx]
        d_q_leak[d_idx] += 0.5 * (here + there) * d_heat_dt[0]


class HeatFixedTemperature(Equation):
    r"""Heat from wall particles with fixed temperatures; all other wall particles are adiabatic.

    .. math::  m_i \frac{de_i}{dt} \mathrel{+}= \sum_b V_i V_b\, 4 k_i (T_i - T_b)
               \frac{x_{ib} \cdot \nabla W_{ib}}{r_{ib}^2 + 0.01 h^2}

    Source: Cleary & Monaghan 1999, eq. 24, for a wall that conducts perfectly (k_w >> k_i).

    Parameters
    ----------
    rho0 : float     Rest density [kg/m^3], > 0.
    spacing : float  Particle spacing [m], > 0: V_b = spacing^dim.
    dim : int        2 or 3.

    A particle whose ``T_heater`` is 0 has the temperature of the constant ``heater_T``.

    Reads    d_T [K], d_k [W/(m K)], d_m [kg], s_heated, s_T_heater [K], constants heater_T [K], heater_on [-],
    heat_dt [s].
    Writes   d_ae [J/(kg s)], d_q_heater [J], own index only.   Needs   HeatTemperature in an earlier group.
    Errors   ValueError if rho0 or spacing <= 0.
    Limits   The isothermal surface lies within 0.06 spacings of the face (measured), so the error is of first order.
    Explicit: at ``heat_dt`` = 0.1 rho c h^2/k the temperature of a particle at the face changes by at most .7 of the
    difference, and that of a particle inside a heated block by 1.4 of it, which is still stable.
    """

    def __init__(self, dest, sources, rho0, spacing, dim):
        _positive(rho0=(rho0, "kg/m^3"), spacing=(spacing, "m"))
        self.rho0 = float(rho0)
        self.volume = float(spacing**dim)
        super().__init__(dest, sources)

    def loop(self, d_idx, s_idx, d_ae, d_q_heater, d_heat_dt, d_heater_T, d_heater_on, d_T, d_k, d_m, s_heated,
             s_T_heater, XIJ, DWIJ, R2IJ, HIJ):
        if s_heated[s_idx] == 1:
            f = (XIJ[0]*DWIJ[0] + XIJ[1]*DWIJ[1] + XIJ[2]*DWIJ[2]) / (R2IJ + 0.01*HIJ*HIJ)
            T = s_T_heater[s_idx]
            if T == 0.0:
                T = d_heater_T[0]
            q = self.volume / self.rho0 * 4.0*d_k[d_idx] * (d_T[d_idx] - T) * f * d_heater_on[0]
            d_ae[d_idx] += q
            d_q_heater[d_idx] += q * d_m[d_idx] * d_heat_dt[0]


class HeatFluxWeight(Equation):
    r"""Weights for the distribution of a heater's power: the kernel sum over the heater's particles in reach.

    The conductivity distinguishes liquid (wet) from vapour (dry) particles. Vapour only gets heat if no liquid is in
    reach of the heater, because otherwise a single vapour particle would take the power of a whole dry spot.

    Source: ours. A metal base conducts heat sideways, so the heated area is treated as one patch with one power.

    Parameters
    ----------
    k_liquid_min : float   A particle with k >= k_liquid_min is wet [W/(m K)], > 0.

    Reads    d_k [W/(m K)], s_heated, constants heater_power [W], heater_on [-], heat_dt [s].
    Writes   d_heater_wet, d_heater_dry [1/m^dim], own index only; constants heater_weight (wet sum, dry sum) and
    energy_undelivered [J].   Needs   HeatTemperature in an earlier group.   Errors   ValueError if k_liquid_min <= 0.
    """

    def __init__(self, dest, sources, k_liquid_min):
        _positive(k_liquid_min=(k_liquid_min, "W/(m K)"))
        self.k_liquid_min = float(k_liquid_min)
        super().__init__(dest, sources)

    def initialize(self, d_idx, d_heater_wet, d_heater_dry):
        d_heater_wet[d_idx] = 0.0
        d_heater_dry[d_idx] = 0.0

    def loop(self, d_idx, s_idx, d_k, d_heater_wet, d_heater_dry, s_heated, WIJ):
        if s_heated[s_idx] == 1:
            if d_k[d_idx] >= self.k_liquid_min:
                d_heater_wet[d_idx] += WIJ
            else:
                d_heater_dry[d_idx] += WIJ

    def reduce(self, dst, t, dt):
        from pysph_boiling.device import summed, values  # here: compiled modules see no imports of ours

        wet = parallel_reduce_array(summed(values(dst, 'heater_wet')), 'sum')
        dry = parallel_reduce_array(summed(values(dst, 'heater_dry')), 'sum')
        dst.heater_weight[0] = wet
        dst.heater_weight[1] = dry
        if wet <= 0.0 and dry <= 0.0:
            dst.energy_undelivered[0] += dst.heater_power[0] * dst.heater_on[0] * dst.heat_dt[0]
        if dst.gpu is not None:
            dst.gpu.push('heater_weight', 'energy_undelivered')


class HeatFlux(Equation):
    r"""A heater of given power, which is delivered exactly, since the normalised weights add up to one.

    .. math::  m_i \frac{de_i}{dt} \mathrel{+}= P \frac{w_i}{\sum_j w_j}

    Source: ours; the constant heat source of the paper's experiments (section 6).

    Parameters
    ----------
    none

    Reads    d_heater_wet, d_heater_dry, d_m [kg], constants heater_power [W], heater_on [-], heater_weight and
    heat_dt [s].   Writes   d_ae [J/(kg s)], d_q_heater [J], own index only.
    Needs    HeatFluxWeight in an earlier group.
    """

    def post_loop(self, d_idx, d_ae, d_q_heater, d_heat_dt, d_heater_wet, d_heater_dry, d_heater_power, d_heater_on,
                  d_heater_weight, d_m):
        q = 0.0
        if d_heater_weight[0] > 0.0:
            q = d_heater_power[0] * d_heater_on[0] * d_heater_wet[d_idx] / d_heater_weight[0]
        else:
            if d_heater_weight[1] > 0.0:
                q = d_heater_power[0] * d_heater_on[0] * d_heater_dry[d_idx] / d_heater_weight[1]
        d_ae[d_idx] += q / d_m[d_idx]
        d_q_heater[d_idx] += q * d_heat_dt[0]


class HeatAmbientLoss(Equation):
    r"""Newton cooling of the free surface, :math:`m_i \dot e_i = -\eta A_i (T_i - T_a)`, exact over a heat step.

    .. math::  A_i = a V_i \Big|\sum_j V_j \nabla W_{ij}\Big|
               \quad\text{where } |\sum_j V_j \nabla W_{ij}| > 0.2/\Delta x

    .. math::  \Delta e_i = -c\, (T^*_i - T_a) \left(1 - e^{-\eta A_i \Delta t_h/(m_i c)}\right)

    T* is the temperature after all other terms of the step, so T stays between T_a and T* for any coefficient. If the
    ambient is hotter than saturation and the particle boils in this step, it takes up heat only until ``e_hot``.

    Source: ours; the gradient of the indicator function is a surface density (as in continuum surface force models),
    and the ``factor`` a makes it exact for the flat surface of a lattice. :class:`HeatAmbientWall` counts walls as
    filled.

    Parameters
    ----------
    coefficient : float   Heat transfer coefficient eta [W/(m^2 K)], >= 0.
    T_ambient : float     Ambient temperature [K], > 0.
    rho0 : float          Rest density [kg/m^3], > 0.
    threshold : float     Smallest gradient that counts as a surface [1/m], > 0.
    factor : float        Calibration a [-], > 0.
    c, k : float          Specific heat capacity [J/(kg K)] and conductivity [W/(m K)] of the liquid, > 0. Liquid with
        another conductivity has the same diffusivity, so its capacity is c d_k/k (see :class:`PhaseTemperature`).
    c_vapour : float      Specific heat capacity of the vapour [J/(kg K)], > 0.
    k_liquid_min : float  A particle with k < k_liquid_min is vapour [W/(m K)].
    e_hot : float         Enthalpy of vapour at T_a [J/kg], where that lies above saturation.

    Reads    d_T [K], d_e [J/kg], d_k [W/(m K)], d_m, s_m [kg], constant heat_dt [s].   Writes   d_gsx, d_gsy, d_gsz
    [1/m], d_ae [J/(kg s)], d_q_loss [J] (positive when heat leaves), own index only.
    Needs    to be the last of the terms that add to ``ae``.   Errors   ValueError outside the ranges above.
    Limits   On a disordered surface the area is too large, by 11 % at displacements of .2 spacings and 68 % at .3
    (measured). Latent heat is lost in the same way, at most c (T_sat - T_a) per heat step.
    """

    def __init__(self, dest, sources, coefficient, T_ambient, rho0, threshold, factor, c, k, c_vapour=1.0,
                 k_liquid_min=0.0, e_hot=1e30):
        if not coefficient >= 0.0:
            raise ValueError(f"heat transfer coefficient must be >= 0 W/(m^2 K), got {coefficient}")
        _positive(T_ambient=(T_ambient, "K"), rho0=(rho0, "kg/m^3"), threshold=(threshold, "1/m"), factor=(factor, ""),
                  c=(c, "J/(kg K)"), k=(k, "W/(m K)"), c_vapour=(c_vapour, "J/(kg K)"))
        self.coefficient = float(coefficient)
        self.T_ambient = float(T_ambient)
        self.rho0 = float(rho0)
        self.threshold = float(threshold)
        self.factor = float(factor)
        self.c = float(c)
        self.cond = float(k)
        self.c_vapour = float(c_vapour)
        self.k_liquid_min = float(k_liquid_min)
        self.e_hot = float(e_hot)
        super().__init__(dest, sources)

    def initialize(self, d_idx, d_gsx, d_gsy, d_gsz):
        d_gsx[d_idx] = 0.0
        d_gsy[d_idx] = 0.0
        d_gsz[d_idx] = 0.0

    def loop(self, d_idx, s_idx, d_gsx, d_gsy, d_gsz, s_m, DWIJ):
        V = s_m[s_idx] / self.rho0
        d_gsx[d_idx] += V * DWIJ[0]
        d_gsy[d_idx] += V * DWIJ[1]
        d_gsz[d_idx] += V * DWIJ[2]

    def post_loop(self, d_idx, d_gsx, d_gsy, d_gsz, d_ae, d_q_loss, d_heat_dt, d_e, d_T, d_k, d_m):
        size = sqrt(d_gsx[d_idx]*d_gsx[d_idx] + d_gsy[d_idx]*d_gsy[d_idx] + d_gsz[d_idx]*d_gsz[d_idx])
        if size > self.threshold:
            c = self.c * (d_k[d_idx]/self.cond)
            if d_k[d_idx] < self.k_liquid_min:
                c = self.c_vapour
            rate = self.coefficient * self.factor / self.rho0 * size / c
            fall = rate * d_heat_dt[0]
            if fall > 1e-9:
                rate = (1.0 - exp(-fall)) / d_heat_dt[0]
            q = rate * (c * (d_T[d_idx] - self.T_ambient) + d_heat_dt[0] * d_ae[d_idx])
            if q < 0.0:
                room = self.e_hot - d_e[d_idx] - d_heat_dt[0] * d_ae[d_idx]
                if room < 0.0:
                    room = 0.0
                if -q * d_heat_dt[0] > room:
                    q = -room / d_heat_dt[0]
            d_ae[d_idx] -= q
            d_q_loss[d_idx] += q * d_m[d_idx] * d_heat_dt[0]


class HeatAmbientWall(Equation):
    r"""The contribution of walls to :math:`\sum_j V_j \nabla W_{ij}` in :class:`HeatAmbientLoss`.

    Source: ours. The volume does not follow from the mass of the wall particle, which is chosen for the density
    constraint and would turn every wall into a free surface here.

    Parameters
    ----------
    spacing : float  Particle spacing [m], > 0: V_b = spacing^dim.
    dim : int        2 or 3.

    Reads nothing but positions.   Writes   d_gsx, d_gsy, d_gsz [1/m], own index only.
    Needs    HeatAmbientLoss in the same group.   Errors   ValueError if spacing <= 0.
    """

    def __init__(self, dest, sources, spacing, dim):
        _positive(spacing=(spacing, "m"))
        self.volume = float(spacing**dim)
        super().__init__(dest, sources)

    def loop(self, d_idx, d_gsx, d_gsy, d_gsz, DWIJ):
        d_gsx[d_idx] += self.volume * DWIJ[0]
        d_gsy[d_idx] += self.volume * DWIJ[1]
        d_gsz[d_idx] += self.volume * DWIJ[2]


class HeatUniformSource(Equation):
    r"""Uniform volumetric heating, :math:`\rho_0 \dot e = q_s`.

    Source: the paper, eqs. 10-16 (the term q_s).

    Parameters
    ----------
    density : float   Power density q_s [W/m^3], any sign.
    rho0 : float      Rest density [kg/m^3], > 0.

    Reads    d_m [kg], constant heat_dt [s].   Writes   d_ae [J/(kg s)], d_q_source [J], own index only.
    Errors   ValueError if rho0 <= 0.
    """

    def __init__(self, dest, sources, density, rho0):
        _positive(rho0=(rho0, "kg/m^3"))
        self.rate = float(density) / float(rho0)
        super().__init__(dest, sources)

    def post_loop(self, d_idx, d_ae, d_q_source, d_heat_dt, d_m):
        d_ae[d_idx] += self.rate
        d_q_source[d_idx] += self.rate * d_m[d_idx] * d_heat_dt[0]


class HeatUpdate(Equation):
    r"""Forward Euler step of the enthalpy, :math:`e \leftarrow e + \Delta t_h\, \dot e`.

    Source: ours. The time step is the constant ``heat_dt`` [s] of the array, set before each evaluation: by the
    integrator of our schemes, by :class:`pysph_boiling.schemes.integrator.HeatClock` in any other scheme.

    Parameters
    ----------
    none

    Reads    d_ae [J/(kg s)], constant heat_dt [s].   Writes   d_e [J/kg], own index only.
    Limits   First order in time; stable for heat_dt <= 0.1 rho c h^2 / k.
    """

    def post_loop(self, d_idx, d_e, d_ae, d_heat_dt):
        d_e[d_idx] += d_heat_dt[0] * d_ae[d_idx]
