#include "world/attach.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "core/names.h"
#include "state/world.h"
#include "step/solve/attach.h"
#include "step/stages.h"
#include "step/watch/energy_watch.h"
#include "world/queries.h"

namespace dfm {
namespace {

// [nsurfel] 1: selected
std::vector<uint8_t> selected(const Body &b, const dfm_attach_def &def) {
  const Surface &s = b.surface;
  std::vector<uint8_t> out(s.nsurfel);
  if ((def.npoint && !def.points) || (def.nsurfel && !def.surfels))
    refuse(b, ": points or surfels to attach are announced, but the list is NULL");
  if (def.npoint && !s.identity())
    refuse(b,
           " has its own surface, whose surfels are not points of the body; name surfels, a group or a box");
  if (def.npoint) {
    std::vector<uint32_t> surfel(b.p.n, kNone);
    for (uint32_t i = 0; i < s.nsurfel; ++i) surfel[s.point[i]] = i;
    for (uint32_t k = 0; k < def.npoint; ++k) {
      if (def.points[k] >= b.p.n) refuse(b, " has no point %u to attach; it has %u", def.points[k], b.p.n);
      if (const uint32_t i = surfel[def.points[k]]; i != kNone) out[i] = 1;
    }
  }
  for (uint32_t k = 0; k < def.nsurfel; ++k) {
    if (def.surfels[k] >= s.nsurfel)
      refuse(b, " has no surfel %u to attach; it has %u", def.surfels[k], s.nsurfel);
    out[def.surfels[k]] = 1;
  }
  if (def.group) {
    bool known = false;
    std::vector<std::string> groups;
    for (uint32_t z = 0; z < b.zones.list.size(); ++z) {
      const std::string &group = b.zones.list[z].group;
      if (!group.empty()) groups.push_back(group);
      if (group != def.group) continue;
      known = true;
      for (uint32_t t = 0; t < s.ntri; ++t)
        if (b.zones.of.empty() || b.zones.of[t] == z)
          for (size_t k = 0; k < 3; ++k) out[s.tri[3 * size_t{t} + k]] = 1;
    }
    if (!known)
      fail(DFM_E_ARG, "the surface of body '%s' has no group '%s'%s", b.name.c_str(), def.group,
           did_you_mean(def.group, groups, '\'').c_str());
  }
  for (uint32_t i = 0; def.box && i < s.nsurfel; ++i) {
    const Vec3 x = b.surface.sum(i, b.p.x.data());
    bool in = true;
    for (int k = 0; k < 3; ++k) in = in && x[k] >= def.box[k] && x[k] <= def.box[3 + k];
    if (in) out[i] = 1;
  }
  return out;
}

Place place_on(const Body &b, const TriangleNearPoint &near, Vec3 x) {
  Place p{};
  for (uint32_t k = 0; k < 3; ++k) {
    p.node[k] = b.surface.tri[3 * size_t{near.triangle} + k];
    p.weight[k] = near.at.weight[k];
  }
  lift(b, x, p);
  return p;
}

void place_on_body(const Body &b, const dfm_attach_def &def, Body &other, Attachment &a) {
  for (uint32_t i = 0, n = 0; i < a.surfels.size(); ++i) {
    const Vec3 x = b.surface.sum(a.surfels[i], b.p.x.data());
    const TriangleNearPoint near = closest_on_body(other, x);
    if (def.max_distance > 0 && near.key > def.max_distance * def.max_distance) continue;
    const Place p = place_on(other, near, x);
    a.node.insert(a.node.end(), p.node, p.node + kAnchors);
    a.weight.insert(a.weight.end(), p.weight, p.weight + kAnchors);
    a.surfels[n++] = a.surfels[i];
  }
  a.surfels.resize(a.weight.size() / kAnchors);
}

void place_on_obstacle(const Body &b, const Obstacle &o, Attachment &a) {
  const Pose frame = attached_frame(o);
  a.place.resize(3 * a.surfels.size());
  for (size_t i = 0; i < a.surfels.size(); ++i)
    store3(&a.place[3 * i],
           rotate_back(frame.rotation, b.surface.sum(a.surfels[i], b.p.x.data()) - frame.position));
}

void check_values(const Body &b, const dfm_attach_def &def) {
  for (const double x : {def.max_distance, def.stiffness, def.damping, def.release})
    if (!(x >= 0 && std::isfinite(x)))
      refuse(
          b,
          ": max_distance, stiffness, damping and release of an attachment are zero or positive, and finite");
  if (def.box && !std::all_of(def.box, def.box + 6, [](double x) { return !std::isnan(x); }))
    refuse(b, ": the box of an attachment is not a number");
}

const Attachment &attachment_of(const Body &b, uint32_t number) {
  for (const Attachment &a : b.world->attachments)
    if (a.body == b.id && a.number == number && !a.released) return a;
  refuse(b, " has no attachment %u", number);
}

}  // namespace

void lift(const Body &b, Vec3 x, Place &p) {
  const Surface &s = b.surface;
  const auto at = [&](uint32_t i) { return b.surface.sum(i, b.p.x.data()); };
  p.node[3] = p.node[0];
  p.weight[3] = 0;
  const Vec3 a = at(p.node[0]), e1 = at(p.node[1]) - a, e2 = at(p.node[2]) - a;
  Vec3 off = x - a;
  for (uint32_t k = 1; k < 3; ++k) off -= p.weight[k] * (k == 1 ? e1 : e2);
  if (!(norm(off) > 1e-12 * s.median_edge)) return;
  const Vec3 normal = normalized(cross(e1, e2));
  double farthest = 0;
  for (uint32_t i = 0; i < s.nsurfel; ++i)
    if (const double height = std::fabs(dot(normal, at(i) - a)); height > farthest) {
      farthest = height;
      p.node[3] = i;
    }
  if (!(farthest > 1e-6 * s.median_edge)) return;
  const Vec3 e3 = at(p.node[3]) - a;
  p.weight[3] = dot(normal, x - a) / dot(normal, e3);
  const Vec3 r = x - a - p.weight[3] * e3;  // in the plane
  const double g11 = norm2(e1), g22 = norm2(e2), g12 = dot(e1, e2), det = g11 * g22 - g12 * g12;
  p.weight[1] = (g22 * dot(e1, r) - g12 * dot(e2, r)) / det;
  p.weight[2] = (g11 * dot(e2, r) - g12 * dot(e1, r)) / det;
  p.weight[0] = 1 - p.weight[1] - p.weight[2] - p.weight[3];
}

uint32_t attach(Body &b, const dfm_attach_def &def, Body *other, const Obstacle *obstacle) {
  World &w = *b.world;
  check_values(b, def);
  if (other == &b) refuse(b, " cannot be attached to itself");
  if ((other ? other->world : obstacle->world) != &w)
    refuse(b, DFM_E_HANDLE, " cannot be attached to an object of another world");
  Attachment a;
  const std::vector<uint8_t> meant = selected(b, def);
  for (uint32_t i = 0; i < meant.size(); ++i)
    if (meant[i]) a.surfels.push_back(i);
  if (!other && def.max_distance > 0)
    refuse(b, ": max_distance is for attachments to bodies, and '%s' is an obstacle or rigid",
           obstacle->name.c_str());
  if (other) place_on_body(b, def, *other, a);
  else place_on_obstacle(b, *obstacle, a);
  if (a.surfels.empty())
    refuse(b,
           ": nothing of its surface is attached: the points, surfels, group and box of the def name none "
           "that is near enough");
  a.number = b.next_load;
  a.body = b.id;
  a.to = other ? other->id : obstacle->id;
  a.obstacle = !other;
  a.flags = def.flags;
  a.stiffness = def.stiffness;
  a.damping = def.damping;
  a.release = def.release;
  a.impulse.assign(3 * a.surfels.size(), 0.0);
  // by body: the order in which they are solved follows from what there is, not from who came first
  w.attachments.insert(std::ranges::upper_bound(w.attachments, a.body, {}, &Attachment::body), std::move(a));
  for (Body *one : {&b, other}) {
    if (!one) continue;
    wake(w, *one);
    forget_energy(*one);
  }
  w.changed = true;
  return b.next_load++;
}

void detach(Body &b, uint32_t number) {
  World &w = *b.world;
  attachment_of(b, number);
  const auto meant = [&](const Attachment &a) { return a.body == b.id && a.number == number; };
  for (const Attachment &a : w.attachments)
    if (const uint32_t slot = meant(a) && !a.obstacle ? slot_of(w, a.to) : kNone; slot != kNone)
      wake(w, *w.bodies[slot]);
  wake(w, b);
  w.overlaps.place(b.id);
  std::erase_if(w.attachments, meant);
  w.changed = true;
}

dfm_attachment attachment_report(const Body &b, uint32_t number) {
  const World &w = *b.world;
  const Attachment &first = attachment_of(b, number);
  dfm_attachment out{};
  std::vector<Vec3> x, f;
  Vec3 middle, force, moment, total;
  // the other body may have been parted since, and each piece has some of the points
  for (const Attachment &a : w.attachments) {
    if (a.body != b.id || a.number != number || a.released) continue;
    for (size_t i = 0; i < a.surfels.size(); ++i) {
      x.push_back(b.surface.sum(a.surfels[i], b.p.x.data()));
      f.push_back(a.h > 0 ? (1 / a.h) * load3(&a.impulse[3 * i]) : Vec3{});
      out.stretch = std::max(out.stretch, norm(x.back() - attached_place(w, a, i)));
    }
    out.stiffness += a.stiffness;
    out.damping += a.damping;
    out.release += a.release;
    total += a.total;
  }
  for (const Vec3 at : x) middle += (1 / double(x.size())) * at;
  for (size_t i = 0; i < x.size(); ++i) {
    force += f[i];
    moment += cross(x[i] - middle, f[i]);
  }
  out.flags = first.flags;
  out.to = w.handle_of(first.to);
  out.nsurfel = static_cast<uint32_t>(x.size());
  store3(out.point, middle);
  store3(out.force, force);
  store3(out.moment, moment);
  const double asleep = b.sleep_state.asleep ? w.time - b.sleep_state.since : 0;
  store3(out.impulse, total + asleep * force);
  return out;
}

}  // namespace dfm
