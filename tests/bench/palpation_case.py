"""The block with a stiff ball in it and the sphere that palpates it, in SI units.

Reference, mesh and study share this.
"""

SIZE = (0.07, 0.05, 0.025)    # edges; the middle of the block lies at y = 0, its foot at z = 0
BALL, RADIUS = (0.035, 0, 0.013), 0.008
YOUNG, RATIO, POISSON = 1e4, 10, 0.4  # of the gel, Pa; the ball is RATIO times as stiff
PROBE, DEPTH = 0.06, 0.0015  # radius of the sphere, how far it is pushed in
PLACES = [(15 + 2 * i) / 1000 for i in range(11)]  # the other half of the way is the mirror image


def young_at(x):
    inside = sum((a - b) ** 2 for a, b in zip(x, BALL)) < RADIUS ** 2
    return YOUNG * (RATIO if inside else 1)
