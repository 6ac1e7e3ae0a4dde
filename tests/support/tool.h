// Vectors and calls that the tests of tools share.
#pragma once
#include "deform/tool.h"
#include "rigid.h"

namespace test::tools {

inline Vec cross(Vec a, Vec b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

inline Vec rotate(const double q[4], Vec v) {
  const Vec u = {q[0], q[1], q[2]}, t = cross(u, v), s = cross(u, t);
  return {v[0] + 2 * (q[3] * t[0] + s[0]), v[1] + 2 * (q[3] * t[1] + s[1]), v[2] + 2 * (q[3] * t[2] + s[2])};
}

inline dfm_tool make(dfm_world w, const dfm_tool_def &d) {
  dfm_tool t = 0;
  test::ok(dfm_tool_create(w, &d, &t));
  return t;
}

inline dfm_tool_state state(dfm_tool t) {
  dfm_tool_state s{};
  s.size = sizeof s;
  test::ok(dfm_tool_get_state(t, &s));
  return s;
}

}  // namespace test::tools
