"""How many bodies a fill has: from its packing fraction, by their mean volume, or from its spacing."""

from __future__ import annotations

import math

from carom import _carom
from carom.scene.model import (
    ConstantRadius,
    Domain,
    Fill,
    LognormalRadius,
    MixtureRadius,
    NormalRadius,
    Radius,
    UniformRadius,
    axis_kinds,
)

FCC_PACKING = math.pi / math.sqrt(18)
"""The closest packing of equal balls."""

# A normal distribution cut at three deviations keeps this share of its variance: 1 - 6 f(3) / (2 F(3) - 1).
_CUT_VARIANCE = 1 - 6 * math.exp(-4.5) / math.sqrt(2 * math.pi) / math.erf(3 / math.sqrt(2))


def mean_power(radius: Radius, power: int) -> float:
    """The mean of radius^power (power 2 or 3), in m^power."""
    match radius:
        case ConstantRadius(value=value):
            return value**power
        case UniformRadius(low=low, high=high):
            # (h^(k+1) - l^(k+1)) / ((k+1) (h - l)) without its cancellation where low and high are close.
            return sum(low**k * high ** (power - k) for k in range(power + 1)) / (power + 1)
        case NormalRadius(mean=mean, deviation=deviation):
            variance = deviation**2 * _CUT_VARIANCE
            return mean**2 + variance if power == 2 else mean**3 + 3 * mean * variance
        case LognormalRadius(mean=mean, deviation=deviation):
            return mean**power * (1 + (deviation / mean) ** 2) ** (power * (power - 1) // 2)
        case MixtureRadius(radii=radii, shares=shares):
            return math.fsum(s * r**power for r, s in zip(radii, shares, strict=True)) / math.fsum(shares)
        case _:
            return float(radius) ** power


def region(fill: Fill, domain: Domain | None, dimensions: int) -> tuple[list[float], list[float]]:
    """Middle and lengths of the region that a fill takes up, m; three numbers each, z = 0 where dimensions = 2."""
    size = fill.size if fill.size is not None else (domain.size if domain is not None else None) or []
    center = fill.center if fill.center is not None else []
    return _three(center, dimensions), _three(size, dimensions)


def _three(vector: list[float], dimensions: int) -> list[float]:
    kept = [float(number) for number in vector[:dimensions]]
    return kept + [0.0] * (3 - len(kept))


def fill_count(fill: Fill, domain: Domain | None, dimensions: int, geometry: _carom.Geometry | None = None) -> int:
    """The number of bodies: as given, or what packing or spacing come to; ``geometry`` is that of ``fill.shape``.

    By packing it is the whole number nearest to packing × region / mean volume; by spacing, all sites of the lattice.
    """
    if fill.count is not None:
        return fill.count
    _, size = region(fill, domain, dimensions)
    if fill.spacing is not None and geometry is not None:
        return _carom.lattice_sites(fill.placement, size, _wraps(fill, domain), geometry, fill.spacing)
    space = math.prod(size[:dimensions])
    body = _mean_volume(fill, dimensions) if geometry is None else geometry.volume
    count = (fill.packing or 0) * space / body if body > 0 else math.inf
    return round(count) if math.isfinite(count) else 2**63


def _mean_volume(fill: Fill, dimensions: int) -> float:
    assert fill.radius is not None
    return mean_power(fill.radius, dimensions) * (math.pi if dimensions == 2 else 4 / 3 * math.pi)


def _wraps(fill: Fill, domain: Domain | None) -> list[bool]:
    """The axes along which the region of a fill closes on itself: if it is the whole of a periodic domain."""
    if domain is None or fill.size is not None or fill.center is not None:
        return [False] * 3
    return [kind == "periodic" for kind in axis_kinds(domain, 3)]
