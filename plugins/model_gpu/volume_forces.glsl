// First pass of a sub-step of springs beside volume terms (doc/models/msm.md): each cell's resistance to a
// change of its volume, and to its collapse, as GLSL and as C++.
#include "corner.glsl"
// d: edges of a cell from corner 0; cell: stiffness and that against collapse over 36 V0, 6 V0, the limit of
// the sum of its squared edges; w: weights of its corners, as binary32. Forces of corners 1 to 3; what the
// cell's second derivative adds to the rows of its corners.
void resist(IN(d, 9), dvec4 cell, uvec4 w, OUT(of, 9), OUT(row, 4)) {
  precise double g[9];   // of six volumes, by corners 1 to 3
  g[0] = d[4] * d[8] - d[5] * d[7];
  g[1] = d[5] * d[6] - d[3] * d[8];
  g[2] = d[3] * d[7] - d[4] * d[6];
  g[3] = d[7] * d[2] - d[8] * d[1];
  g[4] = d[8] * d[0] - d[6] * d[2];
  g[5] = d[6] * d[1] - d[7] * d[0];
  g[6] = d[1] * d[5] - d[2] * d[4];
  g[7] = d[2] * d[3] - d[0] * d[5];
  g[8] = d[0] * d[4] - d[1] * d[3];
  precise double s[3];
  precise double edge[3];    // squares of the three edges, and of those between their ends
  precise double other[3];
  UNROLLED for (uint k = 0u; k < 3u; ++k) {
    s[k] = (d[k] + d[3u + k]) + d[6u + k];
    const uint a = 3u * k;
    const uint b = k < 2u ? a + 3u : 0u;
    precise double x = d[b] - d[a];
    precise double y = d[b + 1u] - d[a + 1u];
    precise double z = d[b + 2u] - d[a + 2u];
    edge[k] = (d[a] * d[a] + d[a + 1u] * d[a + 1u]) + d[a + 2u] * d[a + 2u];
    other[k] = (x * x + y * y) + z * z;
  }
  precise double all = 4.0 * ((edge[0] + edge[1]) + edge[2]) - ((s[0] * s[0] + s[1] * s[1]) + s[2] * s[2]);
  precise double now = (d[0] * g[0] + d[1] * g[1]) + d[2] * g[2];
  precise double share = 1.0;   // of the volume that counts, and its derivative by the sum of squares
  precise double by_all = 0.0;
  const bool far = all > cell.w;
  if (far) {
    precise double u = cell.w / all;
    precise double power = sqrt(u) * u;
    by_all = (0.0 - 3.75) * ((power * (1.0 - u)) / all);
    share = power * (2.5 - 1.5 * u);
  }
  precise double counts = now * share;
  precise double kept = min(max(counts, 0.0 - cell.z), 3.0 * cell.z);
  precise double lost = max(COLLAPSE_BELOW * cell.z - kept, 0.0);
  precise double p = cell.x * (cell.z - kept) + cell.y * lost;
  precise double along = p * share;
  precise double inward = (8.0 * p) * (now * by_all);
  UNROLLED for (uint k = 0u; k < 9u; ++k) of[k] = along * g[k] + inward * (d[k] - 0.25 * s[k % 3u]);

  precise float stiff = float(cell.x + (COLLAPSE_COUNTED * cell.z > counts ? cell.y : double(0.0f)));
  precise float pressure = float(abs(p));
  precise float longest =
      sqrt(float(max(max(max(edge[0], edge[1]), edge[2]), max(max(other[0], other[1]), other[2]))));
  precise float weight[4];
  weight[0] = uintBitsToFloat(w.x);
  weight[1] = uintBitsToFloat(w.y);
  weight[2] = uintBitsToFloat(w.z);
  weight[3] = uintBitsToFloat(w.w);
  precise float norm[4];
  UNROLLED for (uint k = 0u; k < 3u; ++k) {
    const uint a = 3u * k;
    s[k] = (g[k] + g[3u + k]) + g[6u + k];
    norm[k + 1u] = sqrt(float((g[a] * g[a] + g[a + 1u] * g[a + 1u]) + g[a + 2u] * g[a + 2u]));
  }
  norm[0] = sqrt(float((s[0] * s[0] + s[1] * s[1]) + s[2] * s[2]));
  precise float sum =
      (norm[0] * weight[0] + norm[1] * weight[1]) + (norm[2] * weight[2] + norm[3] * weight[3]);
  precise float weights = (weight[0] + weight[1]) + (weight[2] + weight[3]);
  precise float limit = float(cell.w);
  precise float beyond = stiff * (FADE1 * (limit * limit)) + pressure * (FADE2 * sqrt(limit));
  UNROLLED for (uint k = 0u; k < 4u; ++k) {
    precise float near = (stiff * (norm[k] * sum) + (pressure * longest) * (weights - weight[k])) / weight[k];
    row[k] = double(far ? beyond : near);
  }
}
void force_of_volume(uint i) {
  const uvec4 q = CORNER(entry_of(i, 0u));
  const uvec4 to = CORNER(entry_of(i, 1u));
  const uvec4 w = CORNER(entry_of(i, 2u));
  precise double d[9];
  precise double of[9];
  precise double row[4];
  edges_of(PLACE(q.x), PLACE(q.y), PLACE(q.z), PLACE(q.w), d);
  resist(d, VOLUME(i), w, of, row);
  write_forces(to, of, dvec4(rows_of(float(row[0]), 0.0f), rows_of(float(row[1]), 0.0f),
                             rows_of(float(row[2]), 0.0f), rows_of(float(row[3]), 0.0f)));
}
