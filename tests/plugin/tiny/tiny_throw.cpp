// Laws that misbehave: one throws across the boundary, one behind guarded<>, one returns a failure, one
// refuses every parameter.
#include <stdexcept>

#include "deform/plugin.hpp"

namespace {
namespace dp = dfm::plugin;
dfm_status eval(const dfm_friction_in *, dfm_friction_out *) { throw std::runtime_error("boom"); }
dfm_status fails(const dfm_friction_in *, dfm_friction_out *) { return DFM_E_FATAL; }
dfm_status discards(const dfm_friction_in *, dfm_friction_out *) { return DFM_DISCARD; }
dfm_status check(const double *, char *, size_t) { throw 1; }
const dfm_friction bare_law = dp::friction(0, 0, eval), guarded_law = dp::friction(0, 0, dp::guarded<eval>),
                   failing_law = dp::friction(0, 0, fails), discarding_law = dp::friction(0, 0, discards),
                   checking_law = dp::friction(0, 0, fails, check);
const dfm_type bare =
    dp::type(DFM_KIND_FRICTION, "org.tiny.throws", "throws", "1.0", "MIT", "test", nullptr, &bare_law);
const dfm_type guarded =
    dp::type(DFM_KIND_FRICTION, "org.tiny.guarded", "guarded", "1.0", "MIT", "test", nullptr, &guarded_law);
const dfm_type failing =
    dp::type(DFM_KIND_FRICTION, "org.tiny.fails", "fails", "1.0", "MIT", "test", nullptr, &failing_law);
const dfm_type discarding = dp::type(DFM_KIND_FRICTION, "org.tiny.discards", "discards", "1.0", "MIT", "test",
                                     nullptr, &discarding_law);
const dfm_type checking =
    dp::type(DFM_KIND_FRICTION, "org.tiny.checks", "checks", "1.0", "MIT", "test", nullptr, &checking_law);
}  // namespace
DFM_PLUGIN(&bare, &guarded, &failing, &discarding, &checking)
