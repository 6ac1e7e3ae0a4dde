#!/usr/bin/env python3
"""What friction with memory costs on a body at rest: at most a quarter more than Coulomb's, and hardly more
on a floor that has keyframes than on a fixed one.

at_rest.py DEFORM_COMMAND

Instructions of dfm_world_step in the last 20 ms of at_rest.json (a block of 192 cells and 15 contacts that
was dropped by 1 mm), counted as frozen.py counts them. Vectors have four doubles (DEFORM_SIMD=avx2), since
the laws' kernels are written for wide ones. Exit 77: a processor without AVX2.
"""
import pathlib
import sys
from concurrent.futures import ThreadPoolExecutor

from frozen import instructions

LAWS = ("coulomb", "dahl", "lugre", "elastoplastic")
FROM, TO, STEP = 0.18, 0.2, 0.001
MOST = 0.25
KEYFRAMES = '/obstacles/0/motion={"keyframes":[{"t":0,"position":[0,0,0]},{"t":1,"position":[0,0,0]}]}'
MOST_ON_KEYFRAMES = 0.1


def main():
    if "avx2" not in pathlib.Path("/proc/cpuinfo").read_text().split():
        print("at_rest.py: skipped: this processor has no AVX2")
        sys.exit(77)

    def per_step(law, more=()):
        chosen = [f'/contact/friction/0/law="{law}"', *more]
        early, late = (instructions(sys.argv[1], "at_rest", chosen, "avx2", time) for time in (FROM, TO))
        return (late - early) / ((TO - FROM) / STEP)

    with ThreadPoolExecutor(2) as pool:
        on_keyframes = pool.submit(per_step, "lugre", (KEYFRAMES,))
        counts = dict(zip(LAWS, pool.map(per_step, LAWS)))
    wrong = []
    for law, count in counts.items():
        more = count / counts["coulomb"] - 1
        print(f"{law}: {count:.0f} instructions per step, {100 * more:+.1f} % of coulomb's")
        if more > MOST:
            wrong.append(f"{law} costs {100 * more:.1f} % more than coulomb on a body at rest, over 25 %")
    more = on_keyframes.result() / counts["lugre"] - 1
    print(f"lugre on a floor with keyframes: {100 * more:+.1f} % of that on a fixed one")
    if more > MOST_ON_KEYFRAMES:
        wrong.append(f"a floor with keyframes costs lugre {100 * more:.1f} % more than a fixed one, over "
                     f"{100 * MOST_ON_KEYFRAMES:.0f} %")
    if not more > 0:
        wrong.append("a floor with keyframes costs no more than a fixed one: they were not set")
    if not counts["dahl"] > counts["coulomb"]:
        wrong.append("dahl costs no more than coulomb: the laws were not chosen")
    for sentence in wrong:
        print(sentence, file=sys.stderr)
    sys.exit(1 if wrong else 0)


if __name__ == "__main__":
    main()
