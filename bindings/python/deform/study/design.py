"""The points of a sweep."""
from __future__ import annotations

import itertools
from typing import Any

import numpy as np

from .._library import UnsupportedError
from .spec import Parameter, Study


def _along(parameter: Parameter) -> list[Any]:
    if parameter.values:
        return parameter.values
    # whole numbers may be fewer than "count"
    return list(dict.fromkeys(parameter.place(i / (parameter.count - 1)) for i in range(parameter.count)))


def points(study: Study) -> list[dict[str, Any]]:
    """{parameter: value} of each run, the same for the same study."""
    of, n, seed = study.parameters, study.design["runs"], study.design["seed"]
    method, place = study.design["method"], study.design["place"]
    names = [p.name for p in of]
    if method == "grid":
        return [dict(zip(names, row)) for row in itertools.product(*map(_along, of))]
    if method == "list":
        columns = [_along(p) for p in of]
        if len({len(c) for c in columns}) > 1:
            counts = ", ".join(f"{p.name} {len(c)}" for p, c in zip(of, columns))
            raise place.fail(f"a list takes the i-th value of each parameter: all need equally many: "
                             f"{counts}")
        return [dict(zip(names, row)) for row in zip(*columns)]
    if n < 1:
        raise place.fail(f'the method {method} needs "runs", how many points it takes')
    if method == "random":
        shares = np.random.default_rng(seed).random((n, len(of)))
    else:
        try:
            from scipy.stats import qmc
        except ImportError:
            raise UnsupportedError(f"the method {method} needs SciPy for this Python: Debian's "
                                   f'python3-scipy, or pip install scipy; "random" and "grid" do without',
                                   "DFM_E_UNSUPPORTED") from None
        if method == "sobol":
            # Its first 2^m points are balanced; others are the beginning of the next such set.
            shares = qmc.Sobol(len(of), seed=seed).random_base2(max(0, (n - 1).bit_length()))[:n]
        else:
            shares = qmc.LatinHypercube(len(of), seed=seed).random(n)
    return [{p.name: p.place(float(s)) for p, s in zip(of, row)} for row in shares]
