// Constants of the volume terms of org.deform.msm, plain for kernels (doc/models/msm.md).
#pragma once

namespace msm {

// The share of its rest volume below which a cell resists collapse, and that below which the step bound
// counts on it: rows are kept for some steps, and what lies between is what a cell may lose in that time.
constexpr double kCollapseBelow = 0.6, kCollapseCounted = 0.7;

// Where the pressure of a cell stops to grow, in rest volumes, and the sum of its squared edges from which on
// its volume counts less.
constexpr double kMinVolume = -1, kMaxVolume = 3, kLimit = 3;
// With Q that sum, Qm the limit and u = Qm/Q <= 1, the volume that counts is V t, t = u^(3/2) (5 - 3 u)/2,
// dt/dQ = -15/4 u^(3/2) (1 - u)/Q. Norms of its first two derivatives at a cell beyond the limit: 36 |d|^2 <=
// kFade1 Qm^2 and 6 |d2| <= kFade2 sqrt(Qm), of six volumes.
constexpr double kFade1 = 0.1287, kFade2 = 4.655;

}  // namespace msm
