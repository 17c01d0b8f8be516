"""Coefficients of sg_normal_quantile: rational functions through the normal quantile at Chebyshev nodes.

    fit_normal_quantile.py [--errors]

Prints the Fortran parameters; with --errors the largest relative error of each function before rounding of its
coefficients, found on a fine grid. Needs mpmath, which nothing else here does, and takes a few seconds.
"""

import argparse

import mpmath as mp

mp.mp.dps = 60

CENTRE = mp.mpf("0.45")  # |u - 1/2| up to which the central function serves
SMALLEST = mp.mpf(2) ** -53  # tail probability of the smallest uniform number
DEGREE_CENTRE = 10
DEGREE_TAIL = 9


def quantile(p):
    """The x with Phi(x) = p < 1/2."""
    return -mp.sqrt(2) * mp.erfinv(1 - 2 * p) if p > mp.mpf("1e-3") else newton(p)


def newton(p):
    """The same in the tail, where 1 - 2 p loses digits: Newton's method on the logarithm of Phi."""
    x = -mp.sqrt(-2 * mp.log(p))
    for _ in range(60):
        phi = mp.erfc(-x / mp.sqrt(2)) / 2
        density = mp.exp(-x * x / 2) / mp.sqrt(2 * mp.pi)
        change = mp.log(phi / p) * phi / density
        x -= change
        if abs(change) < mp.mpf(10) ** -50:
            return x
    raise ArithmeticError(f"no quantile of {p}")


def central(s):
    """(x/q) as a function of s = CENTRE^2 - q^2, q = u - 1/2."""
    q = mp.sqrt(max(CENTRE**2 - s, mp.mpf(0)))
    if q < mp.mpf(10) ** -25:
        return mp.sqrt(2 * mp.pi)
    return quantile(mp.mpf(1) / 2 - q) / -q


def tail(s):
    """|x| as a function of s = sqrt(-ln p) - sqrt(-ln p_centre)."""
    return -quantile(mp.exp(-((s + tail_start()) ** 2)))


def tail_start():
    """sqrt(-ln p) where the tail begins."""
    return mp.sqrt(-mp.log(mp.mpf(1) / 2 - CENTRE))


def chebyshev(count, end):
    """Nodes on [0, end]."""
    return [end / 2 * (1 - mp.cos(mp.pi * (2 * i + 1) / (2 * count))) for i in range(count)]


def fit(function, end, degree):
    """N and D, both of that degree and lowest power first, with D(0) = 1 and N = function D at the nodes."""
    nodes = chebyshev(2 * degree + 1, end)
    values = [function(s) for s in nodes]
    rows = [
        [s**k for k in range(degree + 1)] + [-f * s**k for k in range(1, degree + 1)]
        for s, f in zip(nodes, values, strict=True)
    ]
    solution = list(mp.lu_solve(mp.matrix(rows), mp.matrix(values)))
    return solution[: degree + 1], [mp.mpf(1), *solution[degree + 1 :]]


def largest_error(function, end, coefficients):
    """Largest relative error on a grid of 400 points."""
    top, bottom = (list(reversed(part)) for part in coefficients)
    worst = mp.mpf(0)
    for i in range(401):
        s = end * i / 400
        worst = max(worst, abs(mp.polyval(top, s) / mp.polyval(bottom, s) / function(s) - 1))
    return worst


def print_parameter(name, values):
    """As a Fortran array."""
    numbers = ", &\n    ".join(mp.nstr(v, 20, min_fixed=0, max_fixed=0) + "_wp" for v in values)
    print(f"  real(wp), parameter :: {name}(0:{len(values) - 1}) = [ &\n    {numbers}]")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--errors", action="store_true", help="also print the errors of the functions")
    show_errors = parser.parse_args().errors
    ends = CENTRE**2, mp.sqrt(-mp.log(SMALLEST)) - tail_start()
    print(f"  real(wp), parameter :: TAIL_START = {mp.nstr(tail_start(), 20)}_wp")
    for name, function, end, degree in (
        ("CENTRE", central, ends[0], DEGREE_CENTRE),
        ("TAIL", tail, ends[1], DEGREE_TAIL),
    ):
        coefficients = fit(function, end, degree)
        for letter, part in zip(("N", "D"), coefficients, strict=True):
            print_parameter(f"{name}_{letter}", part)
        if show_errors:
            print(f"  ! largest relative error {mp.nstr(largest_error(function, end, coefficients), 3)}")


if __name__ == "__main__":
    main()
