// What a ray and a closest point cost among few and many triangles: nodes and triangles that are looked at,
// and ns per query.
//
//   query_bench [--csv FILE --commit HASH]
//
// Deformable balls, one of which wears a fine surface, and mesh obstacles of the same shape. `update` is what
// the first query after a step pays; a tree is built before anything is timed.
#include <chrono>
#include <cstdio>
#include <cstring>
#include <random>

#include "../unit/narrow/detect_scene.h"
#include "core/handle.h"
#include "coupled.h"
#include "machine.h"
#include "state/world.h"
#include "world.h"
#include "world/find.h"

namespace {

using dfm::Vec3;
constexpr int kQueries = 20000;
constexpr int kRounds = 5;

double seconds_since(std::chrono::steady_clock::time_point begin) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

struct Sink : bench::Csv {
  using Csv::Csv;
  void row(const char *query, const char *what, uint32_t triangles, double nodes, double tried, double ns,
           double update_us) const {
    std::printf("%-8s %-10s %9u %8.1f %10.1f %9.0f %10.1f\n", query, what, triangles, nodes, tried, ns,
                update_us);
    if (csv)
      std::fprintf(csv, "%s,%s,%s,%u,%.1f,%.1f,%.0f,%.1f\n", head.c_str(), query, what, triangles, nodes,
                   tried, ns, update_us);
  }
};

// Origins outside of the unit ball, each with a direction to somewhere in it.
struct Questions {
  std::vector<Vec3> from, to;
  Questions() {
    std::mt19937 random(1);
    std::uniform_real_distribution<double> uniform(-1, 1);
    const auto any = [&] { return Vec3{uniform(random), uniform(random), uniform(random)}; };
    for (int i = 0; i < kQueries; ++i) {
      from.push_back((1.2 + 0.5 * std::fabs(uniform(random))) * dfm::normalized(any()));
      to.push_back(dfm::normalized(0.5 * any() - from.back()));
    }
  }
};

template <class Query>
void measure(const Sink &sink, const char *query, const char *what, uint32_t triangles, double update_us,
             Query &&request) {
  const Questions q;
  dfm::SearchCount count;
  for (int i = 0; i < kQueries; ++i) request(q.from[size_t(i)], q.to[size_t(i)], &count);
  double best = HUGE_VAL;
  for (int round = 0; round < kRounds; ++round) {
    const auto begin = std::chrono::steady_clock::now();
    for (int i = 0; i < kQueries; ++i) request(q.from[size_t(i)], q.to[size_t(i)], nullptr);
    best = std::min(best, seconds_since(begin));
  }
  sink.row(query, what, triangles, double(count.nodes) / kQueries, double(count.triangles) / kQueries,
           1e9 * best / kQueries, update_us);
}

// A ray, or (to zero) the closest point.
void request(dfm::World &w, Vec3 from, Vec3 to, dfm::SearchCount *count) {
  dfm_query_hit hit;
  dfm_query_hits hits{sizeof hits, sizeof hit, 1, 0, &hit};
  dfm::ThingQuery q;
  q.shape.position = from;
  q.point = true;
  q.way = {dfm::norm2(to) > 0, to};
  q.count = count;
  dfm::find(w, dfm::ThingFilter(nullptr), q, dfm::keep_nearest, &hits);
}

void body(const Sink &sink, const char *what, uint32_t cells, const dfm_surface_def *skin) {
  test::Context c;
  const dfm_world world = test::make_world(c);
  dfm::World &w = *static_cast<dfm::World *>(dfm::handle_find(dfm::Kind::world, world));
  test::BodyOptions o;
  o.surface = skin;
  const dfm_body b = test::make_body(c, world, "ball", {1, 0, 0}, cells, o);
  dfm_body_info info{};
  test::ok(dfm_body_get_info(b, &info));
  request(w, {2, 0, 0}, {-1, 0, 0}, nullptr);
  double update = HUGE_VAL;
  for (int round = 0; round < kRounds; ++round) {
    ++w.bodies[0]->x_version;
    const auto begin = std::chrono::steady_clock::now();
    request(w, {2, 0, 0}, {-1, 0, 0}, nullptr);
    update = std::min(update, 1e6 * seconds_since(begin));
  }
  const auto ray = [&](Vec3 from, Vec3 to, dfm::SearchCount *count) { request(w, from, to, count); };
  const auto point = [&](Vec3 from, Vec3, dfm::SearchCount *count) { request(w, from, {}, count); };
  measure(sink, "ray", what, info.ntriangle, update, ray);
  measure(sink, "closest", what, info.ntriangle, update, point);
}

void obstacle(const Sink &sink, int level) {
  test::Context c;
  const dfm_world world = test::make_world(c);
  dfm::World &w = *static_cast<dfm::World *>(dfm::handle_find(dfm::Kind::world, world));
  const test::Mesh ball = test::sphere_mesh(1, level);
  dfm_obstacle_def d = dfm_obstacle_def_default();
  d.shape = DFM_SHAPE_MESH;
  d.npoint = ball.npoint();
  d.points = ball.x.data();
  d.ntriangle = ball.ntri();
  d.triangles = ball.tri.data();
  dfm_obstacle o = 0;
  test::ok(dfm_obstacle_create(world, &d, &o));
  const auto ray = [&](Vec3 from, Vec3 to, dfm::SearchCount *count) { request(w, from, to, count); };
  measure(sink, "ray", "obstacle", ball.ntri(), 0, ray);
}

}  // namespace

int main(int argc, char **argv) {
  Sink sink(argc, argv, "query,what,triangles,nodes,triangles_tried,ns_per_query,update_us");
  std::printf("%-8s %-10s %9s %8s %10s %9s %10s\n", "query", "of", "triangles", "nodes", "triangles", "ns",
              "update us");
  for (const uint32_t cells : {1500u, 60000u}) body(sink, "body", cells, nullptr);
  const test::Skin skin = test::ball_skin(0.97, 7);
  const dfm_surface_def worn = skin.def();
  body(sink, "fine skin", 1500, &worn);
  for (const int level : {3, 5, 7}) obstacle(sink, level);
  return 0;
}
