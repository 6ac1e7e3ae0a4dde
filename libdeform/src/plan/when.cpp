// When a stage runs, and its text in `deform explain`.
#include "plan/plan.h"

#include "core/error.h"

namespace dfm::when {
namespace {

std::string count(unsigned n, const char *noun, const char *plural) {
  return std::to_string(n) + " " + (n == 1 ? noun : plural);
}
StageChoice runs(std::string why) { return {true, std::move(why)}; }
StageChoice left_out(std::string why = {}) { return {false, std::move(why)}; }

unsigned pairs(const SceneFacts &f) { return f.body_pairs + f.obstacle_pairs; }
bool touches(const SceneFacts &f) { return pairs(f) || f.self_bodies; }
std::string who(const SceneFacts &f) {
  return count(f.body_pairs, "pair of bodies", "pairs of bodies") + " and " +
         count(f.obstacle_pairs, "pair of body and obstacle", "pairs of body and obstacle") + " may touch";
}
std::string nobody(const SceneFacts &f) {
  return f.bodies < 2 && !f.obstacles ? "one body and nothing to touch" : "filters let no pair touch";
}
std::string rigids(const SceneFacts &f) {
  return count(f.rigid_bodies, "rigid body", "rigid bodies") + " and " +
         count(f.rigid_joints, "joint", "joints") + " of host " + f.rigid_hosts;
}

// Loads that act on bodies through their surfaces.
StageChoice of_contact(const SceneFacts &f) {
  if (!when::acts(f)) return left_out(nobody(f));
  std::vector<std::string> what;
  if (touches(f)) what.push_back(who(f));
  if (f.attachments) what.push_back(count(f.attachments, "attachment holds", "attachments hold"));
  if (f.paid_cuts) what.push_back(count(f.paid_cuts, "body drags on a blade", "bodies drag on blades"));
  return runs(join(what));
}
StageChoice of_pairs(const SceneFacts &f) {
  if (!touches(f)) return left_out(nobody(f));
  return pairs(f) ? runs(who(f)) : left_out("no pair may touch");
}

}  // namespace

bool acts(const SceneFacts &f) { return touches(f) || f.attachments || f.paid_cuts; }

StageChoice motion(const SceneFacts &f) {
  std::vector<std::string> what;
  if (f.gravity_keys) what.push_back("gravity varies");
  if (f.loads_vary) what.push_back("loads vary");
  if (f.held_move) what.push_back("held points move");
  if (f.obstacles_move) what.push_back("obstacles move");
  return what.empty() ? left_out("nothing is prescribed over time") : runs(join(what));
}

StageChoice model(const SceneFacts &f) {
  return f.bodies > f.self_stepping
             ? runs("internal forces of " + count(f.bodies - f.self_stepping, "body", "bodies"))
             : left_out();
}

StageChoice predict(const SceneFacts &f) {
  return f.bodies ? runs("velocities without contact of " + count(f.bodies, "body", "bodies")) : left_out();
}

StageChoice rigid_predict(const SceneFacts &f) {
  if (!f.rigid_bodies) return left_out("no rigid bodies");
  std::string why = rigids(f);
  if (f.rigid_pairs)
    why += "; " + count(f.rigid_pairs, "pair", "pairs") +
           " of rigid bodies with each other and with obstacles may touch";
  if (!f.rigid_alone.empty()) why += "; these pass through obstacles: " + join(f.rigid_alone);
  return runs(why);
}

StageChoice gather(const SceneFacts &f) {
  if (!acts(f)) return left_out(nobody(f));
  if (!f.coupled) return left_out("every surfel is a point of its body");
  return runs(count(f.coupled_surfels, "surfel", "surfels") + " of " + count(f.coupled, "body", "bodies") +
              " hang on several points each");
}

StageChoice broad(const SceneFacts &f) { return of_pairs(f); }

StageChoice narrow(const SceneFacts &f) { return of_pairs(f); }

StageChoice self(const SceneFacts &f) {
  const std::string by = self_requested_by(f);
  if (f.self_bodies)
    return runs(count(f.self_bodies, "body", "bodies") + " may touch themselves (" +
                (by.empty() ? "contact.filter" : by) + ")");
  return left_out(by.empty() ? "not asked for (contact.self), and no effect needs it"
                  : f.bodies ? "filters take every body out"
                             : "no body");
}

StageChoice solve(const SceneFacts &f) {
  if (!acts(f) && f.rigid_rows) return runs("rigid bodies and tools may touch each other or obstacles");
  return of_contact(f);
}

StageChoice rigid_commit(const SceneFacts &f) {
  return f.rigid_bodies ? runs("ends of " + rigids(f)) : left_out();
}

StageChoice distribute(const SceneFacts &f) { return of_contact(f); }

StageChoice guard(const SceneFacts &f) {
  if (!touches(f)) return left_out(nobody(f));
  if (f.unguarded && f.effects_listed)
    return left_out(
        "not in the list of effects: bodies that move farther than contacts reach in one sub-step may cross");
  if (f.unguarded)
    return left_out(
        "switched off (contact.guard): bodies that move farther than contacts reach in one sub-step may "
        "cross");
  return runs(
      "nothing crosses at the end of a sub-step: " + count(pairs(f), "pair", "pairs") +
      (f.self_bodies ? ", " + count(f.self_bodies, "body with itself", "bodies with themselves") : ""));
}

StageChoice commit(const SceneFacts &f) {
  return f.bodies ? runs("positions and velocities at the end of the sub-step") : left_out();
}

StageChoice sleep(const SceneFacts &f) {
  if (f.bodies && f.sleep)
    return runs("islands at rest leave the stages above until something reaches them (contact.sleep)");
  return left_out(f.bodies ? "not asked for (contact.sleep)" : "no body");
}

}  // namespace dfm::when
